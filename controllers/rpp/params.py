"""Parameters of Regulated Pure Pursuit, with Nav2's names and Humble's defaults.

Source: nav2_regulated_pure_pursuit_controller (Humble); values are the defaults in its code.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gym_mapbench.settings import Settings

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]


class RppParams(Settings):
    """What ``nav2_regulated_pure_pursuit_controller`` reads in Humble.

    Nav2's quirks are kept: with ``use_rotate_to_heading``, ``allow_reversing`` has no effect; the turn rate
    ``v * curvature`` has no limit; there is no limit of the linear acceleration.

    Args:
        desired_linear_vel: Top speed, m/s.
        lookahead_dist: Distance of the carrot, m.
        min_lookahead_dist: Lower bound where it scales with the speed, m.
        max_lookahead_dist: Upper bound where it scales with the speed, m.
        lookahead_time: The scale, s.
        use_velocity_scaled_lookahead_dist: Whether it scales with the speed.
        use_interpolation: Whether the carrot lies between two poses of the path, at exactly the lookahead distance.
        use_rotate_to_heading: Whether the robot turns on the spot towards the path and, at the goal, to its heading.
        rotate_to_heading_min_angle: Bearing of the carrot from which on it turns on the spot, rad.
        rotate_to_heading_angular_vel: Turn rate on the spot, rad/s.
        max_angular_accel: Of the turn on the spot, rad/s^2.
        min_approach_linear_velocity: Lowest speed of the approach to the path's end, m/s.
        approach_velocity_scaling_dist: Remaining length from which on the speed falls, m.
        use_collision_detection: Whether the arc up to the carrot is checked.
        max_allowed_time_to_collision_up_to_carrot: Length of that arc, s.
        use_regulated_linear_velocity_scaling: Whether curvature slows down.
        regulated_linear_scaling_min_radius: Radius below which it does, m.
        regulated_linear_scaling_min_speed: Floor of the regulated speed, m/s.
        use_cost_regulated_linear_velocity_scaling: Whether near obstacles slow down.
        cost_scaling_dist: Distance of the obstacles below which they do, m.
        cost_scaling_gain: How much, at most 1.
        inflation_cost_scaling_factor: The inflation layer's ``cost_scaling_factor``; not read from the layer, 1/m.
        allow_reversing: Whether it drives backwards where the path does.
        max_robot_pose_search_dist: Length of path searched for the nearest pose, m; None for half the local costmap,
            negative for the whole path.
    """

    desired_linear_vel: Positive = 0.5
    lookahead_dist: Positive = 0.6
    min_lookahead_dist: Positive = 0.3
    max_lookahead_dist: Positive = 0.9
    lookahead_time: NonNegative = 1.5
    use_velocity_scaled_lookahead_dist: bool = False
    use_interpolation: bool = True
    use_rotate_to_heading: bool = True
    rotate_to_heading_min_angle: NonNegative = 0.785
    rotate_to_heading_angular_vel: Positive = 1.8
    max_angular_accel: Positive = 3.2
    min_approach_linear_velocity: NonNegative = 0.05
    approach_velocity_scaling_dist: Positive = 0.6
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


ROS_ONLY_KEYS = frozenset({"plugin", "transform_tolerance"})
"""Keys of a parameter file that mean nothing without ROS: listed as ignored."""

RENAMED_KEYS = {"max_linear_vel": "desired_linear_vel"}
"""Newer name -> the name in Humble; both are accepted."""

_WINDOW = "a limit of the dynamic window"
NEWER_ONLY_KEYS = {
    "use_dynamic_window": "Humble limits neither speed nor acceleration by a dynamic window",
    "velocity_feedback": "it belongs to the dynamic window of newer releases",
    "min_linear_vel": _WINDOW,
    "max_angular_vel": _WINDOW,
    "min_angular_vel": _WINDOW,
    "max_linear_accel": _WINDOW,
    "max_linear_decel": _WINDOW,
    "max_angular_decel": _WINDOW,
    "min_distance_to_obstacle": "Humble looks ahead for a time only: max_allowed_time_to_collision_up_to_carrot",
    "use_fixed_curvature_lookahead": "Humble takes the curvature at the carrot",
    "curvature_lookahead_dist": "Humble takes the curvature at the carrot",
    "interpolate_curvature_after_goal": "Humble takes the curvature at the carrot",
    "use_cancel_deceleration": "Humble stops at once when cancelled",
    "cancel_deceleration": "Humble stops at once when cancelled",
    "stateful": "in Humble the goal checker alone is stateful",
}
"""Parameters of newer releases that Humble does not have -> what Humble does instead."""
