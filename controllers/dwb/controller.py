"""DwbFollower: Nav2's Dynamic Window controller as a path follower.

Source: nav2_dwb_controller/dwb_core/src/dwb_local_planner.cpp (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import ControllerError, FollowerSetup, InvalidPath, LocalPlan, Twist
from controllers.dwb.kernels.decision import NO_PLAN, decide
from controllers.dwb.kernels.rollout import roll_out, trace
from controllers.dwb.params import DwbParams
from controllers.dwb.records import (
    MEMORY,
    UNTIL_NEXT_PLAN,
    Record,
    make_critics,
    make_tuning,
    most_candidates,
    points_ahead,
)
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.scenario import Pose

PATH_LENGTH_TOLERANCE = 1.0
"""Length of Lyrical's local plan above which RotateToGoal waits, m; Nav2 reads its parameter by a wrong name."""
FORWARD = 0.4
"""Share of the top speed from which on a candidate counts as driving on in :meth:`DwbFollower.explain`."""


class DwbEvaluation(NamedTuple):
    """How every candidate of one cycle was judged.

    Args:
        critics: Names of the critics, in order.
        twists: ``(n, 2)`` float64, sampled v in m/s and omega in rad/s.
        velocities: ``(n, 2)`` float64, the command of each candidate, which is the sample itself unless
            ``limit_vel_cmd_in_traj`` is set.
        scales: ``(critics,)`` float32, effective weights.
        raw_scores: ``(n, critics)`` float64, before weighing; -1 throughout for an illegal candidate.
        totals: ``(n,)`` float32; -1 for an illegal candidate.
        illegal_by: ``(n,)`` int64, index of the critic that rejected the candidate, -1 if legal.
        best: Index of the chosen candidate, -1 if all are illegal.
    """

    critics: tuple[str, ...]
    twists: NDArray[np.float64]
    velocities: NDArray[np.float64]
    scales: NDArray[np.float32]
    raw_scores: NDArray[np.float64]
    totals: NDArray[np.float32]
    illegal_by: NDArray[np.int64]
    best: int

    def rejections(self) -> dict[str, float]:
        """Return the share of the candidates that each critic rejected, for critics that rejected any."""
        counts = np.bincount(self.illegal_by[self.illegal_by >= 0], minlength=len(self.critics)).tolist()
        return {name: n / len(self.totals) for name, n in zip(self.critics, counts, strict=True) if n > 0}


