"""Parameters of the Graceful Controller, with Nav2's names and the defaults of its code.

Source: nav2_graceful_controller/src/parameter_handler.cpp (Humble and Jazzy).
"""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import create_model

from controllers.parameters import ReleaseSettings
from controllers.releases import Release
from gym_mapbench.quantities import NonNegative, Positive

ROS_ONLY_KEYS = frozenset({"plugin", "transform_tolerance"})
"""Keys of a parameter file that mean nothing without ROS: listed as ignored."""

RENAMED_KEYS: dict[str, str] = {}
"""Name in newer releases -> name in Humble and Jazzy."""

_ONE_TARGET = "Humble has one target, at motion_target_dist"
_MANY_TARGETS = "Jazzy takes the farthest target between min_lookahead and max_lookahead"
_NEWER = {
    "use_collision_detection": "collisions are always looked for",
    "footprint_scaling_linear_vel": "a target that cannot be reached is not tried at a lower speed",
    "footprint_scaling_step": "a target that cannot be reached is not tried at a lower speed",
    "obstacle_cost_margin": "the approach to the goal does not look for cheaper curves",
    "final_rotation_search_step": "the approach to the goal does not look for cheaper curves",
    "deceleration_max": "the speed near the target is set by slowdown_radius alone",
}

_WithLambda = create_model("_WithLambda", __base__=ReleaseSettings, **{"lambda": (NonNegative, 2.0)})  # type: ignore[call-overload]
"""Holds the parameter ``lambda``, whose name is a keyword of Python."""


class GracefulParams(_WithLambda):
    """The parameters that ``nav2_graceful_controller`` reads.

    Nav2's quirks are kept: ``allow_backward`` has no effect with ``initial_rotation``. Humble takes the headings of the
    path as they are, and NavFn's are all 0 but the last; Jazzy points every pose at the next if they are all the same.

    Args:
        lambda: Sharpness of the slowing down on a curve.
        max_robot_pose_search_dist: Length of the path that is searched for the nearest pose, m; None for half the width
            of the local costmap, negative for the whole path.
        k_phi: How fast the robot turns to the heading that leads to the target, against how fast it gets there.
        k_delta: How fast the robot's heading approaches that heading.
        beta: Strength of the slowing down on a curve.
        v_linear_min: Lowest speed, m/s.
        v_linear_max: Top speed, m/s.
        v_angular_max: Top turn rate, rad/s.
        slowdown_radius: Distance of the target from which on the speed falls, m.
        initial_rotation: Whether the robot turns on the spot towards the target first.
        rotation_scaling_factor: Turn rate on the spot per rad and per ``v_angular_max``.
        allow_backward: Whether the robot drives backwards to a target behind it.
        motion_target_dist: Humble: distance of the target, m.
        initial_rotation_min_angle: Humble: bearing of the target from which on the robot turns first, rad.
        final_rotation: Humble: whether the robot turns to the goal's heading only at the goal.
        min_lookahead: Jazzy: least distance of a target along the path, m; the goal may be nearer.
        max_lookahead: Jazzy: greatest distance of a target along the path, m.
        v_angular_min_in_place: Jazzy: lowest turn rate on the spot, rad/s.
        initial_rotation_tolerance: Jazzy: bearing of the target below which the first turn of a path ends, rad.
        prefer_final_rotation: Jazzy: whether the robot heads straight for a target near the goal, and turns there.
        in_place_collision_resolution: Jazzy: angle between the headings that are checked before the turn at the goal,
            rad.
    """

    MISSING: ClassVar[dict[Release, dict[str, str]]] = {
        "humble": {
            **_NEWER,
            "min_lookahead": _ONE_TARGET,
            "max_lookahead": _ONE_TARGET,
            "v_angular_min_in_place": "in Humble a turn on the spot may become as slow as it likes",
            "initial_rotation_tolerance": "Humble's name is initial_rotation_min_angle",
            "prefer_final_rotation": "Humble's final_rotation does nearly the same",
            "in_place_collision_resolution": "in Humble the turn at the goal is not checked heading by heading",
        },
        "jazzy": {
            **_NEWER,
            "motion_target_dist": _MANY_TARGETS,
            "initial_rotation_min_angle": "Jazzy's name is initial_rotation_tolerance",
            "final_rotation": "Jazzy always turns at the goal; prefer_final_rotation does nearly the same",
        },
    }
    DEFAULTS: ClassVar[dict[Release, dict[str, Any]]] = {
        "humble": {
            "k_phi": 3.0,
            "k_delta": 2.0,
            "beta": 0.2,
            "motion_target_dist": 0.6,
            "initial_rotation_min_angle": 0.75,
            "final_rotation": True,
        },
        "jazzy": {
            "k_phi": 2.0,
            "k_delta": 1.0,
            "beta": 0.4,
            "min_lookahead": 0.25,
            "max_lookahead": 1.0,
            "v_angular_min_in_place": 0.25,
            "initial_rotation_tolerance": 0.75,
            "prefer_final_rotation": True,
            "in_place_collision_resolution": 0.1,
        },
    }

    max_robot_pose_search_dist: float | None = None
    k_phi: NonNegative = 3.0
    k_delta: NonNegative = 2.0
    beta: NonNegative = 0.2
    v_linear_min: NonNegative = 0.1
    v_linear_max: Positive = 0.5
    v_angular_max: Positive = 1.0
    slowdown_radius: Positive = 1.5
    initial_rotation: bool = True
    rotation_scaling_factor: Positive = 0.5
    allow_backward: bool = False
    motion_target_dist: Positive | None = None
    initial_rotation_min_angle: NonNegative | None = None
    final_rotation: bool | None = None
    min_lookahead: NonNegative | None = None
    max_lookahead: Positive | None = None
    v_angular_min_in_place: NonNegative | None = None
    initial_rotation_tolerance: NonNegative | None = None
    prefer_final_rotation: bool | None = None
    in_place_collision_resolution: Positive | None = None
