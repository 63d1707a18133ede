"""The figures of a study: 5.1 to 5.5 of the thesis, and those that a reviewer misses there."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from evolution.figures import FIGURES, DrivenMap, drive_best
from evolution.plots import (
    box_figure,
    critical_difference_figure,
    curse_figure,
    lorenz_figure,
    map_set_figure,
    save_figure,
    spread_figure,
    times_figure,
)
from evolution.rundir import LoadedRun, load_run
from evolution.study.comparisons import QUANTITIES, Comparison, Groups, by_judge, compare
from evolution.study.engine import NAV2, Engine
from evolution.study.results import StudyResults, StudyRun

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class BestSet:
    """The best set of one configuration (thesis, figures 5.3 and 5.5), by the fitness the search saw.

    Args:
        run: The run that found it.
        loaded: Its run directory.
        maps: Its maps, driven again as the search saw them.
    """

    run: StudyRun
    loaded: LoadedRun
    maps: tuple[DrivenMap, ...]


@dataclass(frozen=True)
class StudyFigure:
    """A figure that was drawn: its caption and its files."""

    caption: str
    png: Path
    svg: Path


def drive_best_sets(results: StudyResults, engine: Engine = NAV2) -> list[BestSet]:
    """Drive the best set of every configuration again: the trajectories for figures and replays."""
    found = []
    for runs in results.by_configuration.values():
        best = min(runs, key=lambda run: run.fitness)
        loaded = load_run(best.path)
        found.append(BestSet(best, loaded, tuple(drive_best(loaded, engine.read_experiment, engine.drive))))
    return found


def write_study_figures(results: StudyResults, best_sets: Sequence[BestSet]) -> list[StudyFigure]:
    """Draw every figure of a study into ``figures/``, as PNG and SVG."""
    folder = results.path / FIGURES
    figures = []
    for judge, groups in by_judge(results).items():
        comparisons = [one for one in compare(results) if one.judge == judge]
        figures += _Judged(folder, judge, groups, comparisons).draw()
    for best in best_sets:
        figures += _best_set_figures(folder, best)
    return figures


@dataclass(frozen=True)
class _Judged:
    """All runs that one fitness judged, and the figures over them."""

    folder: Path
    judge: str
    groups: Groups
    comparisons: Sequence[Comparison]

    def draw(self) -> list[StudyFigure]:
        """Draw them all."""
        return [*self.populations(), self.progress(), self.final(), *self.curse(), *self.ranks()]

    def populations(self) -> list[StudyFigure]:
        """Figure 5.1, for every group that differs in its population only."""
        caption = f"Best fitness so far for different populations, mean and SD over runs ({self.judge}; thesis, 5.1)"
        return [
            self._save(f"populations_{number}", caption, self._curves(test.groups))
            for number, test in enumerate(self.comparisons[0].populations, start=1)
        ]

    def progress(self) -> StudyFigure:
        """Convergence of all methods, baselines included (for one method: figure 5.4)."""
        caption = f"Best fitness so far over the budget, mean and SD over runs ({self.judge}; thesis, 5.4)"
        return self._save("progress", caption, self._curves(list(self.groups)))

    def final(self) -> StudyFigure:
        """Figure 5.2, as seen and on fresh seeds."""
        boxes = {QUANTITIES[one.quantity]: one.values for one in self.comparisons}
        caption = f"Fitness of the best set of every run ({self.judge}; thesis, 5.2)"
        return self._save("final", caption, box_figure(boxes, highest=self._highest))

    def curse(self) -> list[StudyFigure]:
        """What was seen against what fresh seeds show, where anything was driven again."""
        points = {}
        for name, runs in self.groups.items():
            if again := [run for run in runs if run.fresh is not None]:
                fresh = [run.fresh.fitness_as_searched for run in again if run.fresh]
                points[name] = [run.fitness for run in again], fresh
        caption = f"What the search saw and what fresh seeds show; above the line it was luck ({self.judge})"
        return [self._save("curse", caption, curse_figure(points, self._highest))] if points else []

    def ranks(self) -> list[StudyFigure]:
        """Critical-difference diagrams."""
        found = [(one.quantity, one.ranking) for one in self.comparisons if one.ranking is not None]
        return [
            self._save(
                f"ranks_{quantity}",
                f"Mean ranks over {len(ranking.seeds)} seeds, {QUANTITIES[quantity]} ({self.judge})",
                critical_difference_figure(ranking.names, ranking.ranks, ranking.critical_difference),
            )
            for quantity, ranking in found
        ]

    @property
    def _highest(self) -> float:
        """Fitness from which on a set is out of the question: its failures alone cost that much."""
        return float(next(iter(self.groups.values()))[0].experiment.search.base_cost)

    def _curves(self, names: Sequence[str]) -> Figure:
        curves = {name: _curve(self.groups[name]) for name in names}
        return spread_figure(curves, "map sets evaluated", self._highest)

    def _save(self, what: str, caption: str, figure: Figure) -> StudyFigure:
        name = re.sub(r"[^A-Za-z0-9]+", "_", self.judge).strip("_")
        return _save(self.folder / f"{what}_{name}", caption, figure)


def _curve(runs: Sequence[StudyRun]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Best fitness so far of every run at common numbers of evaluations."""
    steps = [[row["evaluations"] for row in run.generations] for run in runs]
    if any(len(of_run) == 1 for of_run in steps):
        return np.array([steps[0][-1]], dtype=float), np.array([[run.generations[-1]["best"]] for run in runs])
    places = np.unique(np.concatenate(steps)).astype(float)
    places = places[places >= max(of_run[0] for of_run in steps)]
    best = [np.array([row["best"] for row in run.generations]) for run in runs]
    rows = [values[np.searchsorted(of_run, places, "right") - 1] for of_run, values in zip(steps, best, strict=True)]
    return places, np.array(rows)


