"""Expected held-out fitness: the expected fitness of one further trial of a set, estimated from few repeats.

Most maps have one or a few repeats. The estimate therefore shrinks the variance of a map towards that of similar
maps. A set discriminates between controllers only in trials that keep the ranks of its maps, so the
expected fitness includes the chance of that order, where the fitness looks at it. It also includes the chance that all
controllers reach the goal within the time limit: a map on which a controller is slow has failures on some seeds, even
if no repeat so far had one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from statistics import NormalDist, median
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from evolution.search.judging.equation import gain, penalty
from evolution.search.judging.exact import Names
from evolution.search.judging.fitness import Fitness, scores_of
from evolution.search.judging.map_results import (
    MapResults,
    failed_trials,
    repeats_of,
    singles_of,
    sum_over_trials,
    without_failed_trials,
)
from evolution.search.judging.patterns import log_times
from gym_mapbench.kernels.nearest import nearest

SIMILAR = 8
"""Number of similar maps whose pooled variance is the prior of a map's variance."""
PRIOR = 4
"""Degrees of freedom of that prior."""
INHERITED = 0.5
"""Runs of a map as which the value of its parent counts."""
SIMILAR_FAILURES = 10
"""Number of similar maps whose failed trials are the prior of a map's chance to fail."""
FAILURES, TRIALS = 0.3, 10.0
"""Failed trials and trials that are added to those of the similar maps."""
PRIOR_OF_FAILURES = 6.0
"""Trials as which that prior counts."""
RELIABILITY = 0.9
"""Default of ``reliability``, also that of the validation stage."""
STANDARD_NORMAL = NormalDist()

OfRepeats = Mapping[str, Sequence[float]]
"""One value for each repeat of each map, in their order; the maps by name."""
Place = NDArray[np.float64]
Places = Mapping[str, Place]
"""What makes maps similar, one vector for each map by name."""


class Estimate(NamedTuple):
    """What is expected of a map in a further trial.

    Args:
        values: The value of each controller, shrunk.
        score: The score of these values.
        deviation: Expected standard deviation of the score of a single trial.
        success: Chance that every controller reaches the goal within the time limit.
    """

    values: tuple[float, ...]
    score: float
    deviation: float
    success: float


def estimates_of(maps: Mapping[str, MapResults], parents: Mapping[str, str], fitness: Fitness) -> dict[str, Estimate]:
    """Return the estimate of every map whose first runs reached the goal or count; controllers may lack runs.

    Args:
        maps: Results of all evaluated maps, by name, parents before their children.
        parents: Of each map that was made of another one, the name of that map.
        fitness: Judges sets.
    """
    values = shrunken_values(maps, parents, fitness)
    expected = {name: fitness.score_of(some) for name, some in values.items()}
    counted = {name: fitness.counted(runs) for name, runs in maps.items()}
    known = {name: of_map for name, of_map in counted.items() if fitness.values_of(of_map) is not None}
    scores = {name: scores_of(known[name], fitness) if name in known else [expected[name]] for name in maps}
    places = places_of(maps, scores)
    deviations, success = deviations_of(scores, places), _chances_of_success(maps, known, places, fitness)
    return {name: Estimate(values[name], expected[name], deviations[name], chance) for name, chance in success.items()}


def _chances_of_success(
    maps: Mapping[str, MapResults], known: Mapping[str, MapResults], places: Places, fitness: Fitness
) -> dict[str, float]:
    """Return the chance that all controllers reach the goal in time, of every map whose first runs did.

    Where failed runs have a value, it is 1 for every map: their values count instead.
    """
    if not fitness.policy.excludes:
        return dict.fromkeys(maps, 1.0)
    in_time, goals = chances_in_time(known, places, fitness.time_limit), chances_of_goals(maps, places)
    return {
        name: goals[name] * in_time.get(name, 1.0)
        for name, of_map in maps.items()
        if all(run.success for runs in of_map for run in runs[:1])
    }


