"""Which of several plugins of a server counts: the plugin that the behaviour tree names by a port of its leaf.

Source: nav2_controller (Humble, Jazzy and Lyrical) src/controller_server.cpp, ``findGoalCheckerId`` and the like;
nav2_planner src/planner_server.cpp, ``getPlan``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from controllers.nav2_params.file.tree import NAVIGATOR, TREE_FILE, TreeFile
from controllers.tree_xml.needs import plugin_names
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import Section

PLANNER = "planner_id"
CONTROLLER = "controller_id"
GOAL_CHECKER = "goal_checker_id"
PROGRESS_CHECKER = "progress_checker_id"
PATH_HANDLER = "path_handler_id"
PORTS = (PLANNER, GOAL_CHECKER, PROGRESS_CHECKER, PATH_HANDLER)
DEFAULT = TreeFile()
OWN_TREE = f"the tree in {NAVIGATOR}.{TREE_FILE}"


class Chosen(NamedTuple):
    """The plugin that counts.

    Args:
        name: Its name; empty if the list is.
        is_usual: Whether the list is Nav2's own, to which Nav2 gives the class.
    """

    name: str
    is_usual: bool


@dataclass(frozen=True)
class TreeIds:
    """The plugins that the tree names.

    Args:
        names: Port -> the name. Nav2's default tree gives none of the ports of the controller server's checkers.
        tree: What the tree is called.
        given: The ports whose names stand in the navigator's section.
    """

    names: Mapping[str, str] = field(default_factory=dict)
    tree: str = "Nav2's default tree"
    given: frozenset[str] = frozenset()

    @classmethod
    def take(cls, navigator: Section | None, file: TreeFile = DEFAULT) -> TreeIds:
        """Take the names out of a file's own tree, and out of the navigator's section, which has the last word."""
        if navigator is None:
            return cls()
        given = {port: navigator.take_name(port, "") for port in PORTS if port in navigator.values}
        if file.tree is None:
            return cls(given, given=frozenset(given))
        return cls(plugin_names(file.tree) | given, OWN_TREE, frozenset(given))

    def choose(self, port: str, server: Section, key: str, usual: tuple[str, ...], least: int = 1) -> Chosen:
        """Choose the plugin of a server's list that the tree names, or else the only plugin; the others are unused.

        Args:
            port: The port that names it.
            server: The section.
            key: The list.
            usual: Nav2's own list, which counts if the file has none.
            least: Smallest number of plugins.

        Raises:
            ConfigError: If the tree names a plugin that the list does not have, or none of several.
        """
        names = server.take_names(key, usual, least)
        name = self.named(port, names, f"{server.name}.{key}") or (*names, "")[0]
        if len(names) > 1 and not self.names.get(port):
            raise ConfigError(
                f"{server.name}.{key}: {self.tree} names none of {', '.join(names)}, so Nav2 refuses every "
                f"path; if your tree names one, add {NAVIGATOR}.{port}: {name}"
            )
        for other in names:
            if other != name:
                server.leave(other)
        return Chosen(name, names == usual)

    def named(self, port: str, names: tuple[str, ...], where: str) -> str:
        """Return the plugin that the tree names; empty if it names none.

        Raises:
            ConfigError: If it is not in the list.
        """
        name = self.names.get(port, "")
        if name and name not in names:
            said = f"{NAVIGATOR}.{port} says" if port in self.given else f"the {port} of {self.tree} says"
            raise ConfigError(f"{where}: expected {name!r} among them, as {said}, got {list(names)}")
        return name
