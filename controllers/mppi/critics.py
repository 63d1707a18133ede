"""The critics: each says what the rollout has to collect, and turns that into costs.

Source: nav2_mppi_controller/src/critics (Humble). A critic adds ``(factor * scores)^cost_power``.
"""

from __future__ import annotations

import math
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from controllers.base import FollowerSetup
from controllers.mppi import params as p
from controllers.mppi.batch import Batch, Demands
from controllers.mppi.kernels.align import (
    SLOTS,
    build_slots,
    measure_path,
    prepare_targets,
    score_align,
    too_many_invalid,
)
from controllers.mppi.kernels.controls import add_below, add_too_tight, add_turning
from controllers.mppi.kernels.path import furthest_reached, nearest_point, score_follow
from controllers.mppi.kernels.points import sweep_bearing
from controllers.mppi.kernels.walk import settle_sums, walk_cost, walk_obstacles
from controllers.mppi.scene import Scene
from gym_mapbench.kernels.geometry import normalize_angle

Scores = NDArray[np.float32]
P = TypeVar("P", bound=p.CriticParams)

MARKED = np.float32(1e30)
"""Contribution of a cell that ends a trajectory or needs a look at the footprint."""
NEVER = 256


class Critic(Generic[P]):
    """One critic.

    Args:
        own: Its parameters.
        params: MPPI's.
        setup: Footprint, goal tolerance and inflation layer.
    """

    def __init__(self, own: P, params: p.MppiParams, setup: FollowerSetup) -> None:
        self.own, self.params, self.setup = own, params, setup

    @property
    def factor(self) -> float:
        """What scores are multiplied with before the power."""
        return self.own.cost_weight

    def demand(self, scene: Scene, demands: Demands) -> None:
        """Say what the rollout has to collect."""

    def score(self, scene: Scene, batch: Batch) -> Scores | None:
        """Return ``(blocks, samples)`` scores, None if the critic does not apply now."""
        raise NotImplementedError


class ConstraintCritic(Critic[p.ConstraintParams]):
    """Speeds outside the limits; with Ackermann, too tight turns as well."""

    @property
    def factor(self) -> float:
        """Weight per second."""
        return self.own.cost_weight * self.params.model_dt

    def demand(self, scene: Scene, demands: Demands) -> None:
        """Ask for the sum of speeds outside Humble's limits, in which ``vy_max`` counts."""
        lowest = math.hypot(self.params.vx_min, self.params.vy_max)
        lowest = lowest if self.params.vx_min > 0 else -lowest
        demands.speeds = (math.hypot(self.params.vx_max, self.params.vy_max), lowest)

    def score(self, scene: Scene, batch: Batch) -> Scores:
        """Return metres per second too many, summed up over the steps."""
        if self.params.motion_model == "Ackermann":
            noise = batch.noise
            radius = self.params.AckermannConstraints.min_turning_r
            add_too_tight(noise.v, noise.w, batch.v, batch.w, *scene.state[3:], radius, batch.excess)
        return batch.excess


class CollisionCritic(Critic[P]):
    """What Cost and Obstacles share."""

    consider_footprint: bool

    def __init__(self, own: P, params: p.MppiParams, setup: FollowerSetup) -> None:
        super().__init__(own, params, setup)
        self.corners = np.array(setup.footprint.corners, dtype=np.float64)

    def threshold(self, scene: Scene) -> float:
        """Cost of the centre from which on the footprint is looked at."""
        if not self.consider_footprint:
            return NEVER
        cost = scene.circumscribed_cost()
        return cost if cost >= 1 else 0

    def where(self, scene: Scene, near_goal_distance: float) -> tuple[Any, ...]:
        """Return what the kernels want to know of costmap and footprint."""
        free = (scene.costmap.track_unknown_space, self.consider_footprint)
        near = scene.near(near_goal_distance)
        return scene.costmap.costs, scene.place, self.corners, self.threshold(scene), free, near


