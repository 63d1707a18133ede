"""Confirmation: the maps that could end in the best set are driven with new seeds before a set is named.

A search keeps what went best, luck included. So its best maps are driven again with seeds that it has not used; those
that fail once are out. Of the rest, the best set is chosen whose maps keep their order: the bounds of single runs
(mean reading +- ``bound`` standard deviations) of neighbouring maps must not overlap. What the set is worth is then
said by the new seeds alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise, product
from statistics import fmean, median

import numpy as np

from evolution.driving import RunResult, SetResults
from evolution.search.archive import Archive
from evolution.search.exact import MapResults, Names
from evolution.search.fitness import Fitness, FitnessBreakdown, is_solved, repeats_of
from evolution.search.settings import EvolveSettings
from evolution.statistics import wilson_interval

MAX_COMBINATIONS = 1024
MIDDLE = (2.5, 97.5)
PRIOR_WEIGHT = 3.0
"""Runs that the spread common to all maps counts as, beside a map's own, in the spread of its readings."""


@dataclass(frozen=True)
class Confirmation:
    """What the best set is worth on seeds that the search did not use.

    Args:
        seeds: New seeds on each map.
        fitness: Median fitness of driving the set once, over all combinations of one new seed for each map.
        interval: Between which values the middle 95 % of these lie.
        fitness_par2: The same median, if a failed run counts as twice the time limit.
        order_kept: Share of the combinations in which the maps' readings are in the order of their means.
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


def confirm(archive: Archive, fitness: Fitness, settings: EvolveSettings, runs: int | None) -> tuple[Names, int]:
    """Drive the maps that could end in the best set with new seeds, and return the best set that holds.

    Args:
        archive: Every driven map.
        fitness: Judges sets.
        settings: Options of the search, with a confirmation.
        runs: Runs that may be driven; None for no limit.

    Returns:
        The names of its maps, in order of their readings, empty if fewer maps were solved than a set has; and the
        number of maps that were driven with new seeds.
    """
    candidates = _Candidates(archive, fitness, settings, runs)
    candidates.confirm_best()
    candidates.confirm_others()
    held = {name: archive.results(name) for name in candidates.names}
    return choose(held, fitness, settings) if len(held) >= settings.maps_per_set else (), len(held)


class _Candidates:
    """The maps that are driven with new seeds."""

    def __init__(self, archive: Archive, fitness: Fitness, settings: EvolveSettings, runs: int | None) -> None:
        self.archive = archive
        self.fitness = fitness
        self.settings = settings
        self.names: dict[str, None] = {}
        self.last = None if runs is None else archive.count + runs

    def confirm_best(self) -> None:
        """Drive the best set until it stays the best."""
        while self._drive(self.archive.best(self.fitness, self.settings.maps_per_set)):
            pass

    def confirm_others(self) -> None:
        """Drive the best sets of the other maps, one after the other."""
        while self._drive(self.archive.best(self.fitness, self.settings.maps_per_set, without=self.names)):
            pass

    def _drive(self, names: Names) -> bool:
        """Drive the maps among these that are new; False if there are none, or no more are wanted."""
        options = self.settings.confirmation
        assert options is not None
        new = [name for name in names if name not in self.names][: options.candidates - len(self.names)]
        if not new or not self._affordable(len(new) * (self.settings.elite_seeds + options.seeds)):
            return False
        self.names |= dict.fromkeys(new)
        for repeats in (self.settings.elite_repeats, self.settings.elite_repeats + options.seeds):
            good = [name for name in new if is_solved(self.archive.results(name))]
            self.archive.drive([self.archive.scenarios[name] for name in good], repeats)
        return True

    def _affordable(self, drives: int) -> bool:
        return self.last is None or self.archive.count + drives * len(self.archive.plan.controllers) <= self.last


def choose(maps: Mapping[str, MapResults], fitness: Fitness, settings: EvolveSettings) -> Names:
    """Return the best set that holds, its maps in order of their readings.

    Fewest failures come first, then the least overlap of the bounds of neighbouring maps, then the fitness.

    Args:
        maps: Results of the candidates, by name.
        fitness: Judges sets.
        settings: Options of the search, with a confirmation.
    """
    assert settings.confirmation is not None
    solved = {name: of_map for name, of_map in maps.items() if is_solved(of_map)}
    if len(solved) >= settings.maps_per_set:
        maps = solved
    bounds = bounds_of(maps, fitness, settings.confirmation.bound)

    def rank(names: Names) -> tuple[float, float, float]:
        found = fitness(tuple(maps[name] for name in names))
        overlap = overlap_of([bounds[name] for name in names if name in bounds]) if fitness.kind.ordered else 0.0
        return 1.0 - found.success_rate, overlap, found.total

    best = min(combinations(maps, settings.maps_per_set), key=rank)
    return tuple(sorted(best, key=lambda name: fmean(bounds.get(name, (np.inf, np.inf)))))


def bounds_of(maps: Mapping[str, MapResults], fitness: Fitness, width: float) -> dict[str, tuple[float, float]]:
    """Return between which readings single runs on each map are expected: mean +- ``width`` standard deviations.

    The variance of a map's readings is taken together with that of all maps, which counts as three runs, because few
    runs say little about their own spread. Maps without readings are left out.
    """
    read = {name: np.array(readings_of(of_map, fitness)) for name, of_map in maps.items()}
    read = {name: readings for name, readings in read.items() if len(readings)}
    squares = {name: float(((one - one.mean()) ** 2).sum()) for name, one in read.items()}
    freedom = sum(len(one) - 1 for one in read.values())
    common = sum(squares.values()) / freedom if freedom else 0.0
    bounds = {}
    for name, one in read.items():
        spread = float(np.sqrt((PRIOR_WEIGHT * common + squares[name]) / (PRIOR_WEIGHT + len(one) - 1)))
        mean = float(one.mean())
        bounds[name] = mean - width * spread, mean + width * spread
    return bounds


def readings_of(of_map: MapResults, fitness: Fitness) -> list[float]:
    """Return the reading of each repeat of a map; repeats without one are left out."""
    singles = [fitness((one,)).readings[0] for one in singles_of(of_map)]
    return [reading for reading in singles if reading is not None]


def overlap_of(bounds: Sequence[tuple[float, float]]) -> float:
    """Return by how much the bounds of neighbouring maps overlap, in sum."""
    ordered = sorted(bounds, key=fmean)
    return sum(max(below[1] - above[0], 0.0) for below, above in pairwise(ordered))


def singles_of(of_map: MapResults) -> list[MapResults]:
    """Return each repeat of a map alone."""
    return [tuple(runs[number : number + 1] for runs in of_map) for number in range(repeats_of(of_map))]


def claim(results: SetResults, fitness: Fitness, seeds: int, candidates: int) -> Confirmation:
    """Say what a set is worth by its last ``seeds`` repeats, which the search did not see.

    Args:
        results: Results of the set.
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
        order_kept=order_kept(last, drives, fitness),
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


def order_kept(results: SetResults, drives: Sequence[FitnessBreakdown], fitness: Fitness) -> float:
    """Return the share of the drives in which the readings are in the order of the maps' mean readings."""
    means = [readings_of(of_map, fitness) for of_map in results]
    if not all(means):
        return 0.0
    order = np.argsort([fmean(one) for one in means], kind="stable")
    kept = [
        None not in one.readings and bool((np.diff(np.array(one.readings, dtype=float)[order]) > 0).all())
        for one in drives
    ]
    return fmean(kept)


def _par2(results: SetResults, fitness: Fitness) -> float | None:
    """Return the median fitness if failed runs count as twice the time limit; None where only times can."""
    options = fitness.settings
    if options.metric != "time" or fitness.kind.solved_only or any(len(set(map(len, one))) > 1 for one in results):
        return None
    counted = replace(fitness, settings=options.replace(failures="par2", drive_last=()))
    return median(counted(one).total for one in combined(results))
