"""The page of an atlas: a grid of maps; a click on a cell shows its map with a replay."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import median

import numpy as np
import yaml

from evolution.driving import JobPlan, drive
from evolution.files import counted, write_text
from evolution.quality_diversity import ELITES, HISTORY, Atlas, Elite
from evolution.report.cell_grid import CellGrid, FilledCell
from evolution.report.page import Report, Section, command_of, download, page_tables, render_page
from evolution.report.replays import ReplayedMap

ABOUT = (
    "Each cell holds the simplest reliable map with these ratios of the controllers' times, at its place after the "
    "re-evaluation on held-out seeds. Empty cells have no such map."
)
SETS = (
    "The best set of the atlas' maps for each fitness, found exactly. Its value is on the held-out seeds that it is "
    "chosen by; re-evaluate the set with mapbench bench for an unbiased value."
)


def write_atlas_report(atlas: Atlas, page: Path, arguments: Sequence[str] = ()) -> None:
    """Write the page of an atlas; the first held-out run of each controller is re-run for the replays.

    Args:
        atlas: The atlas.
        page: The file.
        arguments: The command line after ``mapbench``; empty if it was started from Python.
    """
    experiment = atlas.experiment
    names = experiment.plan.names
    tables = [one for caption, name in TABLES for one in page_tables(caption, atlas.table(name))]
    report = Report(
        title=f"Atlas: {' and '.join(atlas.axes.names)}",
        subtitle=f"{', '.join(names)}; {counted(atlas.found.runs, 'run')}; seed {experiment.search.seed}",
        verdict=atlas.sentences(),
        command=command_of(arguments, "atlas"),
        configuration=yaml.safe_dump(
            {"atlas": atlas.settings.model_dump(mode="json"), **experiment.document()}, sort_keys=False
        ),
        grid=_grid(atlas),
        maps=[_replayed(atlas, elite) for elite in atlas.elites],
        group_name="Cell",
        sections=[Section("Tables", [SETS], tables, id="tables")],
        downloads=[download(ELITES, atlas.table().to_csv()), download(HISTORY, atlas.table("history").to_csv())],
    )
    write_text(page, render_page(report))


TABLES = (
    ("Coverage and QD score before and after the re-evaluation", "coverage"),
    ("Best sets", "sets"),
    ("Maps of the cells", ""),
)


def _grid(atlas: Atlas) -> CellGrid:
    axes, cells = atlas.axes, {one.cell: one for one in atlas.elites}
    centres = [f"{ratio:.2f}" for ratio in np.sqrt(axes.edges[1:] * axes.edges[:-1])]
    several = len(axes.names) > 1
    ups = range(axes.cells) if several else [None]
    rows = [[_filled(atlas, cells.get(_cell(column, up))) for column in range(axes.cells)] for up in ups]
    vertical = (f"time ratio {axes.names[1]}", centres) if several else ("", ())
    return CellGrid("Atlas", ABOUT, (f"time ratio {axes.names[0]}", centres), vertical, rows)


def _cell(column: int, up: int | None) -> tuple[int, ...]:
    return (column,) if up is None else (column, up)


def _filled(atlas: Atlas, elite: Elite | None) -> FilledCell | None:
    return None if elite is None else FilledCell(elite.scenario.name, _title(atlas, elite), elite.scenario.map)


def _title(atlas: Atlas, elite: Elite) -> str:
    """Return the ratios and the median times on the map of a cell."""
    ratios = (f"{name} {ratio:.2f}" for name, ratio in zip(atlas.axes.names, elite.ratios, strict=True))
    names = atlas.experiment.plan.names
    times = (
        f"{name} {median(run.time_s for run in runs):.1f} s" for name, runs in zip(names, elite.results, strict=True)
    )
    return f"{elite.scenario.name}: {', '.join(ratios)}; {', '.join(times)}"


def _replayed(atlas: Atlas, elite: Elite) -> ReplayedMap:
    experiment = atlas.experiment
    plan = JobPlan(experiment.controllers, experiment.run, experiment.search.seed)
    repeat = atlas.settings.repeats
    episodes = [drive(plan.job(elite.scenario, number, repeat)) for number in range(len(plan.controllers))]
    seeds = atlas.settings.held_out_seeds
    sample = f"Medians of {seeds} held-out seeds. Replay: the first of them."
    sample = sample if seeds > 1 else "Times and replay: the held-out seed."
    return ReplayedMap(_title(atlas, elite), episodes, elite.scenario.name, sample)
