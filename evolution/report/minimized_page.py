"""The page of a minimisation: the map before and after side by side, with replays."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import yaml

from evolution.driving import JobPlan, drive
from evolution.files import counted, write_text
from evolution.minimizing import Minimized
from evolution.report.page import Report, Section, command_of, page_tables, render_page
from evolution.report.replays import ReplayedMap


def write_minimized_report(result: Minimized, plan: JobPlan, page: Path, arguments: Sequence[str] = ()) -> None:
    """Write the page of a minimisation; the runs of the first seed are re-run for the replays.

    Args:
        result: The minimisation.
        plan: Controllers, world and seed of its runs.
        page: The file.
        arguments: The command line after ``mapbench``; empty if it was started from Python.
    """
    before, after = result.table()
    maps = [
        ReplayedMap(
            f"{row['map']}: {counted(row['obstacles'], 'obstacle')}",
            [drive(plan.job(scenario, number, 0)) for number in range(len(plan.controllers))],
            sample=f"Verdict on held-out seeds: {row['verdict on held-out seeds']}. Replay: the first seed.",
        )
        for row, scenario in ((before, result.before), (after, result.after))
    ]
    steps = page_tables("Smaller maps, in order", result.table("steps"))
    tables = [*page_tables("Maps", result.table()), *steps]
    report = Report(
        title=f"Smallest map: {result.keep}",
        subtitle=f"{result.before.name}; {', '.join(plan.names)}; seed {plan.root_seed}",
        verdict=result.sentences(),
        command=command_of(arguments, "minimize"),
        configuration=yaml.safe_dump(plan.settings.model_dump(mode="json"), sort_keys=False),
        maps=maps,
        sections=[Section("Tables", (), tables, id="tables")],
    )
    write_text(page, render_page(report))
