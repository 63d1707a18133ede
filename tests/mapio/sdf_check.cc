// Loads SDF files with the simulator's own parser; prints every error, returns how many there were.
#include <iostream>
#include <string>

#include <sdf/Root.hh>
#include <sdf/SDFImpl.hh>

int main(int argc, char **argv) {
  const std::string models = argv[1];
  sdf::setFindCallback([&](const std::string &uri) {
    const std::string prefix = "model://";
    return uri.rfind(prefix, 0) == 0 ? models + "/" + uri.substr(prefix.size()) : uri;
  });
  int errors = 0;
  for (int i = 2; i < argc; ++i) {
    sdf::Root root;
    for (const auto &error : root.Load(argv[i])) {
      std::cout << argv[i] << ": " << error << "\n";
      ++errors;
    }
  }
  return errors == 0 ? 0 : 1;
}
