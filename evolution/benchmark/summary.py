"""Summary tables: the scores of controllers and their differences, every value with its interval in one cell."""

from __future__ import annotations

from collections.abc import Sequence

from evolution.benchmark.configurations import ParameterComparison
from evolution.benchmark.scores import MEANS, SHARES
from evolution.files import Row, Table

WITH_INTERVALS = "Rates and means with 95 % intervals; times, lengths, clearance, smoothness: of runs at the goal"
PAIRED = "The same, paired by map and noise; p of the times by Wilcoxon's test, corrected by Holm"
TESTED = "Tests in pairs on the same map and noise: McNemar (success), Wilcoxon (time), p-values corrected by Holm"
LABELS = {"spl": "SPL", "ms": "ms a control step"}
"""Names of means for a reader, where they are not clear."""


def table_of_scores(rows: Sequence[Row], metrics: Sequence[str] = ()) -> Table:
    """Return a table with a line for every rate and mean, and a column for every controller.

    Args:
        rows: As :func:`~evolution.benchmark.scores.score_rows` returns them.
        metrics: Further metrics that the rows have; each gets a line.
    """
    lines = [(f"{name} %", name, 100.0) for name in SHARES]
    lines += [(LABELS.get(name, name), name, 1.0) for name in dict.fromkeys([*MEANS, *metrics])]
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


def table_of_compared(comparison: ParameterComparison) -> Table:
    """Return a table with a line for every configuration; each value has its interval."""
    columns = {"success %": ("success", 100.0), "mean s": ("mean s", 1.0), "clearance m": ("clearance m", 1.0)}
    columns |= {name: (name, 1.0) for name in comparison.metrics}
    return Table(
        [
            {
                "configuration": row["configuration"],
                "goals": f"{row['goals']}/{row['runs']}",
                **{label: _with_interval(row, name, factor) for label, (name, factor) in columns.items()},
            }
            for row in comparison.table("configurations")
        ],
        WITH_INTERVALS,
    )


def table_of_comparisons(comparison: ParameterComparison) -> Table:
    """Return a table with a line for every two configurations: units won and lost, ratio of times, p-values."""
    return Table(
        [
            {
                "pair": f"{row['second']} against {row['first']}",
                "n": row["n"],
                "better on": row["wins"],
                "worse on": row["losses"],
                "p success": row["p_success_holm"],
                "both at goal": row["both"],
                "time ratio": _ratio(row),
                "p time": row["p_time_holm"],
            }
            for row in comparison.pairs
        ],
        TESTED,
    )


def _ratio(row: Row) -> str:
    """Write the ratio of times with its interval, if it has one."""
    return _with_interval({"r": row["time_ratio"], "r from": row["ratio_low"], "r to": row["ratio_high"]}, "r")


def _of_pair(row: Row) -> Row:
    return {
        "pair": f"{row['second']} against {row['first']}",
        "pairs": row["pairs"],
        "success gained %": _with_interval(row, "gained", 100.0),
        "both at goal": row["both"],
        "faster, s": _with_interval(row, "faster s"),
        "p time": row["p_time_holm"],
    }


def _with_interval(row: Row, name: str, factor: float = 1.0) -> str:
    """Write a value with its interval, if it has one."""
    value, low, high = (row[key] for key in (name, f"{name} from", f"{name} to"))
    if value is None:
        return ""
    interval = "" if low is None else f" ({factor * low:.3g} to {factor * high:.3g})"
    return f"{factor * value:.3g}{interval}"
