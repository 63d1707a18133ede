"""Builds the behaviour tree of a run: Nav2's default tree, or the one of a user's XML file.

Source of the default tree: nav2_bt_navigator (Humble, Jazzy and Lyrical)
behavior_trees/navigate_to_pose_w_replanning_and_recovery.xml.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any

from controllers.behaviors import default_limits
from controllers.nav2_params.navigation import NavigationParams
from controllers.navigator import decorators, error_codes
from controllers.navigator.behavior_tree import (
    Condition,
    Fallback,
    Node,
    PipelineSequence,
    RateController,
    ReactiveFallback,
    ReactiveSequence,
    RecoveryNode,
    RoundRobin,
    Sequence,
    SequenceWithMemory,
    Status,
)
from controllers.navigator.behaviors import BackUp, Behavior, DriveOnHeading, Spin, Wait
from controllers.navigator.cancel_node import CancelGoals
from controllers.navigator.conditions import GlobalUpdatedGoal, PathExpiringTimer, distance_traveled, time_expired
from controllers.navigator.latency import Latency
from controllers.navigator.navigate_to_pose import (
    PATH,
    Blackboard,
    Clear,
    ClearCostmap,
    ComputePathToPose,
    FollowPath,
    RunBehavior,
    Servers,
    Square,
)
from controllers.navigator.parallel import Parallel
from controllers.navigator.path_keeper import NearestPose
from controllers.navigator.path_nodes import IsGoalNearby, PathLongerOnApproach, TruncatePath, TruncatePathLocal
from controllers.navigator.smooth_path import SmoothPath
from controllers.navigator.timers import Delay, Timeout
from controllers.tree_xml.needs import cleared_costmap, name_in, named_layers, selected_plugins
from controllers.tree_xml.nodes import CANCELS, REGION_CLEARS, RETRIES, SELECTORS, TreeNode
from controllers.tree_xml.reading import read_tree

GOAL_REACHED_TOLERANCE = 0.25
"""Distance from the goal up to which ``GoalReached`` succeeds, m: the default of Nav2's ``goal_reached_tol``."""
ALWAYS = ("AlwaysSuccess", "InitialPoseReceived", "SetBlackboard", "TransformAvailable", *SELECTORS)
NEVER = ("AlwaysFailure", "GoalUpdated", "IsBatteryCharging", "IsBatteryLow")
"""Nodes that always succeed here, and those that never do."""
HARDEST_BRAKING = -10.0
"""Acceleration below which ``IsStuck`` succeeds, m/s^2."""
PLANNER_CODE, CONTROLLER_CODE = "compute_path_error_code", "follow_path_error_code"
"""Variables of the default tree."""
Ports = Mapping[str, Any]


def build_tree(board: Blackboard, params: NavigationParams, servers: Servers, latency: Latency) -> Node:
    """Build the tree of ``params.bt``.

    Args:
        board: What the leaves share.
        params: All parameters of the navigator.
        servers: What the leaves ask.
        latency: How long messages take.
    """
    if not params.bt.xml:
        builder = _Builder(board, params, servers, latency)
        return builder.default() if params.bt.recoveries else builder.without_recoveries()
    tree = read_tree(params.bt.xml, params.release)
    return _Builder(board, params, servers, latency, selected_plugins(tree)).build(tree)