class CostCritic(CollisionCritic[p.CostParams]):
    """The costs of the cells under the points."""

    def __init__(self, own: p.CostParams, params: p.MppiParams, setup: FollowerSetup) -> None:
        super().__init__(own, params, setup)
        self.consider_footprint = own.consider_footprint
        self._tables: dict[tuple[bool, bool, float], Scores] = {}

    @property
    def factor(self) -> float:
        """Humble's scaling of the weight, and the mean over the steps."""
        return self.own.cost_weight / 254.0 / self.params.time_steps

    def demand(self, scene: Scene, demands: Demands) -> None:
        """Ask for the sum over the cells."""
        key = (scene.near(self.own.near_goal_distance), scene.costmap.track_unknown_space, self.threshold(scene))
        if key not in self._tables:
            self._tables[key] = self._contributions(*key)
        demands.contribution = self._tables[key]

    def _contributions(self, near_goal: bool, unknown_is_free: bool, threshold: float) -> Scores:
        """What a point on a cell of each cost adds; MARKED where it may collide."""
        cost = np.arange(256)
        table = np.where(near_goal, 0, cost).astype(np.float32)
        table[cost >= 253] = self.own.critical_cost
        marked = (cost >= max(threshold, 1)) | (cost == 254)
        if not self.consider_footprint:
            marked |= cost == 253
        if not unknown_is_free:
            marked |= cost == 255
        table[marked] = MARKED
        return table

    def score(self, scene: Scene, batch: Batch) -> Scores:
        """Return the value of each trajectory; fail if all collide."""
        own, layout = self.own, batch.layout
        count, hits = settle_sums(
            batch.sums,
            batch.doubt,
            layout.batch_size,
            MARKED,
            own.collision_cost,
            self.consider_footprint,
            batch.chosen,
        )
        where = self.where(scene, own.near_goal_distance)
        flat = batch.sums.reshape(-1)
        for begin in range(0, count, layout.samples):
            chosen = batch.chosen[begin : min(begin + layout.samples, count)]
            part = batch.part(scene, chosen)
            value, hit = np.zeros(part[0].shape[1], dtype=np.float32), np.zeros(part[0].shape[1], dtype=np.bool_)
            walk_cost(*part, *where, own.critical_cost, value, hit)
            value[hit] = own.collision_cost
            flat[chosen] = value[: len(chosen)]
            hits += int(hit[: len(chosen)].sum())
        scene.failed = hits == layout.batch_size
        return batch.sums


class ObstaclesCritic(CollisionCritic[p.ObstaclesParams]):
    """Distances from obstacles."""

    def __init__(self, own: p.ObstaclesParams, params: p.MppiParams, setup: FollowerSetup) -> None:
        super().__init__(own, params, setup)
        self.consider_footprint = own.consider_footprint

    @property
    def factor(self) -> float:
        """The two weights are in the scores."""
        return 1.0

    def score(self, scene: Scene, batch: Batch) -> Scores:
        """Return the weighted sum of both terms; fail if all collide."""
        own, layout = self.own, batch.layout
        where = self.where(scene, own.near_goal_distance)
        layer = (
            own.cost_scaling_factor,
            own.inflation_radius,
            self.setup.footprint.inscribed_radius,
            own.collision_margin_distance,
        )
        hits = 0
        for b in range(layout.blocks):
            begin = b * layout.samples
            chosen = np.arange(begin, begin + layout.samples, dtype=np.int64)
            part = batch.part(scene, chosen)
            repulsion, critical = np.zeros((2, layout.samples), dtype=np.float32)
            hit = np.zeros(layout.samples, dtype=np.bool_)
            walk_obstacles(*part, *where, layer, own.collision_cost, repulsion, critical, hit)
            batch.scores[b] = own.critical_weight * critical + own.repulsion_weight * repulsion / layout.time_steps
            hits += int(hit[: layout.batch_size - begin].sum())
        scene.failed = hits == layout.batch_size
        return batch.scores


class GoalCritic(Critic[p.GoalParams]):
    """Distance from the end of the local path."""

    @property
    def factor(self) -> float:
        """Weight of the mean over the steps."""
        return self.own.cost_weight / self.params.time_steps

    def demand(self, scene: Scene, demands: Demands) -> None:
        """Ask for the distances, if near."""
        demands.goal = scene.near(self.own.threshold_to_consider)

    def score(self, scene: Scene, batch: Batch) -> Scores | None:
        """Return the distances, summed up."""
        return batch.distance if scene.near(self.own.threshold_to_consider) else None


class GoalAngleCritic(Critic[p.GoalAngleParams]):
    """Difference from the heading at the end of the local path."""

    @property
    def factor(self) -> float:
        """Weight of the mean over the steps."""
        return self.own.cost_weight / self.params.time_steps

    def demand(self, scene: Scene, demands: Demands) -> None:
        """Ask for the differences, if near."""
        demands.heading = scene.near(self.own.threshold_to_consider)
        demands.either_way = self.own.symmetric_yaw_tolerance

    def score(self, scene: Scene, batch: Batch) -> Scores | None:
        """Return the differences, summed up."""
        return batch.angle if scene.near(self.own.threshold_to_consider) else None


class PreferForwardCritic(Critic[p.PreferForwardParams]):
    """Driving backwards."""

    @property
    def factor(self) -> float:
        """Weight per second."""
        return self.own.cost_weight * self.params.model_dt

    def score(self, scene: Scene, batch: Batch) -> Scores | None:
        """Return metres per second backwards, summed up."""
        return None if scene.near(self.own.threshold_to_consider) else batch.reverse


class TwirlingCritic(Critic[p.TwirlingParams]):
    """Turning."""

    @property
    def factor(self) -> float:
        """Weight of the mean over the steps."""
        return self.own.cost_weight / self.params.time_steps

    def score(self, scene: Scene, batch: Batch) -> Scores | None:
        """Return turn rates, summed up, until the goal checker's distance is reached."""
        if scene.near(self.setup.xy_goal_tolerance):
            return None
        add_turning(batch.noise.w, batch.w, scene.state[4], batch.scores)
        return batch.scores


