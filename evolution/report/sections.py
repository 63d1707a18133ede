"""Sections of the page about a run, by name: the built-in ones, then third-party ones.

A third-party section is a function that takes the :class:`~evolution.runs.LoadedRun` and returns a
:class:`~evolution.report.page.Section`, or None for no section.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from copy import deepcopy
from statistics import fmean
from typing import Any

from evolution.pictures import FIGURES
from evolution.report.page import Attachment, Section, Table, picture, tables_of
from evolution.runs import HELD_OUT, OUTLIER, LoadedRun, objectives_in, summary_of_map
from gym_mapbench.errors import MapBenchError, PluginError
from gym_mapbench.generator import MotifGenes
from gym_mapbench.registry import Registry, must_be_callable
from gym_mapbench.world.genome import Genome

CAPTIONS = {
    "best_maps": "The best maps: one run of each controller, and the times of all runs",
    "convergence": "Best fitness over the evaluations",
    "times": "Travel times per map and controller: bars are medians, dots single runs, rings outliers",
    "front": "Pareto front in the search and on held-out seeds among all solved sets; hypervolume over evaluations",
    "lorenz": "Lorenz curves of the times that chose the set: far from the diagonal, the times differ more",
}

GENERATIONS = {
    "generation": "generation",
    "evaluations": "map sets",
    "best": "best fitness",
    "median": "median",
    "mean_success_rate": "runs at the goal",
}
FITNESS_NOTE = (
    "Fitness of the population after each generation; lower is better. A fitness above 0 is a sum of penalties for "
    "failed runs or for maps without the wanted differences."
)

TIMES = ("map", "score", "controller", "runs", "median s", "min s", "max s", "outliers", "recoveries", "outcome")
TIMES_NOTE = (
    "Times of all recorded runs that reached the goal: runs on the seeds of the search and, after a validation, on "
    f"held-out seeds. An outlier takes more than {OUTLIER:g} times the median. The search chose the map by the score, "
    "which does not contain the held-out runs."
)

FRONT_NOTE = (
    "Every objective is minimised. Held-out values are medians over trials on seeds that the search has not used; a "
    "set remains on the front if no other re-evaluated set dominates it. The sets are in the directory front."
)

GENES = ("map", "motif", "route", "elements", "shared genes", "largest deviation")
GENES_NOTE = "Lengths are m, phases shares of the pitch, deviations of elements shares of the width of a gene's range."


def tables_section(run: LoadedRun) -> Section:
    """The runs on the best map set, and every generation."""
    generations = tables_of("Generations", GENERATIONS, run.generations, FITNESS_NOTE)
    tables = [_times_table(run), *_genes_tables(run), *_front_tables(run), *generations]
    return Section("Tables", tables=tables, id="tables")


def figures_section(run: LoadedRun) -> Section:
    """The run's figures that exist."""
    return Section("Figures", figures=figures_of(run), id="figures")


SECTIONS: Registry[Callable[[LoadedRun], Section | None]] = Registry(
    "report section", "report_sections", {"tables": tables_section, "figures": figures_section}, check=must_be_callable
)
"""The sections by name. The built-in ones, those of installed packages, and registered ones are on every page."""


def sections_of(run: LoadedRun, also: Iterable[str] = ()) -> tuple[list[Section], list[str]]:
    """Return the sections about a run.

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
    """Make one section; a third party's gets a copy of the run, so that it cannot change the rest of the page."""
    with SECTIONS.blamed(name):
        section = SECTIONS.get(name)(run if name in SECTIONS.built_in else deepcopy(run))
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
    """Return what else a reader must know of a figure of this run."""
    if name == "convergence" and run.config["search"].get("archive", {}).get("elite"):
        return "; it rises where a re-evaluation with further seeds gives a set a worse fitness"
    return ""


def _times_table(run: LoadedRun) -> Table:
    rows = [row for entry in run.best_results["maps"] for row in _times_rows(entry)]
    return Table("The best map set", TIMES, rows, TIMES_NOTE)


def _times_rows(entry: Mapping[str, Any]) -> list[list[str | float | int]]:
    """Return a row for each controller on a map."""
    score = float("nan") if entry["score"] is None else entry["score"]
    rows: list[list[str | float | int]] = []
    for one in summary_of_map(entry["name"], entry["runs"]).controllers:
        results = entry["runs"][one.controller]
        ends = [min(one.times), max(one.times)] if one.times else [float("nan")] * 2
        known = [result["metrics"].get("n_recoveries", float("nan")) for result in results]
        recoveries = fmean(known) if known else float("nan")
        outcomes = ", ".join(sorted({result["outcome"] for result in results})) or "no run"
        counts = [one.runs, one.median, *ends, len(one.outliers), recoveries]
        rows.append([entry["name"], score, one.controller, *counts, outcomes])
    return rows


def _genes_tables(run: LoadedRun) -> list[Table]:
    """Return a table of the genes of the best maps that are built of motifs; none if there are no such maps."""
    genomes = {scenario.name: scenario.genome for scenario in run.best if scenario.genome is not None}
    rows = [row for name, genome in genomes.items() for row in _genes_rows(name, genome)]
    return [Table("The genes of the best maps", GENES, rows, GENES_NOTE)] if rows else []


def _genes_rows(name: str, genome: Genome) -> list[list[str | float | int]]:
    """Return a row for each section of a map."""
    genes = MotifGenes.from_mapping(genome.genes, "genes")
    route = f"bent ({genes.route.bend:.2f})" if genes.route.name == "bent" else genes.route.name
    return [
        [
            name,
            section.motif or genome.family,
            route,
            len(section.elements),
            ", ".join(f"{gene} {value:.2f}" for gene, value in section.shared.items()),
            max((abs(value) for one in section.elements for value in one.values()), default=0.0),
        ]
        for section in genes.sections
    ]


def _front_tables(run: LoadedRun) -> list[Table]:
    """Return the table of the Pareto front; none for a search of one objective."""
    if not run.front:
        return []
    names = objectives_in(run.front)
    columns = {
        "set": "set",
        **{name: name for name in names},
        **{f"held-out {name}": HELD_OUT + name for name in names},
    }
    columns |= {"goals": "goals", "runs": "runs", "remains on the front": "remains"}
    rows = [["" if row[column] is None else row[column] for column in columns.values()] for row in run.front]
    return [Table("Pareto front", tuple(columns), rows, FRONT_NOTE)]
