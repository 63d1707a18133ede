"""Nav2's progress and goal checkers: their parameters, and how parameter files name them."""

from __future__ import annotations

from typing import Literal

from gym_mapbench.quantities import NonNegative
from gym_mapbench.ros_params import Keys, RosNames, in_every_release, since
from gym_mapbench.settings import Settings


class ProgressChecker(Settings):
    """The progress checker: whether the robot still makes progress.

    Args:
        plugin: ``simple``, ``pose`` (a turn is progress as well) or ``none`` (ours: progress is not checked).
        required_movement_radius: Distance that counts as progress, m.
        movement_time_allowance: Seconds without progress until the controller gives up.
        required_movement_angle: Turn that counts as progress, rad; ``pose`` only.
    """

    plugin: Literal["simple", "pose", "none"] = "simple"
    required_movement_radius: NonNegative = 0.5
    movement_time_allowance: NonNegative = 10.0
    required_movement_angle: NonNegative = 0.5


class GoalChecker(Settings):
    """The goal checker: whether the goal is reached.

    Args:
        plugin: ``simple``, ``stopped`` (the robot must stand as well) or ``position`` (Jazzy: whatever the heading).
        xy_goal_tolerance: Tolerance of the position, m.
        yaw_goal_tolerance: Tolerance of the heading, rad.
        stateful: Whether a position once reached counts until the next path.
        symmetric_yaw_tolerance: Whether the opposite heading is as good.
        trans_stopped_velocity: Speed that counts as standing, m/s; ``stopped`` only.
        rot_stopped_velocity: Turn rate that counts as standing, rad/s; ``stopped`` only.
    """

    plugin: Literal["simple", "stopped", "position"] = "simple"
    xy_goal_tolerance: NonNegative = 0.25
    yaw_goal_tolerance: NonNegative = 0.25
    stateful: bool = True
    symmetric_yaw_tolerance: bool = False
    trans_stopped_velocity: NonNegative = 0.25
    rot_stopped_velocity: NonNegative = 0.25


PROGRESS_CHECKERS: dict[str, RosNames] = {
    "simple": in_every_release("nav2_controller::SimpleProgressChecker"),
    "pose": in_every_release("nav2_controller::PoseProgressChecker"),
}
"""Our names of the progress checkers -> their classes in ROS."""
PROGRESS_CHECKER_KEYS = Keys(ros_only=frozenset({"plugin"}))
GOAL_CHECKERS: dict[str, RosNames] = {
    "simple": in_every_release("nav2_controller::SimpleGoalChecker"),
    "stopped": in_every_release("nav2_controller::StoppedGoalChecker"),
    "position": since("jazzy", "nav2_controller::PositionGoalChecker"),
}
"""Our names of the goal checkers -> their classes in ROS."""
GOAL_CHECKER_KEYS = Keys(
    ros_only=frozenset({"plugin"}),
    elsewhere={
        "path_length_tolerance": "the distance to the goal counts here, not the way along the path",
        "xy_goal_tolerance_buffer": "newer releases only",
    },
)
