"""NavigateToPose: Nav2's default behaviour tree and its leaves.

Source: nav2_bt_navigator (Humble and Jazzy)
behavior_trees/navigate_to_pose_w_replanning_and_recovery.xml and the nodes of nav2_behavior_tree.
A service or an action that takes Nav2 a few of its 10 ms ticks to answer is answered within one tick here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from controllers.base import STOP, Twist
from controllers.nav2_params.navigation import NavigationParams
from controllers.navigator.behavior_tree import (
    Action,
    Condition,
    Node,
    PipelineSequence,
    RateController,
    ReactiveFallback,
    RecoveryNode,
    RoundRobin,
    Sequence,
    Status,
)
from controllers.navigator.behaviors import BackUp, Behavior, BehaviorServer, Spin, Wait
from controllers.navigator.controller_server import ControllerServer
from controllers.navigator.costmap_servers import CostmapServer
from gym_mapbench.errors import EndpointError, PlanningError
from gym_mapbench.metrics.episode import Event, Outcome
from gym_mapbench.planners.base import GlobalPlanner
from gym_mapbench.world.frames import relate
from gym_mapbench.world.scenario import Pose


@dataclass
class Blackboard:
    """What the leaves of the tree share during one run.

    Attributes:
        now: Seconds since the start.
        goal: The goal, on the map.
        pose: Pose of the robot, on the map.
        local_pose: Its pose in the frame of the local costmap.
        odometry: Its measured velocity.
        path: The newest global path, ``(n, 3)``; empty before the first one.
        cmd_vel_nav: Command of the controller server in this tick.
        recovery_command: Command of a recovery in this tick, which bypasses the velocity smoother; None without one.
        failure: Kind and reason of the last failure of the planner or the controller.
        planner_recovery_would_help: Whether the planner failed last time, by an error that a recovery may help
            against; Jazzy asks this before it recovers.
        controller_recovery_would_help: The same for the controller.
        events: What happened so far, in order.
    """

    goal: Pose
    planner: GlobalPlanner
    global_costmap: CostmapServer
    local_costmap: CostmapServer
    controller_server: ControllerServer
    behavior_server: BehaviorServer
    pose: Pose
    local_pose: Pose
    odometry: Twist = STOP
    now: float = 0.0
    path: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))
    cmd_vel_nav: Twist = STOP
    recovery_command: Twist | None = None
    failure: tuple[Outcome, str] = ("controller_failure", "")
    planner_recovery_would_help: bool = False
    controller_recovery_would_help: bool = False
    events: list[Event] = field(default_factory=list)

    def clock(self) -> float:
        """Return the time, s."""
        return self.now

    @property
    def map_in_local(self) -> Pose:
        """Pose of the map's frame in the local costmap's frame, from the robot's two poses."""
        return relate(self.pose, self.local_pose)

    def has_path(self) -> bool:
        """Whether there is a path to follow."""
        return len(self.path) > 0

    def planner_needs_it(self) -> bool:
        """Whether a recovery may help the planner (``WouldAPlannerRecoveryHelp``)."""
        return self.planner_recovery_would_help

    def controller_needs_it(self) -> bool:
        """Whether a recovery may help the controller (``WouldAControllerRecoveryHelp``)."""
        return self.controller_recovery_would_help

    def either_needs_it(self) -> bool:
        """Whether a recovery may help the planner or the controller."""
        return self.planner_recovery_would_help or self.controller_recovery_would_help

    def log(self, kind: str, detail: str = "") -> None:
        """Record an event that happens now."""
        self.events.append(Event(self.now, kind, detail))

    def begin_tick(self, now: float, pose: Pose, local_pose: Pose, odometry: Twist) -> None:
        """Take this tick's measurements and clear the last tick's commands."""
        self.now, self.pose, self.local_pose, self.odometry = now, pose, local_pose, odometry
        self.cmd_vel_nav, self.recovery_command = STOP, None


class ComputePathToPose(Action):
    """Asks the planner for a path from here to the goal."""

    def __init__(self, board: Blackboard) -> None:
        self._board = board

    def update(self) -> Status:
        """Plan; a failure keeps the old path."""
        board = self._board
        try:
            board.path = board.planner.plan(board.global_costmap.costmap, board.pose, board.goal)
        except PlanningError as error:
            board.failure = "planner_failure", str(error)
            board.planner_recovery_would_help = not isinstance(error, EndpointError)
            board.log("replan_failure", str(error))
            return Status.FAILURE
        board.planner_recovery_would_help = False
        board.log("replan")
        return Status.SUCCESS


