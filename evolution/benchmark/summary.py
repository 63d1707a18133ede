"""Summary tables: the scores of controllers and their differences, every value with its interval in one cell."""

from __future__ import annotations

from collections.abc import Sequence

from evolution.benchmark.scores import MEANS, SHARES
from evolution.files import Row, Table

WITH_INTERVALS = "Rates and means with 95 % intervals; times, lengths, clearance, smoothness: of runs at the goal"
PAIRED = "The same, paired by map and noise"
LABELS = {"spl": "SPL", "ms": "ms a control step"}
"""Names of means for a reader, where they are not clear."""


def table_of_scores(rows: Sequence[Row]) -> Table:
    """Return a table with a line for every rate and mean, and a column for every controller.

    Args:
        rows: As :func:`~evolution.benchmark.scores.score_rows` returns them.
    """
    lines = [(f"{name} %", name, 100.0) for name in SHARES]
    lines += [(LABELS.get(name, name), name, 1.0) for name in MEANS]
    return Table(
        [
            {"over all maps": label, **{row["controller"]: _with_interval(row, name, factor) for row in rows}}
            for label, name, factor in lines
        ],
        WITH_INTERVALS,
    )


def table_of_pairs(rows: Sequence[Row]) -> Table:
    """Return a table with a line for every two controllers.

    Args:
        rows: As :func:`~evolution.benchmark.scores.pair_rows` returns them.
    """
    return Table(map(_of_pair, rows), PAIRED)


def _of_pair(row: Row) -> Row:
    return {
        "pair": f"{row['second']} against {row['first']}",
        "pairs": row["pairs"],
        "success gained %": _with_interval(row, "gained", 100.0),
        "both at goal": row["both"],
        "faster, s": _with_interval(row, "faster s"),
    }


def _with_interval(row: Row, name: str, factor: float = 1.0) -> str:
    """Write a value with its interval, if it has one."""
    value, low, high = (row[key] for key in (name, f"{name} from", f"{name} to"))
    if value is None:
        return ""
    interval = "" if low is None else f" ({factor * low:.3g} to {factor * high:.3g})"
    return f"{factor * value:.3g}{interval}"
