"""Benchmark: controllers compared on given maps.

In: scenarios and controllers, or the times that others measured on our maps. Out: rows of measures, BARN's scores, and
how well two sets of times agree.
"""

from __future__ import annotations

from evolution.benchmark.barn import (
    PREFIX,
    BarnScore,
    barn_settings,
    correlation_with,
    load_barn,
    reference_of,
    score_runs,
)
from evolution.benchmark.comparison import BENCH, Comparison, compare, our_times, times_of_results
from evolution.benchmark.runs import BenchRun, bench, summary_rows

__all__ = [
    "BENCH",
    "PREFIX",
    "BarnScore",
    "BenchRun",
    "Comparison",
    "barn_settings",
    "bench",
    "compare",
    "correlation_with",
    "load_barn",
    "our_times",
    "reference_of",
    "score_runs",
    "summary_rows",
    "times_of_results",
]
