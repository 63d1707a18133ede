"""Answers: the results of the runs as the page shows them, with the statistics of ``mapbench bench``."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from statistics import median

import numpy as np

from evolution.benchmark import Configuration, ParameterComparison, bench_row, verdict_of_pairs
from evolution.driving import Job, RunResult
from evolution.files import Row
from evolution.play.messages.replies import Answer, AnswerRow, Run
from evolution.play.plans import PlannedVariant
from evolution.play.streaming import Waypoint
from evolution.search import gini

ONE_RUN = "One run of each cannot tell a difference from chance. More repeats can, with noise."
Results = Mapping[str, Sequence[tuple[Job, RunResult]]]
"""Jobs and results of each variant, by its name, repeat by repeat."""


def run_message(number: int, variant: str, job: Job, result: RunResult, end: Waypoint | None) -> Run:
    """Return the result of a run.

    Args:
        number: The ``drive``.
        variant: Name of the variant.
        job: The run.
        result: Its result.
        end: Its last pose; None if it sent none.
    """
    row = bench_row(job, result)
    return Run(
        id=number,
        variant=variant,
        repeat=job.repeat,
        outcome=result.outcome,
        time=result.time_s,
        length=result.path_length_m,
        clearance=row.get("min_clearance"),
        recoveries=int(row.get("n_recoveries") or 0),
        sentence=result.reason,
        where=None if result.success or end is None else end[1:3],
    )


def answer_message(
    number: int, variants: Sequence[PlannedVariant], results: Results, command: list[str], files: list[str]
) -> Answer:
    """Return what all runs say together."""
    table = [_row(name, [bench_row(*one) for one in runs]) for name, runs in results.items()]
    return Answer(
        id=number,
        table=table,
        verdict=_verdict(variants, results),
        gini=gini_of([row.time for row in table]),
        command=command,
        files=files,
    )


def gini_of(times: Sequence[float | None]) -> float | None:
    """Return the Gini coefficient of the times of variants; None if one has none, or there is only one."""
    known = [time for time in times if time is not None]
    return float(gini(known)) if len(known) == len(times) > 1 else None


def median_time(results: Sequence[RunResult]) -> float | None:
    """Return the median time of the runs at the goal, s; None if there is none."""
    return _median([result.time_s for result in results if result.success])


def _row(name: str, rows: Sequence[Row]) -> AnswerRow:
    """Return the runs of one variant together."""
    goals = [row for row in rows if row["outcome"] == "goal"]
    times = [row["time_s"] for row in goals]
    quartiles = np.percentile(times, (25, 75)).tolist() if times else (None, None)
    return AnswerRow(
        variant=name,
        runs=len(rows),
        outcomes={outcome: count / len(rows) for outcome, count in Counter(row["outcome"] for row in rows).items()},
        time=_median(times),
        time_from=quartiles[0],
        time_to=quartiles[1],
        length=_median([row["path_length_m"] for row in goals]),
        clearance=_median([row["min_clearance"] for row in goals if row.get("min_clearance") is not None]),
        recoveries=sum(row.get("n_recoveries") or 0 for row in rows) / len(rows),
    )


def _verdict(variants: Sequence[PlannedVariant], results: Results) -> list[str]:
    """Return who is better, and how certain that is, as ``mapbench bench`` says it of parameter sets."""
    if len(variants) < 2:
        return []
    if variants[0].plan.repeats == 1:
        return [ONE_RUN]
    rows = tuple(
        {"configuration": name, **bench_row(job, result)} for name, runs in results.items() for job, result in runs
    )
    configurations = tuple(Configuration(one.variant.name, one.plan) for one in variants)
    return verdict_of_pairs(ParameterComparison(rows, (), configurations=configurations))


def _median(values: Sequence[float]) -> float | None:
    return median(value for value in values if math.isfinite(value)) if values else None
