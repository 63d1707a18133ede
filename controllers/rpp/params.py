"""Parameters of Regulated Pure Pursuit, with Nav2's names and the defaults of its code.

Source: nav2_regulated_pure_pursuit_controller (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from typing import Any, ClassVar

from gym_mapbench.quantities import NonNegative, Positive
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import ReleaseSettings

ROS_ONLY_KEYS = frozenset({"plugin", "transform_tolerance"})
"""Keys of a parameter file that mean nothing without ROS: listed as ignored."""

RENAMED_KEYS = {"max_linear_vel": "desired_linear_vel"}
"""Lyrical's name -> name in Humble and Jazzy; both are accepted, and in Lyrical the older one counts first, too."""

_WINDOW = "a limit of the dynamic window"
_AT_CARROT = "Humble takes the curvature at the carrot"
_DYNAMIC_WINDOW = {
    "use_dynamic_window": "neither speed nor acceleration is limited by a dynamic window",
    "min_linear_vel": _WINDOW,
    "max_angular_vel": _WINDOW,
    "min_angular_vel": _WINDOW,
    "max_linear_accel": _WINDOW,
    "max_linear_decel": _WINDOW,
    "max_angular_decel": _WINDOW,
    "min_distance_to_obstacle": "it looks ahead for a time only: max_allowed_time_to_collision_up_to_carrot",
    "allow_obstacle_checking_beyond_goal": "the look-ahead ends at the carrot",
}
NEWER_ONLY_KEYS = _DYNAMIC_WINDOW | {
    "use_fixed_curvature_lookahead": _AT_CARROT,
    "curvature_lookahead_dist": _AT_CARROT,
    "interpolate_curvature_after_goal": _AT_CARROT,
    "use_cancel_deceleration": "Humble stops at once when cancelled",
    "cancel_deceleration": "Humble stops at once when cancelled",
    "stateful": "in Humble the goal checker alone is stateful",
}
"""Parameters of newer releases that Humble does not have -> what Humble does instead."""

_JAZZY = {
    "use_interpolation": None,
    "use_fixed_curvature_lookahead": False,
    "curvature_lookahead_dist": 0.6,
    "interpolate_curvature_after_goal": False,
    "use_cancel_deceleration": False,
    "cancel_deceleration": 3.2,
}


