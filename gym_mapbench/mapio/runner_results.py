"""Reads the runner's CSV file: the runs that the exported ROS 2 package measured in Gazebo."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import NamedTuple

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio.source import as_number, read_text, short

ADDED_LATER = ("contacts", "digest", "simulator", "params", "time_limit_s")
"""Columns that the runners of older packages did not write."""
COLUMNS = ("map", "controller", "repeat", "outcome", "time_s", "path_length_m", *ADDED_LATER)
RUNNER_OUTCOMES = ("goal", "aborted", "timeout", "error")
MAX_RESULTS_BYTES = 50_000_000


class RunnerResult(NamedTuple):
    """One run as the runner measured it: simulated seconds, path length in m.

    ``aborted`` means that Nav2 gave up; ``error`` means that the run was not driven, or ended by a fault of the setup.

    ``contacts`` is how often the robot touched something; None where it was not counted. ``digest`` is that of the map
    with start and goal, ``params`` that of Nav2's parameters and behaviour trees, ``time_limit`` the time limit of the
    run in s, as it was written. ``digest``, ``simulator``, ``params`` and ``time_limit`` are empty where they were not
    written.
    """

    map: str
    controller: str
    repeat: int
    outcome: str
    time: float
    path_length: float
    contacts: int | None = None
    digest: str = ""
    simulator: str = ""
    params: str = ""
    time_limit: str = ""

    @property
    def success(self) -> bool:
        """Whether the goal was reached."""
        return self.outcome == "goal"


def read_runner_results(path: str | Path) -> list[RunnerResult]:
    """Read the runner's CSV file, one line per run.

    Raises:
        MapFormatError: If a column is missing or comes twice, a line has another number of cells than the first, or a
            value is out of its range.
    """
    path = Path(path)
    lines = csv.reader(io.StringIO(read_text(path, MAX_RESULTS_BYTES)))
    try:
        columns = next(lines, [])
        _check_columns(path, columns)
        return [_parse(columns, cells, f"{path}: line {lines.line_num}") for cells in lines if cells]
    except csv.Error as error:
        raise MapFormatError(f"{path}: not a CSV file ({error})") from None


def _check_columns(path: Path, columns: list[str]) -> None:
    """Refuse a first line without a column of the first runners, or with a column twice."""
    for name in COLUMNS:
        if name not in (*columns, *ADDED_LATER):
            got = short(",".join(columns))
            raise MapFormatError(f"{path}: expected the columns {', '.join(COLUMNS)}, got {got}, missing: {name}")
        if columns.count(name) > 1:
            raise MapFormatError(f"{path}: expected each column once, got {name} {columns.count(name)} times")


def _parse(columns: list[str], cells: list[str], where: str) -> RunnerResult:
    """Return the run of one line; a comma within a number would move all later cells."""
    if len(cells) != len(columns):
        raise MapFormatError(f"{where}: expected {len(columns)} cells, as in the first line, got {len(cells)}")
    row = dict(zip(columns, cells, strict=True))
    if row["outcome"] not in RUNNER_OUTCOMES:
        raise MapFormatError(
            f"{where}: outcome: expected one of {', '.join(RUNNER_OUTCOMES)}, got {short(row['outcome'])}"
        )
    if not row["map"] or not row["controller"]:
        raise MapFormatError(f"{where}: expected the names of a map and a controller")
    repeat = _count(f"{where}: repeat", row["repeat"])
    time, length = (_measure(f"{where}: {name}", row[name]) for name in ("time_s", "path_length_m"))
    contacts = _count(f"{where}: contacts", row["contacts"]) if "contacts" in row else None
    said = (row.get(name, "") for name in ADDED_LATER[1:])
    return RunnerResult(row["map"], row["controller"], repeat, row["outcome"], time, length, contacts, *said)


def _measure(where: str, text: str) -> float:
    value = as_number(where, text)
    if value < 0:
        raise MapFormatError(f"{where}: expected 0 or more, got {short(text)}")
    return value


def _count(where: str, text: str) -> int:
    value = as_number(where, text)
    if value < 0 or not value.is_integer():
        raise MapFormatError(f"{where}: expected a whole number of 0 or more, got {short(text)}")
    return int(value)