class _Builder:
    """Builds the default tree, or the nodes of a tree that was read."""

    def __init__(
        self,
        board: Blackboard,
        params: NavigationParams,
        servers: Servers,
        latency: Latency,
        selected: Mapping[str, str] = {},
    ) -> None:
        self.board, self.params, self.servers, self.latency = board, params, servers, latency
        self.selected = selected

    def build(self, read: TreeNode) -> Node:
        """Build a node and all below it."""
        return MAKERS[read.name](self, read.ports, [self.build(child) for child in read.children])

    def default(self) -> Node:
        """Build Nav2's default tree with the numbers of ``params.bt``."""
        bt = self.params.bt
        clear_local, clear_global = (partial(self.clear_layers, which) for which in ("local", "global"))
        planner = partial(self.board.would_recovery_help, PLANNER_CODE, error_codes.PLANNER_RECOVERY_HELPS)
        controller = partial(self.board.would_recovery_help, CONTROLLER_CODE, error_codes.CONTROLLER_RECOVERY_HELPS)
        plan = RecoveryNode(1, self.plan_if_needed(), self.if_it_helps(planner, clear_global()))
        follow = RecoveryNode(1, self.follow_default(), self.if_it_helps(controller, clear_local()))
        in_turn = Sequence(clear_local(), clear_global()), *self.recoveries()
        recover = ReactiveFallback(Condition(never), RoundRobin(*in_turn, wrap_around=bt.wrap_around))
        return RecoveryNode(
            bt.number_of_retries,
            PipelineSequence(RateController(bt.replanning_frequency, self.board.clock, plan), follow),
            self.if_it_helps(partial(_any, controller, planner), recover),
        )

    def without_recoveries(self) -> Node:
        """Build the tree without recoveries: a failed replan keeps the old path, any other failure ends the run."""
        plan = ReactiveFallback(self.plan_if_needed(), Condition(self.board.has_had_path))
        rate = self.params.bt.replanning_frequency
        return PipelineSequence(RateController(rate, self.board.clock, plan), self.follow_default())

    def plan_if_needed(self) -> Node:
        """Make the leaf of the default tree that plans; Lyrical first asks whether the path is kept."""
        plan = self.plan({"path": PATH, "error_code_id": PLANNER_CODE})
        if not self.params.bt.goal_nearby_distance:
            return plan
        return Fallback(Condition(self.keeps_path), plan)

    def keeps_path(self) -> bool:
        """Whether the path is kept instead of a new plan."""
        return self.servers.keeps(self.board.path)

    def follow_default(self) -> Node:
        """Make the leaf of the default tree that follows the path."""
        return self.follow({"path": PATH, "error_code_id": CONTROLLER_CODE})

    def if_it_helps(self, helps: Callable[[], bool], recovery: Node) -> Node:
        """Guard a recovery: since Jazzy it is tried only where it may help, Humble always."""
        return Sequence(Condition(helps), recovery) if self.is_version_4 else recovery

    def clear_layers(self, which: str) -> Node:
        """Make a leaf of the default tree that clears the costmap ``local`` or ``global``."""
        return ClearCostmap(self.board, self.servers.clear, Clear(which, self.params.bt.plugins_to_clear(which)))

    def recoveries(self) -> tuple[Node, Node, Node]:
        """Make the leaves of the default tree that spin, wait and back up."""
        bt = self.params.bt
        back = {"backup_dist": bt.backup_dist, "backup_speed": bt.backup_speed, "time_allowance": bt.time_allowance}
        return (
            self.spin({"spin_dist": bt.spin_dist, "time_allowance": bt.time_allowance}),
            self.recovery("wait", partial(Wait, bt.wait_duration), {}),
            self.back_up(back),
        )

    @property
    def is_version_4(self) -> bool:
        """Whether the nodes are those of BehaviorTree.CPP 4."""
        return self.params.release != "humble"

    def again(self, child: Node, after: Status, times: int) -> Node:
        """Make a decorator that ticks its child again after one result."""
        return decorators.Again(child, after, times, self.board.clock if self.is_version_4 else None)

    def path(self, ports: Ports) -> Callable[[], Any]:
        """Return what returns the path of a port."""
        return partial(self.board.path_named, ports["path"])

    def plan(self, ports: Ports) -> Node:
        """Make the leaf that plans."""
        return ComputePathToPose(self.board, self.servers.planner, self.latency, ports["path"], ports["error_code_id"])

    def smooth(self, ports: Ports) -> Node:
        """Make a leaf that has a path smoothed."""
        name = name_in(ports["smoother_id"], self.selected)
        return SmoothPath(self.board, self.servers.smoother, self.latency, ports, name)

    def follow(self, ports: Ports) -> Node:
        """Make the leaf that follows a path; it is the path of the run."""
        self.board.followed = ports["path"]
        return FollowPath(self.board, self.servers.controller, self.latency, ports["error_code_id"])

    def clear(self, ports: Ports, square: Square | None = None) -> Node:
        """Make a leaf that clears a costmap, or a square of it."""
        request = Clear(cleared_costmap(ports), named_layers(ports), square)
        return ClearCostmap(self.board, self.servers.clear, request)

    def cancel(self, kind: str) -> Node:
        """Make a leaf that cancels a behaviour; one that does not exist fails."""
        server = self.servers.behaviors.get(kind)
        return CancelGoals(server, self.board.clock) if server else Condition(never)

    def recovery(self, kind: str, make: Callable[[], Behavior], ports: Ports) -> Node:
        """Make a leaf that runs a behaviour; one that does not exist fails."""
        if kind not in self.servers.behaviors:
            return Condition(never)
        made = partial(_made, make, not ports.get("disable_collision_checks", False))
        server, is_recovery = self.servers.behaviors[kind], ports.get("is_recovery", True)
        return RunBehavior(self.board, kind, made, server, self.latency, is_recovery=is_recovery)

    def spin(self, ports: Ports) -> Node:
        """Make a leaf that turns the robot."""
        make = partial(Spin, ports["spin_dist"], self.params.behavior_server, ports["time_allowance"])
        return self.recovery("spin", make, ports)

    def back_up(self, ports: Ports) -> Node:
        """Make a leaf that backs up."""
        server = self.params.behavior_server
        make = partial(BackUp, ports["backup_dist"], ports["backup_speed"], server, ports["time_allowance"])
        return self.recovery("backup", make, ports)

    def drive(self, ports: Ports) -> Node:
        """Make a leaf that drives straight on; in Nav2 it counts as no recovery."""
        server, release = self.params.behavior_server, self.params.release
        drive = ports["dist_to_travel"], ports["speed"]
        limits = server.drive_on_heading or default_limits(release)
        make = partial(DriveOnHeading, *drive, server, ports["time_allowance"], limits)
        return self.recovery("drive_on_heading", make, {**ports, "is_recovery": False})

    def parallel(self, ports: Ports, children: list[Node]) -> Node:
        """Make the node that ticks all children."""
        of = "count" if self.is_version_4 else "threshold"
        counts = {"successes": ports[f"success_{of}"], "failures": ports[f"failure_{of}"]}
        return Parallel(*children, **counts, counts_anew=not self.is_version_4)

    def speed_controller(self, ports: Ports, child: Node) -> Node:
        """Make a decorator that follows the robot's speed."""
        rates, speeds = ((ports[f"min_{of}"], ports[f"max_{of}"]) for of in ("rate", "speed"))
        robot = self.servers.robot
        return decorators.SpeedController(child, rates, speeds, self.board.clock, lambda: robot.odometry)

    def is_path_valid(self, ports: Ports) -> bool:
        """Ask the planner server whether a path is free, which takes the time of a service."""
        self.board.clock.now += self.latency.service
        return self.servers.is_path_valid(self.board.path_named(ports["path"]))

    def nearest_pose(self, ports: Ports) -> NearestPose:
        """Make what finds the nearest pose of a path."""
        search = self.length(ports["max_robot_pose_search_dist"])
        return NearestPose(self.servers.robot, search, ports.get("angular_distance_weight", 0.0))

    def length(self, given: float) -> float:
        """Return a length of path; a negative one is the whole path in Lyrical, and ends at once before."""
        return given if given >= 0.0 else math.inf if self.params.release == "lyrical" else 0.0

    def truncate(self, ports: Ports) -> Node:
        """Make a leaf that cuts a path."""
        lengths = self.length(ports["distance_forward"]), ports["distance_backward"]
        return TruncatePathLocal(*self.cut(ports), *lengths, self.nearest_pose(ports))

    def truncate_end(self, ports: Ports) -> Node:
        """Make a leaf that cuts the end off a path."""
        return TruncatePath(*self.cut(ports), ports["distance"])

    def cut(self, ports: Ports) -> tuple[Callable[[], Any], Callable[[Any], None]]:
        """Return what returns the path that is cut, and what takes the rest."""
        return partial(self.board.path_named, ports["input_path"]), partial(self.board.write, ports["output_path"])

    def is_stuck(self) -> bool:
        """Whether the robot has braked harder than it can by itself."""
        return self.servers.robot.acceleration < HARDEST_BRAKING

    def is_goal_reached(self) -> bool:
        """Whether the robot is at the goal, whatever its heading."""
        return decorators.between(self.servers.robot.pose, self.board.goal) <= GOAL_REACHED_TOLERANCE


