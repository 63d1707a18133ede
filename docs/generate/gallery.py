"""The gallery: evolved sets that are kept in docs/gallery, driven again for pictures and replays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from evolution.pictures import DrivenMap, best_maps_figure, drive_best, save_figure, write_run_figures
from evolution.report import picture
from evolution.report.of_run import changed_replays, report_of_run
from evolution.report.page import render_page
from evolution.runs import LoadedRun, RunDir
from gym_mapbench.errors import RunError

KEPT = Path(__file__).parents[1] / "gallery"
"""Directories of runs without what is large: the driven maps, the table of all runs and the store."""


def gallery_names() -> list[str]:
    """Names of the kept sets."""
    return sorted(path.name for path in KEPT.iterdir() if path.is_dir())


def kept_run(name: str) -> LoadedRun:
    """Read a kept run; its tables of individuals and runs are empty."""
    kept = RunDir.open(KEPT / name)
    checkpoint, results = kept.checkpoint, kept.read_best_results()
    assert checkpoint is not None
    best = kept.read_best(results["map_set"])
    return LoadedRun(kept.path, kept.config, checkpoint, kept.read_generations(), [], [], best, results, [])


def gallery_files(folder: Path) -> Iterator[Path]:
    """Drive every kept set again; write its page with replays, and its picture."""
    for name in gallery_names():
        run = kept_run(name)
        maps = drive_best(run)
        if changed := changed_replays(run, maps):
            raise RunError(f"{run.path}: evolve this set again, for the code drives otherwise now: {changed[0]}")
        page = folder / f"replays_{name}.html"
        page.write_text(_page(run, maps), encoding="utf-8")
        yield page
        figure = best_maps_figure(maps, run.controllers)
        assert figure is not None
        (drawn,) = save_figure(figure, folder / f"set_{name}", formats=("png",))
        drawn.write_bytes(picture(name, drawn.read_bytes()).content)
        yield drawn


def _page(run: LoadedRun, maps: list[DrivenMap]) -> str:
    """Return the page that ``mapbench report`` would write."""
    with TemporaryDirectory() as drawn:
        shown = replace(run, figures=Path(drawn))
        write_run_figures(shown, maps)
        return render_page(report_of_run(shown, maps))
