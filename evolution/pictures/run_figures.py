"""The figures of one run directory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from evolution.driving import drive
from evolution.pictures.plots import (
    FORMATS,
    convergence_figure,
    lorenz_figure,
    map_set_figure,
    save_figure,
    times_figure,
)
from evolution.runs import LoadedRun, experiment_in, typical_repeat
from evolution.search import FITNESSES
from gym_mapbench.metrics.episode import Episode

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES = "figures"
MOST = (10, 90)
"""Percentiles between which the times of most runs lie."""


@dataclass(frozen=True)
class DrivenMap:
    """One map of the best set, driven again exactly as the search saw it.

    Args:
        name: Name of the map.
        score: Its score, in words.
        spreads: By controller, between which times its runs on the map took, in words; none if it drove only once.
        episodes: One repeat of every controller, the one nearest to their median times; none if none was driven.
    """

    name: str
    score: str
    episodes: tuple[Episode, ...]
    spreads: Mapping[str, str] = field(default_factory=dict)


def drive_best(run: LoadedRun) -> list[DrivenMap]:
    """Drive the best map set again with the seeds of the search: the same trajectories, now recorded.

    Runs that ended in an ``error`` are left out: they have no trajectory.

    Raises:
        UntrustedError: If the run's experiment names code.
    """
    plan = experiment_in(run).plan
    driven = []
    for scenario, entry in zip(run.best, run.best_results["maps"], strict=True):
        failed = {name for name, runs in entry["runs"].items() if not runs or runs[0]["outcome"] == "error"}
        repeat = typical_repeat(entry)
        jobs = [plan.job(scenario, number, repeat) for number, name in enumerate(plan.names) if name not in failed]
        driven.append(replace(_recorded(run, entry), episodes=tuple(drive(job) for job in jobs)))
    return driven


def recorded_maps(run: LoadedRun) -> list[DrivenMap]:
    """Return the best map set as the search recorded it, without driving it again."""
    return [_recorded(run, entry) for entry in run.best_results["maps"]]


def _recorded(run: LoadedRun, entry: Mapping[str, Any]) -> DrivenMap:
    spreads = {name: _spread(runs) for name, runs in entry["runs"].items() if len(runs) > 1}
    return DrivenMap(entry["name"], _score(run, entry["score"]), (), spreads)


def _spread(runs: Sequence[Mapping[str, Any]]) -> str:
    """Say between which times most runs took, and how many did not reach the goal."""
    times = [one["time_s"] for one in runs if one["outcome"] == "goal"]
    failed = f"{len(runs) - len(times)} of {len(runs)} failed" if len(times) < len(runs) else ""
    if not times:
        return failed
    low, high = np.percentile(times, MOST)
    return f"{low:.0f} to {high:.0f} s in {len(runs)} drives" + (f", {failed}" if failed else "")


def write_run_figures(
    run: LoadedRun, maps: Sequence[DrivenMap] | None = None, formats: Sequence[str] = FORMATS
) -> list[Path]:
    """Draw convergence, best maps with trajectories, times and Lorenz curves into ``figures/``."""
    folder = run.figures or run.path / FIGURES
    maps = drive_best(run) if maps is None else maps
    written = save_figure(convergence_figure(_convergence(run)), folder / "convergence", formats)
    if drawn := best_maps_figure(maps, run.controllers):
        written += save_figure(drawn, folder / "best_maps", formats)
    times = times_figure(_times(run), [driven.name for driven in maps])
    written += save_figure(times, folder / "times", formats)
    if drawn := solved_lorenz_figure(run.best_results["maps"]):
        written += save_figure(drawn, folder / "lorenz", formats)
    return written


def _convergence(run: LoadedRun) -> dict[str, tuple[list[float], list[float]]]:
    """Return the best fitness over the evaluations, without penalties, beside which nothing else could be seen."""
    shown = [row for row in run.generations if row["best"] <= 0] or run.generations
    left_out = len(run.generations) - len(shown)
    name = f"best (without {left_out} generations of penalties)" if left_out else "best"
    return {name: ([row["evaluations"] for row in shown], [row["best"] for row in shown])}


def best_maps_figure(maps: Sequence[DrivenMap], controllers: Sequence[str]) -> Figure | None:
    """Draw the maps of a set with all trajectories; None if nothing was driven."""
    shown = [driven for driven in maps if driven.episodes]
    titles = [f"{driven.name}: {driven.score}" for driven in shown]
    spreads = [driven.spreads for driven in shown]
    return map_set_figure([driven.episodes for driven in shown], titles, controllers, spreads) if shown else None


def solved_lorenz_figure(entries: Sequence[Mapping[str, Any]]) -> Figure | None:
    """Draw the Lorenz curves of the maps that have a value for every controller; None if there are none.

    Args:
        entries: Maps as in ``best_results.json``.
    """
    solved = [entry for entry in entries if entry["values"] is not None]
    curves = [list(entry["values"].values()) for entry in solved]
    return lorenz_figure(curves, [f"{entry['name']} ({entry['score']:.3f})" for entry in solved]) if solved else None


def _times(run: LoadedRun) -> dict[str, list[list[float]]]:
    """Return the travel times of all successful runs on the best set, by controller and map."""
    return {
        name: [
            [one["time_s"] for one in entry["runs"][name] if one["outcome"] == "goal"]
            for entry in run.best_results["maps"]
        ]
        for name in run.controllers
    }


def _score(run: LoadedRun, value: float | None) -> str:
    name = FITNESSES.get(run.config["search"]["judging"]["fitness"]).score_name
    return "not solved by all" if value is None else f"{name} {value:.3f}"
