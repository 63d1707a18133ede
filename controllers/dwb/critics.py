"""The critics: each gives every candidate a raw score, or rejects it.

Source: nav2_dwb_controller/dwb_critics.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from controllers.base import Twist
from controllers.dwb.kernels.scoring import (
    ILLEGAL,
    INSCRIBED,
    LAST,
    PRODUCT,
    SUM,
    aggregated_grid_scores,
    last_footprint_scores,
    last_grid_scores,
    last_obstacle_scores,
    rotation_errors,
    summed_footprint_scores,
    summed_obstacle_scores,
)
from controllers.dwb.kernels.verdict import NO_LIMIT, OFF_MAP
from controllers.dwb.params import (
    AlignParams,
    CriticParams,
    DwbParams,
    MapGridParams,
    ObstacleParams,
    OscillationParams,
    PreferForwardParams,
    RotateToGoalParams,
)
from controllers.dwb.scene import GOAL, GOAL_AHEAD, PATH, Scene
from controllers.dwb.trajectories import Trajectories

Floats = NDArray[np.float64]
AGGREGATIONS = {"last": LAST, "sum": SUM, "product": PRODUCT}


class Critic(ABC):
    """One critic; only :meth:`score` is required.

    Attributes:
        forbidden: Cost under the robot's centre, at any pose, from which the critic rejects a trajectory.
        checks_outline: Whether it also rejects a trajectory on which the footprint's outline touches an obstacle.
    """

    forbidden = NO_LIMIT
    checks_outline = False

    def __init__(self, params: CriticParams) -> None:
        self._scale = params.scale

    def reset(self) -> None:
        """Forget what was remembered since the last plan."""
        return

    def prepare(self, scene: Scene) -> None:
        """Look at the scene before the candidates are scored."""
        return

    def scale(self, resolution: float) -> float:
        """Weight of the raw score on a costmap of this resolution (m); 0 to leave this critic out."""
        del resolution
        return self._scale

    @abstractmethod
    def score(self, scene: Scene, candidates: Trajectories, scores: Floats) -> None:
        """Write the raw scores, ``(n,)``: never negative, but ``ILLEGAL`` for a candidate that is rejected.

        ``scores`` is filled with zeros before. What ``forbidden`` and ``checks_outline`` reject along the way need not
        be found out here.
        """

    def debrief(self, command: Twist, scene: Scene) -> None:
        """Take note of the command that the robot gets."""
        return


class BaseObstacle(Critic):
    """Cost of the cell under the robot's centre; rejects trajectories over inscribed, lethal or unknown cells."""

    forbidden = INSCRIBED

    def __init__(self, params: ObstacleParams, twice: bool) -> None:
        super().__init__(params)
        self._sum_scores = params.sum_scores
        self._twice = twice

    def score(self, scene: Scene, candidates: Trajectories, scores: Floats) -> None:
        """See :class:`Critic`."""
        c, m = candidates, scene.costmap
        if not self._sum_scores:
            last_obstacle_scores(c.last_cells(0.0), m.costs, scores)
            return
        summed_obstacle_scores(
            c.state, c.limits, c.sim_time, c.twists, c.steps, c.headings, c.cos, c.sin,
            m.costs, m.origin_x, m.origin_y, m.resolution, self._twice, scores,
        )  # fmt: skip


class ObstacleFootprint(BaseObstacle):
    """Largest cost under the footprint's outline; rejects trajectories on which that is lethal or unknown."""

    forbidden = OFF_MAP
    checks_outline = True

    def scale(self, resolution: float) -> float:
        """See :class:`Critic`."""
        return resolution * self._scale

    def score(self, scene: Scene, candidates: Trajectories, scores: Floats) -> None:
        """See :class:`Critic`."""
        c, m, corners = candidates, scene.costmap, scene.corners
        if not self._sum_scores:
            last_footprint_scores(
                c.steps, c.headings, c.ends, c.yaw, c.last_cells(0.0), m.costs, m.origin_x, m.origin_y, m.resolution,
                corners, scores,
            )  # fmt: skip
            return
        summed_footprint_scores(
            c.state, c.limits, c.sim_time, c.twists, c.steps, c.headings, c.yaw, c.cos, c.sin,
            m.costs, m.origin_x, m.origin_y, m.resolution, corners, self._twice, scores,
        )  # fmt: skip


