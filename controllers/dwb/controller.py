"""DwbFollower: Nav2's Dynamic Window controller as a path follower.

Source: nav2_dwb_controller/dwb_core/src/dwb_local_planner.cpp (Humble and Jazzy).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import ControllerError, FollowerSetup, InvalidPath, Twist
from controllers.dwb.critics import Critic, make_critics
from controllers.dwb.kernels.plan import plan_window
from controllers.dwb.kernels.verdict import judge_all, judge_cheapest
from controllers.dwb.params import DwbParams
from controllers.dwb.scene import Scene
from controllers.dwb.trajectories import Trajectories
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.scenario import Pose

NO_SPEED_LIMIT = 0.0
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
    _goal: Pose
    _candidates: Trajectories

    def __init__(self, params: DwbParams) -> None:
        self.params = params
        self._critics = make_critics(params)
        self._forbidden = np.array([critic.forbidden for critic in self._critics])
        self._outlines = np.array([critic.checks_outline for critic in self._critics])
        self._plan = np.empty((0, 3))

    def reset(self, setup: FollowerSetup) -> None:
        """Forget the last run: the plan, the critics' memory and the speed limit."""
        self._setup = setup
        self._corners = np.ascontiguousarray(setup.footprint.corners)
        self._candidates = Trajectories(self.params, setup.control_period)
        self._critics = make_critics(self.params)
        self._plan = np.empty((0, 3))

    def set_plan(self, path: NDArray[np.float64]) -> None:
        """Take a new global plan, ``(n, 3)``; all critics forget, as in Nav2."""
        self._plan = np.array(path, dtype=np.float64)
        self._goal = Pose(*self._plan[-1].tolist()) if len(path) else Pose(0.0, 0.0)
        for critic in self._critics:
            critic.reset()

    def move_plan(self, path: NDArray[np.float64]) -> None:
        """Take the same plan at its new place; pruned poses stay pruned, and no critic forgets anything."""
        self._plan = path[len(path) - len(self._plan) :]
        self._goal = Pose(*path[-1].tolist())

    def set_speed_limit(self, speed: float, percentage: bool) -> None:
        """Limit the top speeds to ``speed`` m/s or per cent of the parameters' values; 0 lifts the limit.

        A limit in m/s that is not below ``max_speed_xy`` changes nothing, as in Nav2.

        Raises:
            ConfigError: If the limit is negative or not finite.
        """
        if not 0.0 <= speed < np.inf:
            raise ConfigError(f"speed limit: expected a finite number >= 0, got {speed}")
        base = self.params.max_speed_xy
        if speed != NO_SPEED_LIMIT and not percentage and speed >= base:
            return
        ratio = 1.0 if speed == NO_SPEED_LIMIT else speed / (100.0 if percentage else base)
        self._candidates = Trajectories(_scaled(self.params, ratio), self._setup.control_period)

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Return the command of the best candidate; see :class:`~controllers.base.PathFollower`.

        Raises:
            ControllerError: If every candidate is illegal; in Humble also in the following case.
            InvalidPath: If the plan is empty, or nothing is left of it near the robot.
        """
        scene = self._look(pose, velocity, costmap, now)
        best = self._judge(scene, judge_cheapest).best
        legal = best >= 0
        failure = "" if legal else _no_legal_candidate(self._judge(scene, judge_all))
        command = Twist(*self._candidates.velocities[best].tolist()) if legal else Twist(0.0, 0.0)
        for critic in self._critics:
            critic.debrief(command, scene)
        if not legal:
            raise ControllerError(failure)
        return command

    def evaluate(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> DwbEvaluation:
        """Judge all candidates as :meth:`compute_velocity_commands` does, without giving a command.

        The plan is pruned and RotateToGoal remembers that the goal is near, as in a real cycle.

        Raises:
            ControllerError: In Humble, if the plan is empty, or nothing is left of it near the robot.
            InvalidPath: In Jazzy, in the same case.
        """
        return self._judge(self._look(pose, velocity, costmap, now), judge_all)

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
        return (
            f"{said}; the cheapest, {v:.2f} m/s and {w:.2f} rad/s, beats the cheapest that drives on, {v_on:.2f} m/s "
            f"and {w_on:.2f} rad/s: {' and '.join(reasons)} (smaller scales of these critics let it drive)"
        )

    def trajectory(self, candidate: int) -> NDArray[np.float64]:
        """Return the poses of one candidate of the last cycle, ``(steps + 1, 3)`` x, y in m and yaw in rad."""
        return self._candidates.poses(candidate)

    def _look(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Scene:
        """Roll out the candidates and collect what the critics need to know."""
        plan = self._near_plan(pose, costmap)
        self._candidates.fill(pose, velocity, costmap)
        ahead = self.params.GoalAlign.forward_point_distance
        return Scene(pose, velocity, self._goal, plan, costmap, self._corners, now, self._candidates.box, ahead)

    def _near_plan(self, pose: Pose, costmap: Costmap) -> NDArray[np.float64]:
        """Return the part of the plan near the robot; forget what lies behind it."""
        p, humble = self.params, self.params.release == "humble"
        invalid_path = ControllerError if humble else InvalidPath
        if not len(self._plan):
            raise invalid_path("received plan with zero length")
        half = max(costmap.costs.shape) * costmap.resolution / 2.0
        ahead = np.inf if p.forward_prune_distance < 0 else p.forward_prune_distance
        start = min(half, p.prune_distance) if p.prune_plan else half
        end = min(half, ahead) if p.shorten_transformed_plan else half
        search = p.prune_distance if humble else ahead
        first, last = plan_window(self._plan, pose.x, pose.y, search, start, end)
        near = self._plan[first:last]
        if p.prune_plan:
            self._plan = self._plan[first:]
        if not len(near):
            raise invalid_path("resulting plan has 0 poses in it")
        return near

    def _judge(self, scene: Scene, judge: Callable[..., int]) -> DwbEvaluation:
        """Let every critic score every candidate, and choose."""
        c, m, n = self._candidates, scene.costmap, len(self._candidates.twists)
        raw = np.zeros((len(self._critics), n))
        scales = [self._score(critic, scene, scores) for critic, scores in zip(self._critics, raw, strict=True)]
        weights = np.array(scales, dtype=np.float32)
        totals, illegal_by = np.empty(n, dtype=np.float32), np.empty(n, dtype=np.int64)
        best = judge(
            raw, weights, self._forbidden, self._outlines, c.state, c.limits, c.sim_time, c.twists, c.steps, c.headings,
            c.yaw, c.cos, c.sin, m.costs, m.origin_x, m.origin_y, m.resolution, scene.corners,
            totals, illegal_by,
        )  # fmt: skip
        return DwbEvaluation(self.params.critics, c.twists, c.velocities, weights, raw.T, totals, illegal_by, best)

    def _score(self, critic: Critic, scene: Scene, scores: NDArray[np.float64]) -> float:
        """Let one critic write its raw scores; return its weight."""
        critic.prepare(scene)
        scale = critic.scale(scene.costmap.resolution)
        if scale != 0.0:
            critic.score(scene, self._candidates, scores)
        return scale


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
