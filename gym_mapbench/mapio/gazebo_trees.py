"""A user's behaviour tree in an exported package: its leaves name the plugins of the package's parameter file."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element, indent, tostring

from defusedxml.ElementTree import fromstring

LEAVES = {"planner_id": "ComputePathToPose", "controller_id": "FollowPath"}
"""Ports that each leaf of this type gets; the ports of the other plugins are changed where they are given."""


def tree_with_plugins(xml: str, tree_id: str, plugins: Mapping[str, str]) -> str:
    """Return a tree whose leaves name other plugins; comments and unused includes are lost.

    Args:
        xml: The tree, which has been read before.
        tree_id: ID of the main tree, and the beginning of the IDs of its subtrees: Lyrical keeps the trees of all files
            by ID, and wants each ID once.
        plugins: Port such as ``controller_id`` -> the plugin.
    """
    root: Element = fromstring(xml, forbid_dtd=True)
    trees = root.findall("BehaviorTree")
    for file in root.findall("include"):
        root.remove(file)
    main = root.get("main_tree_to_execute", trees[0].get("ID", ""))
    names = {tree.get("ID", ""): f"{tree_id}_{tree.get('ID', '')}" for tree in trees} | {main: tree_id}
    root.set("main_tree_to_execute", tree_id)
    for tree in trees:
        tree.set("ID", names[tree.get("ID", "")])
        for node in tree.iter():
            if node.tag.startswith("SubTree"):
                node.set("ID", names.get(node.get("ID", ""), node.get("ID", "")))
            given = [port for port in plugins if port in node.attrib]
            wanted = [port for port, leaf in LEAVES.items() if leaf in (node.tag, node.get("ID"))]
            node.attrib |= {port: plugins[port] for port in (*given, *wanted)}
    indent(root)
    return tostring(root, encoding="unicode") + "\n"
