"""The steps of the validation stage: re-evaluate candidates, select a set, measure its held-out fitness."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from evolution.search.budget import Budget
from evolution.search.expectations import Expectations
from evolution.search.judging import Fitness, Judgement, Names, is_solved
from evolution.search.sections import ValidationSettings
from evolution.search.settings import EvolveSettings
from evolution.search.validation_stage.held_out import ValidationResult, held_out
from evolution.search.validation_stage.selection import select
from gym_mapbench.world.scenario import MapSet


class Validated(NamedTuple):
    """The selected set.

    Args:
        map_set: Its maps, in order of their scores.
        judged: Its judgement when it was selected.
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
    judged = fitness(archive.results_of(chosen))
    archive.drive({name: archive.repeats_of(name) + seeds for name in names}, everyone=True)
    result = held_out(archive.results_of(chosen), judged, fitness, seeds, len(candidates.names))
    return Validated(chosen, judged, result)


class _Candidates:
    """The maps that get held-out seeds, including those that failed on them."""

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
        self.settings = settings
        self.stage = stage
        self.budget = budget
        self.names: dict[str, None] = {}

    def re_evaluate(self) -> None:
        """Re-evaluate the best set until it stays the best, then the best set without its most important map, etc."""
        without: frozenset[str] = frozenset()
        while (missing := self.stage.candidates - self._solved) > 0:
            self.expectations.update()
            names = self.expectations.best_without(without)
            new = [name for name in names if name not in self.names]
            if names and not new:
                without |= {self.expectations.largest_contribution(names, without)}
            elif not new or not self._add(new[:missing]):
                break

    @property
    def _solved(self) -> int:
        return sum(is_solved(self.archive.results(name)) for name in self.names)

    def select(self) -> Names:
        """Return the set that is still selected after its maps got as many held-out seeds again."""
        settled: set[str] = set()
        while True:
            maps = {name: self.archive.results(name) for name in self.names}
            names = select(maps, self.fitness, self.settings.maps_per_set, self.stage)
            more = {name: self.archive.repeats_of(name) + self.stage.seeds for name in names if name not in settled}
            if not more or not self._drive(more, reserve=self.stage.held_out_seeds):
                return names
            settled.update(more)

    def _add(self, new: Sequence[str]) -> bool:
        """Drive as many new maps as the runs suffice for; return whether any was driven.

        Maps that fail on the seeds of the elite are no candidates: these come before the held-out seeds.
        """
        elite = {name: max(self.archive.repeats_of(name), self.settings.elite_repeats) for name in new}
        wanted = {name: repeats + self.stage.seeds for name, repeats in elite.items()}
        while wanted and not self._drive(wanted, reserve=self.stage.seeds + self.stage.held_out_seeds):
            wanted.popitem()
        self.names |= {name: None for name in wanted if self.archive.repeats_of(name) > elite[name]}
        return bool(wanted)

    def _drive(self, wanted: Mapping[str, int], reserve: int) -> bool:
        """Drive maps until each has a number of repeats or one failed run.

        Args:
            wanted: For each map the number of repeats.
            reserve: Seeds of a whole set whose runs are reserved for later steps.

        Returns:
            Whether the runs suffice; nothing is driven where they do not.
        """
        reserved = self.budget.controllers * self.settings.maps_per_set * reserve
        if self.budget.cost_of(wanted) + reserved > self.budget.all_runs:
            return False
        self.archive.drive_while_solved(wanted)
        return True
