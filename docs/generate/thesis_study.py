"""The repetition of the thesis' study: searches that are kept for the site, so that it can be run in parts.

``python -m docs.generate.thesis_study runs/study``, from the root of the project, adds a study's finished searches.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from docs.generate.gallery import save_small
from evolution.files import Row, csv_of, write_text
from evolution.pictures import best_maps_figure, drive_best
from evolution.runs import load_run
from evolution.studies.analysis.loading import load_results
from evolution.studies.analysis.results import StudyRun
from evolution.studies.analysis.tables import map_rows

KEPT = Path(__file__).parents[1] / "concepts" / "thesis"
COLUMNS = {
    "runs": ("fitness", "held_out_fitness", "rank_agreement", "held_out_success_rate", "cluster_scale"),
    "generations": ("evaluations", "best"),
    "times": ("map", "score", "controller", "mean_s", "min_s", "max_s", "goals", "runs"),
}
"""The kept tables, by file, with their columns besides configuration and seed."""
KINDS: dict[str, Callable[[str], Any]] = {
    **dict.fromkeys(("configuration", "map", "controller"), str),
    **dict.fromkeys(("seed", "evaluations", "goals", "runs"), int),
}
"""What the columns are that are not numbers with decimals."""
DRAWN = ("gini_40", "cluster")
"""Configurations whose best set the thesis draws (Figures 5.3 and 5.5)."""


def keep(study: Path) -> None:
    """Add the searches of a study to the kept tables, and draw its best sets if they are better than the kept ones."""
    results = load_results(study)
    known = kept_fitness()
    for name, runs in results.by_configuration.items():
        best = min(runs, key=lambda run: run.fitness)
        if name in DRAWN and best.fitness < min(known.get(name, {}).values(), default=np.inf):
            _draw_best(best)
    found = {
        "runs": results.rows(),
        "generations": results.rows("generations"),
        "times": [row for run in results.runs for row in map_rows(run)],
    }
    for name, rows in found.items():
        write_text(KEPT / f"{name}.csv", csv_of(_merged(kept(name), [_of_columns(name, row) for row in rows])))


def kept(name: str) -> list[Row]:
    """Return the rows of a kept table; none if it is not there yet."""
    path = KEPT / f"{name}.csv"
    rows = csv.DictReader(path.read_text(encoding="utf-8").splitlines()) if path.is_file() else ()
    return [{column: KINDS.get(column, float)(text) for column, text in row.items() if text} for row in rows]


def kept_fitness() -> dict[str, dict[int, float]]:
    """Return the reported fitness of the kept searches by configuration and seed."""
    found: dict[str, dict[int, float]] = {}
    for row in kept("runs"):
        found.setdefault(row["configuration"], {})[row["seed"]] = row["fitness"]
    return found


def best_times(configuration: str) -> dict[str, list[Row]]:
    """Return the times on the best kept set, s, by map: one row of ``times.csv`` for each controller."""
    found = kept_fitness()[configuration]
    best = min(found, key=found.__getitem__)
    maps: dict[str, list[Row]] = {}
    for row in kept("times"):
        if (row["configuration"], row["seed"]) == (configuration, best):
            maps.setdefault(row["map"], []).append(row)
    return maps


def _draw_best(run: StudyRun) -> None:
    """Draw the best set of a run with its trajectories."""
    loaded = load_run(run.path)
    figure = best_maps_figure(drive_best(loaded), loaded.controllers)
    if figure is not None:
        save_small(figure, KEPT / f"best_{run.configuration.name}")


def _of_columns(name: str, row: Row) -> Row:
    """Return a row of a study with the kept columns alone."""
    return {column: row.get(column) for column in ("configuration", "seed", *COLUMNS[name])}


def _merged(old: Iterable[Row], new: Sequence[Row]) -> list[Row]:
    """Return both, new searches in place of old ones, by configuration and seed."""
    again = {_search_of(row) for row in new}
    rows = [*(row for row in old if _search_of(row) not in again), *new]
    return sorted(rows, key=_search_of)


def _search_of(row: Row) -> tuple[str, int]:
    return row["configuration"], row["seed"]


if __name__ == "__main__":
    keep(Path(sys.argv[1]))
