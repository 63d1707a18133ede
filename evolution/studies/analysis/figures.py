"""The figures of a study: figures 5.1 to 5.5 of the thesis, the selection bias, mean ranks and Lorenz curves."""

from __future__ import annotations

import re
import zlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from evolution.files import counted
from evolution.pictures import (
    FIGURES,
    FORMATS,
    DrivenMap,
    best_maps_figure,
    box_figure,
    critical_difference_figure,
    curse_figure,
    drive_best,
    recorded_maps,
    save_figure,
    solved_lorenz_figure,
    spread_figure,
    times_figure,
)
from evolution.runs import LoadedRun, load_run
from evolution.studies.analysis.comparisons import QUANTITIES, Comparison, StudyAnalysis
from evolution.studies.analysis.judges import Judge
from evolution.studies.analysis.results import StudyResults, StudyRun, reevaluated
from gym_mapbench.errors import MapBenchError, UntrustedError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LONGEST_NAME = 80
"""Largest number of characters of a judge's name in a file name; file systems limit its length."""


@dataclass(frozen=True)
class BestSet:
    """The best set of one configuration by reported fitness (thesis, figures 5.3 and 5.5).

    Args:
        run: The run that found it.
        loaded: Its run directory.
        maps: Its maps, with the runs of the search repeated.
        refused: Why the runs were not repeated, if that would run code that the user does not name.
    """

    run: StudyRun
    loaded: LoadedRun
    maps: tuple[DrivenMap, ...]
    refused: str = ""


@dataclass(frozen=True)
class StudyFigure:
    """A figure: its caption and its picture as PNG."""

    caption: str
    png: Path


def drive_best_sets(results: StudyResults) -> list[BestSet]:
    """Repeat the runs on the best set of every configuration, for figures and replays.

    A run that cannot be loaded or repeated is replaced by the next best; a configuration without any is left out. A run
    that names code is shown as it was recorded.
    """
    found = []
    for runs in results.by_configuration.values():
        for run in sorted(runs, key=lambda run: run.fitness):
            with suppress(MapBenchError):
                found.append(_driven(run))
                break
    return found


def _driven(run: StudyRun) -> BestSet:
    loaded = load_run(run.path)
    try:
        return BestSet(run, loaded, tuple(drive_best(loaded)))
    except UntrustedError as error:
        return BestSet(run, loaded, tuple(recorded_maps(loaded)), str(error))


def write_study_figures(
    analysis: StudyAnalysis, best_sets: Sequence[BestSet], directory: Path, formats: Sequence[str] = FORMATS
) -> list[StudyFigure]:
    """Draw every figure of a study into ``figures/`` of a directory.

    Args:
        analysis: The comparisons of the study.
        best_sets: As :func:`drive_best_sets` returns them.
        directory: The directory.
        formats: PNG first.
    """
    folder = directory / FIGURES
    judged = [_Judged(folder, formats, judge, analysis.of(judge)) for judge in analysis.judges]
    figures = [figure for one in judged for figure in one.draw()]
    return figures + [figure for best in best_sets for figure in _best_set_figures(folder, formats, best)]


