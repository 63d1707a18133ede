"""Measures of one recorded run. Pure functions of an Episode; SI units; the same run gives the same numbers.

"MRPB" is Wen et al., MRPB 1.0: A Unified Benchmark for the Evaluation of Mobile Robot Local Planning
Approaches (2021); "BARN" is Xiao et al., The Benchmark Autonomous Robot Navigation Challenge (2022 on).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.env.task import distance_to_goal
from gym_mapbench.errors import PluginError
from gym_mapbench.metrics.episode import RECOVERY_KINDS, Episode
from gym_mapbench.metrics.social_metrics import SOCIAL
from gym_mapbench.registry import Registry, must_be_callable

Floats = NDArray[np.float64]
BARN_MOTION = 0.1


def path_length(episode: Episode) -> float:
    """Length of the driven path, m."""
    return float(_steps(episode).sum())


def shortest_length(episode: Episode) -> float:
    """Geodesic distance from start to goal for this robot, m: 8-connected over the cells it fits in."""
    start = episode.scenario.start
    return distance_to_goal(episode.scenario, episode.robot).at(start.x, start.y)


def min_clearance(episode: Episode) -> float:
    """Smallest distance from the robot's outline to a wall, m (MRPB's safety); negative where a disc overlaps one."""
    return float(episode.clearances.min())


def mean_clearance(episode: Episode) -> float:
    """Mean over time of the distance from the robot's outline to the nearest wall, m."""
    return float(episode.clearances.mean())


def curvature(episode: Episode) -> float:
    """Heading turned per metre driven, rad/m: the mean absolute curvature of the path, turns on the spot included."""
    turned = np.abs(np.diff(np.unwrap(episode.trajectory[:, 2]))).sum()
    length = path_length(episode)
    return float(turned / length) if length > 0 else 0.0


def path_smoothness(episode: Episode) -> float:
    """Squared change of the step vector, summed, per metre driven (MRPB's path smoothness), m; 0 on a straight line."""
    bends = np.diff(episode.trajectory[:, :2], n=2, axis=0)
    length = path_length(episode)
    return float((bends**2).sum() / length) if length > 0 else 0.0


def velocity_smoothness(episode: Episode) -> float:
    """Mean absolute forward acceleration (MRPB's velocity smoothness), m/s^2."""
    return _mean_rate(episode, order=1)


def jerk(episode: Episode) -> float:
    """Mean absolute forward jerk, m/s^3."""
    return _mean_rate(episode, order=2)


def effort(episode: Episode) -> float:
    """Control effort: the commanded v^2 + omega^2 integrated over time (linear-quadratic control's input cost)."""
    return float((episode.commands**2).sum() * episode.control_period)


def n_replans(episode: Episode) -> float:
    """Number of replans, the first plan included."""
    return float(sum(event.kind == "replan" for event in episode.events))


def n_recoveries(episode: Episode) -> float:
    """Number of recovery behaviours (Nav2's clear, spin, wait and back up) that were begun."""
    return float(sum(event.kind in RECOVERY_KINDS for event in episode.events))


def n_contacts(episode: Episode) -> float:
    """Number of contacts with a wall or a body that were begun."""
    return float(sum(event.kind == "contact" for event in episode.events))


def spl(episode: Episode) -> float:
    """Success weighted by path length, 0 to 1 (Anderson et al., On Evaluation of Embodied Navigation Agents, 2018)."""
    if not episode.success:
        return 0.0
    shortest = shortest_length(episode)
    longer = max(path_length(episode), shortest)
    return shortest / longer if longer > 0 else 1.0


def barn_score(episode: Episode) -> float:
    """BARN's score with the robot's own top speed, the geodesic distance and the whole time of the run, 0 to 1/2."""
    optimal = shortest_length(episode) / episode.robot.max_linear_velocity
    return score_barn(episode.success and n_contacts(episode) == 0, episode.time, optimal)