def places_of(maps: Mapping[str, MapResults], scores: OfRepeats) -> Places:
    """Return what makes maps similar: first and median score, recoveries in a trial, in units of their spread.

    By the median score alone, maps that had one high score and were re-evaluated for it would be the similar maps of
    all maps with a low score. Recoveries tell a controller that is slow all the way from one that got stuck.

    Args:
        maps: Results of maps, by name.
        scores: Scores of their repeats.
    """
    if not maps:
        return {}
    rows = np.array([[scores[name][0], median(scores[name]), _recoveries(of_map)] for name, of_map in maps.items()])
    spread = rows.std(axis=0)[[0, 0, 2]]
    return dict(zip(maps, rows / np.where(spread > 0.0, spread, 1.0), strict=True))


def _recoveries(of_map: MapResults) -> float:
    """Return the recoveries of all controllers in a trial, on average."""
    total = sum_over_trials(of_map, lambda run: run.metrics.get("n_recoveries") or 0.0)
    return float(total) / repeats_of(of_map)


def shrunken_values(
    maps: Mapping[str, MapResults], parents: Mapping[str, str], fitness: Fitness
) -> dict[str, tuple[float, ...]]:
    """Return for each map the value of each controller, shrunk towards that of its parent (empirical Bayes).

    A map without a parent has the median of all maps instead. So the luck of a single run counts less.

    Args:
        maps: Results of maps by name, parents before their children; failed trials count if the fitness says so.
        parents: Of each map that was made of another one, the name of that map.
        fitness: Judges sets.
    """
    counts = without_failed_trials if fitness.policy.excludes else fitness.counted
    own = {name: counts(of_map) for name, of_map in maps.items()}
    of_controllers = zip(*own.values(), strict=True)
    middle = [median([fitness.value_of(runs) for runs in some if runs] or [0.0]) for some in of_controllers]
    found: dict[str, tuple[float, ...]] = {}
    for name, of_map in own.items():
        prior = found.get(parents.get(name, ""), middle)
        found[name] = tuple(
            (INHERITED * before + len(runs) * fitness.value_of(runs)) / (INHERITED + len(runs)) if runs else before
            for before, runs in zip(prior, of_map, strict=True)
        )
    return found


def chances_of_goals(maps: Mapping[str, MapResults], places: Places) -> dict[str, float]:
    """Return the chance that no controller fails in a further trial of each map whose first trial had no failure.

    The prior is the share of failed trials, after a first trial without a failure, of the ten most similar maps (a
    beta distribution).

    Args:
        maps: Results of all evaluated maps, by name.
        places: What makes them similar (:func:`places_of`).
    """
    failures = {name: failed_trials(of_map) for name, of_map in maps.items()}
    further = {
        name: (repeats_of(of_map) - 1, failures[name])
        for name, of_map in maps.items()
        if repeats_of(of_map) > 1 and all(run.success for runs in of_map for run in runs[:1])
    }
    trials, failed = np.array(list(further.values()), dtype=float).reshape(-1, 2).T
    similar = _most_similar(maps, further, places, SIMILAR_FAILURES)
    priors = (failed[similar].sum(axis=1) + FAILURES) / (trials[similar].sum(axis=1) + TRIALS)
    return {
        name: 1.0 - (prior * PRIOR_OF_FAILURES + failures[name]) / (PRIOR_OF_FAILURES + repeats_of(of_map))
        for (name, of_map), prior in zip(maps.items(), priors.tolist(), strict=True)
    }


def _most_similar(names: Iterable[str], others: Iterable[str], places: Places, count: int) -> NDArray[np.int64]:
    """Return for each map the numbers of some other maps that are most similar, ``(names, count or all others)``."""
    rows = [np.array([places[name] for name in some]).reshape(-1, 3) for some in (names, others)]
    found: NDArray[np.int64] = nearest(*rows, count)
    return found


