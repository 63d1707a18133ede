"""The Graceful Controller as Nav2 names it, and as parameter files hold it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from controllers.descriptor import Limits, Nav2Controller, highest, named_limits
from controllers.graceful.lyrical import make_graceful
from controllers.graceful.params import ROS_ONLY_KEYS, GracefulParams
from gym_mapbench.ros_params import Keys, in_every_release

TARGET = {"humble": "motion_target_dist"}
"""Release -> the distance of the target, m; ``max_lookahead`` since Jazzy."""
LIMITS = {"max_linear_velocity": "v_linear_max", "max_angular_velocity": "v_angular_max"}


def limits(params: Mapping[str, Any]) -> Limits:
    """Return the limits of the robot that the parameters state.

    ``v_angular_max`` does not limit turns on the spot, of which half a turn is the fastest. Backwards the robot is as
    fast as forwards, if at all.
    """
    half_turn = params["rotation_scaling_factor"] * math.pi * params["v_angular_max"]
    backwards = params["allow_backward"] and not params["initial_rotation"]
    reverse = {"max_reverse_velocity": params["v_linear_max"]} if backwards else {}
    return highest([named_limits(params, LIMITS), {"max_angular_velocity": float(half_turn)}, reverse])


def advice(params: Mapping[str, Any]) -> str:
    """Say that the robot never reaches its top speed, as its target is always nearer than ``slowdown_radius``."""
    radius, target = params["slowdown_radius"], TARGET.get(params["release"], "max_lookahead")
    if radius <= params[target]:
        return ""
    return (
        f"slowdown_radius {radius:g}, {target} {params[target]:g}: the target is always within the radius, so the "
        f"robot drives at most {params[target] / radius:.0%} of v_linear_max; a radius of at most {target} helps"
    )


GRACEFUL = Nav2Controller(
    in_every_release("nav2_graceful_controller::GracefulController"),
    "the Graceful Controller",
    GracefulParams,
    Keys(ros_only=ROS_ONLY_KEYS),
    make=make_graceful,
    limits=limits,
    advice=advice,
    relative_cost=1.5,
    needs_no_section=True,
)
