"""The steps of the validation stage: re-evaluate candidates, select a set, measure its held-out fitness."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from evolution.search.budget import Budget
from evolution.search.expectations import Expectations
from evolution.search.judging import Fitness, Judgement, Names, finished_trials, repeats_of, solved_trials
from evolution.search.sections import ValidationSettings
from evolution.search.settings import EvolveSettings
from evolution.search.validation_stage.held_out import ValidationResult, held_out
from evolution.search.validation_stage.selection import select
from gym_mapbench.world.scenario import MapSet

ROUNDS = 3
"""Rounds of the re-evaluation."""
FIRST_SEEDS = 1
"""Held-out seeds of every candidate in the first round."""


class Validated(NamedTuple):
    """The selected set.

    Args:
        map_set: Its maps, in order of their scores.
        judged: Its judgement when it was selected, by the repeats without a failed run.
        result: Its held-out fitness.
    """

    map_set: MapSet
    judged: Judgement
    result: ValidationResult


def validate(
    expectations: Expectations, fitness: Fitness, settings: EvolveSettings, stage: ValidationSettings, budget: Budget
) -> Validated | None:
    """Re-evaluate the best maps on held-out seeds, select a set, and return it with its held-out fitness.

    Args:
        expectations: Estimates of every evaluated map.
        fitness: Judges sets.
        settings: Options of the search.
        stage: Options of the validation stage.
        budget: Limits the runs.

    Returns:
        The selected set; None if there are fewer solved maps than a set has.
    """
    archive, candidates = expectations.archive, _Candidates(expectations, fitness, settings, stage, budget)
    candidates.re_evaluate()
    if len(candidates.names) < settings.maps_per_set:
        return None
    names = candidates.select()
    chosen, seeds = archive.map_set(names), stage.held_out_seeds
    judged = fitness(tuple(map(solved_trials, archive.results_of(chosen))))
    archive.drive({name: archive.repeats_of(name) + seeds for name in names}, everyone=True)
    result = held_out(archive.results_of(chosen), judged, fitness, seeds, len(candidates.before))
    return Validated(chosen, judged, result)


class _Candidates:
    """The maps that get held-out seeds, with the number of repeats that each had before."""

    def __init__(
        self,
        expectations: Expectations,
        fitness: Fitness,
        settings: EvolveSettings,
        stage: ValidationSettings,
        budget: Budget,
    ) -> None:
        self.expectations = expectations
        self.archive = expectations.archive
        self.fitness = fitness
        self.size = settings.maps_per_set
        self.stage = stage
        self.budget = budget
        self.before: dict[str, int] = {}

    @property
    def names(self) -> list[str]:
        """The maps that stayed for the second round; all with some held-out seeds, if these are too few."""
        enough = [name for name in self.before if self._seeds(name) >= FIRST_SEEDS + 1]
        return enough if len(enough) >= self.size else [name for name in self.before if self._seeds(name) > 0]

    def re_evaluate(self) -> None:
        """Drive held-out seeds on the candidates (sequential halving): half of them stay for twice as many seeds."""
        self.expectations.update()
        if not self.expectations.best:
            return
        left = max(self.stage.candidates * self.stage.seeds // ROUNDS, self.size)
        names, seeds = self.expectations.candidates(left), FIRST_SEEDS
        for _ in range(ROUNDS):
            self.before = {name: self.archive.repeats_of(name) for name in names} | self.before
            for _ in range(seeds):
                wanted = {name: self.archive.repeats_of(name) + 1 for name in names}
                if not self._drive(wanted, self.stage.seeds + self.stage.held_out_seeds):
                    return
            self.expectations.update()
            left, seeds = max(left // 2, self.size), 2 * seeds
            names = self.expectations.candidates(left, names)

    def select(self) -> Names:
        """Return the set that is still selected after its maps got ``seeds`` further held-out seeds."""
        settled: set[str] = set()
        while True:
            maps = {name: finished_trials(self.archive.results(name)) for name in self.names}
            names = select(maps, self.fitness, self.size, self.stage)
            more = {name: self.archive.repeats_of(name) + self.stage.seeds for name in names if name not in settled}
            if not more or not self._drive(more, self.stage.held_out_seeds):
                return names
            settled.update(more)

    def _seeds(self, name: str) -> int:
        """Return the number of held-out seeds of a map with which every controller drove or one failed."""
        if name not in self.before:
            return 0
        return repeats_of(finished_trials(self.archive.results(name))) - self.before[name]

    def _drive(self, wanted: Mapping[str, int], reserve: int) -> bool:
        """Drive maps until each has a number of repeats.

        Args:
            wanted: For each map the number of repeats.
            reserve: Seeds of a whole set whose runs are reserved for later steps.

        Returns:
            Whether the runs suffice; nothing is driven where they do not.
        """
        reserved = self.budget.controllers * self.size * reserve
        if self.budget.cost_of(wanted) + reserved > self.budget.all_runs:
            return False
        self.archive.drive(wanted)
        return True
