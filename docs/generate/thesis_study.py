"""The study of the thesis and its repetition, side by side: what is kept of studies, and tables and pictures of it.

``python -m docs.generate.thesis_study runs/study``, from the root of the project, adds the searches of a study
directory to the kept ones, so that a study of days can be run in parts.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import fmean, median, stdev
from typing import Any

import numpy as np

from docs.generate.markdown import table
from evolution.files import Row, csv_of, read_csv, write_text
from evolution.pictures import best_maps_figure, colour_of, drive_best, new_figure, save_figure
from evolution.report import picture
from evolution.runs import load_run
from evolution.statistics import kruskal_wallis
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
THESIS_SIZES = {"gini_20": (-8.57, 1.20, -8.54), "gini_40": (-8.77, 0.85, -8.64), "gini_60": (-8.59, 1.39, -8.69)}
"""Mean, standard deviation and median of the fitness of 24 searches (thesis, Table 5.2), by configuration."""
THESIS_LEAST = {
    "dwb": (9.15, 8.0, 8.4, 7.65, 7.55, 13.83),
    "mppi": (5.95, 6.5, 7.19, 7.48, 6.05, 5.83),
    "rpp": (4.66, 5.23, 5.46, 5.63, 4.54, 4.59),
}
"""Least times of ten runs on the maps of both best sets, s (thesis, Tables 5.3 and 5.4), by controller."""
LABELS = {
    "gini_20": "population 20",
    "gini_40": "population 40",
    "gini_60": "population 60",
    "cluster": "cluster, population 40",
}
"""Configurations of the study ``thesis`` in words."""


def keep(study: Path) -> None:
    """Add the searches of a study to the kept tables, and draw its best sets if none that is kept is better."""
    results = load_results(study)
    known = _fitness_by_configuration()
    for name, runs in results.by_configuration.items():
        best = min(runs, key=lambda run: run.fitness)
        if name in LABELS and best.fitness < min(known.get(name, [np.inf])):
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
    return read_csv(path) if path.is_file() else []


def thesis_sizes() -> str:
    """Return Table 5.2 of the thesis beside ours, and the Kruskal-Wallis test of both."""
    found = _fitness_by_configuration()
    rows = []
    for name, theirs in THESIS_SIZES.items():
        ours = found[name]
        numbers = (fmean(ours), stdev(ours), median(ours))
        rows.append([LABELS[name], "24", *map(_number, theirs), str(len(ours)), *map(_number, numbers)])
    test = kruskal_wallis({name: found[name] for name in THESIS_SIZES})
    heads = [f"{whose}: {what}" for whose in ("thesis", "here") for what in ("n", "mean", "SD", "median")]
    return (
        table(["", *heads], rows) + "\n\n*Reported fitness. Kruskal-Wallis: H = 0.44, p = 0.80 in the thesis, "
        f"H = {test.statistic:.2f}, p = {test.p_value:.2f} here.*"
    )


def thesis_times(configuration: str) -> str:
    """Return Table 5.3 or 5.4 for the best kept set of a configuration: times on ten held-out seeds."""
    found = _fitness_by_seed(configuration)
    seed = min(found, key=found.__getitem__)
    rows = [row for row in kept("times") if (row["configuration"], row["seed"]) == (configuration, seed)]
    maps: dict[str, list[str]] = {}
    for row in rows:
        times = "none" if not row["goals"] else f"{row['mean_s']:.1f} ({row['min_s']:.1f} to {row['max_s']:.1f})"
        maps.setdefault(row["map"], []).append(f"{times}, {row['goals']} of {row['runs']}")
    controllers = dict.fromkeys(row["controller"].upper() for row in rows)
    heads = ["map", *(f"{name}: mean (min to max), s, goals" for name in controllers)]
    return table(heads, [[name, *cells] for name, cells in maps.items()]) + (
        f"\n\n*Seed {seed}, reported fitness {found[seed]:.2f}; held-out seeds with nominal noise.*"
    )


def thesis_speeds() -> str:
    """Return the least times of ten runs on the maps of best sets, and their ratio to RPP's, there and here."""
    ours: dict[str, list[float]] = {}
    for row in kept("times"):
        if row["goals"] and row["configuration"] in LABELS:
            ours.setdefault(row["controller"], []).append(row["min_s"])
    rows = []
    for name, theirs in THESIS_LEAST.items():
        both = ((theirs, THESIS_LEAST["rpp"]), (ours[name], ours["rpp"]))
        cells = [(f"{median(times):.1f}", f"{median(times) / median(rpp):.2f}") for times, rpp in both]
        rows.append([name.upper(), *(cell for pair in cells for cell in pair), str(len(ours[name]))])
    heads = ("thesis: least time, s", "ratio to RPP", "here: least time, s", "ratio to RPP", "maps here")
    return table(["", *heads], rows) + "\n\n*Medians over maps of the least time of ten runs.*"


