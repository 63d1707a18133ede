// Does what `sdf check` does, with the simulator's own parser: loads SDF files, and checks names, frames and joints.
// Prints every complaint; returns how many files have one.
#include <iostream>
#include <string>

#include <sdf/Root.hh>
#include <sdf/SDFImpl.hh>
#include <sdf/parser.hh>

bool check(const std::string &file) {
  sdf::Root root;
  const sdf::Errors errors = root.Load(file);
  for (const auto &error : errors)
    std::cout << file << ": " << error << "\n";
  if (!errors.empty())
    return false;
  // All of them run, so that all complaints are printed; they print by themselves.
  const bool results[] = {
      sdf::checkCanonicalLinkNames(&root),
      sdf::checkJointParentChildLinkNames(&root),
      sdf::checkFrameAttachedToNames(&root),
      sdf::checkFrameAttachedToGraph(&root),
      sdf::checkPoseRelativeToGraph(&root),
      sdf::recursiveSiblingUniqueNames(root.Element()),
      sdf::recursiveSiblingNoDoubleColonInNames(root.Element()),
  };
  for (const bool result : results)
    if (!result)
      return false;
  return true;
}

int main(int argc, char **argv) {
  const std::string models = argv[1];
  sdf::setFindCallback([&](const std::string &uri) {
    const std::string prefix = "model://";
    return uri.rfind(prefix, 0) == 0 ? models + "/" + uri.substr(prefix.size()) : uri;
  });
  int bad = 0;
  for (int i = 2; i < argc; ++i)
    bad += !check(argv[i]);
  return bad;
}
