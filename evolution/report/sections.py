"""Sections of the page about a run, by name: the built-in ones, then third-party ones.

A third-party section is made by a function of the :class:`~evolution.runs.LoadedRun` that returns a
:class:`~evolution.report.page.Section`, or None where it has nothing to say.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from evolution.pictures import FIGURES
from evolution.report.page import Attachment, Section, Table, picture
from evolution.runs import LoadedRun
from gym_mapbench.errors import MapBenchError, PluginError
from gym_mapbench.registry import Registry, must_be_callable

CAPTIONS = {
    "best_maps": "The best maps with all trajectories; crosses mark recoveries",
    "convergence": "Best fitness over the evaluations",
    "times": "Travel times per map and controller; dots are single runs",
    "lorenz": "Lorenz curves: the further from the diagonal, the less alike the controllers' times",
}

FITNESS_NOTE = (
    "Of the population after each generation. Lower is better; a fitness above 0 is made of penalties, for runs that "
    "failed or maps that do not differ as wanted."
)


def tables_section(run: LoadedRun) -> Section:
    """The runs on the best map set, and every generation."""
    return Section("Tables", tables=[_times_table(run), _generations_table(run)], id="tables")


def figures_section(run: LoadedRun) -> Section:
    """The run's figures that exist."""
    return Section("Figures", figures=figures_of(run), id="figures")


SECTIONS: Registry[Callable[[LoadedRun], Section | None]] = Registry(
    "report section",
    "report_sections",
    {"tables": tables_section, "figures": figures_section},
    check=must_be_callable,
)
"""The sections by name. The built-in ones, those of installed packages, and registered ones are on every page."""


def sections_of(run: LoadedRun, also: Iterable[str] = ()) -> tuple[list[Section], list[str]]:
    """Make the sections about a run.

    Args:
        run: The run.
        also: Names of sections to show in addition to those on every page.

    Returns:
        The sections, and a line for each that failed.
    """
    made, failed = [], []
    for name in dict.fromkeys((*SECTIONS.built_in, *SECTIONS.added(), *also)):
        try:
            section = _section(name, run)
        except MapBenchError as error:
            failed.append(str(error))
        else:
            made += [] if section is None else [section]
    return made, failed


def _section(name: str, run: LoadedRun) -> Section | None:
    with SECTIONS.blamed(name):
        section = SECTIONS.get(name)(run)
    if section is None or isinstance(section, Section):
        return section
    raise PluginError(f"report section {name!r}: expected a Section or None, got a {type(section).__name__}")


def figures_of(run: LoadedRun) -> list[Attachment]:
    """The run's figures that exist, as pictures inside the page."""
    folder = run.figures or run.path / FIGURES
    return [
        picture(caption + _how_to_read(name, run), (folder / f"{name}.png").read_bytes())
        for name, caption in CAPTIONS.items()
        if (folder / f"{name}.png").is_file()
    ]


def _how_to_read(name: str, run: LoadedRun) -> str:
    """Say what else a reader must know of a figure of this run."""
    if name == "convergence" and run.config["search"].get("archive", {}).get("elite"):
        return "; it rises where the maps of a set are driven again with further seeds and do not hold"
    return ""


def _times_table(run: LoadedRun) -> Table:
    rows: list[list[str | float | int]] = []
    for entry in run.best_results["maps"]:
        for name, results in entry["runs"].items():
            times = [one["time_s"] for one in results if one["outcome"] == "goal"]
            spread = [float(np.mean(times)), min(times), max(times)] if times else [float("nan")] * 3
            outcomes = ", ".join(sorted({one["outcome"] for one in results}))
            recoveries = float(np.mean([one["metrics"].get("n_recoveries", np.nan) for one in results]))
            rows.append([entry["name"], name, *spread, recoveries, outcomes])
    return Table("The best map set", ("map", "controller", "mean s", "min s", "max s", "recoveries", "outcome"), rows)


def _generations_table(run: LoadedRun) -> Table:
    columns = {
        "generation": "generation",
        "map sets": "evaluations",
        "best fitness": "best",
        "median": "median",
        "runs at the goal": "mean_success_rate",
    }
    rows = [[row[column] for column in columns.values()] for row in run.generations]
    return Table("Generations", tuple(columns), rows, note=FITNESS_NOTE)
