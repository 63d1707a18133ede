"""Regulated Pure Pursuit as Nav2 names it, and as parameter files hold it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from controllers.descriptor import Limits, Nav2Controller, highest, named_limits
from controllers.rpp.lyrical import make_rpp
from controllers.rpp.params import RENAMED_KEYS, ROS_ONLY_KEYS, RppParams
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import Keys, Section, in_every_release

LONGEST_AHEAD = 0.4
"""Longest ``lookahead_dist`` (m) with which RPP rarely stops in a bend (``docs/howto/slow.md``)."""
UNTELLING = frozenset({"max_linear_accel", "max_linear_decel", "min_distance_to_obstacle"})
"""Lyrical's parameters of which Foxy and Galactic have the first two and Kilted has the last; Jazzy has none."""
SCALING_FACTOR, SCALES = "inflation_cost_scaling_factor", "use_cost_regulated_linear_velocity_scaling"
TURNING = {
    "max_angular_velocity": "rotate_to_heading_angular_vel",
    "max_angular_acceleration": "max_angular_accel",
}
"""Limit of the robot -> the parameter that states it; the Rotation Shim has parameters of the same names."""


def adapt(section: Section) -> None:
    """Give Lyrical's parameters their names here, unless the older name is given as well, which then counts there.

    As in Nav2 (``parameter_handler.cpp``), costs do not slow a robot down whose cost scaling factor is not positive.
    """
    factor = section.values.get(SCALING_FACTOR)
    if isinstance(factor, (int, float)) and not isinstance(factor, bool) and factor <= 0:
        del section.values[SCALING_FACTOR]
        section.values[SCALES] = False
        section.findings.add("replaced", f"{section.name}.{SCALING_FACTOR}", f"Nav2 then switches {SCALES} off")
    for name, older in RENAMED_KEYS.items():
        if section.findings.release == "lyrical" and name in section.values and older not in section.values:
            section.rename(name, older)


def arrange(values: dict[str, Any], release: Release) -> dict[str, Any]:
    """Give the parameters the names that a release writes."""
    if release != "lyrical":
        return values
    lyrical = {older: name for name, older in RENAMED_KEYS.items()}
    return {lyrical.get(name, name): value for name, value in values.items()}


def limits(params: Mapping[str, Any]) -> Limits:
    """Return the limits of the robot that the parameters state; backwards it is as fast as forwards, if at all."""
    turns = params["release"] == "humble" and params["use_rotate_to_heading"]
    backwards = params["desired_linear_vel"] if params["allow_reversing"] and not turns else 0.0
    named = named_limits(params, {"max_linear_velocity": "desired_linear_vel", **TURNING})
    return highest([named, {"max_reverse_velocity": backwards}]) if backwards else named


def advice(params: Mapping[str, Any]) -> str:
    """Say that the collision check may stop the robot in bends."""
    ahead = params["lookahead_dist"]
    if not params["use_collision_detection"] or params["use_velocity_scaled_lookahead_dist"] or ahead <= LONGEST_AHEAD:
        return ""
    return (
        f"lookahead_dist {ahead:g}: in bends of narrow corridors the arc to the carrot meets the wall, and RPP stops; "
        "0.3 to 0.4 helps"
    )


RPP = Nav2Controller(
    in_every_release("nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"),
    "Regulated Pure Pursuit",
    RppParams,
    Keys(
        ros_only=ROS_ONLY_KEYS,
        renamed={"max_allowed_time_to_collision": "max_allowed_time_to_collision_up_to_carrot", **RENAMED_KEYS},
        elsewhere={
            "use_approach_linear_velocity_scaling": "a parameter of older releases; the approach is always scaled now",
            "velocity_feedback": "Lyrical's dynamic window is around the last command",
            "use_approach_vel_scaling": "a parameter of older releases; the approach is always scaled now",
        },
        untelling=UNTELLING,
    ),
    adapt=adapt,
    arrange=arrange,
    make=make_rpp,
    limits=limits,
    advice=advice,
    relative_cost=1.0,
)
