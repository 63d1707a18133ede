"""Confirmation: the maps that could end in the best set are driven with new seeds before a set is named.

A search keeps what went best, luck included. So its best maps are driven again with seeds that it has not used; those
that fail once are out. Of the rest, the set is chosen by what it can be relied on for: the value that nine in ten
of its single drives reach, a drive in which the maps are out of order gaining nothing. Its maps are driven with as many
new seeds again, until the choice stays. What that set is worth is then said by further new seeds, which chose nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise, product
from statistics import fmean, median
from typing import NamedTuple

import numpy as np

from evolution.driving import RunResult, SetResults
from evolution.search.archive import Archive
from evolution.search.budget import Budget
from evolution.search.judging.exact import Names
from evolution.search.judging.expected_fitness import best_prospect, chances_in_time, least_dispensable
from evolution.search.judging.fitness import (
    Fitness,
    FitnessBreakdown,
    MapResults,
    is_solved,
    order_of,
    readings_of,
    repeats_of,
    singles_of,
)
from evolution.search.settings import EvolveSettings
from evolution.statistics import wilson_interval
from gym_mapbench.world.scenario import MapSet

MAX_COMBINATIONS = 1024
MIDDLE = (2.5, 97.5)
MAX_SETS = 100_000
"""Sets that are looked at, each for some tenths of a millisecond."""
SHORT_LIST = 40
"""Sets whose single drives are looked at; they are those that are best by their mean readings and their order."""


@dataclass(frozen=True)
class Confirmation:
    """What the best set is worth on seeds that the search did not use.

    Args:
        seeds: New seeds on each map.
        fitness: Median fitness of driving the set once, over all combinations of one new seed for each map.
        interval: Between which values the middle 95 % of these lie.
        fitness_par2: The same median, if a failed run counts as twice the time limit.
        order_kept: Share of the combinations in which the maps' readings are in the order by which the set was chosen.
        goals: Runs that reached the goal, with the new seeds.
        runs: Runs with the new seeds.
        goals_interval: 95 % interval (Wilson) of the share of goals.
        candidates: Maps that were driven with the new seeds.
    """

    seeds: int
    fitness: float
    interval: tuple[float, float]
    fitness_par2: float | None
    order_kept: float
    goals: int
    runs: int
    goals_interval: tuple[float, float]
    candidates: int


class Confirmed(NamedTuple):
    """The chosen set.

    Args:
        map_set: Its maps, in order of their readings.
        judged: How it was judged when it was chosen.
        claim: What it is worth on seeds that chose nothing.
    """

    map_set: MapSet
    judged: FitnessBreakdown
    claim: Confirmation


def confirm(archive: Archive, fitness: Fitness, settings: EvolveSettings, budget: Budget) -> Confirmed | None:
    """Drive the maps that could end in the best set with new seeds, choose the set that holds, and drive that again.

    Args:
        archive: Every driven map.
        fitness: Judges sets.
        settings: Options of the search, with a confirmation.
        budget: Limits the runs.

    Returns:
        The chosen set; None if fewer maps were solved than a set has.
    """
    assert settings.confirmation is not None
    candidates = _Candidates(archive, fitness, settings, budget)
    candidates.drive_all()
    if len(candidates.names) < settings.maps_per_set:
        return None
    names = candidates.settle()
    chosen, seeds = archive.map_set(names), settings.confirmation.claim_seeds
    judged = fitness(archive.results_of(chosen))
    archive.drive({name: archive.repeats_of(name) + seeds for name in names}, everyone=True)
    return Confirmed(chosen, judged, claim(archive.results_of(chosen), judged, fitness, seeds, len(candidates.names)))


class _Candidates:
    """The maps that are driven with new seeds, also those that failed then."""

    def __init__(self, archive: Archive, fitness: Fitness, settings: EvolveSettings, budget: Budget) -> None:
        assert settings.confirmation is not None
        self.archive = archive
        self.fitness = fitness
        self.settings = settings
        self.options = settings.confirmation
        self.budget = budget
        self.names: dict[str, None] = {}

    def drive_all(self) -> None:
        """Drive the best set until it stays the best, then the best one without its most important map, and so on."""
        without: frozenset[str] = frozenset()
        while (wanted := self.options.candidates - self._standing) > 0 and (names := self._best(without)):
            new = [name for name in names if name not in self.names]
            if not new:
                without |= {least_dispensable(self.archive, self.fitness, names, without)}
            elif not self._drive(new[:wanted]):
                break

    @property
    def _standing(self) -> int:
        return sum(is_solved(self.archive.results(name)) for name in self.names)

    def _best(self, without: frozenset[str]) -> Names:
        return best_prospect(self.archive, self.fitness, self.settings.maps_per_set, without)

    def settle(self) -> Names:
        """Return the set that is still chosen after its maps were driven with as many new seeds once more."""
        settled: set[str] = set()
        while True:
            names = choose({name: self.archive.results(name) for name in self.names}, self.fitness, self.settings)
            new = {name: self.archive.repeats_of(name) + self.options.seeds for name in names if name not in settled}
            if not new or not self._drive_further(new, keep=self.options.claim_seeds):
                return names
            settled.update(new)

    def _drive(self, new: Sequence[str]) -> bool:
        """Drive as many new maps as the runs suffice for, and say whether any was.

        Those that fail before they come to the new seeds are no candidates.
        """
        elite = {name: max(self.archive.repeats_of(name), self.settings.elite_repeats) for name in new}
        wanted = {name: repeats + self.options.seeds for name, repeats in elite.items()}
        while wanted and not self._drive_further(wanted, keep=self.options.seeds + self.options.claim_seeds):
            wanted.popitem()
        self.names |= {name: None for name in wanted if self.archive.repeats_of(name) > elite[name]}
        return bool(wanted)

    def _drive_further(self, wanted: Mapping[str, int], keep: int) -> bool:
        """Drive maps until each has so many repeats or has failed once.

        Args:
            wanted: For each map the number of repeats.
            keep: Seeds of a whole set whose runs are kept back for what comes later.

        Returns:
            Whether the runs sufficed; nothing is driven where they do not.
        """
        kept = self.budget.controllers * self.settings.maps_per_set * keep
        if self.budget.cost_of(wanted) + kept > self.budget.runs_to_confirm:
            return False
        self.archive.drive_while_solved(wanted)
        return True


def choose(maps: Mapping[str, MapResults], fitness: Fitness, settings: EvolveSettings) -> Names:
    """Return the set that can be relied on most, its maps in order of their readings; fewest failures come first.

    Where no set gains anything in as many of its single drives as asked for, it is the one that gains most in the mean.

    Args:
        maps: Results of the candidates, by name.
        fitness: Judges sets.
        settings: Options of the search, with a confirmation.
    """
    assert settings.confirmation is not None
    solved = {name: of_map for name, of_map in maps.items() if is_solved(of_map)}
    chosen_from = few_enough(solved if len(solved) >= settings.maps_per_set else maps, settings.maps_per_set)
    choice = _Choice(chosen_from, fitness, settings.confirmation.reliability)
    short_list = sorted(combinations(chosen_from, settings.maps_per_set), key=choice.roughly)[:SHORT_LIST]
    best = min(short_list, key=choice.reliable)
    return tuple(sorted(best, key=lambda name: _place(fitness((maps[name],)).readings[0])))


def few_enough(maps: Mapping[str, MapResults], size: int) -> dict[str, MapResults]:
    """Return so many maps that no more than :data:`MAX_SETS` sets can be made of them, in their order.

    Those that failed least are kept, of equals the first: where few maps stand, hundreds may have failed.

    Args:
        maps: Results of the candidates, by name.
        size: Maps in a set.
    """
    most = len(maps)
    while math.comb(most, size) > MAX_SETS:
        most -= 1
    kept = set(sorted(maps, key=lambda name: -_success_share(maps[name]))[:most])
    return {name: of_map for name, of_map in maps.items() if name in kept}


def _success_share(of_map: MapResults) -> float:
    """Return the share of successful runs; runs that were left out have failed."""
    return sum(run.success for runs in of_map for run in runs) / (len(of_map) * repeats_of(of_map))


class _Choice:
    """What sets of some maps can be relied on for."""

    def __init__(self, maps: Mapping[str, MapResults], fitness: Fitness, reliability: float) -> None:
        self.maps = maps
        self.fitness = fitness
        self.reliability = reliability
        self.readings = {name: readings_of(of_map, fitness) for name, of_map in maps.items()}
        solved = {name: of_map for name, of_map in maps.items() if is_solved(of_map)}
        self.in_time = chances_in_time(solved, self.readings, fitness.time_limit)

    def roughly(self, names: Names) -> float:
        """Return the value of a set times the chance of no timeout, and of its order if it counts; bad stays as bad."""
        total = self.fitness(self._results(names)).total
        likely = self._chance_in_time(names)
        if self.fitness.kind.ordered:
            likely *= chance_of_order([self.readings[name] for name in names])
        return min(total, 0.0) * likely + max(total, 0.0)

    def reliable(self, names: Names) -> tuple[float, float]:
        """Return the gain that enough single drives of a set reach, and their mean gain."""
        gains, chance = gains_of(self._results(names), self.fitness), self._chance_in_time(names)
        return reached_by(gains, self.reliability, chance), fmean(gains) * chance

    def _results(self, names: Names) -> SetResults:
        return tuple(self.maps[name] for name in names)

    def _chance_in_time(self, names: Names) -> float:
        return float(np.prod([self.in_time.get(name, 1.0) for name in names]))


def _place(reading: float | None) -> float:
    """Return what maps are sorted by: those without a reading come last."""
    return np.inf if reading is None else reading


def gains_of(results: SetResults, fitness: Fitness) -> list[float]:
    """Return the fitness of each combination of single drives; at least 0 where the maps are out of order."""
    drives = [fitness(one) for one in combined(results)]
    return [
        drive.total if kept else max(drive.total, 0.0)
        for drive, kept in zip(drives, in_order(drives, fitness(results), fitness), strict=True)
    ]


def reached_by(gains: Sequence[float], share: float, chance: float) -> float:
    """Return the gain that a share of all drives reach, if these gains come with a chance only, and else nothing does.

    Where the chance is too small, nothing is gained; a drive that is worse than that still counts.

    Args:
        gains: Gains of single drives, less is better.
        share: Share of all drives.
        chance: Chance of a drive to be like these.
    """
    if share < chance:
        return float(np.quantile(gains, share / chance))
    return max(0.0, *gains)


def chance_of_order(readings: Sequence[Sequence[float]]) -> float:
    """Return how likely single drives are to keep the order of the mean readings, if maps do not depend on each other.

    Args:
        readings: For each map the readings of single drives.
    """
    if not all(len(one) for one in readings):
        return 0.0
    ordered = [np.array(one) for one in sorted(readings, key=fmean)]
    return float(np.prod([(below[:, None] < above[None, :]).mean() for below, above in pairwise(ordered)]))


def claim(results: SetResults, judged: FitnessBreakdown, fitness: Fitness, seeds: int, candidates: int) -> Confirmation:
    """Say what a set is worth by its last ``seeds`` repeats, which the search did not see.

    Args:
        results: Results of the set.
        judged: How it was judged when it was chosen.
        fitness: Judges sets.
        seeds: Repeats to look at; fewer where a map was not driven so often, because it failed.
        candidates: Maps that were driven with these seeds.
    """
    last = tuple(_last(of_map, seeds) for of_map in results)
    drives = [fitness(one) for one in combined(last)]
    totals = [one.total for one in drives]
    runs: list[RunResult] = [run for of_map in last for of_controller in of_map for run in of_controller]
    goals = sum(run.success for run in runs)
    low, high = np.percentile(totals, MIDDLE)
    return Confirmation(
        seeds=seeds,
        fitness=median(totals),
        interval=(float(low), float(high)),
        fitness_par2=_par2(last, fitness),
        order_kept=fmean(in_order(drives, judged, fitness)),
        goals=goals,
        runs=len(runs),
        goals_interval=wilson_interval(goals, len(runs)),
        candidates=candidates,
    )


def _last(of_map: MapResults, seeds: int) -> MapResults:
    first = max(repeats_of(of_map) - seeds, 0)
    return tuple(runs[first:] for runs in of_map)


def combined(results: SetResults) -> list[SetResults]:
    """Return the set as if driven once, for every combination of one repeat of each map.

    Of more than 1,024 combinations, those are taken in which the repeats of neighbouring maps are equally far apart.
    """
    singles = [singles_of(of_map) for of_map in results]
    counts = [len(of_map) for of_map in singles]
    if np.prod(counts, dtype=float) <= MAX_COMBINATIONS:
        return [tuple(chosen) for chosen in product(*singles)]
    most = max(counts)
    return [
        tuple(of_map[(first + place * step) % len(of_map)] for place, of_map in enumerate(singles))
        for first in range(most)
        for step in range(most)
    ]


def in_order(drives: Sequence[FitnessBreakdown], judged: FitnessBreakdown, fitness: Fitness) -> list[bool]:
    """Say of each drive whether the maps' readings are in the order by which the set was judged, if order counts.

    Args:
        drives: The set as if driven once, several times.
        judged: The set by all its runs.
        fitness: Judged it.
    """
    wanted = order_of(judged.readings)
    return [wanted is not None and (order_of(one.readings) == wanted or not fitness.kind.ordered) for one in drives]


def _par2(results: SetResults, fitness: Fitness) -> float | None:
    """Return the median fitness if failed runs count as twice the time limit; None where only times can."""
    options = fitness.settings
    if options.metric != "time" or fitness.kind.solved_only or any(len(set(map(len, one))) > 1 for one in results):
        return None
    counted = replace(fitness, settings=options.replace(failures="par2", drive_last=()))
    return median(counted(one).total for one in combined(results))
