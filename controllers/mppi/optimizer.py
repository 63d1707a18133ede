"""The optimizer of a run: its control sequence, its noise, and the reset of both.

Source: nav2_mppi_controller/src/optimizer.cpp (Humble and Jazzy); Lyrical is in :mod:`controllers.mppi.lyrical`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import STOP, ControllerAbort, ControllerError, FollowerSetup, Twist
from controllers.mppi.critic_params import WeightedParams
from controllers.mppi.kernels.bearings import score_last_bearings, sweep_bearings
from controllers.mppi.kernels.controls import (
    BEARINGS,
    CELLS,
    CLOSENESS,
    COLLECTED_ROWS,
    DEADBANDS,
    EXCESS,
    TURNING,
    add_too_tight,
    score_deadband,
    score_turning,
)
from controllers.mppi.kernels.critics import CRITICS
from controllers.mppi.kernels.cycle import assess, begin, explore, finish
from controllers.mppi.kernels.update import send, smooth
from controllers.mppi.kernels.walk import walk_cost, walk_obstacles
from controllers.mppi.noise import Layout, Noise, NoiseSource
from controllers.mppi.params import MppiParams
from controllers.mppi.records import CALL, make_tuning, refuse_short_step
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.scenario import Pose

HISTORY = 4

Array = NDArray[np.float32]
Rollout = tuple[int, Array, Array, Array, Array]
"""Steps between two evaluations of sine and cosine, noise of v and w, and the control sequence."""
Plan = tuple[Array, NDArray[np.bool_]]
"""Points of the local path, and whether each of them is free."""


class Explored(NamedTuple):
    """Sampled controls: those of a sample are the sums of the sequence and of its noise.

    Args:
        noise_v: ``(blocks, time_steps, samples)`` m/s.
        noise_w: The same, rad/s.
        v: ``(time_steps,)`` m/s.
        w: The same, rad/s.
    """

    noise_v: Array
    noise_w: Array
    v: Array
    w: Array


class Optimizer:
    """Keeps the control sequence of a run and improves it call by call.

    Args:
        params: MPPI's parameters.
        setup: What the controller server says about the run.
        source: The source of the noise.

    Attributes:
        v, w: ``(time_steps,)`` control sequence, m/s and rad/s.
        critics: Names of the critics that are enabled, in their order.
        critic_costs: ``(critics, blocks, samples)`` what each critic added in the last rollout.
        total: ``(blocks, samples)`` costs as in the soft-max.
        failed: Whether all trajectories of the last call collide.
        furthest: Index of the furthest path point the last call reached; -1 if no critic asked.
        sent: The last command; zero after a reset.
        start: The speeds from which the trajectories of the last call start.
        explored: The controls that the last iteration has sampled; None before.
        chosen: ``(time_steps,)`` speeds and turn rates from which the last command was taken; None before.

    Raises:
        ConfigError: If the control period is longer than ``model_dt``.
    """

    _noise: Noise

    def __init__(self, params: MppiParams, setup: FollowerSetup, source: NoiseSource) -> None:
        refuse_short_step(params.model_dt, setup.control_period)
        self._params, self._source, self._since_jazzy = params, source, params.release != "humble"
        self._tuning, self._call = make_tuning(params, setup), np.zeros(1, dtype=CALL)
        self._shifts = bool(self._tuning["shifts"][0])
        self._corners = np.ascontiguousarray(setup.footprint.corners)
        self.critics = tuple(name for name in params.critics if params.critic(name).enabled)
        self._rows = np.array([CRITICS[name] for name in self.critics], dtype=np.int64)
        self._scan, self._repels = CELLS in self._rows, CLOSENESS in self._rows
        self._factors = np.array([_factor(name, params, int(self._tuning["looks"][0])) for name in self.critics])
        self._powers = np.array([params.critic(name).cost_power for name in self.critics], dtype=np.int64)
        layout = Layout(params.batch_size, params.time_steps)
        shape = (layout.blocks, layout.samples)
        self.critic_costs = np.zeros((len(self.critics), *shape), dtype=np.float32)
        self.total = np.zeros(shape, dtype=np.float32)
        samples = (layout.blocks, params.time_steps, layout.samples) if self._since_jazzy else (0, 0, 0)
        self._limited = np.zeros((2, *samples), dtype=np.float32)
        self._collected = np.zeros((COLLECTED_ROWS, *shape), dtype=np.float32)
        looks = int(self._tuning["looks"][0])
        self._looked = _looked_at(params, looks) if self._scan else np.full(params.time_steps, -1)
        self._keep = _kept_steps(params)
        axes = 3 if params.PathAlignCritic.use_path_orientations else 2
        self._kept = np.zeros((axes, self._keep.max() + 1, *shape), dtype=np.float32)
        self._speeds = _speeds(params)
        self.v, self.w = np.zeros((2, params.time_steps), dtype=np.float32)
        self._history_v, self._history_w = np.zeros((2, HISTORY), dtype=np.float32)
        self.start = STOP
        self.explored: Explored | None = None
        self.chosen: tuple[Array, Array] | None = None
        self.set_speed_limit(0.0)
        self.reset()

    @property
    def failed(self) -> bool:
        """Whether all trajectories of the last call collide."""
        return bool(self._call["failed"][0])

    @property
    def furthest(self) -> int:
        """Index of the furthest path point the last call reached; -1 if no critic asked."""
        return int(self._call["furthest"][0])

    def reset(self) -> None:
        """Forget the control sequence and its history, take new noise; Humble lifts the speed limit as well."""
        self._forget()
        self._noise = self._source.sample()

    def _forget(self) -> None:
        """Forget the control sequence and its history."""
        for values in (self.v, self.w, self._history_v, self._history_w):
            values[:] = 0.0
        if not self._since_jazzy:
            self.set_speed_limit(0.0)
        self.sent = STOP

    def set_speed_limit(self, speed: float, percentage: bool = False) -> None:
        """Scale all limits so that ``vx_max`` becomes ``speed`` (m/s), or by ``speed`` per cent; 0 lifts the limit."""
        ratio = 1.0
        if speed:
            ratio = speed / 100.0 if percentage else speed / self._params.vx_max
        self._tuning["highest_speed"] = ratio * self._params.vx_max
        self._tuning["lowest_speed"] = ratio * self._params.vx_min
        self._tuning["fastest_turn"] = ratio * self._params.wz_max

    def compute(
        self, pose: Pose, velocity: Twist, path: NDArray[np.float64], goal: tuple[float, float], costmap: Costmap
    ) -> Twist:
        """Improve the control sequence and return the next command; arguments as in :meth:`optimize`.

        Raises:
            ControllerAbort: If all trajectories collide, in Humble. Nav2's retries skip all critics and fail again;
                here only their resets remain.
            ControllerError: If all trajectories collide, since Jazzy.
        """
        self.optimize(pose, velocity, path, goal, costmap)
        if self.failed:
            for _ in range(self._params.retry_attempt_limit + 1):
                self.reset()
            raise (ControllerError if self._since_jazzy else ControllerAbort)("Optimizer fail to compute path")
        self.smooth()
        self.chosen = self.v.copy(), self.w.copy()
        return self.send()

    def optimize(
        self, pose: Pose, velocity: Twist, path: NDArray[np.float64], goal: tuple[float, float], costmap: Costmap
    ) -> None:
        """Roll out, score and update ``iteration_count`` times.

        Args:
            pose: Pose of the robot.
            velocity: Measured speeds.
            path: ``(m, 3)`` local path, x, y in m and yaw in rad.
            goal: The goal in the sense of the critics, m.
            costmap: Local costmap.
        """
        self._improve(self._begin(pose, velocity, path, goal, costmap), costmap.costs)

    def _begin(
        self, pose: Pose, velocity: Twist, path: NDArray[np.float64], goal: tuple[float, float], costmap: Costmap
    ) -> Plan:
        """Begin a call; arguments as in :meth:`optimize`."""
        place = (costmap.resolution, costmap.origin_x, costmap.origin_y)
        self.start = self._speeds_at_start(velocity)
        points, valid = begin(
            self._tuning, self._call, (pose[0], pose[1], pose[2]), (self.start[0], self.start[1]), path, goal,
            costmap.costs, place, costmap.track_unknown_space, self.total,
        )  # fmt: skip
        return points, valid

    def _speeds_at_start(self, velocity: Twist) -> Twist:
        """Return the speeds from which the trajectories start, given the measured ones."""
        return self.sent if self._params.open_loop else velocity

    def _improve(self, plan: Plan, costs: NDArray[np.uint8]) -> None:
        """Roll out, score and update ``iteration_count`` times."""
        for i in range(self._params.iteration_count):
            if i > 0:
                self._end_iteration()
            self._iterate(plan, costs)
            if self._params.regenerate_noises:  # Nav2 also samples the next set while it works with this one
                self._noise = self._source.sample()

    def _end_iteration(self) -> None:
        """Do to the control sequence what Nav2 does between two iterations: nothing, up to Jazzy."""

    def _iterate(self, plan: Plan, costs: NDArray[np.uint8]) -> None:
        """Roll out, score and update once."""
        tuning, call, collected = self._tuning, self._call, self._collected
        rollout = self._roll_out(costs)
        self.explored = Explored(rollout[1], rollout[2], rollout[3].copy(), rollout[4].copy())
        self._walk(rollout, costs)
        rows = assess(tuning, call, self._rows, *plan, rollout[1], self._kept, collected)
        self._look_closer(rollout, rows)
        self._update(rollout, rows)

    def _roll_out(self, costs: NDArray[np.uint8]) -> Rollout:
        """Sample controls and roll them out."""
        refresh_every = explore(
            self._tuning, self._call, self._scan, costs, *self._noise, self.v, self.w, *self._speeds, self._keep,
            self._kept, self._looked, self._limited, self._collected,
        )  # fmt: skip
        sampled = self._limited if self._since_jazzy else self._noise[:2]
        return refresh_every, sampled[0], sampled[1], self.v, self.w

    def _update(self, rollout: Rollout, rows: NDArray[np.int64]) -> None:
        """Add up the costs and replace the control sequence by the mean of the samples."""
        summed = self._collected, rows, self._factors, self._powers, self.critic_costs, self.total
        finish(self._tuning, *rollout[1:], *summed)

    def _walk(self, rollout: Rollout, costs: NDArray[np.uint8]) -> None:
        """Follow trajectories point by point where footprints or the Obstacles critic ask for it."""
        params, where = self._params, (rollout, costs, self._corners)
        if self._scan and params.CostCritic.consider_footprint:
            near = self._is_near(params.CostCritic.near_goal_distance)
            walk_cost(self._tuning, self._call, *where, near, self._collected)
        if self._repels:
            near = self._is_near(params.ObstaclesCritic.near_goal_distance)
            walk_obstacles(self._tuning, self._call, *where, near, self._collected)

    def _look_closer(self, rollout: Rollout, rows: NDArray[np.int64]) -> None:
        """Let those critics score that apply and need a roll-out of their own, which few calls do."""
        tuning, call, collected = self._tuning, self._call, self._collected
        for row in rows.tolist():
            if row == BEARINGS and self._since_jazzy:
                score_last_bearings(tuning, call, self._kept, collected)
            elif row == BEARINGS:
                sweep_bearings(tuning, call, rollout, collected)
            elif row == TURNING:
                score_turning(call, rollout, collected)
            elif row == DEADBANDS:
                score_deadband(tuning, call, rollout, collected)
            elif row == EXCESS and self._params.motion_model == "Ackermann":
                add_too_tight(tuning, call, rollout, collected)

    def _is_near(self, distance: float) -> bool:
        """Whether the robot is nearer than ``distance`` (m) to the goal."""
        return bool(self._call["squared_distance"][0] < distance * distance)

    def smooth(self) -> None:
        """Apply the Savitzky-Golay filter to the control sequence."""
        smooth(self.v, self.w, self._history_v, self._history_w, not self._since_jazzy)

    def limit(self) -> None:
        """Bring the filtered control sequence into the limits: up to Jazzy, nothing, as they come before the filter."""

    def collides(self, costmap: Costmap) -> bool:
        """Whether the chosen trajectory is refused: never, up to Jazzy."""
        return False

    def send(self) -> Twist:
        """Return the next command and move the control sequence on by a period."""
        self.sent = Twist(*send(self.v, self.w, self._history_v, self._history_w, self._shifts, True))
        return self.sent


def _kept_steps(params: MppiParams) -> NDArray[np.int64]:
    """Number the steps whose points PathAlign and PathFollow need; -1 for the others."""
    keep = np.full(params.time_steps, -1)
    steps = sorted({*range(0, params.time_steps, params.PathAlignCritic.trajectory_point_step), params.time_steps - 1})
    keep[steps] = range(len(steps))
    return keep


def _looked_at(params: MppiParams, looks: int) -> NDArray[np.int64]:
    """Number the steps at whose points the Cost critic looks up cells, ``looks`` in all; -1 for the others."""
    every = params.CostCritic.trajectory_point_step or 1
    looked = np.full(params.time_steps, -1)
    looked[: looks * every : every] = range(looks)
    return looked


def _speeds(params: MppiParams) -> tuple[np.float32, ...]:
    """Return the highest and the lowest speed without cost in Constraint, m/s; up to Jazzy, ``vy_max`` adds to both."""
    if params.release == "lyrical":
        return np.float32(params.vx_max), np.float32(params.vx_min)
    highest, lowest = math.hypot(params.vx_max, params.vy_max), math.hypot(params.vx_min, params.vy_max)
    lowest = lowest if params.vx_min > 0 else -lowest
    return np.float32(highest), np.float32(lowest)


def _factor(name: str, params: MppiParams, looks: int) -> float:
    """Return the factor of a critic's scores: its weight, and what turns sums over steps into means or integrals."""
    critic, steps, since_jazzy = params.critic(name), params.time_steps, params.release != "humble"
    if not isinstance(critic, WeightedParams):
        return 1.0
    weight = critic.cost_weight
    if name in ("ConstraintCritic", "PreferForwardCritic", "VelocityDeadbandCritic"):
        return weight * params.model_dt
    if name == "CostCritic":
        return weight / 254.0 / looks
    means = ("GoalCritic", "GoalAngleCritic", "TwirlingCritic", "" if since_jazzy else "PathAngleCritic")
    return weight / steps if name in means else weight
