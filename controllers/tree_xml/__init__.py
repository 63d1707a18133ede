"""Behaviour trees in the XML of BehaviorTree.CPP: which nodes are built here, and how a file is read."""

from controllers.tree_xml.includes import TreeText, read_text
from controllers.tree_xml.labels import TreeError
from controllers.tree_xml.nodes import NODES, TreeNode
from controllers.tree_xml.reading import (
    asked_behaviors,
    cleared_costmap,
    cleared_layers,
    name_in,
    named_layers,
    named_smoothers,
    plugin_names,
    read_tree,
    selected_plugins,
    smooths_paths,
    written_codes,
)

__all__ = [
    "NODES",
    "TreeError",
    "TreeNode",
    "TreeText",
    "asked_behaviors",
    "cleared_costmap",
    "cleared_layers",
    "name_in",
    "named_layers",
    "named_smoothers",
    "plugin_names",
    "read_text",
    "read_tree",
    "selected_plugins",
    "smooths_paths",
    "written_codes",
]
