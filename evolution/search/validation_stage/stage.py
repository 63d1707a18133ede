"""The steps of the validation stage: re-evaluate candidates, select a set, measure its held-out fitness."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from evolution.search.budget import Budget, runs_in
from evolution.search.expectations import Expectations
from evolution.search.judging import Fitness, Judgement, Names
from evolution.search.sections import ValidationSettings
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
    expectations: Expectations, fitness: Fitness, stage: ValidationSettings, budget: Budget
) -> Validated | None:
    """Re-evaluate the best maps on held-out seeds, select a set, and return it with its held-out fitness.

    Args:
        expectations: Estimates of every evaluated map.
        fitness: Judges sets.
        stage: Options of the validation stage.
        budget: Limits the runs.

    Returns:
        The selected set; None if there are fewer solved maps than a set has.
    """
    archive, candidates = budget.archive, _Candidates(expectations, fitness, stage, budget)
    candidates.re_evaluate()
    if len(candidates.names) < candidates.size:
        return None
    names = candidates.select()
    chosen, seeds = archive.map_set(names), stage.held_out_seeds
    judged = fitness(tuple(map(fitness.counted, archive.results_of(chosen))))
    archive.drive_more(dict.fromkeys(names, [seeds] * budget.controllers))
    result = held_out(archive.results_of(chosen), judged, fitness, seeds, len(candidates.turns))
    return Validated(chosen, judged, result)


class _Candidates:
    """The maps that get held-out seeds, with the number of turns that each had."""

    def __init__(self, expectations: Expectations, fitness: Fitness, stage: ValidationSettings, budget: Budget) -> None:
        self.expectations = expectations
        self.archive = budget.archive
        self.fitness = fitness
        self.size = budget.settings.maps_per_set
        self.stage = stage
        self.budget = budget
        self.turns: Counter[str] = Counter()

    @property
    def names(self) -> list[str]:
        """The maps that stayed for the second round; all with some held-out seeds, if these are too few."""
        enough = [name for name, turns in self.turns.items() if turns > FIRST_SEEDS]
        return enough if len(enough) >= self.size else list(self.turns)

    def re_evaluate(self) -> None:
        """Drive held-out seeds on the candidates (sequential halving): half of them stay for twice as many seeds."""
        self.expectations.update()
        if not self.expectations.best:
            return
        names, seeds = self._first(), FIRST_SEEDS
        for _ in range(ROUNDS):
            for _ in range(seeds):
                turns = {name: self.expectations.turn(name) for name in names}
                if not self._drive(turns, self.stage.seeds + self.stage.held_out_seeds):
                    return
                self.turns.update(names)
            self.expectations.update()
            names, seeds = self.expectations.candidates(max(len(names) // 2, self.size), names), 2 * seeds

    def _first(self) -> list[str]:
        """Return the candidates of the first round: as many as its share of the runs suffices for."""
        runs = self.budget.controllers * self.stage.candidates * self.stage.seeds // ROUNDS
        names = self.expectations.candidates(runs)
        costs = np.cumsum([sum(self.expectations.turn(name)) for name in names])
        return names[: max(int(np.sum(costs <= runs)), self.size)]

    def select(self) -> Names:
        """Return the set that is still selected after its maps got ``seeds`` further held-out seeds."""
        settled: set[str] = set()
        while True:
            maps = {name: self.archive.results(name) for name in self.names}
            names = select(maps, self.fitness, self.size, self.stage)
            more = {name: [self.stage.seeds] * self.budget.controllers for name in names if name not in settled}
            if not more or not self._drive(more, self.stage.held_out_seeds):
                return names
            settled.update(more)

    def _drive(self, further: Mapping[str, Sequence[int]], reserve: int) -> bool:
        """Drive further runs.

        Args:
            further: For each map the number of further runs of each controller.
            reserve: Seeds of a whole set whose runs are reserved for later steps.

        Returns:
            Whether the runs suffice; nothing is driven where they do not.
        """
        reserved = self.budget.controllers * self.size * reserve
        if runs_in(further) + reserved > self.budget.all_runs:
            return False
        self.archive.drive_more(further)
        return True