@dataclass(frozen=True)
class _Judged:
    """The runs of one judge, and their figures."""

    folder: Path
    formats: Sequence[str]
    judge: Judge
    comparisons: Sequence[Comparison]

    def draw(self) -> list[StudyFigure]:
        """Draw all figures; values on different scales cannot be shown in one figure."""
        if not self.judge.comparable:
            return []
        return [*self.populations(), self.progress(), self.final(), *self.selection_bias(), *self.ranks()]

    def populations(self) -> list[StudyFigure]:
        """Figure 5.1, for every group of configurations that differ only in population size."""
        caption = f"Best fitness so far by population, mean and SD over searches ({self.judge.name}; thesis, 5.1)"
        return [
            self._save(f"populations_{number}", caption, self._curves(test.groups))
            for number, test in enumerate(self.comparisons[0].populations, start=1)
        ]

    def progress(self) -> StudyFigure:
        """Convergence of all methods, baselines included (for one method: figure 5.4)."""
        caption = (
            f"Best fitness so far over the budget, mean and SD over searches; baselines dashed ({self.judge.name}; "
            "thesis, 5.4)"
        )
        return self._save("progress", caption, self._curves(list(self.judge.groups)))

    def final(self) -> StudyFigure:
        """Figure 5.2, reported and held out."""
        boxes = {QUANTITIES[one.quantity]: one.values for one in self.comparisons}
        caption = f"Fitness of the best set of every search ({self.judge.name}; thesis, 5.2)"
        return self._save("final", caption, box_figure(boxes, highest=self._highest))

    def selection_bias(self) -> list[StudyFigure]:
        """Held-out fitness over reported fitness, if a run is re-evaluated."""
        points = {}
        for name, runs in self.judge.groups.items():
            if again := reevaluated(runs):
                points[name] = [run.fitness for run in again], [run.held_out.fitness_as_searched for run in again]
        if not points:
            return []
        caption = (
            "Held-out over reported fitness; above the line: worse than reported; triangles lie beyond the edge "
            f"({self.judge.name})"
        )
        figure = curse_figure(points, self._highest, list(self.judge.groups))
        return [self._save("selection_bias", caption, figure)]

    def ranks(self) -> list[StudyFigure]:
        """Critical-difference diagrams."""
        found = [(one.quantity, one.ranking) for one in self.comparisons if one.ranking is not None]
        return [
            self._save(
                f"ranks_{quantity}",
                f"Mean ranks over {counted(len(ranking.seeds), 'seed')}, {QUANTITIES[quantity]} fitness "
                f"({self.judge.name})",
                critical_difference_figure(ranking.names, ranking.ranks, ranking.critical_difference),
            )
            for quantity, ranking in found
        ]

    @property
    def _highest(self) -> float:
        """Upper end of the fitness axis: the least cost of a set whose runs all failed."""
        return self.judge.experiment.search.judging.base_cost

    def _curves(self, names: Sequence[str]) -> Figure:
        groups = self.judge.groups
        curves = {name: _curve(groups[name]) for name in names}
        baselines = {name for name, runs in groups.items() if runs[0].configuration.method != "ga"}
        return spread_figure(curves, "map sets evaluated", self._highest, list(groups), baselines)

    def _save(self, what: str, caption: str, figure: Figure) -> StudyFigure:
        name = re.sub(r"[^A-Za-z0-9]+", "_", self.judge.name).strip("_")
        if len(name) > LONGEST_NAME:
            name = f"{name[:LONGEST_NAME]}_{zlib.crc32(name.encode()):08x}"
        return _save(self.folder / f"{what}_{name}", self.formats, caption, figure)


def _curve(runs: Sequence[StudyRun]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the best fitness so far of every run at common numbers of evaluations."""
    steps = [[row["evaluations"] for row in run.generations] for run in runs]
    if any(len(of_run) == 1 for of_run in steps):
        return np.array([steps[0][-1]], dtype=float), np.array([[run.generations[-1]["best"]] for run in runs])
    places = np.unique(np.concatenate(steps)).astype(float)
    places = places[places >= max(of_run[0] for of_run in steps)]
    best = [np.array([row["best"] for row in run.generations]) for run in runs]
    rows = [values[np.searchsorted(of_run, places, "right") - 1] for of_run, values in zip(steps, best, strict=True)]
    return places, np.array(rows)


def _best_set_figures(folder: Path, formats: Sequence[str], best: BestSet) -> list[StudyFigure]:
    """Figures of the best set of one configuration."""
    name, seed = best.run.configuration.name, best.run.seed
    figures = []
    if drawn := best_maps_figure(best.maps, best.loaded.controllers):
        caption = (
            f"Best set of {name} (seed {seed}, fitness {best.run.fitness:.2f}) with all trajectories; crosses mark "
            "recoveries (thesis, figures 5.3 and 5.5)"
        )
        figures.append(_save(folder / f"best_{name}", formats, caption, drawn))
    if drawn := solved_lorenz_figure(best.run.best_results["maps"]):
        figures.append(_save(folder / f"lorenz_{name}", formats, f"Lorenz curves of the best set of {name}", drawn))
    if best.run.reevaluation is not None:
        caption = f"Times of the best set of {name} on held-out seeds; dots are single runs that reached the goal"
        figures.append(_save(folder / f"times_{name}", formats, caption, times_figure(*_held_out_times(best))))
    return figures


def _held_out_times(best: BestSet) -> tuple[dict[str, list[list[float]]], list[str]]:
    """Return times of the successful runs on held-out seeds by controller and map, and the names of the maps."""
    results = best.run.reevaluation.results if best.run.reevaluation else ()
    times = {
        name: [[one.time_s for one in of_map[place] if one.success] for of_map in results]
        for place, name in enumerate(best.run.experiment.names)
    }
    return times, [entry["name"] for entry in best.run.best_results["maps"]]


def _save(stem: Path, formats: Sequence[str], caption: str, figure: Figure) -> StudyFigure:
    return StudyFigure(caption, save_figure(figure, stem, formats)[0])