def motion_start(episode: Episode) -> float:
    """Time until the robot was 0.1 m from its start, s, where BARN's clock starts; the run's time if it never was."""
    away = np.hypot(*(episode.trajectory[:, :2] - episode.trajectory[0, :2]).T)
    moved = np.flatnonzero(away >= BARN_MOTION)
    return float(moved[0]) * episode.control_period if len(moved) else episode.time


def score_barn(success: bool, actual_time: float, optimal_time: float, low: float = 2.0, high: float = 8.0) -> float:
    """Return success * OT / clip(AT, low * OT, high * OT).

    Args:
        success: Whether the goal was reached without touching anything.
        actual_time: AT, s.
        optimal_time: OT, path length over top speed, s.
        low: Factor below which faster earns no more: 4 in the challenge of 2022, 2 since.
        high: Factor above which slower costs no more.
    """
    if not success or optimal_time <= 0:
        return 0.0
    return optimal_time / min(max(actual_time, low * optimal_time), high * optimal_time)


_FUNCTIONS = (
    path_length,
    shortest_length,
    min_clearance,
    mean_clearance,
    curvature,
    path_smoothness,
    velocity_smoothness,
    jerk,
    effort,
    n_replans,
    n_recoveries,
    n_contacts,
    spl,
    barn_score,
    motion_start,
)
METRICS: Registry[Callable[[Episode], float]] = Registry(
    "metric", "metrics", {function.__name__: function for function in (*_FUNCTIONS, *SOCIAL)}, check=must_be_callable
)
"""Metrics by name; a third party's are measured only where they are asked for."""

ALWAYS = tuple(function.__name__ for function in _FUNCTIONS)
"""Names of the metrics that are measured on every run; those of social navigation need moving bodies."""

MORE_IS_BETTER = frozenset({"min_clearance", "mean_clearance", "spl", "barn_score", "min_distance_to_people"})
"""Names of the metrics of which a larger value is the better one."""

OF_BODIES = frozenset({"min_distance_to_people"})
"""Names of the metrics that measure nothing where no body moves; a search needs a number there, tables have none."""

WEIGHTED_BY_SUCCESS = frozenset({"spl", "barn_score"})
"""Names of the metrics that are 0 for a failure."""

OF_EVERY_RUN = WEIGHTED_BY_SUCCESS.union(name for name in METRICS.built_in if name.startswith("n_"))
"""Names of the metrics whose mean is that of all runs, not of those that reached the goal: the metrics of
:data:`WEIGHTED_BY_SUCCESS`, and the counts, as a run that ends by a collision counts it."""


def measure(episode: Episode, also: Iterable[str] = ()) -> dict[str, float]:
    """Return the measures of a run by name.

    Args:
        episode: The run.
        also: Metrics to measure besides the project's own.

    Raises:
        ConfigError: If there is no metric of a name.
        PluginError: If a metric fails, or what it returns is not a finite number.
    """
    names = METRICS.built_in if episode.scenario.bodies else ALWAYS
    own = {name: METRICS.get(name)(episode) for name in names}
    return own | {name: _measure_one(name, episode) for name in also}


def _measure_one(name: str, episode: Episode) -> float:
    """Measure what a third party defined."""
    with METRICS.blamed(name):
        value: Any = METRICS.get(name)(episode)
        if isinstance(value, Real | np.bool_) and math.isfinite(value):
            return float(value)
    raise PluginError(f"metric {name!r}: expected a finite number for every run, got {value!r:.80}")


def _steps(episode: Episode) -> Floats:
    """Length of every control step, m."""
    lengths: Floats = np.hypot(*np.diff(episode.trajectory[:, :2], axis=0).T)
    return lengths


def _mean_rate(episode: Episode, order: int) -> float:
    """Mean absolute derivative, of the given order, of the forward speed; 0 for a run too short to have one."""
    rates = np.diff(episode.trajectory[:, 3], n=order) / episode.control_period**order
    return float(np.abs(rates).mean()) if len(rates) else 0.0