class DwbFollower:
    """Nav2's DWB local planner: sample velocities, roll them out, let critics choose.

    Args:
        params: The parameters; see :class:`~controllers.dwb.params.DwbParams`.
    """

    _setup: FollowerSetup
    _corners: NDArray[np.float64]
    _tuning: Record
    _last: tuple[Pose, Twist, Costmap]

    def __init__(self, params: DwbParams) -> None:
        self.params = params
        self._critics, self._forwards = make_critics(params), points_ahead(params)
        most, critics = most_candidates(params), len(params.critics)
        self._twists, self._velocities = np.zeros((2, most, 2))
        self._weights, self._raw = np.zeros(critics, dtype=np.float32), np.zeros(critics * most)
        self._totals, self._illegal_by = np.zeros(most, dtype=np.float32), np.zeros(most, dtype=np.int64)
        self._memory = np.zeros(1, dtype=MEMORY)
        self._plan, self._goal = np.empty((0, 3)), Pose(0.0, 0.0)
        self._judged = 0, -1

    def reset(self, setup: FollowerSetup) -> None:
        """Forget the last run: the plan, the critics' memory and the speed limit."""
        self._setup = setup
        self._corners = np.ascontiguousarray(setup.footprint.corners)
        self._tuning = make_tuning(self.params, setup.control_period)
        self._memory = np.zeros(1, dtype=MEMORY)
        self._plan = np.empty((0, 3))

    def set_plan(self, path: NDArray[np.float64]) -> None:
        """Take a new global plan, ``(n, 3)``; all critics forget, as in Nav2."""
        self._plan = np.array(path, dtype=np.float64)
        self._goal = Pose(*self._plan[-1].tolist()) if len(path) else Pose(0.0, 0.0)
        for name in UNTIL_NEXT_PLAN:
            self._memory[name] = 0

    def move_plan(self, path: NDArray[np.float64]) -> None:
        """Take the same plan at its new place; pruned poses stay pruned, and no critic forgets anything.

        In Lyrical the next local plan takes the place of what is left.
        """
        self._plan = path[len(path) - len(self._plan) :]
        self._goal = Pose(*path[-1].tolist())

    def take_local_plan(self, local: LocalPlan) -> None:
        """Take the part of the plan that the critics see (Lyrical)."""
        self._plan = np.ascontiguousarray(local.path)
        self._memory["is_far"] = local.length > PATH_LENGTH_TOLERANCE

    def set_speed_limit(self, speed: float, percentage: bool) -> None:
        """Limit the top speeds to ``speed`` m/s or per cent of the parameters' values; 0 lifts the limit.

        A limit in m/s that is not below ``max_speed_xy`` changes nothing, as in Nav2.

        Raises:
            ConfigError: If the limit is negative or not finite.
        """
        if not 0.0 <= speed < np.inf:
            raise ConfigError(f"speed limit: expected a finite number >= 0, got {speed}")
        base = self.params.max_speed_xy
        if speed and not percentage and speed >= base:
            return
        ratio = speed / (100.0 if percentage else base) if speed else 1.0
        self._tuning = make_tuning(_scaled(self.params, ratio), self._setup.control_period)

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Return the command of the best candidate; see :class:`~controllers.base.PathFollower`.

        Raises:
            ControllerError: If every candidate is illegal; in Humble also in the following case.
            InvalidPath: If the plan is empty, or nothing is left of it near the robot.
        """
        count, best, v, w = self._decide(pose, velocity, costmap, now, drives=True)
        if best < 0:
            raise ControllerError(_no_legal_candidate(self._evaluation(count, best)))
        return Twist(v, w)

    def evaluate(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> DwbEvaluation:
        """Judge all candidates as :meth:`compute_velocity_commands` does, without giving a command.

        The plan is pruned and RotateToGoal remembers that the goal is near, as in a real cycle.

        Raises:
            ControllerError: In Humble, if the plan is empty, or nothing is left of it near the robot.
            InvalidPath: In Jazzy, in the same case.
        """
        count, best, _, _ = self._decide(pose, velocity, costmap, now, drives=False)
        return self._evaluation(count, best)

    def last_evaluation(self) -> DwbEvaluation:
        """Return how all candidates of the last cycle were judged; there are none before the first."""
        return self._evaluation(*self._judged)

    def explain(self, pose: Pose, costmap: Costmap, now: float) -> str:
        """Say which critics keep a robot at rest from driving on; arguments as in the last cycle."""
        judged = self.evaluate(pose, Twist(0.0, 0.0), costmap, now)
        forward = np.flatnonzero((judged.illegal_by < 0) & (judged.velocities[:, 0] >= FORWARD * self.params.max_vel_x))
        forbidden = ", ".join(f"{name} forbids {share:.0%}" for name, share in judged.rejections().items())
        said = f"of DWB's {len(judged.totals)} candidates {forbidden or 'none is forbidden'}"
        if judged.best < 0 or not len(forward):
            return f"{said}; none of the others drives on"
        onward = forward[np.argmin(judged.totals[forward])]
        if onward == judged.best:
            return said
        dearer = judged.scales * (judged.raw_scores[onward] - judged.raw_scores[judged.best])
        reasons = [f"{judged.critics[i]} by {dearer[i]:.2g}" for i in np.argsort(-dearer)[:2] if dearer[i] > 0]
        (v, w), (v_on, w_on) = judged.velocities[judged.best], judged.velocities[onward]
        window = "prune_distance of the path handler" if self.params.release == "lyrical" else "forward_prune_distance"
        return (
            f"{said}; the cheapest, {v:.2f} m/s and {w:.2f} rad/s, beats the cheapest that drives on, {v_on:.2f} m/s "
            f"and {w_on:.2f} rad/s: {' and '.join(reasons)} (a shorter {window} or a longer sim_time may help)"
        )

    def trajectory(self, candidate: int) -> NDArray[np.float64]:
        """Return the poses of one candidate of the last cycle, ``(steps + 1, 3)`` x, y in m and yaw in rad."""
        pose, velocity, m = self._last
        robot, tuning = np.array([*pose, *velocity]), self._tuning[0]
        twists, steps, headings, _, yaw, cos, sin, _, _ = roll_out(
            robot, tuning["axes"], tuning["horizon"], tuning["speeds"], tuning["sim_time"], tuning["granularity"],
            tuning["limits"], self._forwards, m.origin_x, m.origin_y, m.resolution, m.costs.shape,
        )  # fmt: skip
        count = steps[candidate]
        way = slice(headings[candidate], headings[candidate] + count + 1)
        poses = np.empty((count + 1, 3))
        poses[:, 2] = yaw[way]
        dt = tuning["sim_time"] / count
        trace(robot, twists[candidate, 0], tuning["limits"], dt, cos[way], sin[way], poses)
        return poses

    def _decide(
        self, pose: Pose, velocity: Twist, costmap: Costmap, now: float, *, drives: bool
    ) -> tuple[int, int, float, float]:
        """Judge the candidates; return their number, the chosen one and its command."""
        humble, m = self.params.release == "humble", costmap
        invalid_path = ControllerError if humble else InvalidPath
        if not len(self._plan):
            raise invalid_path("received plan with zero length")
        self._last = pose, velocity, costmap
        status, first, count, best, v, w = decide(
            self._plan, (pose[0], pose[1], pose[2]), (velocity[0], velocity[1]), tuple(self._goal), now, self._tuning,
            self._critics, self._memory, self._forwards, (m.costs, m.origin_x, m.origin_y, m.resolution), self._corners,
            drives, self._twists, self._velocities, self._weights, self._raw, self._totals, self._illegal_by,
        )  # fmt: skip
        self._plan, self._judged = self._plan[first:], (count, best)
        if status == NO_PLAN:
            raise invalid_path("resulting plan has 0 poses in it")
        return count, best, v, w

    def _evaluation(self, count: int, best: int) -> DwbEvaluation:
        """Return how the candidates of this cycle were judged, once all of them are."""
        names = self.params.critics
        return DwbEvaluation(
            names,
            self._twists[:count].copy(),
            self._velocities[:count].copy(),
            self._weights.copy(),
            self._raw[: len(names) * count].reshape(len(names), count).T.copy(),
            self._totals[:count].copy(),
            self._illegal_by[:count].copy(),
            best,
        )


def _scaled(params: DwbParams, ratio: float) -> DwbParams:
    """Scale the top speeds; the lower limits stay, even if they are then above the upper ones."""
    names = ("max_speed_xy", "max_vel_x", "max_vel_theta")
    return params.model_copy(update={name: getattr(params, name) * ratio for name in names})


def _no_legal_candidate(evaluation: DwbEvaluation) -> str:
    """Say which share of the candidates each critic rejected."""
    if not len(evaluation.totals):
        return "no valid trajectories: the velocity limits leave no candidate"
    shares = ", ".join(f"{name} {share:.1%}" for name, share in evaluation.rejections().items())
    return f"no valid trajectories out of {len(evaluation.totals)}: {shares}"
