"""Labels: how messages name the nodes of a tree, and in which tree of a file an error is."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from gym_mapbench.errors import ConfigError

COMPACT = ("Action", "Condition", "Control", "Decorator")
"""Elements that name their node by ``ID``."""


class TreeError(ConfigError):
    """An error in one tree of a file.

    Args:
        message: The message.
        tree: ID of the tree.
    """

    def __init__(self, message: str, tree: str = "") -> None:
        super().__init__(message)
        self.tree = tree


def type_of(element: Element) -> str:
    """Return the type of a node, which BehaviorTree.CPP calls its ID."""
    return element.get("ID", "") if element.tag in COMPACT else element.tag


def label_of(element: Element) -> str:
    """Return the type of a node, and the name that the tree gives it if that is another one."""
    kind, name = type_of(element), element.get("name", "")
    return f"{kind} {name!r}" if name and name != kind else kind
