"""Reads the runner's CSV file: the runs that the exported ROS 2 package measured in Gazebo."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import NamedTuple

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio.source import as_number, read_text, short

ADDED_LATER = ("contacts", "digest", "simulator", "params")
"""Columns that the runners of older packages did not write."""
COLUMNS = ("map", "controller", "repeat", "outcome", "time_s", "path_length_m", *ADDED_LATER)
RUNNER_OUTCOMES = ("goal", "aborted", "timeout", "error")
MAX_RESULTS_BYTES = 50_000_000


class RunnerResult(NamedTuple):
    """One run as the runner measured it: simulated seconds, path length in m; ``aborted`` means that Nav2 gave up.

    ``contacts`` is how often the robot touched something; None where it was not counted. ``digest`` is that of the map
    with start and goal, ``params`` that of Nav2's parameters and behaviour trees. ``digest``, ``simulator`` and
    ``params`` are empty where they were not written.
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

    @property
    def success(self) -> bool:
        """Whether the goal was reached."""
        return self.outcome == "goal"


def read_runner_results(path: str | Path) -> list[RunnerResult]:
    """Read the runner's CSV file, one line per run.

    Raises:
        MapFormatError: If a column is missing, or a value is out of its range.
    """
    path = Path(path)
    rows = csv.DictReader(io.StringIO(read_text(path, MAX_RESULTS_BYTES)), restval="")
    try:
        missing = {*COLUMNS} - {*ADDED_LATER, *(rows.fieldnames or ())}
        if not missing:
            return [_parse(row, f"{path}: line {number}") for number, row in enumerate(rows, start=2)]
    except csv.Error as error:
        raise MapFormatError(f"{path}: not a CSV file ({error})") from None
    raise MapFormatError(f"{path}: expected the columns {', '.join(COLUMNS)}, missing: {sorted(missing)[0]}")


def _parse(row: dict[str, str], where: str) -> RunnerResult:
    if row["outcome"] not in RUNNER_OUTCOMES:
        raise MapFormatError(
            f"{where}: outcome: expected one of {', '.join(RUNNER_OUTCOMES)}, got {short(row['outcome'])}"
        )
    if not row["map"] or not row["controller"]:
        raise MapFormatError(f"{where}: expected the names of a map and a controller")
    repeat, time, length = (as_number(f"{where}: {name}", row[name]) for name in ("repeat", "time_s", "path_length_m"))
    contacts = as_number(f"{where}: contacts", row["contacts"]) if "contacts" in row else None
    if min(repeat, time, length, contacts or 0) < 0:
        raise MapFormatError(f"{where}: expected repeat, time_s, path_length_m and contacts of 0 or more")
    counted = None if contacts is None else int(contacts)
    said = (row.get(name, "") for name in ("digest", "simulator", "params"))
    return RunnerResult(row["map"], row["controller"], int(repeat), row["outcome"], time, length, counted, *said)