def _best_set_figures(folder: Path, best: BestSet) -> list[StudyFigure]:
    """Figures of the best set of one configuration."""
    name, seed = best.run.configuration.name, best.run.seed
    shown = [driven for driven in best.maps if driven.episodes]
    figures = []
    if shown:
        titles = [f"{driven.name}: {driven.reading}" for driven in shown]
        drawn = map_set_figure([driven.episodes for driven in shown], titles, best.loaded.controllers)
        caption = (
            f"Best set of {name} (seed {seed}, fitness {best.run.fitness:.2f}) with all trajectories; crosses mark "
            "recoveries (thesis, figures 5.3 and 5.5)"
        )
        figures.append(_save(folder / f"best_{name}", caption, drawn))
    solved = [entry for entry in best.run.seen["maps"] if entry["values"] is not None]
    if solved:
        curves = [list(entry["values"].values()) for entry in solved]
        drawn = lorenz_figure(curves, [f"{entry['name']} ({entry['reading']:.3f})" for entry in solved])
        figures.append(_save(folder / f"lorenz_{name}", f"Lorenz curves of the best set of {name}", drawn))
    if best.run.fresh is not None:
        caption = f"Times of the best set of {name} on fresh seeds; dots are single runs that reached the goal"
        figures.append(_save(folder / f"times_{name}", caption, times_figure(*_fresh_times(best))))
    return figures


def _fresh_times(best: BestSet) -> tuple[dict[str, list[list[float]]], list[str]]:
    """Times of the successful runs on fresh seeds: per controller, per map; and the maps' names."""
    results = best.run.fresh.results if best.run.fresh else ()
    times = {
        name: [[one.time_s for one in of_map[place] if one.success] for of_map in results]
        for place, name in enumerate(best.run.experiment.plan.names)
    }
    return times, [entry["name"] for entry in best.run.seen["maps"]]


def _save(stem: Path, caption: str, figure: Figure) -> StudyFigure:
    png, svg = save_figure(figure, stem)
    return StudyFigure(caption, png, svg)