def always() -> bool:
    """Return True."""
    return True


def never() -> bool:
    """Return False: a changed goal never interrupts a recovery, and a behaviour that does not exist never succeeds."""
    return False


def _any(*holds: Callable[[], bool]) -> bool:
    return any(each() for each in holds)


def _made(make: Callable[[], Behavior], checks_collisions: bool) -> Behavior:
    """Make a behaviour that checks for collisions, or does not."""
    behavior = make()
    behavior.checks_collisions = checks_collisions
    return behavior


def _says(success: Status, failure: Status) -> Callable[[_Builder, Ports, list[Node]], Node]:
    """Return what makes a decorator that returns something else when its child ends."""
    return lambda builder, ports, children: decorators.Returning(children[0], success, failure)


def _clears_square(outside: bool, builder: _Builder, ports: Ports, children: list[Node]) -> Node:
    return builder.clear(ports, Square(ports["reset_distance"], outside))


def _cancels(kind: str, builder: _Builder, ports: Ports, children: list[Node]) -> Node:
    return builder.cancel(kind)


def _says_if_recovery_helps(helped: Collection[int], builder: _Builder, ports: Ports, children: list[Node]) -> Node:
    return Condition(partial(builder.board.would_recovery_help, ports["error_code"], helped))


SUCCESS, FAILURE, RUNNING = Status.SUCCESS, Status.FAILURE, Status.RUNNING
MAKERS: dict[str, Callable[[_Builder, Ports, list[Node]], Node]] = {
    "Sequence": lambda b, p, c: Sequence(*c),
    "SequenceStar": lambda b, p, c: SequenceWithMemory(*c),
    "SequenceWithMemory": lambda b, p, c: SequenceWithMemory(*c),
    "ReactiveSequence": lambda b, p, c: ReactiveSequence(*c, halts_later=b.is_version_4),
    "Fallback": lambda b, p, c: Fallback(*c),
    "ReactiveFallback": lambda b, p, c: ReactiveFallback(*c, halts_later=b.is_version_4),
    "PipelineSequence": lambda b, p, c: PipelineSequence(*c),
    "RoundRobin": lambda b, p, c: RoundRobin(*c, wrap_around=b.params.release != "lyrical" or p["wrap_around"]),
    "Parallel": lambda b, p, c: b.parallel(p, c),
    "RecoveryNode": lambda b, p, c: RecoveryNode(p["number_of_retries"], *c),
    "Inverter": _says(FAILURE, SUCCESS),
    "ForceSuccess": _says(SUCCESS, SUCCESS),
    "ForceFailure": _says(FAILURE, FAILURE),
    "KeepRunningUntilFailure": _says(RUNNING, FAILURE),
    **{name: lambda b, p, c: b.again(c[0], FAILURE, p["num_attempts"]) for name in RETRIES},
    "Repeat": lambda b, p, c: b.again(c[0], SUCCESS, p["num_cycles"]),
    "GoalUpdater": lambda b, p, c: c[0],
    "SingleTrigger": lambda b, p, c: decorators.SingleTrigger(c[0]),
    "RateController": lambda b, p, c: RateController(p["hz"], b.board.clock, c[0]),
    "DistanceController": lambda b, p, c: decorators.DistanceController(
        c[0], p["distance"], lambda: b.servers.robot.pose
    ),
    "SpeedController": lambda b, p, c: b.speed_controller(p, c[0]),
    "GoalUpdatedController": lambda b, p, c: decorators.GoalUpdatedController(c[0]),
    "Timeout": lambda b, p, c: Timeout(c[0], p["msec"], b.board.clock, wakes=b.is_version_4),
    "Delay": lambda b, p, c: Delay(c[0], p["delay_msec"], b.board.clock, is_version_4=b.is_version_4),
    "PathLongerOnApproach": lambda b, p, c: PathLongerOnApproach(c[0], b.path(p), p["prox_len"], p["length_factor"]),
    **{name: lambda b, p, c: Condition(always) for name in ALWAYS},
    **{name: lambda b, p, c: Condition(never) for name in NEVER},
    "IsStuck": lambda b, p, c: Condition(b.is_stuck),
    "GlobalUpdatedGoal": lambda b, p, c: GlobalUpdatedGoal(),
    "GoalReached": lambda b, p, c: Condition(b.is_goal_reached),
    "IsPathValid": lambda b, p, c: Condition(partial(b.is_path_valid, p)),
    "ValidatePath": lambda b, p, c: Condition(partial(b.is_path_valid, p)),
    "IsGoalNearby": lambda b, p, c: IsGoalNearby(b.path(p), p["proximity_threshold"], b.nearest_pose(p)),
    "TruncatePathLocal": lambda b, p, c: b.truncate(p),
    "TruncatePath": lambda b, p, c: b.truncate_end(p),
    "PathExpiringTimer": lambda b, p, c: PathExpiringTimer(p["seconds"], b.path(p), b.board.clock),
    "TimeExpired": lambda b, p, c: time_expired(p["seconds"], b.board.clock),
    "DistanceTraveled": lambda b, p, c: distance_traveled(p["distance"], lambda: b.servers.robot.pose),
    "WouldAPlannerRecoveryHelp": partial(_says_if_recovery_helps, error_codes.PLANNER_RECOVERY_HELPS),
    "WouldAControllerRecoveryHelp": partial(_says_if_recovery_helps, error_codes.CONTROLLER_RECOVERY_HELPS),
    "WouldASmootherRecoveryHelp": partial(_says_if_recovery_helps, error_codes.SMOOTHER_RECOVERY_HELPS),
    "ComputePathToPose": lambda b, p, c: b.plan(p),
    "SmoothPath": lambda b, p, c: b.smooth(p),
    "FollowPath": lambda b, p, c: b.follow(p),
    "ClearEntireCostmap": lambda b, p, c: b.clear(p),
    **{name: partial(_clears_square, outside) for name, outside in REGION_CLEARS.items()},
    "CancelControl": lambda b, p, c: CancelGoals(b.servers.controller, b.board.clock),
    **{name: partial(_cancels, kind) for name, kind in CANCELS.items()},
    "Spin": lambda b, p, c: b.spin(p),
    "Wait": lambda b, p, c: b.recovery("wait", partial(Wait, p["wait_duration"]), p),
    "BackUp": lambda b, p, c: b.back_up(p),
    "DriveOnHeading": lambda b, p, c: b.drive(p),
}
"""What makes each node of :data:`controllers.tree_xml.nodes.NODES`, of its ports and children."""
