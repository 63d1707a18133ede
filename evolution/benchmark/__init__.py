"""Benchmark: controllers compared on given maps.

In: scenarios and controllers, or times measured in Gazebo on the same maps. Out: rows of measures, BARN scores, and the
agreement of two sets of times.
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
from evolution.benchmark.comparison import Comparison, compare, our_times, times_of_results
from evolution.benchmark.directory import BENCHMARK, begin_benchmark, benchmark_document
from evolution.benchmark.paired import PairedComparison, Trial, compare_paired, compare_rows
from evolution.benchmark.reevaluation import reevaluation_in, reevaluation_sentence
from evolution.benchmark.rules import MEASURES, Rule, broken, read_rule
from evolution.benchmark.runs import BENCH, Benchmark, bench, bench_row, read_bench
from evolution.benchmark.scores import pair_rows, score_rows
from evolution.benchmark.summary import table_of_pairs, table_of_scores

__all__ = [
    "BENCH",
    "BENCHMARK",
    "MEASURES",
    "PREFIX",
    "BarnScore",
    "Benchmark",
    "Comparison",
    "PairedComparison",
    "Rule",
    "Trial",
    "barn_settings",
    "begin_benchmark",
    "bench",
    "bench_row",
    "benchmark_document",
    "broken",
    "compare",
    "compare_paired",
    "compare_rows",
    "correlation_with",
    "load_barn",
    "our_times",
    "pair_rows",
    "read_bench",
    "read_rule",
    "reevaluation_in",
    "reevaluation_sentence",
    "reference_of",
    "score_rows",
    "score_runs",
    "table_of_pairs",
    "table_of_scores",
    "times_of_results",
]
