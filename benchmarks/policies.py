"""Tables of policies beside Nav2's controllers: ``python benchmarks/policies.py fair15 policy path`` reads results.

The results are a directory of `mapbench bench`.

The first table has shares and means of every controller, the others the paired differences of each named policy to
the controllers that are not named before it. Times, lengths, clearances and smoothness are means over the runs that
reached the goal. The intervals are 95 %: Wilson's for shares, else of bootstraps, over maps, or over tasks
where there are fewer than five maps.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean

import numpy as np
from run_tables import MISSING, is_goal, of, over_maps, share_and_ends

from evolution import load
from evolution.benchmark.paired import Unit, Values, groups_of, paired_rows, place_of, unit_of
from evolution.files import Row
from evolution.statistics import mean_interval

OUTCOMES = {"success": "goal", "collision": "collision", "time-out": "timeout"}
SPL = "spl"
"""The only measure that failed runs have as well."""
MEASURES = {
    "time, s": ("time_s", 1.0, 1),
    "SPL": (SPL, 1.0, 3),
    "length, m": ("path_length_m", 1.0, 2),
    "least clearance, m": ("min_clearance", 1.0, 3),
    "path smoothness, 1e-6": ("path_smoothness", 1e6, 1),
}
"""Column, factor and decimals of each row."""


def means(rows: Sequence[Row]) -> dict[str, str]:
    """Return the cells of one controller."""
    cells = {}
    for name, outcome in OUTCOMES.items():
        found = share_and_ends(rows, lambda row, outcome=outcome: row["outcome"] == outcome)  # type: ignore[misc]
        cells[f"{name}, %"] = "{:.1f} ({:.1f} to {:.1f})".format(*found)
    for title, (column, factor, digits) in MEASURES.items():
        values = [(str(row["map"]), factor * float(row[column])) for row in rows if column == SPL or is_goal(row)]
        cells[title] = over_maps(values, np.mean, digits)
    return cells


def differences(policy: Sequence[Row], other: Sequence[Row]) -> dict[str, str]:
    """Return the cells of another controller beside a policy."""
    pairs = paired_rows(policy, other)
    unit = unit_of(place_of(a) for a, _ in pairs)
    both = [(a, b) for a, b in pairs if is_goal(a) and is_goal(b)]
    more = [(place_of(a), 100.0 * (is_goal(b) - is_goal(a))) for a, b in pairs]
    faster = [(place_of(a), float(a["time_s"]) - float(b["time_s"])) for a, b in both]
    return {
        "success, points more": _mean(more, unit, 1),
        "seconds faster where both arrive": f"{_mean(faster, unit, 2)}, {len(both)} runs" if both else MISSING,
    }


def _mean(values: Values, unit: Unit, digits: int) -> str:
    """Return the mean with its interval over the units."""
    low, high = mean_interval(groups_of(values, unit))
    interval = "" if math.isnan(low) else f" ({low:.{digits}f} to {high:.{digits}f})"
    return f"{fmean(value for _, value in values):.{digits}f}{interval}"


def print_table(corner: str, columns: dict[str, dict[str, str]]) -> None:
    """Print a table with a column of cells for each controller."""
    print(f"| {corner} | " + " | ".join(columns) + " |")
    print("|---" * (1 + len(columns)) + "|")
    for title in next(iter(columns.values())):
        print(f"| {title} | " + " | ".join(cells[title] for cells in columns.values()) + " |")
    print()


def main() -> None:
    """Read and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path, help="directory of `mapbench bench`")
    parser.add_argument("policies", nargs="+", metavar="NAME", help="controller with a table of paired differences")
    parser.add_argument("--title", default="", help="of the first table")
    args = parser.parse_args()
    rows = load(args.results).rows
    runs = {str(name): of(rows, controller=name) for name in dict.fromkeys(row["controller"] for row in rows)}
    if unknown := [name for name in args.policies if name not in runs]:
        parser.error(f"policies: expected some of {', '.join(runs)}, got {', '.join(unknown)}")
    print_table(args.title, {name: means(own) for name, own in runs.items()})
    for number, policy in enumerate(args.policies, start=1):
        others = [name for name in runs if name not in args.policies[:number]]
        print_table(f"paired with {policy}", {name: differences(runs[policy], runs[name]) for name in others})


if __name__ == "__main__":
    main()
