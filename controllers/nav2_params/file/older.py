"""Brings nodes and lists of plugins from Dashing, Eloquent, Foxy and Galactic into today's spelling.

Source: Nav2's migration guides and the example files of those releases.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from gym_mapbench.ros_params import Findings

OLD_NODES = {
    "dwb_controller": "controller_server",
    "navfn_planner": "planner_server",
    "recoveries_server": "behavior_server",
}
"""Node of an older release -> the section that reads it today."""


class PluginLists(NamedTuple):
    """How a node lists its plugins: ``plugins: [a]`` with ``a: {plugin: class}``; formerly names and classes apart.

    Args:
        now: Key of today's list of names.
        names: Keys of older lists of names, newest first.
        types: Key of the older list of classes; empty if there never was one.
        default: The names if a file lists only the classes.
    """

    now: str
    names: tuple[str, ...]
    types: str = ""
    default: tuple[str, ...] = ()


COSTMAP = (PluginLists("plugins", ("plugin_names",), "plugin_types"),)
LISTS: dict[str, tuple[PluginLists, ...]] = {
    "controller_server": (
        PluginLists("controller_plugins", ("controller_plugin_ids",), "controller_plugin_types", ("FollowPath",)),
        PluginLists("goal_checker_plugins", ("goal_checker_plugin",)),
    ),
    "planner_server": (
        PluginLists("planner_plugins", ("planner_plugin_ids",), "planner_plugin_types", ("GridBased",)),
    ),
    "recoveries_server": (PluginLists("behavior_plugins", ("recovery_plugins", "plugin_names"), "plugin_types"),),
    "local_costmap": COSTMAP,
    "global_costmap": COSTMAP,
}
SERVER_KEYS = ("controller_frequency", "failure_tolerance", "odom_topic", "speed_limit_topic", "use_sim_time")
SERVER_GROUPS = ("goal_checker", "progress_checker")
OLD_BEHAVIORS = {"BackUp": "backup", "back_up": "backup", "Spin": "spin", "Wait": "wait"}
"""Names of the recoveries for which Eloquent's and Foxy's trees ask -> the names for which today's asks."""


def modernised(node: str, values: Mapping[str, Any], full: str, findings: Findings) -> dict[str, Any]:
    """Return the parameters of a node in today's spelling.

    Args:
        node: Name of the node in the file.
        values: Its parameters, nested.
        full: Its full name.
        findings: Collects every name that has changed.
    """
    if node == "dwb_controller":
        return _dashing_controller(values)
    if node == "navfn_planner":
        return {"planner_plugins": ["GridBased"], "GridBased": {"plugin": "nav2_navfn_planner/NavfnPlanner", **values}}
    changed = dict(values)
    for lists in LISTS.get(node, ()):
        _modernise_list(changed, lists, full, findings)
    return changed


def _dashing_controller(values: Mapping[str, Any]) -> dict[str, Any]:
    """Turn Dashing's DWB, a node of its own, into the controller server and the controller that it is today."""
    server = {key: value for key, value in values.items() if _is_servers(key)}
    dwb = {key: value for key, value in values.items() if not _is_servers(key)}
    plugin = {"plugin": "dwb_core::DWBLocalPlanner", **dwb}
    return {**server, "controller_plugins": ["FollowPath"], "FollowPath": plugin}


def _is_servers(key: str) -> bool:
    return key in SERVER_KEYS or key in SERVER_GROUPS or key.endswith("_velocity_threshold")


def _modernise_list(values: dict[str, Any], lists: PluginLists, full: str, findings: Findings) -> None:
    """Turn an older list of plugins into today's, unless today's is given as well."""
    old = next((key for key in (*lists.names, lists.types) if key and key in values), None)
    if old is None or lists.now in values:
        return
    given = next((values.pop(key) for key in lists.names if key in values), list(lists.default))
    before = given if isinstance(given, list) else [given]
    names = todays_names(before)
    values[lists.now] = names
    for name, renamed in zip(before, names, strict=True):
        if name != renamed and name in values:
            values[renamed] = values.pop(name)
    _give_classes(values, names, values.pop(lists.types, None))
    findings.add("renamed", f"{full}.{old}", lists.now)


def todays_names(names: list[Any]) -> list[Any]:
    """Return the names of plugins, those of older recoveries as today's tree asks for them."""
    todays = [OLD_BEHAVIORS.get(name, name) if isinstance(name, str) else name for name in names]
    return [name if new in names else new for name, new in zip(names, todays, strict=True)]


def _give_classes(values: dict[str, Any], names: list[Any], classes: object) -> None:
    """Put each class into the group of its plugin, unless the group gives its class itself."""
    for name, ros_class in zip(names, classes if isinstance(classes, list) else [], strict=False):
        group = values.get(name, {}) if isinstance(name, str) else None
        if isinstance(group, Mapping):
            values[name] = {"plugin": ros_class, **group}
