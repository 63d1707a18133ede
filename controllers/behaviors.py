"""Nav2's default behaviour tree and its recovery behaviours: their parameters.

Source: nav2_bt_navigator and nav2_behaviors (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from gym_mapbench.quantities import Natural, NonNegative, Positive
from gym_mapbench.releases import Release
from gym_mapbench.settings import ExtendedSettings, Settings

LatencyModel = Literal["ideal", "nav2"]
"""Duration of messages and plans: none, or those of a computer that is otherwise idle."""


class DriveLimits(Settings):
    """Limits of a behaviour that drives straight (Humble and Lyrical); an acceleration of 0 means no limit.

    Args:
        acceleration_limit: Largest acceleration, m/s^2.
        deceleration_limit: Largest deceleration, m/s^2; not positive.
        minimum_speed: Lowest speed, m/s.
    """

    acceleration_limit: NonNegative = 0.0
    deceleration_limit: Annotated[float, Field(le=0)] = 0.0
    minimum_speed: NonNegative = 0.0


NO_LIMITS = DriveLimits()
DRIVE_ON_HEADING = "drive_on_heading"
"""The behaviour that exists only where a user's tree asks for it."""


class BehaviorServer(ExtendedSettings):
    """Nav2's ``behavior_server``: spin, back-up, wait, and the drive on the heading of a user's tree.

    Args:
        cycle_frequency: Rate of the behaviours, Hz.
        simulate_ahead_time: How far the behaviours look ahead for collisions, s.
        max_rotational_vel: Highest turn rate of a spin, rad/s.
        min_rotational_vel: Lowest turn rate of a spin, rad/s.
        rotational_acc_lim: Angular acceleration of a spin, rad/s^2.
        behavior_plugins: Which of the behaviours exist; the tree's other ones fail.
        backup: Limits of the back-up (Humble and Lyrical).
        drive_on_heading: Limits of the drive on the heading (Humble and Lyrical); None for those of a release's code.
    """

    newer: ClassVar[tuple[str, ...]] = ("drive_on_heading",)

    cycle_frequency: Annotated[Positive, Field(le=1000)] = 10.0
    simulate_ahead_time: NonNegative = 2.0
    max_rotational_vel: Positive = 1.0
    min_rotational_vel: NonNegative = 0.4
    rotational_acc_lim: Positive = 3.2
    behavior_plugins: tuple[Literal["spin", "backup", "wait"], ...] = ("spin", "backup", "wait")
    backup: DriveLimits = NO_LIMITS
    drive_on_heading: DriveLimits | None = None


class BehaviorTree(ExtendedSettings):
    """The behaviour tree: the numbers of Nav2's default tree, or a whole tree. Only ``bt_loop_duration`` is in ROS.

    Args:
        bt_loop_duration: Period of the tree's ticks, ms as in Nav2; with ``latency: ideal`` it has no effect.
        replanning_frequency: Rate of replanning, Hz.
        number_of_retries: Largest number of recoveries per goal.
        spin_dist: Angle of a spin, rad.
        wait_duration: Duration of a wait, s.
        backup_dist: Distance of a back-up, m.
        backup_speed: Speed of a back-up, m/s.
        time_allowance: Seconds that a spin or a back-up may take; 0 for no limit.
        recoveries: Whether there are recoveries at all; without them the first failure ends the run.
        latency: ``ideal``: the tree ticks once in a control period, and everything is answered at once. ``nav2``: it
            ticks every ``bt_loop_duration``; actions, services and plans take time.
        goal_nearby_distance: Lyrical: remaining length of path below which a valid path is kept, m; 0 to replan always.
        wrap_around: Whether the recoveries begin again after the last; in Lyrical the last one ends them.
        local_clear_plugins: Lyrical: layers that the clears of the local costmap name (``plugins`` of
            ``ClearEntireCostmap``); none for all layers.
        global_clear_plugins: Lyrical: the same for the global costmap.
        xml: A tree in the XML of BehaviorTree.CPP, as text; it has its own numbers. Nav2's default tree if empty.
    """

    newer: ClassVar[tuple[str, ...]] = (
        "goal_nearby_distance",
        "wrap_around",
        "local_clear_plugins",
        "global_clear_plugins",
        "xml",
    )

    bt_loop_duration: Annotated[int, Field(gt=0)] = 10
    replanning_frequency: Positive = 1.0
    number_of_retries: Natural = 6
    spin_dist: float = 1.57
    wait_duration: NonNegative = 5.0
    backup_dist: NonNegative = 0.30
    backup_speed: Positive = 0.05
    time_allowance: NonNegative = 10.0
    recoveries: bool = True
    latency: LatencyModel = "ideal"
    goal_nearby_distance: NonNegative = 0.0
    wrap_around: bool = True
    local_clear_plugins: tuple[str, ...] = ()
    global_clear_plugins: tuple[str, ...] = ()
    xml: str = ""

    def plugins_to_clear(self, which: str) -> tuple[str, ...]:
        """Return the layers that a clear of the costmap ``local`` or ``global`` names; none for all."""
        return self.local_clear_plugins if which == "local" else self.global_clear_plugins


GOAL_NEARBY = 4.0
"""Remaining length of path below which Lyrical's default tree keeps a valid path, m."""
BACKUP_SPEED: dict[Release, float] = {"humble": 0.05, "jazzy": 0.15, "lyrical": 0.15}
"""Speed of BackUp in the default tree, m/s."""


def default_tree(release: Release) -> BehaviorTree:
    """Return the numbers of the default tree of a release."""
    if release == "lyrical":
        return BehaviorTree(backup_speed=BACKUP_SPEED[release], goal_nearby_distance=GOAL_NEARBY, wrap_around=False)
    return BehaviorTree(backup_speed=BACKUP_SPEED[release])


def default_limits(release: Release) -> DriveLimits:
    """Return the limits of the behaviours that drive straight, with the defaults of a release's code."""
    lyrical = DriveLimits(acceleration_limit=2.5, deceleration_limit=-2.5, minimum_speed=0.10)
    return lyrical if release == "lyrical" else NO_LIMITS


def default_behaviors(release: Release) -> BehaviorServer:
    """Return the behaviour server with the defaults of a release's code."""
    return BehaviorServer(backup=default_limits(release))
