"""Reads the smoother server's section: the path smoothers that are built here, if the tree asks for any.

Source: nav2_smoother (Humble, Jazzy and Lyrical) src/nav2_smoother.cpp, ``findSmootherId``.
"""

from __future__ import annotations

from collections.abc import Sequence

from controllers.nav2_params.file import keys
from controllers.nav2_params.file.tree_ids import OWN_TREE
from controllers.nav2_params.navigation import DEFAULT_SMOOTHER
from controllers.nav2_params.plugin_settings import SmootherPlugin
from controllers.nav2_params.plugins import SMOOTHERS, names_in_ros
from controllers.tree_xml.needs import named_smoothers
from controllers.tree_xml.nodes import TreeNode
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import Section, refuse_slash, take_class

PLUGINS = "smoother_plugins"
COSTMAP = "costmap_topic"


def read_smoothers(server: Section, tree: TreeNode | None) -> dict[str, SmootherPlugin]:
    """Read ``smoother_server`` into smoothers by name; none if the tree smooths no path.

    Args:
        server: The section.
        tree: The tree of the file's own; None if Nav2's default tree drives.

    Raises:
        ConfigError: If a value is wrong, or the tree names a smoother that the list does not have or that is not built
            here, or none of several.
    """
    asked = named_smoothers(tree) if tree is not None else []
    if not asked:
        server.findings.add("unused", server.name, "no node of the tree smooths a path")
        return {}
    names = server.take_names(PLUGINS, (DEFAULT_SMOOTHER,), least=1)
    _refuse_unnamed(asked, names, f"{server.name}.{PLUGINS}")
    smoothers = {
        name: _read_smoother(server.take_group(name), names == (DEFAULT_SMOOTHER,))
        for name in names
        if name in asked or "" in asked
    }
    server.leave_groups()
    if "global_costmap" not in (topic := str(server.values.get(COSTMAP, "global_costmap"))):
        del server.values[COSTMAP]
        server.findings.add("left_out", f"{server.name}.{COSTMAP}", f"{topic}: smoothers see the global costmap here")
    server.read(keys.SMOOTHER_SERVER, ())
    return smoothers


def _refuse_unnamed(asked: Sequence[str], names: Sequence[str], where: str) -> None:
    """Refuse a tree that asks for a smoother which the server does not have, or for none of several."""
    for name in asked:
        if name and name not in names:
            said = f"as a smoother_id of {OWN_TREE} says"
            raise ConfigError(f"{where}: expected {name!r} among them, {said}, got {list(names)}")
        if not name and len(names) > 1:
            raise ConfigError(
                f"{where}: a SmoothPath of {OWN_TREE} names none of {', '.join(names)}, so Nav2 smooths no path; "
                "give it a smoother_id"
            )


def _read_smoother(group: Section, is_usual: bool) -> SmootherPlugin:
    """Read one smoother; Nav2 gives a class to its own list alone."""
    default = SMOOTHERS["simple"].names[group.findings.release] if is_usual else None
    refuse_slash(group.values.get("plugin", ""), group.findings.release, f"{group.name}.plugin")
    kind = take_class(group, default, names_in_ros(SMOOTHERS), "smoother")
    return group.make(SmootherPlugin, {"kind": kind, "params": SMOOTHERS[kind].read(group)})
