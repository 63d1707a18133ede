"""The tables of a study as rows: summaries (thesis, Table 5.2), tests, and maps (thesis, Tables 5.3 and 5.4)."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from evolution.driving import RunResult
from evolution.files import Row, csv_of, make_directory, write_text
from evolution.statistics import TestResult, cliffs_delta, vargha_delaney_a12
from evolution.studies.analysis.comparisons import Comparison, StudyAnalysis
from evolution.studies.analysis.held_out import held_out_rows
from evolution.studies.analysis.reported_fitness import reported_fitness_rows
from evolution.studies.analysis.results import StudyRun
from evolution.studies.former_names import StudyRow

TABLES = "tables"


def write_tables(analysis: StudyAnalysis, directory: Path) -> list[Path]:
    """Write every table of a study as CSV into ``tables/`` of a directory; returns the files."""
    folder, results, comparisons = directory / TABLES, analysis.results, analysis.comparisons
    make_directory(folder)
    tables: dict[str, Callable[[], list[Row]]] = {
        "runs": results.rows,
        "reevaluation": lambda: results.rows("reevaluation"),
        "generations": lambda: results.rows("generations"),
        "summary": lambda: [row for one in comparisons for row in summary_rows(one)],
        "tests": lambda: [row for one in comparisons for row in test_rows(one)],
        "pairs": lambda: [row for one in comparisons for row in pair_rows(one)],
        "ranks": lambda: [row for one in comparisons for row in rank_rows(one)],
        "maps": lambda: [row for run in results.runs for row in map_rows(run)],
        "measures": lambda: [row for run in results.runs for row in measure_rows(run)],
        "repeats": lambda: held_out_rows(results),
        "reported_fitness": lambda: reported_fitness_rows(results),
    }
    for name, rows in tables.items():
        write_text(folder / f"{name}.csv", csv_of(rows()))
    return [folder / f"{name}.csv" for name in tables]


def summary_rows(comparison: Comparison) -> list[Row]:
    """Table 5.2: one row per configuration, the best median first; the interval is of the median (bootstrap, 95 %)."""
    rows = []
    for name in comparison.order:
        one = comparison.summaries[name]
        row = {"configuration": name, "n": one.n, "mean": one.mean, "std": one.std, "median": one.median}
        row |= {"min": one.minimum, "max": one.maximum, "ci_low": one.ci_low, "ci_high": one.ci_high}
        rows.append({"judge": comparison.judge, "quantity": comparison.quantity, **row})
    return rows


def test_rows(comparison: Comparison) -> list[Row]:
    """Tests over several configurations at once: Kruskal-Wallis over populations, Friedman over seeds."""
    friedman = comparison.ranking.test if comparison.ranking else None
    tests = [*comparison.populations, *([] if friedman is None else [friedman])]
    return [{"judge": comparison.judge, "quantity": comparison.quantity, **_test_row(test)} for test in tests]


test_rows.__test__ = False  # type: ignore[attr-defined]  # not a test, whatever its name looks like to pytest


def _test_row(test: TestResult) -> Row:
    return {
        "test": test.test,
        "groups": ", ".join(test.groups),
        "n": ", ".join(map(str, test.n)),
        "statistic": test.statistic,
        "p_value": test.p_value,
        "effect": test.effect,
        "effect_name": test.effect_name,
    }


def pair_rows(comparison: Comparison) -> list[Row]:
    """Every pair of configurations, ``first`` with the better median: Mann-Whitney with Holm's correction.

    ``a12`` is the chance that a run of ``first`` is better. Pairs that differ by construction have no test.
    """
    tested = [_pair_row(comparison, pair.groups, pair.statistic, pair.p_value) for pair in comparison.pairs]
    return [*tested, *[_pair_row(comparison, pair, math.nan, math.nan) for pair in comparison.by_construction]]


def _pair_row(comparison: Comparison, pair: tuple[str, ...], u: float, p_holm: float) -> Row:
    first, second = pair
    better, worse = comparison.values[first], comparison.values[second]
    return {
        "judge": comparison.judge,
        "quantity": comparison.quantity,
        "first": first,
        "second": second,
        "median_difference": comparison.summaries[first].median - comparison.summaries[second].median,
        "u": u,
        "p_holm": p_holm,
        "a12": vargha_delaney_a12(worse, better),
        "cliffs_delta": cliffs_delta(worse, better),
        "n_first": comparison.summaries[first].n,
        "n_second": comparison.summaries[second].n,
        "by_construction": "yes" if (first, second) in comparison.by_construction else "",
    }


def rank_rows(comparison: Comparison) -> list[Row]:
    """Mean ranks over the seeds that all configurations share, with the critical difference."""
    ranking = comparison.ranking
    if ranking is None:
        return []
    common = {"critical_difference": ranking.critical_difference, "seeds": len(ranking.seeds)}
    order = np.argsort(ranking.ranks, kind="stable")
    return [
        {
            "judge": comparison.judge,
            "quantity": comparison.quantity,
            "configuration": ranking.names[i],
            "mean_rank": float(ranking.ranks[i]),
            **common,
        }
        for i in order
    ]


def map_rows(run: StudyRun) -> list[Row]:
    """Tables 5.3 and 5.4: the best set of a run on held-out seeds, one row per map and controller.

    Times are those of the runs that reached the goal; ``searched_s`` is their mean in the search.
    """
    if run.reevaluation is None:
        return []
    names = run.experiment.names
    return [
        StudyRow(
            {
                "configuration": run.configuration.name,
                "seed": run.seed,
                "map": entry["name"],
                "score": entry["score"],
                "controller": name,
                "searched_s": _mean([one["time_s"] for one in entry["runs"][name] if one["outcome"] == "goal"]),
                **times_row(results),
            }
        )
        for entry, of_map in zip(run.best_results["maps"], run.reevaluation.results, strict=True)
        for name, results in zip(names, of_map, strict=True)
    ]


def measure_rows(run: StudyRun) -> list[Row]:
    """All other measures on held-out seeds: their means over the runs that reached the goal."""
    if run.reevaluation is None:
        return []
    return [
        {
            "configuration": run.configuration.name,
            "seed": run.seed,
            "map": entry["name"],
            "controller": name,
            "path_length": _mean([one.path_length_m for one in results if one.success]),
            **{key: _mean([one.metrics[key] for one in results if one.success]) for key in _metrics(results)},
        }
        for entry, of_map in zip(run.best_results["maps"], run.reevaluation.results, strict=True)
        for name, results in zip(run.experiment.names, of_map, strict=True)
    ]


def _metrics(results: Sequence[RunResult]) -> list[str]:
    """Return the names of the metrics that all successful runs have."""
    good = [one.metrics for one in results if one.success]
    return [name for name in good[0] if all(name in metrics for metrics in good)] if good else []


def times_row(results: Sequence[RunResult]) -> Row:
    """Mean, extremes and spread of the successful runs' times, and how the others ended."""
    times = np.array([one.time_s for one in results if one.success])
    others = Counter(one.outcome for one in results if not one.success)
    return {
        "mean_s": _mean(times.tolist()),
        "min_s": float(times.min()) if len(times) else float("nan"),
        "max_s": float(times.max()) if len(times) else float("nan"),
        "std_s": float(times.std(ddof=1)) if len(times) > 1 else float("nan"),
        "goals": len(times),
        "runs": len(results),
        "otherwise": ", ".join(f"{count} {outcome}" for outcome, count in sorted(others.items())),
    }


def _mean(values: Sequence[float]) -> float:
    known = [value for value in values if np.isfinite(value)]
    return float(np.mean(known)) if known else float("nan")