class FollowPath(Action):
    """Has the controller server follow the newest path."""

    def __init__(self, board: Blackboard) -> None:
        self._board = board

    def start(self) -> None:
        """Send the path as a new goal."""
        self._path = self._board.path
        self._board.controller_server.start(self._path, self._board.now)

    def update(self) -> Status:
        """Hand on a new path if there is one, and take the next command."""
        board = self._board
        if board.path is not self._path:
            self._path = board.path
            board.controller_server.set_plan(self._path)
        server, costmap = board.controller_server, board.local_costmap.costmap
        status = server.step(board.local_pose, board.odometry, costmap, board.now, board.map_in_local)
        board.cmd_vel_nav = server.command
        board.controller_recovery_would_help = status is Status.FAILURE and server.recovery_would_help
        if status is Status.FAILURE:
            board.failure = "controller_failure", server.failure_reason
            board.log(*board.failure)
        return status

    def halt(self) -> None:
        """Cancel the action."""
        self._board.controller_server.cancel()
        self._board.cmd_vel_nav = STOP
        self._board.controller_recovery_would_help = False


class ClearEntireCostmap(Action):
    """Clears the global or the local costmap, which is filled again at once."""

    def __init__(self, board: Blackboard, which: str) -> None:
        self._board = board
        self._which = which

    def update(self) -> Status:
        """Clear the costmap."""
        server = self._board.local_costmap if self._which == "local" else self._board.global_costmap
        server.clear()
        self._board.log(f"clear_{self._which}")
        return Status.SUCCESS


class RunBehavior(Action):
    """Has the behaviour server run the behaviour that ``make_behavior`` makes; fails at once if that is None."""

    def __init__(self, board: Blackboard, kind: str, make_behavior: Callable[[], Behavior] | None) -> None:
        self._board = board
        self._kind = kind
        self._make_behavior = make_behavior

    def start(self) -> None:
        """Start the behaviour."""
        if self._make_behavior is not None:
            self._board.log(self._kind)
            self._board.behavior_server.run(self._make_behavior(), self._board.local_pose, self._board.now)

    def update(self) -> Status:
        """Take the next command."""
        if self._make_behavior is None:
            return Status.FAILURE
        board = self._board
        status = board.behavior_server.step(board.local_pose, board.local_costmap.costmap, board.now)
        board.recovery_command = board.behavior_server.command if status is Status.RUNNING else None
        return status

    def halt(self) -> None:
        """Cancel the behaviour."""
        self._board.behavior_server.cancel()
        self._board.recovery_command = None


def goal_updated() -> bool:
    """Whether the goal has changed: it never does, because a run has one goal."""
    return False


def navigate_to_pose_w_replanning_and_recovery(board: Blackboard, params: NavigationParams) -> Node:
    """Build ``navigate_to_pose_w_replanning_and_recovery.xml``."""
    bt = params.bt
    clear_local = partial(ClearEntireCostmap, board, "local")
    clear_global = partial(ClearEntireCostmap, board, "global")
    return RecoveryNode(
        bt.number_of_retries,
        PipelineSequence(
            RateController(
                bt.replanning_frequency,
                board.clock,
                RecoveryNode(1, ComputePathToPose(board), _if_it_helps(params, board.planner_needs_it, clear_global())),
            ),
            RecoveryNode(1, FollowPath(board), _if_it_helps(params, board.controller_needs_it, clear_local())),
        ),
        _if_it_helps(
            params,
            board.either_needs_it,
            ReactiveFallback(
                Condition(goal_updated),
                RoundRobin(
                    Sequence(clear_local(), clear_global()),
                    *_behaviors(board, params),
                ),
            ),
        ),
    )


def _if_it_helps(params: NavigationParams, helps: Callable[[], bool], recovery: Node) -> Node:
    """Guard a recovery: Jazzy tries it only where it may help, Humble always."""
    return recovery if params.release == "humble" else Sequence(Condition(helps), recovery)


def navigate_to_pose_w_replanning(board: Blackboard, params: NavigationParams) -> Node:
    """Build the tree without recoveries: a failed replan keeps the old path, any other failure ends the run."""
    return PipelineSequence(
        RateController(
            params.bt.replanning_frequency,
            board.clock,
            ReactiveFallback(ComputePathToPose(board), Condition(board.has_path)),
        ),
        FollowPath(board),
    )


def _behaviors(board: Blackboard, params: NavigationParams) -> list[RunBehavior]:
    """Make the leaves Spin, Wait and BackUp, in the order of the tree."""
    bt, server = params.bt, params.behavior_server
    makers: dict[str, Callable[[], Behavior]] = {
        "spin": partial(Spin, bt.spin_dist, server, bt.time_allowance),
        "wait": partial(Wait, bt.wait_duration),
        "backup": partial(BackUp, bt.backup_dist, bt.backup_speed, server, bt.time_allowance),
    }
    return [
        RunBehavior(board, kind, make if kind in server.behavior_plugins else None) for kind, make in makers.items()
    ]