class MapGrid(Critic):
    """Manhattan distance in cells of the trajectory from a set of seed cells, obstacles ignored."""

    forbidden = OFF_MAP
    _forward = 0.0
    _needs_seed = True
    _layer: int

    def __init__(self, params: MapGridParams, twice: bool) -> None:
        super().__init__(params)
        self._aggregation = AGGREGATIONS[params.aggregation_type]
        self._twice = twice

    def scale(self, resolution: float) -> float:
        """See :class:`Critic`."""
        return resolution * 0.5 * self._scale

    def score(self, scene: Scene, candidates: Trajectories, scores: Floats) -> None:
        """See :class:`Critic`."""
        c, m, f = candidates, scene.costmap, scene.fields
        if self._needs_seed and not f.reached:
            scores[:] = ILLEGAL
        elif self._aggregation == LAST:
            last_grid_scores(c.last_cells(self._forward), f.distances[self._layer], f.skipped, scores)
        else:
            aggregated_grid_scores(
                c.state, c.limits, c.sim_time, c.twists, c.steps, c.headings, c.cos, c.sin, self._forward,
                f.distances[self._layer], f.skipped, m.costs.shape, m.origin_x, m.origin_y, m.resolution,
                self._aggregation, self._twice, scores,
            )  # fmt: skip


class PathDist(MapGrid):
    """Distance from the plan."""

    _layer = PATH


class GoalDist(MapGrid):
    """Distance from the last cell of the plan on the map."""

    _layer = GOAL


class Align(MapGrid):
    """Distance of a point ahead of the robot; the robot itself may leave the map on the way."""

    forbidden = NO_LIMIT
    _needs_seed = False

    def __init__(self, params: AlignParams, twice: bool) -> None:
        super().__init__(params, twice)
        self._forward = params.forward_point_distance


class PathAlign(Align):
    """Distance of a point ahead from the plan; does not score close to the goal."""

    _layer = PATH
    _near_goal = False

    def prepare(self, scene: Scene) -> None:
        """See :class:`Critic`."""
        self._near_goal = scene.goal_distance_sq() <= self._forward * self._forward

    def scale(self, resolution: float) -> float:
        """See :class:`Critic`."""
        return 0.0 if self._near_goal else super().scale(resolution)


class GoalAlign(Align):
    """Distance of a point ahead from a point as far ahead of the plan's end."""

    _layer = GOAL_AHEAD


class RotateToGoal(Critic):
    """Once within ``xy_goal_tolerance``, until the next plan: slow down, stop, then only turn to the goal's heading.

    With a ``lookahead_time`` Nav2 Humble reads past the end of its array of times; here it works as intended there.
    """

    def __init__(self, params: RotateToGoalParams, dwb: DwbParams) -> None:
        super().__init__(params)
        self._params = params
        self._tolerance_sq = dwb.xy_goal_tolerance * dwb.xy_goal_tolerance
        self._stopped_sq = dwb.trans_stopped_velocity * dwb.trans_stopped_velocity
        self.reset()

    def reset(self) -> None:
        """See :class:`Critic`."""
        self._in_window = False
        self._rotating = False

    def prepare(self, scene: Scene) -> None:
        """See :class:`Critic`."""
        self._in_window = self._in_window or scene.goal_distance_sq() <= self._tolerance_sq
        stopped = scene.velocity.v * scene.velocity.v <= self._stopped_sq
        self._rotating = self._rotating or (self._in_window and stopped)

    def score(self, scene: Scene, candidates: Trajectories, scores: Floats) -> None:
        """See :class:`Critic`."""
        if not self._in_window:
            return
        c = candidates
        rotation_errors(c.steps, c.headings, c.yaw, c.sim_time, self._params.lookahead_time, scene.goal.yaw, scores)
        v = c.velocities[:, 0]
        if self._rotating:
            scores[v != 0.0] = ILLEGAL
        else:
            speed_sq = v * v
            scores += speed_sq * self._params.slowing_factor
            scores[speed_sq >= scene.velocity.v * scene.velocity.v] = ILLEGAL


