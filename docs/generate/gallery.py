"""The gallery: runs that are kept in docs/gallery, whose best sets are driven again for pictures and replays."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from evolution.pictures import best_maps_figure, drive_best, save_figure
from evolution.report import changed_replays, picture, write_report
from evolution.runs import load_run
from gym_mapbench.errors import RunError

KEPT = Path(__file__).parents[1] / "gallery"
"""Directories of runs without what is large and not needed here: the driven maps, figures, timing and the store."""


def gallery_files(folder: Path) -> Iterator[Path]:
    """Drive every kept set again; write its page with replays, and its picture.

    Raises:
        RunError: If the code drives otherwise than when the set was evolved.
    """
    for kept in sorted(path for path in KEPT.iterdir() if path.is_dir()):
        run = load_run(kept)
        maps = drive_best(run)
        if changed := changed_replays(run, maps):
            raise RunError(f"{kept}: evolve this set again, for the code drives otherwise now: {changed[0]}")
        yield write_report(kept, folder / f"replays_{kept.name}.html")
        figure = best_maps_figure(maps, run.controllers)
        if figure is None:
            raise RunError(f"{kept}: nothing could be driven")
        (drawn,) = save_figure(figure, folder / f"set_{kept.name}", formats=("png",))
        drawn.write_bytes(picture(kept.name, drawn.read_bytes()).content)
        yield drawn
