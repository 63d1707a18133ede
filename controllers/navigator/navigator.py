"""Navigator: Nav2's NavigateToPose as a policy over the env API.

One ``act`` is one control period. It does all that was due since the last one, with the measurements of now: update the
costmaps, tick the tree, and let the servers of planner, controller and recoveries do their cycles. With ``latency:
ideal`` the tree ticks once: replan if that is due, check progress, ask the path follower for a command, and test the
goal at the same pose. Time is counted in control periods, never by a wall clock.

The planner works on the map. The controller, its checkers and the recovery behaviours work in the frame of the local
costmap, which is ``odom`` (a costmap's ``global_frame`` in Nav2). It is shifted and turned against the map; the robot
moves smoothly in it, but it drifts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from controllers.base import (
    STOP,
    Context,
    ControllerAbort,
    ControllerError,
    FollowerSetup,
    Observation,
    PathFollower,
    Twist,
)
from controllers.collision_monitor import ActionType
from controllers.nav2_params.navigation import NavigationParams
from controllers.navigator.actions import ActionServer
from controllers.navigator.behavior_server import BehaviorServer
from controllers.navigator.behavior_tree import Status
from controllers.navigator.checkers import make_goal_checker
from controllers.navigator.collision_monitor import CollisionMonitor
from controllers.navigator.controller_server import ControllerServer
from controllers.navigator.costmap_servers import CostmapServer, Ranges
from controllers.navigator.latency import LATENCIES
from controllers.navigator.navigate_to_pose import Blackboard, Clear, Servers
from controllers.navigator.path_keeper import PathKeeper, PathValidity
from controllers.navigator.planner_server import PlannerServer
from controllers.navigator.rate import NEVER, TIME_RESOLUTION
from controllers.navigator.smoother_server import SmootherServer
from controllers.navigator.speed_limits import speed_limiter
from controllers.navigator.tree_builder import build_tree
from controllers.navigator.tree_loop import TreeLoop
from controllers.navigator.velocity_smoother import VelocitySmoother
from gym_mapbench.costmap import Costmap, CostmapParams
from gym_mapbench.env.render import SeenCostmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.metrics.episode import RECOVERY_KINDS, Event, Outcome
from gym_mapbench.planners import make_planner
from gym_mapbench.smoothers import make_smoother
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.frames import relate
from gym_mapbench.world.scenario import Pose


@dataclass
class Measured:
    """What is measured of the robot.

    Attributes:
        pose: Its pose on the map.
        local_pose: Its pose in the frame of the local costmap.
        odometry: Its velocity.
        acceleration: Its acceleration, from the last two velocities, m/s^2; 0 before the third one.
    """

    pose: Pose
    local_pose: Pose
    odometry: Twist = STOP
    acceleration: float = 0.0

    @property
    def map_in_local(self) -> Pose:
        """Pose of the map's frame in the local costmap's frame, from the robot's two poses."""
        return relate(self.pose, self.local_pose)


