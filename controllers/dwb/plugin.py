"""DWB as Nav2 names it, and as parameter files hold it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from controllers.descriptor import Nav2Controller, named_limits
from controllers.dwb.controller import DwbFollower
from controllers.dwb.params import ROS_ONLY_KEYS, DwbParams
from gym_mapbench.ros_params import Keys, Section, in_every_release

LONGEST_AHEAD = 1.2
"""Longest ``forward_prune_distance`` (m) with which DWB rarely stands still (``docs/howto/slow.md``)."""
SIDEWAYS = ("min_vel_y", "max_vel_y")
LIMITS = {
    "max_linear_velocity": "max_vel_x",
    "max_reverse_velocity": "min_vel_x",
    "max_angular_velocity": "max_vel_theta",
    "max_linear_acceleration": "acc_lim_x",
    "max_angular_acceleration": "acc_lim_theta",
}


def adapt(section: Section) -> None:
    """Set the speeds sideways to 0, since the robots here cannot move sideways, and name the critics by their class."""
    _name_critics(section)
    for key in SIDEWAYS:
        value = section.values.get(key)
        if isinstance(value, (int, float)) and not isinstance(value, bool) and value != 0:
            section.values[key] = 0.0
            section.findings.add(
                "replaced", f"{section.name}.{key}", "taken as 0: the robots here cannot move sideways"
            )


def _name_critics(section: Section) -> None:
    """Name every critic by its class if all classes are known and different; a critic's ``class`` is its name else.

    Source: dwb_core/src/dwb_local_planner.cpp (loadCritics, resolveCriticClassName).
    """
    critics = section.values.get("critics")
    if not isinstance(critics, list) or not all(isinstance(name, str) for name in critics):
        return
    own = {name: section.values.get(name) for name in critics}
    classes = {
        name: critic_class(str(group.get("class", name)) if isinstance(group, Mapping) else name)
        for name, group in own.items()
    }
    if len({*classes.values()} & {*DwbParams.critic_names()}) < len(critics):
        return
    groups = {name: section.values.pop(name) for name in critics if isinstance(section.values.get(name), Mapping)}
    for name, kind in classes.items():
        if name != kind:
            section.findings.add("renamed", f"{section.name}.{name}", kind)
            section.values.pop(kind, None)
    for name, group in groups.items():
        section.values[classes[name]] = {key: value for key, value in group.items() if key != "class"}
    section.values["critics"] = list(classes.values())


def critic_class(given: str) -> str:
    """Return the class of a critic as it is named here, without its namespace and ``Critic`` at its end."""
    return given.removeprefix("dwb_critics::").removesuffix("Critic")


def advice(params: Mapping[str, Any]) -> str:
    """Say that the end of the local plan may lie behind a wall; Lyrical measures it along the path."""
    ahead = 0.0 if params["release"] == "lyrical" else params["forward_prune_distance"]
    if 0.0 <= ahead <= LONGEST_AHEAD:  # a negative value of Jazzy stands for the whole plan
        return ""
    return (
        f"forward_prune_distance {ahead:g}: where the path winds around a wall, the end of the local plan may lie "
        "behind the wall, and DWB stands still; 1.0 helps"
    )


DWB = Nav2Controller(
    in_every_release("dwb_core::DWBLocalPlanner"),
    "DWB",
    DwbParams,
    Keys(ros_only=ROS_ONLY_KEYS),
    adapt=adapt,
    make=DwbFollower,
    limits=partial(named_limits, sources=LIMITS),
    advice=advice,
    relative_cost=3.0,
)
