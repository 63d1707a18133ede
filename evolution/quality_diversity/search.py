"""The search of an atlas: MAP-Elites over maps, then a re-evaluation of all elites on held-out seeds.

Source: Mouret and Clune, "Illuminating search spaces by mapping elites", 2015. A new map is sampled, or it is a mutated
elite of a random cell. It runs on one seed; if it would enter a cell, it runs on the other seeds of the search, too.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from evolution.driving import Evaluator, JobPlan
from evolution.files import Row, counted
from evolution.quality_diversity.elites import Elite, quality, quality_of
from evolution.quality_diversity.grid import Axes, Cell, Floats, MapGrid
from evolution.quality_diversity.settings import AtlasSettings
from evolution.search import Archive, Experiment, MapResults, is_solved, stages_of
from gym_mapbench.world.scenario import MapSet, Scenario

MAX_TRIES = 20
"""Tries until a new map is one that was not evaluated before."""

OnStep = Callable[[str], object]


class GridFigures(NamedTuple):
    """How well a grid is filled.

    Args:
        cells: Filled cells.
        coverage: Filled cells over all cells.
        qd_score: Sum of the qualities of all elites.
    """

    cells: int
    coverage: float
    qd_score: float

    @classmethod
    def of(cls, grid: MapGrid) -> GridFigures:
        """Measure a grid."""
        return cls(len(grid.elites), grid.coverage, grid.qd_score)


@dataclass(frozen=True)
class AtlasSearch:
    """What the search of an atlas found.

    Args:
        elites: The maps of the cells after the re-evaluation, in order of the cells.
        searched: How well the search filled the grid.
        held_out: The same after the re-evaluation.
        dropped: Elites that a controller failed on a held-out seed.
        displaced: Elites that moved to a cell with a better map, or whose cell got a better one.
        runs: Runs of the search.
        held_out_runs: Runs of the re-evaluation.
        history: One row per batch.
        unsolved: By controller, the number of maps that have no cell because it was the first to fail on them.
        failures: By outcome, the number of these maps.
    """

    elites: tuple[Elite, ...]
    searched: GridFigures
    held_out: GridFigures
    dropped: int
    displaced: int
    runs: int
    held_out_runs: int
    history: tuple[Row, ...]
    unsolved: Mapping[str, int] = field(default_factory=dict)
    failures: Mapping[str, int] = field(default_factory=dict)


def search_atlas(
    experiment: Experiment, settings: AtlasSettings, evaluator: Evaluator, *, on_step: OnStep = lambda _: None
) -> AtlasSearch:
    """Fill an atlas, and re-evaluate it on held-out seeds, without writing anything.

    Args:
        experiment: Families, mutation and seed of the maps; controllers; world.
        settings: Options.
        evaluator: Drives the runs.
        on_step: Called with a line about each batch.

    Raises:
        ConfigError: If the options do not go together, or pyribs is not installed.
        RunError: If no worker starts.
    """
    search = _Search(experiment, settings, evaluator, on_step)
    while search.step():
        pass
    return search.result()


class _Search:
    """The state of a search."""

    def __init__(self, experiment: Experiment, settings: AtlasSettings, evaluator: Evaluator, on_step: OnStep) -> None:
        plan = JobPlan(experiment.controllers, experiment.run, experiment.search.seed)
        settings.check(plan.names)
        self.settings = settings
        self.on_step = on_step
        self.axes = Axes.of(settings, plan.names)
        self.grid = MapGrid(self.axes)
        self.archive = Archive(evaluator, plan, stages_of(plan))
        self.sampling, self.mutator = experiment.sampling, experiment.mutator
        self.rng = np.random.default_rng(experiment.search.seed)
        self.digests: list[str] = []
        self.history: list[Row] = []

    def step(self) -> bool:
        """Evaluate a batch of new maps; False if the runs do not suffice for another map, or no new map is found."""
        left = self.settings.runs - self.archive.count
        most = left // (len(self.archive.plan.controllers) * self.settings.repeats)
        new = self._new_maps(min(self.settings.batch, most))
        if not new:
            return False
        self.digests += new
        self.archive.evaluate([MapSet((scenario,)) for scenario in new.values()])
        self.archive.drive_while_solved({name: self.settings.repeats for name in new if self._may_enter(name)})
        for number in range(len(self.digests) - len(new), len(self.digests)):
            self._add(number)
        self._record()
        return True

    def result(self) -> AtlasSearch:
        """Re-evaluate the elites on held-out seeds, and fill a new grid with those that are still solved."""
        found, searched, runs = self.grid.elites, GridFigures.of(self.grid), self.archive.count
        failed = self._failed()
        held_out = self._held_out({self.digests[number]: cell for cell, number in found.items()})
        grid = MapGrid(self.axes)
        numbers = [number for number in found.values() if self.digests[number] in held_out]
        for number in numbers:
            ratios = self.axes.log_ratios(held_out[self.digests[number]])
            grid.add(number, self._quality(self.digests[number], ratios), ratios.mean(axis=0))
        from_cell = {number: cell for cell, number in found.items()}
        return AtlasSearch(
            elites=tuple(self._elite(cell, number, from_cell, held_out) for cell, number in grid.elites.items()),
            searched=searched,
            held_out=GridFigures.of(grid),
            dropped=len(found) - len(numbers),
            displaced=len(numbers) - len(grid.elites),
            runs=runs,
            held_out_runs=self.archive.count - runs,
            history=tuple(self.history),
            unsolved=_counts(name for name, _ in failed),
            failures=_counts(outcome for _, outcome in failed),
        )

    def _failed(self) -> list[tuple[str, str]]:
        """Return, for each map that is not solved, the controller that failed first and the outcome of its run."""
        return [
            (name, next(run.outcome for run in runs if not run.success))
            for digest in self.digests
            for name, runs in zip(self.archive.plan.names, self.archive.results(digest), strict=True)
            if not all(run.success for run in runs)
        ]

    def _new_maps(self, count: int) -> dict[str, Scenario]:
        """Return up to ``count`` maps that were not evaluated before, by digest."""
        parents = [self.archive.scenarios[self.digests[number]] for number in self.grid.elites.values()]
        new: dict[str, Scenario] = {}
        for _ in range(count * MAX_TRIES):
            if len(new) == count:
                break
            scenario = self._new_map(parents)
            if scenario.world_digest not in self.archive.scenarios:
                new.setdefault(scenario.world_digest, scenario)
        return new

    def _new_map(self, parents: Sequence[Scenario]) -> Scenario:
        """Return a sampled map, or a mutated elite."""
        if self.rng.random() < self.settings.fresh or not parents:
            return self.sampling.draw(self.rng)
        parent = parents[int(self.rng.integers(len(parents)))]
        mates = [one.genome for one in parents if one.genome is not None]
        return self.mutator.vary(parent, self.rng, mates=mates)[0]

    def _may_enter(self, digest: str) -> bool:
        """Whether a map with its first run would enter a cell if all its trials were reliable."""
        if not self.archive.is_solved(digest):
            return False
        position = self.axes.log_ratios(self.archive.results(digest)).mean(axis=0)
        best = quality(self.archive.scenarios[digest].map, 1.0, self.settings.repeats)
        return self.grid.takes(best, position)

    def _add(self, number: int) -> None:
        """Add a map to the grid if it is solved on all seeds of the search."""
        digest = self.digests[number]
        if self.archive.is_solved(digest) and self.archive.repeats_of(digest) == self.settings.repeats:
            ratios = self.axes.log_ratios(self.archive.results(digest))
            self.grid.add(number, self._quality(digest, ratios), ratios.mean(axis=0))

    def _record(self) -> None:
        """Add a row to the history, and report it."""
        figures = GridFigures.of(self.grid)
        self.history.append({"runs": self.archive.count, "maps": len(self.digests), **figures._asdict()})
        self.on_step(
            f"{self.archive.count} of {counted(self.settings.runs, 'run')}, {counted(figures.cells, 'cell')} filled"
        )

    def _held_out(self, digests: Mapping[str, Cell]) -> dict[str, MapResults]:
        """Return the held-out results of those maps that all controllers solve on all held-out seeds."""
        first, seeds = self.settings.repeats, self.settings.held_out_seeds
        self.archive.drive_while_solved(dict.fromkeys(digests, first + seeds))
        results = {name: self.archive.results(name) for name in digests}
        return {name: _held_out_of(of_map, first) for name, of_map in results.items() if is_solved(of_map)}

    def _quality(self, digest: str, log_ratios: Floats) -> float:
        return quality_of(self.archive.scenarios[digest].map, log_ratios, self.axes)

    def _elite(
        self, cell: Cell, number: int, from_cell: Mapping[int, Cell], held_out: Mapping[str, MapResults]
    ) -> Elite:
        digest = self.digests[number]
        ratios = self.axes.log_ratios(held_out[digest])
        scenario = replace(self.archive.scenarios[digest], name="_".join(["cell", *map(str, cell)]))
        means = tuple(np.exp(ratios.mean(axis=0)).tolist())
        return Elite(scenario, cell, from_cell[number], means, self._quality(digest, ratios), held_out[digest])


def _counts(names: Iterable[str]) -> dict[str, int]:
    """Return how often each name occurs, the most frequent first."""
    return dict(Counter(names).most_common())


def _held_out_of(of_map: MapResults, first: int) -> MapResults:
    """Return the results from a repeat on, without what differs between equal runs."""
    return tuple(tuple(replace(run, timings={}, attempts=1) for run in runs[first:]) for runs in of_map)