class Trend:
    """Sign of the last nonzero command on one axis, and the only sign allowed since it flipped (0: both)."""

    def __init__(self) -> None:
        self.sign = 0
        self.only = 0

    def update(self, command: float) -> bool:
        """Take a command; return whether its sign flipped."""
        sign = (command > 0.0) - (command < 0.0)
        if sign == 0:
            return False
        flipped = sign == -self.sign
        if flipped:
            self.only = sign
        self.sign = sign
        return flipped


class Oscillation(Critic):
    """Rejects going back and forth: after a change of sign only the new sign is legal until the robot has moved on."""

    def __init__(self, params: OscillationParams) -> None:
        super().__init__(params)
        self._params = params
        self.reset()
        self._flip_pose, self._flip_time = (0.0, 0.0, 0.0), 0.0

    def reset(self) -> None:
        """See :class:`Critic`."""
        self._forward, self._turn = Trend(), Trend()

    def score(self, scene: Scene, candidates: Trajectories, scores: Floats) -> None:
        """See :class:`Critic`."""
        del scene
        for axis, trend in enumerate((self._forward, self._turn)):
            if trend.only:
                scores[candidates.velocities[:, axis] * trend.only < 0.0] = ILLEGAL

    def debrief(self, command: Twist, scene: Scene) -> None:
        """See :class:`Critic`."""
        flipped = self._forward.update(command.v)
        limit = self._params.x_only_threshold
        if limit < 0.0 or abs(command.v) <= limit:
            flipped |= self._turn.update(command.w)
        if flipped:
            self._flip_pose, self._flip_time = scene.pose, scene.now
        if (self._forward.only or self._turn.only) and self._moved_on(scene):
            self.reset()

    def _moved_on(self, scene: Scene) -> bool:
        """Whether distance, turn (not wrapped, as in Humble) or time since the flip lifts the restrictions."""
        p, (x, y, yaw) = self._params, self._flip_pose
        dx, dy = scene.pose.x - x, scene.pose.y - y
        if p.oscillation_reset_dist >= 0.0 and dx * dx + dy * dy > p.oscillation_reset_dist * p.oscillation_reset_dist:
            return True
        if p.oscillation_reset_angle >= 0.0 and abs(scene.pose.yaw - yaw) > p.oscillation_reset_angle:
            return True
        return 0.0 <= p.oscillation_reset_time < scene.now - self._flip_time


class PreferForward(Critic):
    """A penalty on driving backwards, and on driving slowly without turning; otherwise on turning."""

    def __init__(self, params: PreferForwardParams) -> None:
        super().__init__(params)
        self._params = params

    def score(self, scene: Scene, candidates: Trajectories, scores: Floats) -> None:
        """See :class:`Critic`."""
        del scene
        p = self._params
        v, turn = candidates.velocities[:, 0], np.abs(candidates.velocities[:, 1])
        scores[:] = turn * p.theta_scale
        scores[(v < 0.0) | ((v < p.strafe_x) & (turn < p.strafe_theta))] = p.penalty


class Twirling(Critic):
    """A penalty on turning."""

    def score(self, scene: Scene, candidates: Trajectories, scores: Floats) -> None:
        """See :class:`Critic`."""
        del scene
        np.abs(candidates.velocities[:, 1], out=scores)


def make_critics(params: DwbParams) -> tuple[Critic, ...]:
    """Build the critics that ``params.critics`` names, in that order."""
    p, twice = params, params.include_last_point
    makers: dict[str, Callable[[], Critic]] = {
        "BaseObstacle": lambda: BaseObstacle(p.BaseObstacle, twice),
        "GoalAlign": lambda: GoalAlign(p.GoalAlign, twice),
        "GoalDist": lambda: GoalDist(p.GoalDist, twice),
        "ObstacleFootprint": lambda: ObstacleFootprint(p.ObstacleFootprint, twice),
        "Oscillation": lambda: Oscillation(p.Oscillation),
        "PathAlign": lambda: PathAlign(p.PathAlign, twice),
        "PathDist": lambda: PathDist(p.PathDist, twice),
        "PreferForward": lambda: PreferForward(p.PreferForward),
        "RotateToGoal": lambda: RotateToGoal(p.RotateToGoal, p),
        "Twirling": lambda: Twirling(p.Twirling),
    }
    return tuple(makers[name]() for name in params.critics)