class Navigator:
    """Plans, follows the plan with ``follower``, and recovers, as Nav2 does.

    Args:
        follower: DWB, MPPI or any other :class:`controllers.base.PathFollower`.
        params: Parameters of everything but the follower.
        name: Name under which the controller is reported.
        abort_is_exception: Whether the failure tolerance also covers a follower's ControllerAbort, which in Nav2 ends
            the action at once.

    Attributes:
        status: ``running``, ``succeeded`` (the goal was reached) or ``failed``.
        failure_kind: What failed, as an episode's outcome.
        failure_reason: Why it failed, in one line.
        events: Replans, failures and recoveries of this run, in order.
        path: The newest global path, ``(n, 3)`` x, y in m and yaw in rad; empty before the first one.
        first_path: The first global path; empty before it.
    """

    decides_goal = True
    _board: Blackboard
    _robot: Measured
    _local_costmap: CostmapServer
    _global_costmap: CostmapServer
    _controller_server: ControllerServer
    _servers: Servers
    _loop: TreeLoop
    _monitor: CollisionMonitor | None = None

    def __init__(
        self, follower: PathFollower, params: NavigationParams, name: str, *, abort_is_exception: bool = False
    ) -> None:
        self.follower = follower
        self.params = params
        self.name = name
        self._abort_is_exception = abort_is_exception
        self._local_in_odom = not params.local_costmap.covers_map  # a costmap of the whole map is in the map's frame
        self._latency = LATENCIES[params.bt.latency]
        self._forget_outcome()

    @property
    def observation_keys(self) -> tuple[str, ...]:
        """``pose``, ``odom`` and ``velocity``, and ``scan`` if a costmap or the collision monitor uses it."""
        keys = "pose", "odom", "velocity"
        return (*keys, "scan") if self._observing_costmaps or self.params.collision_monitor else keys

    @property
    def scan_rate(self) -> float:
        """Highest rate of what uses scans, Hz: the costmaps, and the commands that the collision monitor gets."""
        rates = [costmap.update_frequency for costmap in self._observing_costmaps]
        if self.params.collision_monitor:
            rates.append(self.params.command_rate)
        return max(rates, default=self.params.local_costmap.update_frequency)

    @property
    def _observing_costmaps(self) -> tuple[CostmapParams, ...]:
        return tuple(costmap for costmap in self.params.costmaps.values() if costmap.observes)

    def check_frequency(self, control_period: float) -> None:
        """Refuse an env that is slower than the controller server.

        Args:
            control_period: The env's control period, s.

        Raises:
            ConfigError: If ``controller_frequency`` is above the env's rate of control.
        """
        wanted = self.params.controller_server.controller_frequency
        if wanted * control_period > 1.0 + TIME_RESOLUTION:
            raise ConfigError(
                f"controller_frequency: expected at most the env's rate of control, {1.0 / control_period:g} Hz, "
                f"got {wanted:g}"
            )

    def reset(self, context: Context) -> None:
        """Forget the last run and build the servers of the next.

        Raises:
            ConfigError: If ``controller_frequency`` is above the env's rate of control.
        """
        self.check_frequency(context.control_period)
        self._forget_outcome()
        self._period = context.control_period
        self._steps = 0
        self._now = 0.0
        self._measured = b""
        self._cmd_vel = STOP
        self._costmaps_due = 0.0
        self._robot = Measured(context.start, context.start)
        self._board = Blackboard(context.goal, events=self.events)
        self._servers = self._make_servers(context)
        self._loop = self._make_loop()
        self._set_speed_limit = speed_limiter(self.follower, self.params)
        limits = self.params.velocity_smoother
        self._smoother = VelocitySmoother(limits) if limits else None
        self._monitor = self._make_monitor(context)

    def act(self, observation: Observation) -> Twist:
        """Return the command for one control period; zero when the run is over."""
        if self.status != "running":
            return STOP
        self._now = round(self._steps * self._period, 9)
        self._steps += 1
        self._measure(observation)
        outcome = self._loop.run_until(self._now)
        self._remember_path()
        if outcome is not Status.RUNNING:
            self._finish(outcome)
            return STOP
        self._advance_servers()
        return self._command()

    def explain(self) -> str:
        """Say in one line what keeps the robot from driving on; empty if neither monitor nor follower can tell."""
        if self._monitor is not None and self._monitor.last.velocity == STOP and self._monitor.last.polygon:
            return f"polygon {self._monitor.last.polygon} of the collision monitor stops it"
        explain = getattr(self.follower, "explain", None)
        if explain is None or not len(self.path):
            return ""
        try:
            return str(explain(self._robot.local_pose, self._local_costmap.costmap, self._now))
        except (ControllerError, ControllerAbort) as error:
            return str(error)

    @property
    def seen_costmap(self) -> SeenCostmap:
        """The current local costmap, placed on the map where the robot believes it to be."""
        robot = self._robot
        return SeenCostmap(self._local_costmap.costmap, relate(robot.local_pose, robot.pose), robot.pose)

    @property
    def cmd_vel(self) -> Twist:
        """The newest command that the robot was given."""
        return self._cmd_vel

    @property
    def global_costmap(self) -> Costmap:
        """The current global costmap, in the frame of the map."""
        return self._global_costmap.costmap

    @property
    def number_recoveries(self) -> int:
        """Number of clears, spins, waits and back-ups in this run, as Nav2 counts them."""
        return sum(event.kind in RECOVERY_KINDS for event in self.events)

    @property
    def monitor_actions(self) -> dict[ActionType, int]:
        """Number of commands of this run by what the collision monitor did with them; empty without a monitor."""
        return {} if self._monitor is None else dict(self._monitor.actions)

    @property
    def controller_seconds(self) -> float:
        """Wall-clock seconds spent inside the path follower in this run."""
        return self._controller_server.seconds

    @property
    def controller_calls(self) -> int:
        """Number of calls of the path follower in this run."""
        return self._controller_server.calls

    def _forget_outcome(self) -> None:
        self.status: Literal["running", "succeeded", "failed"] = "running"
        self.failure_kind: Outcome = "controller_failure"
        self.failure_reason = ""
        self.events: list[Event] = []
        self.path = self.first_path = np.empty((0, 3))

    def _make_servers(self, context: Context) -> Servers:
        """Build the servers on this run's map."""
        params, latency = self.params, self._latency
        setup = self.follower_setup(context)
        self.follower.reset(setup)
        global_footprint = params.global_costmap.make_footprint(context.robot)
        self._global_costmap = CostmapServer(params.global_costmap, context.grid, global_footprint, context.lidar)
        self._local_costmap = CostmapServer(params.local_costmap, context.grid, setup.footprint, context.lidar)
        validity = PathValidity(self._robot, self._global_costmap, global_footprint)
        self._controller_server = ControllerServer(
            self.follower,
            params.controller_server,
            self._robot,
            self._local_costmap,
            self._take_nav_command,
            abort_is_exception=self._abort_is_exception,
            release=params.release,
            goal_checker=setup.goal_checker,
        )
        return Servers(
            planner=ActionServer(self._make_planner_server(), latency),
            controller=ActionServer(self._controller_server, latency),
            behaviors={kind: ActionServer(self._make_behavior_server(setup), latency) for kind in params.behaviors},
            clear=self._clear,
            keeps=PathKeeper(params.bt.goal_nearby_distance, self._robot, validity).keeps,
            is_path_valid=validity.is_valid,
            robot=self._robot,
            smoother=ActionServer(self._make_smoother_server(global_footprint), latency),
        )

    def _make_monitor(self, context: Context) -> CollisionMonitor | None:
        monitor, footprint = self.params.collision_monitor, self.params.local_costmap.make_footprint(context.robot)
        return CollisionMonitor(monitor, self.params.release, footprint, context.lidar) if monitor else None

    def _make_planner_server(self) -> PlannerServer:
        planner = self.params.planner
        timeout = NEVER if self.params.release == "humble" else planner.costmap_update_timeout
        made = make_planner(planner.name, **planner.params)
        return PlannerServer(made, self._robot, self._global_costmap, self._latency.planning, timeout)

    def _make_smoother_server(self, footprint: Footprint) -> SmootherServer:
        smoothers = {name: make_smoother(one.kind, **one.params) for name, one in self.params.used_smoothers.items()}
        published = self._global_costmap.published
        return SmootherServer(smoothers, published, footprint, self._latency.smoothing, self.params.release)

    def _make_behavior_server(self, setup: FollowerSetup) -> BehaviorServer:
        return BehaviorServer(
            self.params.behavior_server,
            setup.footprint,
            self._robot,
            self._local_costmap.published,
            self._take_recovery_command,
        )

    def _make_loop(self) -> TreeLoop:
        """Build the tree, and what ticks it."""
        params = self.params
        tree = build_tree(self._board, params, self._servers, self._latency)
        period = self._period if self._latency.is_ideal else params.bt.bt_loop_duration / 1000.0
        return TreeLoop(tree, self._board.clock, period, self._update_costmaps, params.release)

    def follower_setup(self, context: Context) -> FollowerSetup:
        """Return what Nav2's controller server tells the path follower before a run."""
        server, inflation = self.params.controller_server, self.params.local_costmap.inflation_layer
        return FollowerSetup(
            footprint=self.params.local_costmap.make_footprint(context.robot),
            control_period=1.0 / server.controller_frequency,
            xy_goal_tolerance=server.goal_checker.tolerance,
            yaw_goal_tolerance=server.goal_checker.yaw_goal_tolerance,
            inflation_radius=inflation.inflation_radius,
            cost_scaling_factor=inflation.cost_scaling_factor,
            rng=context.rng,
            goal_checker=make_goal_checker(server.goal_checker),
            custom_inscribed_radius=inflation.custom_inscribed_radius,
        )

    def _measure(self, observation: Observation) -> None:
        """Take this step's measurements."""
        robot, odom, scan = self._robot, Pose(*observation["odom"].tolist()), self._new_scan(observation)
        velocity = Twist(*observation["velocity"].tolist())
        robot.acceleration = (velocity.v - robot.odometry.v) / self._period if self._steps > 2 else 0.0
        robot.pose, robot.odometry = Pose(*observation["pose"].tolist()), velocity
        robot.local_pose = odom if self._local_in_odom else robot.pose
        if scan is not None:
            self._global_costmap.observe(robot.pose, scan)
            self._local_costmap.observe(robot.local_pose, scan)
        if self._monitor is not None:
            self._monitor.observe(odom, observation["scan"])

    def _new_scan(self, observation: Observation) -> Ranges | None:
        """Return the scan; None where all ranges equal the last ones: it is then still the last scan."""
        scan: Ranges | None = observation.get("scan")
        if scan is None or (measured := scan.tobytes()) == self._measured:  # a seventh of array_equal's time
            return None
        self._measured = measured
        return scan

    def _update_costmaps(self, now: float) -> None:
        """Update the costmaps if that is due; the follower gets the speed limits that their filters publish."""
        if now < self._costmaps_due - TIME_RESOLUTION:
            return
        robot = self._robot
        from_global = self._global_costmap.advance(now, robot.pose)
        from_local = self._local_costmap.advance(now, robot.local_pose, robot.pose)
        for limit in (*from_global, *from_local):
            self._set_speed_limit(*limit)
        self._costmaps_due = min(self._global_costmap.next_update, self._local_costmap.next_update)

    def _advance_servers(self) -> None:
        """Do what the servers had to do since the last tick."""
        self._update_costmaps(self._now)
        for server in self._servers.actions:
            server.advance(self._now)

    def _clear(self, clear: Clear) -> float:
        """Clear a costmap; returns how long the service takes."""
        robot, is_local = self._robot, clear.costmap == "local"
        costmap, pose = (self._local_costmap, robot.local_pose) if is_local else (self._global_costmap, robot.pose)
        if clear.square is None:
            costmap.clear(clear.plugins)
        else:
            costmap.clear_square(pose, clear.square.side, outside=clear.square.outside, plugins=clear.plugins)
        return self._latency.service

    def _take_nav_command(self, command: Twist) -> None:
        """Take a command of the controller server."""
        if self._smoother is None:
            self._send(command)
        else:
            self._smoother.take(command, self._now)

    def _take_recovery_command(self, command: Twist) -> None:
        """Take a command of a recovery: Humble's go to the robot at once, Jazzy's as the controller's do."""
        if self.params.release == "humble":
            self._cmd_vel = command
        else:
            self._take_nav_command(command)

    def _command(self) -> Twist:
        """Return the newest command that the robot was given."""
        if self._smoother is not None:
            self._smoother.measure(self._robot.odometry, self._now)
            command = self._smoother.advance(self._now)
            if command is not None:
                self._send(command)
        return self._cmd_vel

    def _send(self, command: Twist) -> None:
        """Send a command to the robot, past the collision monitor if there is one."""
        self._cmd_vel = command if self._monitor is None else self._monitor.process(command)

    def _remember_path(self) -> None:
        if len(path := self._board.path):
            self.path = path
        if not len(self.first_path):
            self.first_path = self.path

    def _finish(self, outcome: Status) -> None:
        """Record how the run ended; a tree's success counts only if the goal was reached."""
        if outcome is Status.SUCCESS and (self._board.goal_reached or self._is_at_goal()):
            self.status = "succeeded"
            return
        self.status = "failed"
        if outcome is Status.SUCCESS or (self.params.bt.xml and not self._board.failure[1]):
            self._blame_tree(outcome)
        self.failure_kind, self.failure_reason = self._board.failure
        if self.failure_kind == "planner_failure":
            self._board.log(*self._board.failure)

    def _is_at_goal(self) -> bool:
        """Whether a new goal checker finds the robot at the goal now."""
        checker = make_goal_checker(self.params.controller_server.goal_checker)
        return checker.is_goal_reached(self._robot.pose, self._board.goal, self._robot.odometry)

    def _blame_tree(self, outcome: Status) -> None:
        """Give the reason where the tree itself is to blame: it succeeded elsewhere, or failed without its servers."""
        pose, goal = self._robot.pose, self._board.goal
        place = f"{math.hypot(goal.x - pose.x, goal.y - pose.y):.2f} m from the goal"
        if outcome is Status.SUCCESS:
            reason = f"the behaviour tree succeeded {place}, which the goal checker never found reached"
        else:
            reason = f"the behaviour tree failed {place}, though neither planner nor controller had failed"
        self._board.failure = "controller_failure", reason
