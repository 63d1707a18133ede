"""Benchmark: controllers compared on given maps.

In: scenarios and controllers, or times measured in Gazebo on the same maps. Out: rows of measures, BARN scores, and the
agreement of two sets of times.
"""

from __future__ import annotations

from evolution.benchmark.barn import (
    PREFIX,
    RULED,
    BarnScore,
    barn_settings,
    correlation_with,
    load_barn,
    official_lengths,
    reference_of,
    refuse_ruled,
    score_runs,
)
from evolution.benchmark.comparison import Comparison, check_maps, check_one_setup, compare, our_times, times_of_results
from evolution.benchmark.comparison_verdict import differences_in_words, verdict_of_comparison, verdict_of_pairs
from evolution.benchmark.configurations import (
    Configuration,
    ParameterComparison,
    check_configurations,
    configurations_document,
    run_configurations,
)
from evolution.benchmark.directory import BENCHMARK, begin_benchmark, benchmark_document, map_options
from evolution.benchmark.paired import (
    Place,
    Values,
    compare_rows,
    copies_in_words,
    distinct_pairs,
    few_maps_in_words,
    groups_of,
    maps_in_words,
    paired_rows,
    place_of,
    place_of_task,
    unit_of,
    units_in_words,
)
from evolution.benchmark.parameter_differences import parameter_rows
from evolution.benchmark.parameter_sweep import read_sweep, sweep, swept_controllers
from evolution.benchmark.reading import read_bench
from evolution.benchmark.reevaluation import reevaluation_in, reevaluation_sentence
from evolution.benchmark.rules import MEASURES, Rule, broken, read_rule, runs_by_controller
from evolution.benchmark.runs import BENCH, Benchmark, bench, bench_row
from evolution.benchmark.scores import goals_of_groups, pair_rows, score_rows, too_few_runs, value_of
from evolution.benchmark.summary import table_of_compared, table_of_comparisons, table_of_pairs, table_of_scores
from evolution.benchmark.time_lost import time_lost, without_people

__all__ = [
    "BENCH",
    "BENCHMARK",
    "MEASURES",
    "PREFIX",
    "RULED",
    "BarnScore",
    "Benchmark",
    "Comparison",
    "Configuration",
    "ParameterComparison",
    "Place",
    "Rule",
    "Values",
    "barn_settings",
    "begin_benchmark",
    "bench",
    "bench_row",
    "benchmark_document",
    "broken",
    "check_configurations",
    "check_maps",
    "check_one_setup",
    "compare",
    "compare_rows",
    "configurations_document",
    "copies_in_words",
    "correlation_with",
    "differences_in_words",
    "distinct_pairs",
    "few_maps_in_words",
    "goals_of_groups",
    "groups_of",
    "load_barn",
    "map_options",
    "maps_in_words",
    "official_lengths",
    "our_times",
    "pair_rows",
    "paired_rows",
    "parameter_rows",
    "place_of",
    "place_of_task",
    "read_bench",
    "read_rule",
    "read_sweep",
    "reevaluation_in",
    "reevaluation_sentence",
    "reference_of",
    "refuse_ruled",
    "run_configurations",
    "runs_by_controller",
    "score_rows",
    "score_runs",
    "sweep",
    "swept_controllers",
    "table_of_compared",
    "table_of_comparisons",
    "table_of_pairs",
    "table_of_scores",
    "time_lost",
    "times_of_results",
    "too_few_runs",
    "unit_of",
    "units_in_words",
    "value_of",
    "verdict_of_comparison",
    "verdict_of_pairs",
    "without_people",
]
