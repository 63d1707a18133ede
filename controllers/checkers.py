"""Nav2's progress and goal checkers: their parameters, and how parameter files name them.

Source: nav2_controller (Humble, Jazzy and Lyrical), plugins. PositionGoalChecker came to Humble in a later patch
release (1.1.x); early installations of Humble lack it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from gym_mapbench.quantities import NonNegative
from gym_mapbench.ros_params import Keys, RosNames, in_every_release, since
from gym_mapbench.settings import ExtendedSettings, Settings

_HEADING = frozenset({"yaw_goal_tolerance", "symmetric_yaw_tolerance"})
_STANDING = frozenset({"trans_stopped_velocity", "rot_stopped_velocity"})
_OF_AXIS = frozenset({"along_path_tolerance", "cross_track_tolerance", "is_overshoot_valid"})
_OF_ADAPTIVE = frozenset({"fine_xy_goal_tolerance", "coarse_xy_goal_tolerance", "required_stagnation_cycles"})
_ONE_TOLERANCE = frozenset({"xy_goal_tolerance", "xy_goal_tolerance_buffer"})
UNREAD_GOAL: Mapping[str, frozenset[str]] = {
    "simple": _STANDING | _OF_AXIS | _OF_ADAPTIVE,
    "stopped": _OF_AXIS | _OF_ADAPTIVE,
    "position": _HEADING | _STANDING | _OF_AXIS | _OF_ADAPTIVE,
    "axis": _HEADING | _STANDING | _OF_ADAPTIVE | _ONE_TOLERANCE | {"stateful"},
    "adaptive": _OF_AXIS | _ONE_TOLERANCE,
}
"""Goal checker -> parameters of the others, which it does not read."""


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

    @property
    def unread(self) -> Mapping[str, str]:
        """Parameters that the plugin does not read -> why."""
        return {} if self.plugin == "pose" else {"required_movement_angle": "only PoseProgressChecker reads it"}


class GoalChecker(ExtendedSettings):
    """The goal checker: whether the goal is reached.

    Args:
        plugin: ``simple``, ``stopped`` (the robot must stand as well), ``position`` (whatever the heading), ``axis``
            (Lyrical: along and across the path) or ``adaptive`` (Lyrical: a coarse tolerance where the robot comes no
            nearer).
        xy_goal_tolerance: Tolerance of the position, m; neither ``axis`` nor ``adaptive``.
        yaw_goal_tolerance: Tolerance of the heading, rad.
        stateful: Whether a position once reached counts until the next path.
        symmetric_yaw_tolerance: Whether the opposite heading is as good.
        trans_stopped_velocity: Speed that counts as standing, m/s; ``stopped``, and ``adaptive`` with default 0.1.
        rot_stopped_velocity: Turn rate that counts as standing, rad/s; ``stopped``, and ``adaptive`` with default 0.1.
        path_length_tolerance: Lyrical: length of the local plan above which the goal is not reached, m.
        xy_goal_tolerance_buffer: Lyrical: distance beyond the tolerance from which on a position once reached no
            longer counts, m; 0 for none.
        along_path_tolerance: ``axis``: tolerance in the direction of the path, m.
        cross_track_tolerance: ``axis``: tolerance across the path, m.
        is_overshoot_valid: ``axis``: whether the robot may be any distance past the goal.
        fine_xy_goal_tolerance: ``adaptive``: tolerance within which the goal is reached at once, m.
        coarse_xy_goal_tolerance: ``adaptive``: tolerance for a robot that comes no nearer, m.
        required_stagnation_cycles: ``adaptive``: number of cycles after which a robot comes no nearer.
    """

    newer: ClassVar[tuple[str, ...]] = (
        "path_length_tolerance",
        "xy_goal_tolerance_buffer",
        "along_path_tolerance",
        "cross_track_tolerance",
        "is_overshoot_valid",
        "fine_xy_goal_tolerance",
        "coarse_xy_goal_tolerance",
        "required_stagnation_cycles",
    )

    plugin: Literal["simple", "stopped", "position", "axis", "adaptive"] = "simple"
    xy_goal_tolerance: NonNegative = 0.25
    yaw_goal_tolerance: NonNegative = 0.25
    stateful: bool = True
    symmetric_yaw_tolerance: bool = False
    trans_stopped_velocity: NonNegative = 0.25
    rot_stopped_velocity: NonNegative = 0.25
    path_length_tolerance: NonNegative = 1.0
    xy_goal_tolerance_buffer: NonNegative = 0.0
    along_path_tolerance: NonNegative = 0.25
    cross_track_tolerance: NonNegative = 0.25
    is_overshoot_valid: bool = False
    fine_xy_goal_tolerance: NonNegative = 0.10
    coarse_xy_goal_tolerance: NonNegative = 0.25
    required_stagnation_cycles: Annotated[int, Field(ge=1)] = 15

    @property
    def unread(self) -> Mapping[str, str]:
        """Parameters that the plugin does not read -> why."""
        return dict.fromkeys(UNREAD_GOAL[self.plugin], "only other goal checkers read it")

    @property
    def tolerance(self) -> float:
        """The tolerance of the position that controllers are told, m: the lesser of two, or the coarser."""
        if self.plugin == "axis":
            return min(self.along_path_tolerance, self.cross_track_tolerance)
        return self.coarse_xy_goal_tolerance if self.plugin == "adaptive" else self.xy_goal_tolerance

    @model_validator(mode="before")
    @classmethod
    def _of_the_plugin(cls, values: Any) -> Any:
        """Fill in the defaults that another plugin does not have."""
        adaptive = isinstance(values, Mapping) and values.get("plugin") == "adaptive"
        return {"trans_stopped_velocity": 0.10, "rot_stopped_velocity": 0.10, **values} if adaptive else values


PROGRESS_CHECKERS: dict[str, RosNames] = {
    "simple": in_every_release("nav2_controller::SimpleProgressChecker"),
    "pose": in_every_release("nav2_controller::PoseProgressChecker"),
}
"""Our names of the progress checkers -> their classes in ROS."""
PROGRESS_CHECKER_KEYS = Keys(ros_only=frozenset({"plugin"}))
GOAL_CHECKERS: dict[str, RosNames] = {
    "simple": in_every_release("nav2_controller::SimpleGoalChecker"),
    "stopped": in_every_release("nav2_controller::StoppedGoalChecker"),
    "position": in_every_release("nav2_controller::PositionGoalChecker"),
    "axis": since("lyrical", "nav2_controller::AxisGoalChecker"),
    "adaptive": since("lyrical", "nav2_controller::AdaptiveToleranceGoalChecker"),
}
"""Our names of the goal checkers -> their classes in ROS."""
_BEFORE_LYRICAL = {
    "path_length_tolerance": "the distance to the goal counts, not the way along the path",
    "xy_goal_tolerance_buffer": "a position once reached counts until the next path",
}
GOAL_CHECKER_KEYS = Keys(
    ros_only=frozenset({"plugin"}),
    missing={"humble": _BEFORE_LYRICAL, "jazzy": _BEFORE_LYRICAL},
)
