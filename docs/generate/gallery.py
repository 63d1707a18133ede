"""The gallery: runs that are kept in docs/gallery, whose best sets are re-run for pictures and replays.

``python -m docs.generate.gallery runs/mine NAME``, from the root of the project, keeps a finished run.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from docs.generate.markdown import table
from evolution.files import csv_of, read_csv, write_text
from evolution.pictures import DrivenMap, best_maps_figure, drive_best, save_figure
from evolution.report import changed_replays, picture, replay_page, write_report
from evolution.runs import LoadedRun, load_run
from gym_mapbench.errors import RunError

KEPT = Path(__file__).parents[1] / "gallery"
WHOLE = ("config.json", "checkpoint.json", "generations.csv", "best_map_set.json", "best_results.json")
"""Files of a run that are copied; its tables of individuals and runs are reduced to the last generation."""


def keep(run: Path, name: str) -> None:
    """Copy the files of a finished run that the site needs into the gallery."""
    folder = KEPT / name
    folder.mkdir(parents=True)
    for file in WHOLE:
        shutil.copy(run / file, folder)
    individuals = read_csv(run / "individuals.csv")
    last = [row for row in individuals if row["generation"] == individuals[-1]["generation"]]
    maps = {value for row in last for key, value in row.items() if key.startswith("map_") and key != "map_set"}
    write_text(folder / "individuals.csv", csv_of(last))
    write_text(folder / "runs.csv", csv_of([row for row in read_csv(run / "runs.csv") if row["map"] in maps]))


def gallery_files(folder: Path) -> Iterator[Path]:
    """Re-run every kept set; write its page, its replays alone, and its picture.

    Raises:
        RunError: If a run ends otherwise than when the set was evolved.
    """
    for kept in sorted(path for path in KEPT.iterdir() if path.is_dir()):
        run = load_run(kept)
        maps = drive_best(run)
        if changed := changed_replays(run, maps):
            raise RunError(f"{kept}: evolve this set again, because its runs have changed: {changed[0]}")
        yield write_report(kept, folder / f"replays_{kept.name}.html")
        write_text(alone := folder / f"replay_{kept.name}.html", replay_page(run, maps))
        yield alone
        yield save_best_maps(run, maps, folder / f"set_{kept.name}")


def save_best_maps(run: LoadedRun, maps: Sequence[DrivenMap], stem: Path) -> Path:
    """Write the figure of the best maps of a run, and return its file.

    Raises:
        RunError: If no run could be recorded.
    """
    figure = best_maps_figure(maps, run.controllers)
    if figure is None:
        raise RunError(f"{run.path}: no run could be recorded")
    return save_small(figure, stem)


def save_small(figure: Any, stem: Path) -> Path:
    """Write a figure as PNG with 256 colours, and return its file."""
    (drawn,) = save_figure(figure, stem, formats=("png",))
    drawn.write_bytes(picture(stem.name, drawn.read_bytes()).content)
    return drawn


def kept_times(name: str) -> str:
    """Return a table of the times of every map of a kept set: median, least and greatest over all its runs."""
    run = load_run(KEPT / name)
    maps = run.best_results["maps"]
    rows = [[entry["name"], *(_spread(entry["runs"][controller]) for controller in run.controllers)] for entry in maps]
    outcomes = [one["outcome"] for entry in maps for runs in entry["runs"].values() for one in runs]
    goals = f"{outcomes.count('goal')} of {len(outcomes)} runs reach the goal."
    return (
        table(["map", *(f"{one}, s" for one in run.controllers)], rows) + f"\n\n*Median (least to greatest). {goals}*"
    )


def _spread(runs: Sequence[Mapping[str, Any]]) -> str:
    times = [one["time_s"] for one in runs]
    return f"{median(times):.2f} ({min(times):.2f} to {max(times):.2f}), {len(times)} runs"


if __name__ == "__main__":
    keep(Path(sys.argv[1]), sys.argv[2])