class RppParams(ReleaseSettings):
    """The parameters that ``nav2_regulated_pure_pursuit_controller`` reads.

    Nav2's quirks are kept: in Humble, ``allow_reversing`` has no effect with ``use_rotate_to_heading``; the turn rate
    ``v * curvature`` has no limit, and neither has the linear acceleration. A cancelled action stops at once here,
    whatever ``use_cancel_deceleration`` says.

    Args:
        desired_linear_vel: Top speed, m/s; ``max_linear_vel`` in files of Lyrical.
        lookahead_dist: Distance of the carrot, m.
        min_lookahead_dist: Shortest distance of the carrot if it scales with the speed, m.
        max_lookahead_dist: Longest distance of the carrot if it scales with the speed, m.
        lookahead_time: Distance of the carrot per speed if it scales with the speed, s.
        use_velocity_scaled_lookahead_dist: Whether the distance of the carrot scales with the speed.
        use_interpolation: Humble: whether the carrot lies between two poses of the path, at exactly the lookahead
            distance; in newer releases it always does.
        use_rotate_to_heading: Whether the robot turns on the spot towards the path and, at the goal, to its heading.
        rotate_to_heading_min_angle: Bearing of the carrot from which on the robot turns on the spot, rad.
        rotate_to_heading_angular_vel: Turn rate on the spot, rad/s.
        max_angular_accel: Angular acceleration of a turn on the spot and of the dynamic window, rad/s^2.
        min_approach_linear_velocity: Lowest speed of the approach to the path's end, m/s.
        approach_velocity_scaling_dist: Remaining length of path below which the speed falls, m; with 0 it does not.
        use_collision_detection: Whether the arc up to the carrot is checked.
        max_allowed_time_to_collision_up_to_carrot: Time for which that arc is checked, s.
        use_regulated_linear_velocity_scaling: Whether the robot slows down in curves.
        regulated_linear_scaling_min_radius: Radius below which it does, m.
        regulated_linear_scaling_min_speed: Lowest regulated speed, m/s.
        use_cost_regulated_linear_velocity_scaling: Whether the robot slows down near obstacles.
        cost_scaling_dist: Distance of the obstacles below which it does, m.
        cost_scaling_gain: Factor of the speed near obstacles.
        inflation_cost_scaling_factor: The inflation layer's ``cost_scaling_factor``, 1/m; it is not read from the
            layer.
        allow_reversing: Whether the robot drives backwards where the path does.
        max_robot_pose_search_dist: Humble and Jazzy: length of the path that is searched for the nearest pose, m; None
            for half the local costmap, negative for the whole path.
        use_fixed_curvature_lookahead: Since Jazzy: whether the curvature is taken from a second carrot.
        curvature_lookahead_dist: Since Jazzy: distance of the second carrot, m.
        interpolate_curvature_after_goal: Since Jazzy: whether the second carrot may lie beyond the path's end, on its
            extended last segment.
        use_cancel_deceleration: Since Jazzy: whether a cancelled action slows down first.
        cancel_deceleration: Since Jazzy: deceleration of a cancelled action, m/s^2.
        stateful: Jazzy: whether a goal position once reached counts until the next path.
        use_dynamic_window: Lyrical: whether the command is taken from the window that the limits allow.
        min_linear_vel: Lyrical: lowest speed of the window, m/s.
        max_angular_vel: Lyrical: highest turn rate of the window, rad/s.
        min_angular_vel: Lyrical: lowest turn rate of the window, rad/s.
        max_linear_accel: Lyrical: acceleration of the window, m/s^2.
        max_linear_decel: Lyrical: deceleration of the window, m/s^2; negative.
        max_angular_decel: Lyrical: angular deceleration of the window, rad/s^2; negative.
        min_distance_to_obstacle: Lyrical: distance for which the arc is checked at least, m; without effect if it is
            not positive.
        allow_obstacle_checking_beyond_goal: Lyrical: whether ``min_distance_to_obstacle`` may reach past the path's
            end.
    """

    MISSING: ClassVar[dict[Release, dict[str, str]]] = {
        "humble": NEWER_ONLY_KEYS,
        "jazzy": _DYNAMIC_WINDOW | {"use_interpolation": "Jazzy always interpolates"},
        "lyrical": {
            "use_interpolation": "Lyrical always interpolates",
            "max_robot_pose_search_dist": "it is a parameter of the controller server's path handler",
            "stateful": "in Lyrical the goal checker alone is stateful",
        },
    }
    DEFAULTS: ClassVar[dict[Release, dict[str, Any]]] = {
        "jazzy": _JAZZY | {"stateful": True},
        "lyrical": _JAZZY
        | {
            "use_dynamic_window": False,
            "min_linear_vel": -0.5,
            "max_angular_vel": 2.5,
            "min_angular_vel": -2.5,
            "max_linear_accel": 2.5,
            "max_linear_decel": -2.5,
            "max_angular_decel": -3.2,
            "min_distance_to_obstacle": -1.0,
            "allow_obstacle_checking_beyond_goal": False,
        },
    }

    desired_linear_vel: Positive = 0.5
    lookahead_dist: Positive = 0.6
    min_lookahead_dist: Positive = 0.3
    max_lookahead_dist: Positive = 0.9
    lookahead_time: NonNegative = 1.5
    use_velocity_scaled_lookahead_dist: bool = False
    use_interpolation: bool | None = True
    use_rotate_to_heading: bool = True
    rotate_to_heading_min_angle: NonNegative = 0.785
    rotate_to_heading_angular_vel: Positive = 1.8
    max_angular_accel: Positive = 3.2
    min_approach_linear_velocity: NonNegative = 0.05
    approach_velocity_scaling_dist: NonNegative = 0.6
    use_collision_detection: bool = True
    max_allowed_time_to_collision_up_to_carrot: NonNegative = 1.0
    use_regulated_linear_velocity_scaling: bool = True
    regulated_linear_scaling_min_radius: Positive = 0.9
    regulated_linear_scaling_min_speed: NonNegative = 0.25
    use_cost_regulated_linear_velocity_scaling: bool = True
    cost_scaling_dist: Positive = 0.6
    cost_scaling_gain: NonNegative = 1.0
    inflation_cost_scaling_factor: Positive = 3.0
    allow_reversing: bool = False
    max_robot_pose_search_dist: float | None = None
    use_fixed_curvature_lookahead: bool | None = None
    curvature_lookahead_dist: Positive | None = None
    interpolate_curvature_after_goal: bool | None = None
    use_cancel_deceleration: bool | None = None
    cancel_deceleration: Positive | None = None
    stateful: bool | None = None
    use_dynamic_window: bool | None = None
    min_linear_vel: float | None = None
    max_angular_vel: NonNegative | None = None
    min_angular_vel: float | None = None
    max_linear_accel: NonNegative | None = None
    max_linear_decel: float | None = None
    max_angular_decel: float | None = None
    min_distance_to_obstacle: float | None = None
    allow_obstacle_checking_beyond_goal: bool | None = None