def deviations_of(values: OfRepeats, places: Places) -> dict[str, float]:
    """Return the expected standard deviation of a value in single trials of each map.

    The estimate shrinks the variance of a map towards that of the eight most similar maps that have at least two
    repeats, pooled; it is 0 where no map has two.

    Args:
        values: The value of each repeat, for each map by name.
        places: What makes the maps similar (:func:`places_of`).
    """
    several = {name: some for name, some in values.items() if len(some) > 1}
    freedom = np.array([len(some) - 1 for some in several.values()], dtype=float)
    squares = np.array([np.var(some, ddof=1) for some in several.values()]) * freedom
    similar = _most_similar(values, several, places, SIMILAR)
    priors = squares[similar].sum(axis=1) / freedom[similar].sum(axis=1) if several else np.zeros(len(values))
    found = {}
    for (name, some), prior in zip(values.items(), priors.tolist(), strict=True):
        own = float(np.var(some)) * len(some) if name in several else 0.0
        found[name] = math.sqrt((own + PRIOR * prior) / (PRIOR + len(some) - 1))
    return found


def chances_in_time(maps: Mapping[str, MapResults], places: Places, time_limit: float) -> dict[str, float]:
    """Return the chance that the slowest controller finishes a further trial of each map within the time limit.

    The logarithms of its times are modelled as normally distributed, with the deviation of :func:`deviations_of`.

    Args:
        maps: Results of solved maps, by name.
        places: What makes them similar (:func:`places_of`).
        time_limit: Simulated seconds.
    """
    slowest = {
        name: log_times([max(run.time_s for (run,) in single) for single in singles_of(of_map)]).tolist()
        for name, of_map in maps.items()
    }
    deviations = deviations_of(slowest, places)
    return {
        name: _predicted(math.log(time_limit) - float(np.mean(some)), deviations[name], len(some))
        for name, some in slowest.items()
    }


def _predicted(margin: float, deviation: float, repeats: int) -> float:
    """Return the chance that a further value lies less than ``margin`` above the mean of some repeats."""
    if deviation == 0.0:
        return float(margin >= 0.0)
    return float(scipy.special.stdtr(PRIOR + repeats - 1, margin / (deviation * np.sqrt(1.0 + 1.0 / repeats))))


def expected_fitness(
    names: Names, estimates: Mapping[str, Estimate], fitness: Fitness, reliability: float = RELIABILITY
) -> float:
    """Return the expected fitness of a single trial of a set; less is better.

    It is the fitness of the set times the square of two chances: that the maps keep the ranks of their scores, if these
    are normally distributed, and that no run fails. Once because other trials have no value, and once more because the
    validation stage names such a set less often. A set whose trials are less likely to be without a failure than
    ``reliability`` costs a share of a timeout besides. Caution applies to maps with one repeat, too. A fitness above 0
    is not multiplied: a penalty does not shrink.

    Args:
        names: The set.
        estimates: Estimates of its maps.
        fitness: Judges sets.
        reliability: Chance that no run of a trial fails, below which a set costs more.
    """
    ordered = sorted((estimates[name] for name in names), key=lambda one: one.score)
    spreads = [fitness.settings.caution * one.deviation for one in ordered]
    pattern = fitness.pattern_of([one.score for one in ordered], [one.values for one in ordered], spreads)
    value = -gain(fitness.settings, pattern)
    success = math.prod(one.success for one in ordered)
    if value < 0.0:
        chances = [_chance_of_order(*pair) for pair in pairwise(ordered)] if fitness.kind.ordered else []
        value *= math.prod([success, *chances]) ** 2
    return value + cost_of_unreliability(success, reliability, sum(len(one.values) for one in ordered), fitness)


def cost_of_unreliability(chance: float, reliability: float, runs: int, fitness: Fitness) -> float:
    """Return what a set costs whose trials are less likely to be good than they should: a share of a timeout.

    Args:
        chance: Chance that a trial is good.
        reliability: What it should be at least.
        runs: Runs in a trial.
        fitness: Gives the cost of a timeout.
    """
    return penalty(fitness.settings, 1.0 - 1.0 / runs, timeouts=1.0) * max(1.0 - chance / reliability, 0.0)


def _chance_of_order(less: Estimate, more: Estimate) -> float:
    """Return the chance that a single trial of one map has a smaller score than a trial of another."""
    deviation = float(np.hypot(less.deviation, more.deviation))
    return STANDARD_NORMAL.cdf((more.score - less.score) / deviation) if deviation > 0.0 else 1.0