class VelocityDeadbandCritic(Critic[p.VelocityDeadbandParams]):
    """Speeds too low for the base."""

    @property
    def factor(self) -> float:
        """Weight per second."""
        return self.own.cost_weight * self.params.model_dt

    def score(self, scene: Scene, batch: Batch) -> Scores:
        """Return how much the speeds lack, summed up."""
        x, _, yaw = self.own.deadband_velocities
        batch.scores[:] = 0.0
        add_below(batch.noise.v, batch.v, scene.state[3], abs(x), batch.scores)
        add_below(batch.noise.w, batch.w, scene.state[4], abs(yaw), batch.scores)
        return batch.scores


def find_furthest(scene: Scene, batch: Batch) -> int:
    """Return the index of the furthest path point a trajectory reaches, found once per call."""
    if scene.furthest < 0:
        last = batch.kept[:, -1]
        scene.furthest = int(
            furthest_reached(scene.path[0], scene.path[1], last[0], last[1], batch.layout.batch_size, batch.scratch[0])
        )
    return scene.furthest


class PathFollowCritic(Critic[p.PathFollowParams]):
    """Distance of the last points from a path point ahead."""

    def score(self, scene: Scene, batch: Batch) -> Scores | None:
        """Return the distances."""
        if scene.points < 2 or scene.near(self.own.threshold_to_consider):
            return None
        target = min(find_furthest(scene, batch) + self.own.offset_from_furthest, scene.points - 1)
        while target < scene.points - 2 and not scene.valid[target]:
            target += 1
        last = batch.kept[:, -1]
        score_follow(last[0], last[1], scene.path[0, target], scene.path[1, target], batch.scores)
        return batch.scores


class PathAngleCritic(Critic[p.PathAngleParams]):
    """Looking away from a path point ahead."""

    @property
    def factor(self) -> float:
        """Weight of the mean over the steps."""
        return self.own.cost_weight / self.params.time_steps

    @property
    def either_way(self) -> bool:
        """Whether a heading may count from behind."""
        return abs(self.params.vx_min) >= 1e-6 and not self.own.forward_preference

    def score(self, scene: Scene, batch: Batch) -> Scores | None:
        """Return the angles between heading and bearing, summed up, if the robot itself looks away."""
        if scene.near(self.own.threshold_to_consider):
            return None
        index = min(find_furthest(scene, batch) + self.own.offset_from_furthest, scene.points - 1)
        target = scene.from_start(*scene.path[:2, index].tolist())
        angle = abs(normalize_angle(scene.pose.yaw - math.atan2(target[1], target[0])))
        if (min(angle, math.pi - angle) if self.either_way else angle) < self.own.max_angle_to_furthest:
            return None
        batch.scores[:] = 0.0
        sweep_bearing(*batch.rollout(scene), batch.rows, target, self.either_way, batch.scores)
        return batch.scores


class PathAlignCritic(Critic[p.PathAlignParams]):
    """Distance from the path points as far along the path."""

    def demand(self, scene: Scene, demands: Demands) -> None:
        """Ask for every so many points."""
        if not scene.near(self.own.threshold_to_consider):
            demands.steps.update(self._steps())
            demands.yaws = self.own.use_path_orientations

    def _steps(self) -> range:
        return range(0, self.params.time_steps, self.own.trajectory_point_step)

    def score(self, scene: Scene, batch: Batch) -> Scores | None:
        """Return the mean distances, unless the path is too short or too blocked to follow."""
        if scene.near(self.own.threshold_to_consider):
            return None
        furthest = find_furthest(scene, batch)
        if furthest < max(self.own.offset_from_furthest, 1):
            return None
        x, y = scene.path[0], scene.path[1]
        first = nearest_point(x, y, batch.kept[0, 0, 0, 0], batch.kept[1, 0, 0, 0])
        if too_many_invalid(scene.valid, first, furthest, np.float32(self.own.max_path_occupancy_ratio)):
            return None
        return self._align(scene, batch, furthest)

    def _align(self, scene: Scene, batch: Batch, furthest: int) -> Scores:
        """Compare trajectories with the path up to its furthest point reached."""
        arc = np.empty(furthest, dtype=np.float32)
        measure_path(scene.path[0, :furthest], scene.path[1, :furthest], arc)
        beyond = furthest if self.own.humble_search else furthest - 1
        targets = np.empty((4, beyond + 1), dtype=np.float32)
        prepare_targets(scene.path, scene.valid, arc, beyond, targets)
        slots = np.empty(SLOTS, dtype=np.int32)
        per_metre = build_slots(arc, beyond, slots)
        score_align(
            batch.kept, len(self._steps()), arc, beyond, targets, slots, np.float32(per_metre),
            self.own.humble_search, batch.scratch, batch.slots, batch.scores,
        )  # fmt: skip
        return batch.scores


CRITICS: dict[str, type[Critic[Any]]] = {
    critic.__name__: critic
    for critic in (
        ConstraintCritic,
        CostCritic,
        ObstaclesCritic,
        GoalCritic,
        GoalAngleCritic,
        PathAlignCritic,
        PathFollowCritic,
        PathAngleCritic,
        PreferForwardCritic,
        TwirlingCritic,
        VelocityDeadbandCritic,
    )
}
