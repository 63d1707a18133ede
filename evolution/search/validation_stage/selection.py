"""Selection of the best set among candidates: the best mean trial counts, and how reliable the trials are."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import combinations, pairwise
from statistics import fmean

import numpy as np

from evolution.driving import SetResults
from evolution.search.judging import (
    Fitness,
    MapResults,
    Names,
    is_untouched,
    order_kept,
    repeats_of,
    scores_of,
    success_share,
    values_in_order,
)
from evolution.search.judging.expected_fitness import chances_in_time, cost_of_unreliability, places_of
from evolution.search.sections import ValidationSettings
from evolution.search.validation_stage.trials import judged_trials

Results = Mapping[str, MapResults]
"""Results of maps, by name."""

MAX_SETS = 100_000
"""Most sets that are judged; each takes some hundredths of a millisecond."""
SHORT_LIST = 40
"""Sets whose trials are judged: those that are best by the chances of single maps."""


def select(maps: Results, fitness: Fitness, size: int, stage: ValidationSettings) -> Names:
    """Return the set with the best mean trial, its maps in order of their scores.

    A trial is good if the maps keep the ranks of their scores and no run fails. A set with a smaller share of good
    trials than ``reliability`` costs a share of a timeout besides, as in the search. The scores are those of the trials
    without a failed run.

    Args:
        maps: Results of the candidates, by name.
        fitness: Judges sets.
        size: Maps in a set.
        stage: That share (``reliability``), and whether maps without a contact come first, too.
    """
    eligible = preferred(maps, is_untouched, size) if stage.avoid_contact else maps
    eligible = few_enough(eligible, size)
    values = _Values(eligible, fitness, stage.reliability)
    short_list = sorted(combinations(eligible, size), key=values.estimate)[:SHORT_LIST]
    best = min(short_list, key=values.of_trials)
    return tuple(sorted(best, key=lambda name: _place(fitness.judge_map(fitness.counted(maps[name])).score)))


def preferred(maps: Results, passes: Callable[[MapResults], bool], size: int) -> Results:
    """Return the maps that pass a test where they suffice for a set, otherwise all."""
    passing = {name: of_map for name, of_map in maps.items() if passes(of_map)}
    return passing if len(passing) >= size else maps


def few_enough(maps: Results, size: int) -> dict[str, MapResults]:
    """Return the maps with the fewest failures, as many as make at most :data:`MAX_SETS` sets, in their order.

    Args:
        maps: Results of the candidates, by name.
        size: Maps in a set.
    """
    most = len(maps)
    while math.comb(most, size) > MAX_SETS:
        most -= 1
    kept = set(sorted(maps, key=lambda name: -success_share(maps[name]))[:most])
    return {name: of_map for name, of_map in maps.items() if name in kept}


class _Values:
    """Values of sets of some maps in single trials; less is better."""

    def __init__(self, maps: Results, fitness: Fitness, reliability: float) -> None:
        self.maps = maps
        self.fitness = fitness
        self.reliability = reliability
        self.scores = {name: scores_of(of_map, fitness) for name, of_map in maps.items()}
        counted = {name: fitness.counted(of_map) for name, of_map in maps.items()}
        self.judged = {name: fitness.judge_map(of_map) for name, of_map in counted.items()}
        timed = {name: of_map for name, of_map in counted.items() if self.scores[name] and fitness.policy.excludes}
        self.in_time = chances_in_time(timed, places_of(timed, self.scores), fitness.time_limit)
        self.solved_share = {name: len(self.scores[name]) / repeats_of(of_map) for name, of_map in maps.items()}
        self._means = {name: fmean(some) for name, some in self.scores.items() if some}
        self._chances: dict[tuple[str, str], float] = {}

    def estimate(self, names: Names) -> float:
        """Return the value of a set by the chances of order, if it counts, of no failure, and of no timeout.

        Maps are taken as independent of each other, and a good trial has the fitness of the set.
        """
        value = self.fitness.judge([self.judged[name] for name in names]).fitness
        chance = self._chance_in_time(names)
        chance *= math.prod(self.solved_share[name] for name in names)
        if self.fitness.kind.ordered:
            chance *= self._chance_of_order(names)
        return self._value(names, value, chance, chance)

    def of_trials(self, names: Names) -> float:
        """Return the value of a set by its trials, and by the chance of no timeout."""
        values, kept = values_of_trials(self._results(names), self.fitness)
        in_time = self._chance_in_time(names)
        return self._value(names, fmean(values), in_time, in_time * fmean(kept))

    def _value(self, names: Names, value: float, chance: float, good: float) -> float:
        """Return a value times a chance, unless it is a penalty, and the cost of a small share of good trials."""
        runs = sum(len(self.maps[name]) for name in names)
        cost = cost_of_unreliability(good, self.reliability, runs, self.fitness)
        return min(value, 0.0) * chance + max(value, 0.0) + cost

    def _results(self, names: Names) -> SetResults:
        return tuple(self.maps[name] for name in names)

    def _chance_in_time(self, names: Names) -> float:
        return math.prod(self.in_time.get(name, 1.0) for name in names)

    def _chance_of_order(self, names: Names) -> float:
        """Return the chance that trials keep the ranks of the mean scores, if maps are independent of each other."""
        if not all(self.scores[name] for name in names):
            return 0.0
        return math.prod(map(self._chance_of_pair, pairwise(sorted(names, key=self._means.__getitem__))))

    def _chance_of_pair(self, pair: tuple[str, str]) -> float:
        if pair not in self._chances:
            self._chances[pair] = chance_of_less(*(self.scores[name] for name in pair))
        return self._chances[pair]


def _place(score: float | None) -> float:
    """Return the sort key of a map; maps without a score come last."""
    return np.inf if score is None else score


def values_of_trials(results: SetResults, fitness: Fitness) -> tuple[list[float], list[bool]]:
    """Return the fitness of each trial, at least 0 where the maps lose their order, and where they keep it."""
    trials = judged_trials(results, fitness)
    kept = order_kept(trials, fitness(tuple(map(fitness.counted, results))).scores, fitness.kind.ordered)
    return values_in_order(trials, kept), kept


def chance_of_less(below: Sequence[float], above: Sequence[float]) -> float:
    """Return the share of pairs in which a score of one map is less than one of another, of all pairs of repeats."""
    return float((np.array(below)[:, None] < np.array(above)[None, :]).mean())
