"""The plugins of Nav2 that are built here, by our names; each describes itself in a module beside its code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from controllers.behaviors import DRIVE_ON_HEADING
from controllers.descriptor import Nav2Controller
from controllers.dwb.plugin import DWB
from controllers.graceful.plugin import GRACEFUL
from controllers.mppi.plugin import MPPI
from controllers.rotation_shim.plugin import NAMES as SHIM_NAMES
from controllers.rotation_shim.plugin import OWN_KEYS as SHIM_KEYS
from controllers.rotation_shim.plugin import PRIMARY, around
from controllers.rpp.plugin import RPP
from gym_mapbench.costmap import LAYERS
from gym_mapbench.planners import PLANNERS as ALL_PLANNERS
from gym_mapbench.registry import Registry
from gym_mapbench.ros_params import RosNames, RosPlugin, known_class, slashed_in_humble
from gym_mapbench.smoothers import SMOOTHERS as ALL_SMOOTHERS

PRIMARIES = {"dwb": DWB, "mppi": MPPI, "rpp": RPP, "graceful": GRACEFUL}
"""The controllers that drive by themselves."""
SHIMS = {f"shim_{name}": name for name in PRIMARIES}
"""A Rotation Shim around a controller -> that controller."""
CONTROLLERS: dict[str, Nav2Controller] = PRIMARIES | {
    shim: around(PRIMARIES[name], PRIMARIES.values()) for shim, name in SHIMS.items()
}
BEHAVIORS = {
    "spin": slashed_in_humble("nav2_behaviors", "Spin"),
    "backup": slashed_in_humble("nav2_behaviors", "BackUp"),
    "wait": slashed_in_humble("nav2_behaviors", "Wait"),
}
"""Behaviours by the names that the default tree asks for."""
DRIVES = {DRIVE_ON_HEADING: slashed_in_humble("nav2_behaviors", "DriveOnHeading")}
"""The behaviour for which a user's tree may ask besides."""


def _of_nav2(registry: Registry[Any]) -> Iterator[tuple[str, RosPlugin]]:
    """Yield the plugins of a registry that this project brings and Nav2 has."""
    described = ((name, registry.get(name).nav2) for name in registry.built_in)
    return ((name, plugin) for name, plugin in described if plugin is not None)


PLANNERS = dict(_of_nav2(ALL_PLANNERS))
SMOOTHERS = dict(_of_nav2(ALL_SMOOTHERS))
COSTMAP_LAYERS = dict(_of_nav2(LAYERS))


def names_in_ros(plugins: Mapping[str, RosPlugin]) -> dict[str, RosNames]:
    """Return a table of our names of plugins -> their names in ROS."""
    return {name: plugin.names for name, plugin in plugins.items()}


def stand_in(ros_class: object, plugins: Mapping[str, RosPlugin]) -> str | None:
    """Return our name of the plugin that stands in for a foreign class; None if there is none."""
    parts = ((name, part) for name, plugin in plugins.items() for part in plugin.stands_in_for)
    return next((name for name, part in parts if part in str(ros_class)), None)


def is_shim(ros_class: object) -> bool:
    """Whether a class is the Rotation Shim."""
    return known_class(ros_class, {"shim": SHIM_NAMES}) is not None


def controller_kind(group: Mapping[str, Any]) -> str | None:
    """Return our name of the controller that a group of parameters is for, None if it is not built here.

    The kind of a Rotation Shim also names its primary controller.
    """
    if not is_shim(group.get("plugin")):
        return known_class(group.get("plugin"), names_in_ros(PRIMARIES))
    inside = known_class(primary_class(group), names_in_ros(PRIMARIES))
    return f"shim_{inside}" if inside else None


def primary_class(group: Mapping[str, Any]) -> object:
    """Return the class of the primary controller of a Rotation Shim: in Lyrical the plugin of a group of its own."""
    primary = group.get(PRIMARY)
    return primary.get("plugin") if isinstance(primary, Mapping) else primary


@cache
def strays(kind: str) -> Mapping[str, str]:
    """Return the parameters of other controllers, which are often left over after a change of the plugin."""
    others = [plugin for plugin in PRIMARIES.values() if plugin is not CONTROLLERS[kind]]
    named = {name: f"a parameter of {plugin.title}" for plugin in others for name in plugin.parameters}
    shims = {} if kind in SHIMS else dict.fromkeys(SHIM_KEYS, "a parameter of the Rotation Shim")
    return {**named, **shims}
