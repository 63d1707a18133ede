"""Benchmark: every controller on every scenario, and what came out of it as rows."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from evolution.driving import Evaluator, Job, JobPlan, OnRun, RunResult
from gym_mapbench.scenario import Scenario


@dataclass(frozen=True)
class BenchRun:
    """One driven run of a benchmark."""

    job: Job
    result: RunResult

    def row(self) -> dict[str, Any]:
        """All fields of the run, JSON-able; a measure that is not a number is None."""
        measures = {**self.result.metrics, **self.result.timings}
        return {
            "map": self.job.scenario.name,
            "controller": self.job.controller.name,
            "repeat": self.job.repeat,
            "seed": self.result.seed,
            "outcome": self.result.outcome,
            "time_s": self.result.time_s,
            "path_length_m": self.result.path_length_m,
            "reason": self.result.reason,
            **{name: value if math.isfinite(value) else None for name, value in measures.items() if name != "time"},
        }


def bench(
    scenarios: Sequence[Scenario], plan: JobPlan, evaluator: Evaluator, on_run: OnRun | None = None
) -> list[BenchRun]:
    """Drive every controller on every scenario as ``plan`` says; in the order of scenarios and controllers."""
    jobs = [job for scenario in scenarios for job in plan.jobs(scenario)]
    return [BenchRun(job, result) for job, result in zip(jobs, evaluator.run(jobs, on_run), strict=True)]


def summary_rows(runs: Sequence[BenchRun]) -> list[tuple[str, ...]]:
    """One row per map and controller: goals, times and measures of the successful runs, how the others ended.

    The measures are length, clearance, recoveries, and whatever was asked for besides.
    """
    groups: dict[tuple[str, str], list[RunResult]] = {}
    for one in runs:
        groups.setdefault((one.job.scenario.name, one.job.controller.name), []).append(one.result)
    asked = runs[0].job.metrics if runs else ()
    return [(name, controller, *_summary(results, asked)) for (name, controller), results in groups.items()]


def _summary(results: Sequence[RunResult], asked: Sequence[str]) -> tuple[str, ...]:
    good = [result for result in results if result.success]
    times = np.array([result.time_s for result in good])
    others = Counter(result.outcome for result in results if not result.success)
    return (
        f"{len(good)}/{len(results)}",
        *(f"{value:.2f}" if len(times) else "-" for value in _spread(times)),
        _mean([result.path_length_m for result in good]),
        _mean([result.metrics["min_clearance"] for result in good]),
        _mean([result.metrics["n_recoveries"] for result in results if result.outcome != "error"]),
        *(_mean([result.metrics[name] for result in good]) for name in asked),
        ", ".join(f"{count} {outcome}" for outcome, count in others.items()),
    )


def _spread(times: np.ndarray[Any, np.dtype[np.float64]]) -> tuple[float, float, float]:
    return (times.mean(), times.min(), times.max()) if len(times) else (math.nan,) * 3


def _mean(values: Sequence[float]) -> str:
    return f"{np.mean(values):.2f}" if values else "-"
