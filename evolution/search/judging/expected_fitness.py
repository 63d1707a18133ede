"""Expected held-out fitness: the expected fitness of one further trial of a set, estimated from few repeats.

Most maps have one or a few repeats. The estimate therefore shrinks the variance of a map towards the median variance
of similar maps. A set discriminates between controllers only in trials that keep the ranks of its maps, so the
expected fitness includes the chance of that order. It also includes the chance that no run reaches the time limit: a
map on which a controller is slow has timeouts on some seeds, even if no repeat so far had one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from statistics import NormalDist, median
from typing import NamedTuple

import numpy as np
import scipy

from evolution.search.judging.equation import gain
from evolution.search.judging.exact import JudgedMap, Names
from evolution.search.judging.fitness import Fitness, scores_of
from evolution.search.judging.map_results import MapResults, singles_of

SIMILAR = 5
"""Number of similar maps whose median variance is the prior of a map's variance."""
PRIOR = 4
"""Degrees of freedom of that prior."""
STANDARD_NORMAL = NormalDist()

OfRepeats = Mapping[str, Sequence[float]]
"""One value for each repeat of each map, in their order; the maps by name."""


class Estimate(NamedTuple):
    """What is expected of a solved map in a further trial.

    Args:
        values: The aggregated value of each controller.
        score: The score of the map.
        deviation: Expected standard deviation of the score of a single trial.
        in_time: Chance that every controller finishes a single trial within the time limit.
    """

    values: tuple[float, ...]
    score: float
    deviation: float
    in_time: float


def estimates_of(
    maps: Mapping[str, MapResults], judged: Mapping[str, JudgedMap], fitness: Fitness
) -> dict[str, Estimate]:
    """Return the estimate of every map.

    Args:
        maps: Results of solved maps, by name.
        judged: The same maps, judged.
        fitness: Judged them.
    """
    scores = {name: scores_of(of_map, fitness) for name, of_map in maps.items()}
    deviations, in_time = deviations_of(scores, scores), chances_in_time(maps, scores, fitness.time_limit)
    return {
        name: Estimate(one.values or (), one.score or 0.0, deviations[name], in_time[name])
        for name, one in judged.items()
    }


def deviations_of(values: OfRepeats, scores: OfRepeats) -> dict[str, float]:
    """Return the expected standard deviation of a value in single trials of each map.

    The estimate shrinks the variance of a map towards the median variance of the five most similar maps that have at
    least two repeats; it is 0 where no map has two. Two maps are similar if their first score and their median score
    are close. By the median score alone, maps that had one high score and were re-evaluated for it would be the similar
    maps of all maps with a low score.

    Args:
        values: The value of each repeat, for each map by name.
        scores: The score of each repeat.
    """
    places = {name: np.array([scores[name][0], median(scores[name])]) for name in values}
    known = [name for name, some in values.items() if len(some) > 1]
    variances = np.array([np.var(values[name], ddof=1) for name in known])
    others = np.array([places[name] for name in known]).reshape(-1, 2)
    found = {}
    for name, some in values.items():
        similar = np.argsort(np.abs(others - places[name]).sum(axis=1), kind="stable")[:SIMILAR]
        prior = float(np.median(variances[similar])) if known else 0.0
        own = float(np.var(some)) * len(some)
        found[name] = float(np.sqrt((own + PRIOR * prior) / (PRIOR + len(some) - 1)))
    return found


def chances_in_time(maps: Mapping[str, MapResults], scores: OfRepeats, time_limit: float) -> dict[str, float]:
    """Return the chance that the slowest controller finishes a further trial of each map within the time limit.

    The logarithms of its times are modelled as normally distributed, with the deviation of :func:`deviations_of`.

    Args:
        maps: Results of solved maps, by name.
        scores: The score of each repeat.
        time_limit: Simulated seconds.
    """
    slowest = {
        name: [float(np.log(max(run.time_s for (run,) in single))) for single in singles_of(of_map)]
        for name, of_map in maps.items()
    }
    deviations = deviations_of(slowest, scores)
    return {
        name: _predicted(np.log(time_limit) - float(np.mean(some)), deviations[name], len(some))
        for name, some in slowest.items()
    }


def _predicted(margin: float, deviation: float, repeats: int) -> float:
    """Return the chance that a further value lies less than ``margin`` above the mean of some repeats."""
    if deviation == 0.0:
        return float(margin >= 0.0)
    return float(scipy.special.stdtr(PRIOR + repeats - 1, margin / (deviation * np.sqrt(1.0 + 1.0 / repeats))))


def expected_fitness(names: Names, estimates: Mapping[str, Estimate], fitness: Fitness) -> float:
    """Return the expected fitness of a single trial of a set; less is better.

    It is the fitness of the set times two chances: that the maps keep the ranks of their scores, if these are normally
    distributed, and that no run reaches the time limit. Caution applies to maps with one repeat, too. A fitness above
    0 is not multiplied: a penalty does not shrink.

    Args:
        names: The set.
        estimates: Estimates of its maps.
        fitness: Judges sets.
    """
    ordered = sorted((estimates[name] for name in names), key=lambda one: one.score)
    spreads = [fitness.settings.caution * one.deviation for one in ordered]
    value = -gain(fitness.settings, fitness.pattern_of([one.values for one in ordered], spreads)[1])
    chances = [*(_chance_of_order(*pair) for pair in pairwise(ordered)), *(one.in_time for one in ordered)]
    return value * float(np.prod(chances)) if value < 0.0 else value


def _chance_of_order(less: Estimate, more: Estimate) -> float:
    """Return the chance that a single trial of one map has a smaller score than a trial of another."""
    deviation = float(np.hypot(less.deviation, more.deviation))
    return STANDARD_NORMAL.cdf((more.score - less.score) / deviation) if deviation > 0.0 else 1.0
