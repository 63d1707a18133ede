"""Behaviour trees in the XML of BehaviorTree.CPP: which nodes are built here, and how a file is read."""

from controllers.tree_xml.nodes import NODES, TreeNode
from controllers.tree_xml.reading import plugin_names, read_tree

__all__ = ["NODES", "TreeNode", "plugin_names", "read_tree"]
