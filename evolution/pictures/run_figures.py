"""The figures of one run directory."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from evolution.driving import Job, drive
from evolution.files import counted
from evolution.pictures.map_figures import DrivenMap, map_set_figure
from evolution.pictures.pareto_figure import pareto_figure
from evolution.pictures.plots import convergence_figure, lorenz_figure, times_figure
from evolution.pictures.style import FORMATS, save_figure
from evolution.runs import LoadedRun, experiment_in, summary_of_map, typical_repeat
from gym_mapbench.errors import PluginError
from gym_mapbench.metrics.episode import Episode

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOG = logging.getLogger(__name__)

FIGURES = "figures"
Recorded = Episode | str
"""A re-run, or why it failed."""
Apply = Callable[[Callable[[Job], Recorded], Iterable[Job]], Iterable[Recorded]]


def drive_best(run: LoadedRun, apply: Apply = map) -> list[DrivenMap]:
    """Re-run one repeat of the best map set with the seeds of the search, and record it.

    The repeat is the one nearest to the median times. Runs that ended in an ``error`` have no trajectory and are left
    out, and so is a run that a third party's code now fails in, with a warning.

    Args:
        run: The run of the search.
        apply: Applies a function to jobs, for example :meth:`evolution.driving.Evaluator.map`.

    Raises:
        UntrustedError: If the run's experiment names code.
    """
    plan, maps = experiment_in(run).plan, recorded_maps(run)
    jobs = []
    for scenario, entry, recorded in zip(run.best, run.best_results["maps"], maps, strict=True):
        failed = {name for name, runs in entry["runs"].items() if not runs or runs[0]["outcome"] == "error"}
        numbers = [number for number, name in enumerate(plan.names) if name not in failed]
        jobs.append([plan.job(scenario, number, recorded.repeat) for number in numbers])
    recorded_runs = iter(apply(_recorded, [job for of_map in jobs for job in of_map]))
    return [
        replace(recorded, episodes=tuple(_episodes(islice(recorded_runs, len(of_map)), of_map)))
        for recorded, of_map in zip(maps, jobs, strict=True)
    ]


def _recorded(job: Job) -> Recorded:
    """Run a job; returns the reason if a third party's code fails."""
    try:
        return drive(job)
    except PluginError as error:
        return str(error)


def _episodes(recorded_runs: Iterable[Recorded], jobs: Iterable[Job]) -> Iterator[Episode]:
    """Yield the runs that did not fail, and warn of the others."""
    for run, job in zip(recorded_runs, jobs, strict=True):
        if isinstance(run, str):
            LOG.warning("no replay of %s on %s: %s", job.controller.name, job.scenario.name, run)
        else:
            yield run


def recorded_maps(run: LoadedRun) -> list[DrivenMap]:
    """Return the best map set as the search recorded it, without trajectories."""
    return [
        DrivenMap(summary_of_map(entry["name"], entry["runs"]), typical_repeat(entry))
        for entry in run.best_results["maps"]
    ]


def write_run_figures(
    run: LoadedRun, maps: Sequence[DrivenMap] | None = None, formats: Sequence[str] = FORMATS, apply: Apply = map
) -> list[Path]:
    """Draw convergence, best maps with trajectories, times, Lorenz curves and a Pareto front into ``figures/``.

    Args:
        run: The run of the search.
        maps: What :func:`drive_best` returned; it is called if None.
        formats: Formats of the files.
        apply: As for :func:`drive_best`.
    """
    folder = run.figures or run.path / FIGURES
    maps = drive_best(run, apply) if maps is None else maps
    written = save_figure(convergence_figure(_convergence(run)), folder / "convergence", formats)
    if drawn := best_maps_figure(maps, run.controllers):
        written += save_figure(drawn, folder / "best_maps", formats)
    times = times_figure(_times(run), [driven.name for driven in maps])
    written += save_figure(times, folder / "times", formats)
    if drawn := solved_lorenz_figure(run.best_results["maps"]):
        written += save_figure(drawn, folder / "lorenz", formats)
    if run.front:
        written += save_figure(pareto_figure(run.front, run.individuals), folder / "front", formats)
    return written


def _convergence(run: LoadedRun) -> dict[str, tuple[list[float], list[float]]]:
    """Return the best fitness over the evaluations, without penalties, beside which nothing else could be seen."""
    shown = [row for row in run.generations if row["best"] <= 0] or run.generations
    left_out = len(run.generations) - len(shown)
    name = f"best (without {counted(left_out, 'generation')} of penalties)" if left_out else "best"
    return {name: ([row["evaluations"] for row in shown], [row["best"] for row in shown])}


def best_maps_figure(maps: Sequence[DrivenMap], controllers: Sequence[str]) -> Figure | None:
    """Draw the maps of a set with all trajectories; None if no run was recorded."""
    shown = [driven for driven in maps if driven.episodes]
    return map_set_figure(shown, controllers) if shown else None


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
