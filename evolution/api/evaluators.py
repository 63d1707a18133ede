"""The evaluators of the functions: their workers load the kernels that a plan needs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from evolution.benchmark import BENCHMARK
from evolution.driving import Evaluator, JobPlan, Resources, ResultStore, preparation_of, run_job
from evolution.runs import exclusive_store


@contextmanager
def benchmark_evaluator(kept: Path | None, resources: Resources, plans: Sequence[JobPlan]) -> Iterator[Evaluator]:
    """Yield an evaluator whose results are kept in the directory of a benchmark, or in memory if it is None."""
    prepare = preparation_of((plan.controllers, plan.settings) for plan in plans)
    with (
        ResultStore() if kept is None else exclusive_store(BENCHMARK, kept, resources.wait_s) as store,
        resources.evaluator(run_job, store, prepare) as evaluator,
    ):
        yield evaluator


def evaluator_of(resources: Resources, plan: JobPlan) -> Evaluator:
    """Return the evaluator of a plan; its workers first compile the kernels that the plan needs."""
    return resources.evaluator(run_job, warm_up=preparation_of([(plan.controllers, plan.settings)]))
