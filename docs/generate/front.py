"""The pictures of the first screen, ``docs/evolved.png`` and ``docs/controllers.gif``, from the kept run ``quick``.

``python -m docs.generate.front``, from the root of the project, writes both. They are kept in the repository because
README.md shows them without a build of the site.
"""

from __future__ import annotations

from pathlib import Path

from docs.generate.gallery import KEPT, save_best_maps
from evolution.pictures import drive_best, save_comparison
from evolution.runs import load_run

DOCS = Path(__file__).parents[1]
LABELS = {"dwb": "DWB", "mppi": "MPPI", "rpp": "RPP"}


def main() -> None:
    """Write the figure of the set, and the film of its last map.

    Raises:
        RunError: If no run could be recorded.
    """
    run = load_run(KEPT / "quick")
    maps = drive_best(run)
    save_best_maps(run, maps, DOCS / "evolved")
    last = maps[-1]
    title = f"Three Nav2 controllers on an evolved map: {last.recorded_sample}"
    labels = [LABELS[one.controller] for one in last.episodes]
    save_comparison(last.episodes, DOCS / "controllers.gif", title, labels)


if __name__ == "__main__":
    main()
