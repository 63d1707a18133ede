"""Parameters of the Graceful Controller, with Nav2's names and the defaults of its code.

Source: nav2_graceful_controller/src/parameter_handler.cpp (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import Field, create_model

from gym_mapbench.quantities import Natural, NonNegative, Positive
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import ReleaseSettings

ROS_ONLY_KEYS = frozenset({"plugin", "transform_tolerance"})
"""Keys of a parameter file that mean nothing without ROS: listed as ignored."""

_ONE_TARGET = "Humble has one target, at motion_target_dist"
_NEWER = {
    "use_collision_detection": "collisions are always looked for",
    "footprint_scaling_linear_vel": "a target that cannot be reached is not tried at a lower speed",
    "footprint_scaling_factor": "the footprint is the same at every speed",
    "footprint_scaling_step": "a target that cannot be reached is not tried at a lower speed",
    "obstacle_cost_margin": "the approach to the goal does not look for cheaper curves",
    "final_rotation_search_step": "the approach to the goal does not look for cheaper curves",
    "deceleration_max": "the speed near the target is set by slowdown_radius alone",
}

_ONLY_HUMBLE = {
    "motion_target_dist": "{} takes the farthest target up to max_lookahead",
    "initial_rotation_min_angle": "{}'s name is initial_rotation_tolerance",
    "final_rotation": "{} always turns at the goal; prefer_final_rotation does nearly the same",
}
_JAZZY: dict[str, Any] = {
    "k_phi": 2.0,
    "k_delta": 1.0,
    "beta": 0.4,
    "min_lookahead": 0.25,
    "max_lookahead": 1.0,
    "v_angular_min_in_place": 0.25,
    "initial_rotation_tolerance": 0.75,
    "prefer_final_rotation": True,
    "in_place_collision_resolution": 0.1,
}

_WithLambda = create_model("_WithLambda", __base__=ReleaseSettings, **{"lambda": (NonNegative, 2.0)})  # type: ignore[call-overload]
"""Holds the parameter ``lambda``, whose name is a keyword of Python."""


class GracefulParams(_WithLambda):
    """The parameters that ``nav2_graceful_controller`` reads.

    Nav2's quirks are kept: ``allow_backward`` has no effect with ``initial_rotation``. Humble takes the headings of the
    path as they are, and NavFn's are all 0 but the last; Jazzy points every pose at the next if they are all the same.

    Args:
        lambda: Sharpness of the slowing down on a curve.
        max_robot_pose_search_dist: Humble and Jazzy: length of the path that is searched for the nearest pose, m; None
            for half the width of the local costmap, negative for the whole path.
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
        min_lookahead: Since Jazzy: least distance of a target along the path, m; the goal may be nearer. Lyrical reads
            it without using it.
        max_lookahead: Since Jazzy: greatest distance of a target along the path, m.
        v_angular_min_in_place: Since Jazzy: lowest turn rate on the spot, rad/s.
        initial_rotation_tolerance: Since Jazzy: bearing of the target below which the first turn of a path ends,
            rad.
        prefer_final_rotation: Since Jazzy: whether the robot heads straight for a target near the goal, and turns
            there.
        in_place_collision_resolution: Since Jazzy: angle between the headings that are checked before the turn at the
            goal, rad.
        deceleration_max: Lyrical: deceleration with which the robot can stop at the target, m/s^2.
        use_collision_detection: Lyrical: whether the way to a target and the turn at the goal are checked.
        footprint_scaling_linear_vel: Lyrical: lowest top speed at which a target is tried, m/s; the footprint grows
            for commands above it.
        footprint_scaling_factor: Lyrical: share by which the footprint has grown for a command of ``v_linear_max``; as
            in Nav2 a triangle does not grow.
        footprint_scaling_step: Lyrical: by how much the top speed is lowered for the next try, m/s.
        obstacle_cost_margin: Lyrical: how far below the highest valid cost the way to the goal must stay, or else other
            headings of the goal are searched.
        final_rotation_search_step: Lyrical: angle between these headings, rad.
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
            **{name: why.format("Jazzy") for name, why in _ONLY_HUMBLE.items()},
        },
        "lyrical": {
            **{name: why.format("Lyrical") for name, why in _ONLY_HUMBLE.items()},
            "max_robot_pose_search_dist": "it is a parameter of the controller server's path handler",
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
        "jazzy": _JAZZY,
        "lyrical": _JAZZY
        | {
            "deceleration_max": 2.5,
            "use_collision_detection": True,
            "footprint_scaling_linear_vel": 0.5,
            "footprint_scaling_factor": 0.25,
            "footprint_scaling_step": 0.1,
            "obstacle_cost_margin": 1,
            "final_rotation_search_step": 0.1,
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
    deceleration_max: Positive | None = None
    use_collision_detection: bool | None = None
    footprint_scaling_linear_vel: NonNegative | None = None
    footprint_scaling_factor: NonNegative | None = None
    footprint_scaling_step: Positive | None = None
    obstacle_cost_margin: Annotated[Natural, Field(le=255)] | None = None
    final_rotation_search_step: Positive | None = None
