"""Solve every task of a ``.scen`` file exactly and compare with the length in the file."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.mapio.movingai import ScenTask, map_of_scen, optimal_lengths, read_map_file, read_scen_file

SUMMATION = 1e-3
"""Rounding error allowed in the lengths of a file, cells: some were summed in single precision."""


@dataclass(frozen=True)
class ScenReport:
    """The result of the check.

    Args:
        path: The ``.scen`` file.
        tasks: Number of its tasks.
        solved: Tasks with a path.
        largest_error: Largest difference between our length and the file's among them, cells.
        wrong: Index (from 0) of every task without a path, or off by more than the file's rounding
            (:func:`tolerances`).
        seconds: Wall-clock time of the searches.
    """

    path: Path
    tasks: int
    solved: int
    largest_error: float
    wrong: tuple[int, ...]
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether every task was solved with the file's length."""
        return not self.wrong

    def __str__(self) -> str:
        verdict = "all agree" if self.passed else f"{len(self.wrong)} disagree, the first is task {self.wrong[0]}"
        return (
            f"{self.path}: {self.solved} of {self.tasks} tasks solved, {verdict}; "
            f"largest error {self.largest_error:.1e} cells, {self.seconds:.2f} s"
        )


def check_scen(path: str | Path) -> ScenReport:
    """Solve every task of a ``.scen`` file on the map beside it.

    Raises:
        MapFormatError: If one of the two files is damaged.
    """
    path = Path(path)
    grid = read_map_file(map_of_scen(path))
    tasks = read_scen_file(path, grid.shape)
    begin = time.perf_counter()
    lengths = optimal_lengths(grid, [(task.start, task.goal) for task in tasks])
    seconds = time.perf_counter() - begin
    errors = np.abs(lengths - [task.optimal for task in tasks])
    solved = np.isfinite(lengths)
    return ScenReport(
        path,
        len(tasks),
        int(solved.sum()),
        float(errors[solved].max(initial=0.0)),
        tuple(np.flatnonzero(~(errors <= tolerances(tasks))).tolist()),
        seconds,
    )


def tolerances(tasks: Sequence[ScenTask]) -> NDArray[np.float64]:
    """Return by how much each length may be off, cells: half a unit of its last digit, and the error of a sum.

    Zeros at the end are often not printed. Whether a file prints so many digits after the point or so many in all, a
    length has at least as many after the point as any that is longer, so it is taken to have been printed with those.
    """
    lengths, printed = np.array([task.optimal for task in tasks]), np.array([task.decimals for task in tasks])
    longest_first = np.argsort(-lengths, kind="stable")
    decimals = np.empty(len(tasks))
    decimals[longest_first] = np.maximum.accumulate(printed[longest_first]) if len(tasks) else []
    return SUMMATION + 0.5 * 10.0**-decimals
