"""The result of an atlas, and the directory that holds it.

::

    atlas.json        experiment and options, and the versions it was begun with
    results.sqlite    every run, as it ends
    maps.json         the map of each cell, as a map set
    set_NAME.json     the best set of these maps for the fitness NAME
    elites.csv        the map of each cell: time ratios, quality, boundary length, median times
    history.csv       after each batch: runs, maps, filled cells, coverage, QD score
    summary.json      coverage and QD score before and after the re-evaluation, and the runs on held-out seeds
    report.html       the grid; a click on a cell shows the map with a replay
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from pydantic import Field

from evolution.driving import RunResult, derive_seed
from evolution.files import (
    DirectoryKind,
    Document,
    Row,
    Table,
    Tabled,
    advising,
    counted,
    read_document,
    write_json,
    write_text,
)
from evolution.quality_diversity.elites import Elite, boundary_length
from evolution.quality_diversity.grid import Axes
from evolution.quality_diversity.search import AtlasSearch, GridFigures
from evolution.quality_diversity.sets import best_set_of, best_sets_of
from evolution.quality_diversity.settings import AtlasSettings
from evolution.search import Experiment
from gym_mapbench.errors import RunError
from gym_mapbench.mapio import load_map_set, save_map_set
from gym_mapbench.world.scenario import MapSet

ATLAS = DirectoryKind("map-atlas", "atlas.json", format_version=1, remade=True)
MAPS, SUMMARY, REPORT, ELITES, HISTORY = "maps.json", "summary.json", "report.html", "elites.csv", "history.csv"
COUNTS = ("dropped", "displaced", "runs", "held_out_runs")
"""Numbers of ``summary.json``, which has those of :class:`AtlasSearch`."""
FAILURES = ("unsolved", "failures")
"""Counts by name in ``summary.json``, which has those of :class:`AtlasSearch`."""


class EliteSummary(Document):
    """An elite in ``summary.json``."""

    cell: list[int]
    found_in: list[int]
    ratios: list[float]
    quality: float
    results: list[list[RunResult]]


class AtlasSummary(Document):
    """``summary.json``."""

    searched: GridFigures
    held_out: GridFigures
    dropped: int
    displaced: int
    runs: int
    held_out_runs: int
    elites: list[EliteSummary]
    history: list[Row]
    unsolved: dict[str, int] = Field(default_factory=dict)
    failures: dict[str, int] = Field(default_factory=dict)


@dataclass(frozen=True)
class Atlas(Tabled):
    """A filled atlas.

    Args:
        experiment: Families and mutation of the maps, controllers, world.
        settings: Options of the search.
        found: The elites, and how well the grid is filled.
    """

    experiment: Experiment
    settings: AtlasSettings
    found: AtlasSearch

    @property
    def axes(self) -> Axes:
        """The axes of the grid."""
        return Axes.of(self.settings, self.experiment.plan.names)

    @property
    def elites(self) -> tuple[Elite, ...]:
        """The map of each filled cell, in order of the cells."""
        return self.found.elites

    @property
    def is_of_its_maps(self) -> bool:
        """Whether all runs have the seeds of the experiment on these maps; if not, files of two atlases are mixed."""
        root, names = self.experiment.plan.root_seed, self.experiment.plan.names
        return all(len(one.results) == len(names) for one in self.elites) and all(
            run.seed == derive_seed(root, one.scenario.world_digest, name, repeat)
            for one in self.elites
            for name, runs in zip(names, one.results, strict=True)
            for repeat, run in enumerate(runs, start=self.settings.repeats)
        )

    def best_set(self, fitness: str) -> MapSet:
        """Return the best set of its maps for a fitness; arguments and errors as for :func:`best_set_of`."""
        return best_set_of(self.elites, self.experiment, fitness)[0]

    @property
    def tables(self) -> Mapping[str, Callable[[], Table]]:
        """``elites``, ``coverage``, ``sets`` and ``history``."""
        return {
            "elites": lambda: Table(self._row(one) for one in self.elites),
            "coverage": self._coverage,
            "sets": lambda: Table(best_sets_of(self.elites, self.experiment)[1]),
            "history": lambda: Table(self.found.history),
        }

    def _coverage(self) -> Table:
        stages = (("search", self.found.searched), ("held-out seeds", self.found.held_out))
        return Table(
            {"seeds": what, "cells": one.cells, "coverage": one.coverage, "QD score": one.qd_score}
            for what, one in stages
        )

    def sentences(self) -> list[str]:
        """Return the result in words."""
        found, moved = self.found, sum(one.moved for one in self.elites)
        return [
            f"After {found.runs} of {counted(self.settings.runs, 'run')}, {_in_words(found.searched)}.",
            *self._end(),
            *self._unsolved(),
            f"After {counted(found.held_out_runs, 'run')} on held-out seeds, {_in_words(found.held_out)}.",
            f"Maps that a controller failed on a held-out seed: {found.dropped}. Maps that came to a cell with a "
            f"better map: {found.displaced}. Maps in another cell than in the search: {moved}.",
        ]

    def _end(self) -> list[str]:
        """Say why runs are left; nothing if none is."""
        left, most = self.settings.runs - self.found.runs, len(self.experiment.controllers) * self.settings.repeats
        if left >= most:
            return ["No further new map was found."]
        return [f"Another map may need {most}, so it was not begun."] if left else []

    def _unsolved(self) -> list[str]:
        """Say on how many maps a controller failed, which, and how; nothing if none did."""
        failed, failures = self.found.unsolved, self.found.failures
        if not failed:
            return []
        named = ", ".join(f"{name} on {count}" for name, count in failed.items())
        ends = ", ".join(f"{outcome.replace('_', ' ')} on {count}" for outcome, count in failures.items())
        maps = self.found.history[-1]["maps"]
        return [
            f"Maps without a cell because a controller failed: {sum(failed.values())} of {maps}. The first to fail: "
            f"{named}.{f' How: {ends}.' if ends else ''}"
        ]

    def write(self, path: Path) -> None:
        """Write everything but the page into its directory."""
        if self.elites:
            save_map_set(MapSet(tuple(one.scenario for one in self.elites)), path / MAPS)
        for name, map_set in best_sets_of(self.elites, self.experiment)[0].items():
            save_map_set(map_set, path / f"set_{name}.json")
        write_text(path / ELITES, self.table().to_csv())
        write_text(path / HISTORY, self.table("history").to_csv())
        write_json(path / SUMMARY, self.document())

    def document(self) -> Row:
        """Return everything but the maps, JSON-able."""
        found = self.found
        counts = {name: getattr(found, name) for name in COUNTS}
        figures = {"searched": found.searched._asdict(), "held_out": found.held_out._asdict()}
        elites = [_elite_document(one) for one in self.elites]
        return {
            **counts,
            **figures,
            **{name: dict(getattr(found, name)) for name in FAILURES},
            "sets": list(self.table("sets")),
            "elites": elites,
            "history": list(found.history),
        }

    def _row(self, elite: Elite) -> Row:
        names = self.experiment.plan.names
        times = {
            f"{name} s": median(run.time_s for run in runs) for name, runs in zip(names, elite.results, strict=True)
        }
        return {
            "map": elite.scenario.name,
            **dict(zip(self.axes.names, elite.ratios, strict=True)),
            "quality": elite.quality,
            "boundary m": boundary_length(elite.scenario.map),
            **times,
            "moved": "yes" if elite.moved else "no",
        }


def _in_words(figures: GridFigures) -> str:
    share, score = 100 * figures.coverage, figures.qd_score
    filled = counted(figures.cells, "cell is filled", "cells are filled")
    return f"{filled} ({share:.0f} % of all cells), with a QD score of {score:.1f}"


def load_atlas(path: Path) -> Atlas:
    """Return the atlas in a directory.

    Raises:
        RunError: If it is not finished, damaged, or mixed with another atlas.
    """
    config = ATLAS.open(path)
    if not (path / SUMMARY).is_file():
        raise RunError(f"{path}: the atlas was not finished; continue it with --resume")
    where = str(path / ATLAS.mark)
    experiment = Experiment.from_document(config.get("experiment"), where)
    settings = AtlasSettings.from_mapping(config.get("atlas"), f"{where}: atlas")
    with advising():
        atlas = Atlas(experiment, settings, _found(path))
        if not atlas.is_of_its_maps:
            raise RunError(f"{path / SUMMARY}: expected the runs on the maps in {MAPS} with the seed of {ATLAS.mark}")
    return atlas


def _found(path: Path) -> AtlasSearch:
    summary = read_document(AtlasSummary, path / SUMMARY)
    maps = load_map_set(path / MAPS) if summary["elites"] else ()
    try:
        return AtlasSearch(
            elites=tuple(_elite(one, scenario) for one, scenario in zip(summary["elites"], maps, strict=True)),
            history=tuple(summary["history"]),
            searched=GridFigures(**summary["searched"]),
            held_out=GridFigures(**summary["held_out"]),
            **{name: summary.get(name, {}) for name in FAILURES},
            **{name: summary[name] for name in COUNTS},
        )
    except (TypeError, ValueError):  # a result with another key, or more or fewer elites than maps
        raise RunError(f"{path / SUMMARY}: expected the summary of the maps in {MAPS}") from None


def _elite_document(elite: Elite) -> Row:
    return {
        "cell": list(elite.cell),
        "found_in": list(elite.found_in),
        "ratios": list(elite.ratios),
        "quality": elite.quality,
        "results": [[vars(run) for run in runs] for runs in elite.results],
    }


def _elite(document: Mapping[str, Any], scenario: Any) -> Elite:
    results = tuple(tuple(RunResult(**run) for run in runs) for runs in document["results"])
    cells = tuple(document["cell"]), tuple(document["found_in"])
    return Elite(scenario, *cells, tuple(document["ratios"]), document["quality"], results)