def sizes_figure() -> Any:
    """Figures 5.1 and 5.2: fitness over the budget, and of the best sets, by population size."""
    figure, (left, right) = new_figure(2, width=9.5, height=3.8)
    _draw_progress(left, list(THESIS_SIZES))
    names, found = list(THESIS_SIZES), _fitness_by_configuration()
    for place, (name, (mean, deviation, _)) in enumerate(THESIS_SIZES.items()):
        colour = colour_of(names, name)
        values = found[name]
        right.plot(np.full(len(values), place - 0.12), values, "o", color=colour, alpha=0.6)
        right.errorbar(place - 0.12, fmean(values), stdev(values), fmt="_", color=colour, markersize=18, capsize=4)
        right.errorbar(place + 0.12, mean, deviation, fmt="_", color="#888888", markersize=18, capsize=4)
    right.errorbar([], [], fmt="_", color="#888888", label="thesis (24 searches), mean and SD")
    right.set_xticks(range(len(names)), [LABELS[name] for name in names], fontsize=8)
    right.set_ylabel("reported fitness (lower is better)")
    right.legend(frameon=False, fontsize=8)
    right.grid(axis="y", alpha=0.3)
    return figure


def cluster_figure() -> Any:
    """Figure 5.4: fitness over the budget with the cluster fitness."""
    figure, (axes,) = new_figure(width=5.5, height=3.4)
    _draw_progress(axes, ["cluster"])
    return figure


def _draw_progress(axes: Any, names: Sequence[str]) -> None:
    """Draw mean and standard deviation of the best fitness so far, over map sets evaluated."""
    for name in names:
        rows = [row for row in kept("generations") if row["configuration"] == name]
        curves: dict[int, list[float]] = {}
        for row in rows:
            curves.setdefault(row["evaluations"], []).append(row["best"])
        places, values = list(curves), np.array(list(curves.values()))
        mean, deviation = values.mean(axis=1), values.std(axis=1, ddof=1)
        colour = colour_of(names, name)
        axes.plot(places, mean, color=colour, label=f"{LABELS[name]} (n = {values.shape[1]})")
        axes.fill_between(places, mean - deviation, mean + deviation, color=colour, alpha=0.15, linewidth=0)
    axes.set_xlabel("map sets evaluated")
    axes.set_ylabel("best fitness, mean and SD")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize=8)


def _draw_best(run: StudyRun) -> None:
    """Draw the best set of a run with its trajectories."""
    loaded = load_run(run.path)
    figure = best_maps_figure(drive_best(loaded), loaded.controllers)
    if figure is not None:
        (drawn,) = save_figure(figure, KEPT / f"best_{run.configuration.name}", formats=("png",))
        drawn.write_bytes(picture("best", drawn.read_bytes()).content)


def _of_columns(name: str, row: Row) -> Row:
    """Return a row of a study with the kept columns alone."""
    return {column: row[column] for column in ("configuration", "seed", *COLUMNS[name])}


def _merged(old: Iterable[Row], new: Sequence[Row]) -> list[Row]:
    """Return both, new searches in place of old ones, by configuration and seed."""
    again = {_search_of(row) for row in new}
    rows = [*(row for row in old if _search_of(row) not in again), *new]
    return sorted(rows, key=_search_of)


def _search_of(row: Row) -> tuple[str, int]:
    return row["configuration"], row["seed"]


def _fitness_by_seed(configuration: str) -> dict[int, float]:
    return {row["seed"]: row["fitness"] for row in kept("runs") if row["configuration"] == configuration}


def _fitness_by_configuration() -> dict[str, list[float]]:
    """Return the reported fitness of the kept searches."""
    return {name: list(of_seed.values()) for name in LABELS if (of_seed := _fitness_by_seed(name))}


def _number(value: float) -> str:
    return f"{value:.2f}"


if __name__ == "__main__":
    keep(Path(sys.argv[1]))
