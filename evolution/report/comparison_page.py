"""The page of a comparison of parameter sets: verdict, replays side by side, tables, and figures of a sweep."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import yaml

from evolution.benchmark import (
    Configuration,
    ParameterComparison,
    configurations_document,
    score_rows,
    table_of_compared,
    table_of_comparisons,
    table_of_scores,
    verdict_of_comparison,
)
from evolution.driving import drive
from evolution.files import Row, write_text
from evolution.pictures import sweep_figure
from evolution.report.benchmark_page import INTERVALS, maps_and_runs, typical_run
from evolution.report.page import Attachment, Report, Section, command_of, download, page_tables, picture, render_page
from evolution.report.replays import ReplayedMap
from gym_mapbench.errors import RunError
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.scenario import Scenario

LONGEST_TITLE = 60
SWEEP_CAPTIONS = {
    1: "Success and mean time with 95 % intervals; dashed line: own value",
    2: "Success and mean time of each pair of values; cross: own values",
    3: "Success and mean time by the first two parameters, in the mean over the others; cross: own values",
}
"""What the figure of a sweep shows, by the number of its parameters; 3 stands for more as well."""
MOST_MAPS, MOST_SIDES = 12, 6
"""Largest numbers of maps with replays and of replays of one map; more would make the page too large to open."""


def write_comparison_report(result: ParameterComparison, page: Path, arguments: Sequence[str] = ()) -> None:
    """Write the page of a comparison; one run of each side is re-run on the maps where the sides differ most.

    Args:
        result: The comparison, as :func:`evolution.compare` returned it.
        page: The file; see :func:`evolution.report.writing.new_page`.
        arguments: The command line after ``mapbench``; empty if the comparison was started from Python.

    Raises:
        RunError: If the comparison was read from a file, which does not hold its maps, or the page cannot be written.
    """
    if not result.configurations:
        raise RunError(f"{page}: expected a comparison that was just run; a file of results does not hold its maps")
    document = configurations_document(result.scenarios, result.configurations)
    plan = result.configurations[0].plan
    report = Report(
        title="Comparison of parameter sets",
        subtitle=f"{', '.join(result.by_label)} on {maps_and_runs(result.scenarios, plan.repeats)}; "
        f"seed {plan.root_seed}",
        verdict=verdict_of_comparison(result),
        command=command_of(arguments, "compare"),
        configuration=yaml.safe_dump(document, sort_keys=False),
        maps=_replays(result),
        sections=_sections(result),
        downloads=[download(name, content) for name, content in result.files.items()],
        missing=_missing(result),
    )
    write_text(page, render_page(report))


def _sections(result: ParameterComparison) -> list[Section]:
    swept = result.configurations[0].values is not None
    scores = table_of_compared(result) if swept else table_of_scores(result.table(), result.metrics)
    pairs = table_of_comparisons(result)
    tables = [*page_tables("Configurations", scores), *page_tables("Pairs", pairs)]
    parameters = page_tables("Parameters", result.table("parameters"))
    maps = page_tables("Maps, largest differences first", result.table("maps"))
    return [
        *([Section("Sweep", figures=[_figure(result)], id="sweep")] if swept else []),
        Section("Tables", [INTERVALS], tables, id="tables"),
        Section("Keys that differ", (), parameters, id="parameters"),
        Section("Maps", (), maps, id="all-maps"),
    ]


def _figure(result: ParameterComparison) -> Attachment:
    """Return the figure of a sweep, over all controllers together."""
    rows = [
        {**score_rows([{**row, "controller": one.label} for row in result.by_label[one.label]], [one.label])[0]}
        | dict(one.values or {})
        for one in result.configurations
    ]
    own = result.configurations[0].values or {}
    content = io.BytesIO()
    sweep_figure(rows, list(own), own).savefig(content, format="png", dpi=150)
    return picture(SWEEP_CAPTIONS[min(len(own), 3)], content.getvalue())


def _replays(result: ParameterComparison) -> list[ReplayedMap]:
    """Return the replays of the maps where the sides differ most."""
    by_name = {scenario.name: scenario for scenario in result.scenarios}
    shown = list(result.table("maps"))[:MOST_MAPS]
    sides = list(result.sides)[:MOST_SIDES]
    replays = []
    for row in shown:
        episodes = [one for side in sides for one in _episode(result, side, by_name[row["map"]])]
        if episodes:
            title = _title(row, sides)
            sample = "Title: runs at the goal. Replay: the run of each with its median time."
            replays.append(ReplayedMap(title, episodes, sample=sample))
    return replays


def _title(row: Row, sides: Sequence[str]) -> str:
    """Return the name of a map with the goals of each side; the name alone where that is too long."""
    goals = ", ".join(f"{side} {row[f'{side} goals']}" for side in sides)
    return f"{row['map']}: {goals}" if len(goals) <= LONGEST_TITLE else str(row["map"])


def _episode(result: ParameterComparison, side: str, scenario: Scenario) -> list[Episode]:
    """Return the typical run of a side on a map, named after the side; nothing if all runs ended in an error."""
    configuration, number = _owner(result.configurations, side)
    rows = [row for row in result.sides[side] if row["map"] == scenario.name and row["outcome"] != "error"]
    if not rows:
        return []
    job = configuration.plan.job(scenario, number, typical_run(rows)["repeat"])
    return [replace(drive(job), controller=side)]


def _owner(configurations: Sequence[Configuration], side: str) -> tuple[Configuration, int]:
    """Return the configuration of a side and the position of its controller."""
    for one in configurations:
        names = [one.label] if len(one.plan.names) == 1 else [f"{one.label}.{name}" for name in one.plan.names]
        if side in names:
            return one, names.index(side)
    raise KeyError(side)


def _missing(result: ParameterComparison) -> list[str]:
    """Say which replays are left out."""
    maps, sides = len(result.scenarios) - MOST_MAPS, len(result.sides) - MOST_SIDES
    lines = [f"Replays of the {MOST_MAPS} maps with the largest differences only; {maps} more are in the tables."]
    more = [f"Replays of the first {MOST_SIDES} configurations only; {sides} more are in the tables."]
    return [*(lines if maps > 0 else []), *(more if sides > 0 else [])]
