"""A user's behaviour tree in an exported package: its leaves name the plugins of the package's parameter file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import chain, count
from xml.etree.ElementTree import Element, indent, tostring

from defusedxml.ElementTree import fromstring

LEAVES = {"planner_id": "ComputePathToPose", "controller_id": "FollowPath"}
"""Ports that each leaf of this type gets; the ports of the other plugins are changed where they are given."""


def tree_ids(controllers: Iterable[str], xml: str) -> dict[str, str]:
    """Return an ID of the main tree for each controller, so that no two files share an ID of a tree or a subtree.

    Args:
        controllers: Their names; an ID has ``_`` for each dot, which BehaviorTree.CPP refuses.
        xml: A user's tree; empty for a tree without subtrees.
    """
    root = fromstring(xml or "<root><BehaviorTree/></root>", forbid_dtd=True)
    taken, found = set[str](), dict[str, str]()
    for name in controllers:
        plain = f"MapBench_{name.replace('.', '_')}"
        numbered = (f"{plain}_{number}" for number in count(2))
        found[name] = next(one for one in chain([plain], numbered) if taken.isdisjoint(_renamed(root, one).values()))
        taken.update(_renamed(root, found[name]).values())
    return found


def _renamed(root: Element, tree_id: str) -> dict[str, str]:
    """Return, by their IDs in a file, the new IDs of its trees; ``tree_id`` is that of the main tree."""
    names = [tree.get("ID", "") for tree in root.findall("BehaviorTree")]
    return {name: f"{tree_id}_{name}" for name in names} | {root.get("main_tree_to_execute", names[0]): tree_id}


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
    names = _renamed(root, tree_id)
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
