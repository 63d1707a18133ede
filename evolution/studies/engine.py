"""Engine: how the runs of a study are driven; by default, by Nav2's controllers in this project's simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from evolution.driving import (
    RUN_TIMEOUT_SECONDS,
    Evaluator,
    Job,
    ResultStore,
    RunJob,
    RunResult,
    drive,
    run_job,
    try_controllers,
    warm_up,
)
from evolution.search import Experiment, experiment_of
from evolution.studies.baselines.path_length import PLANNER, plan_job
from gym_mapbench.metrics.episode import Episode

E = TypeVar("E", bound=Evaluator)


def check_experiment(experiment: Experiment) -> None:
    """Refuse an experiment with a controller that cannot drive; see :func:`~evolution.driving.try_controllers`."""
    try_controllers(experiment.controllers, experiment.run)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Engine:
    """What a study has to know about how its runs are driven.

    Args:
        read_experiment: Builds an experiment from a document and the beginning of its error messages.
        run_job: Drives a job in a worker process.
        plan_job: Plans the path of a job that asks for nothing else, in a worker process.
        drive: Drives a job in this process and records everything.
        warm_up: Called once in every new worker.
        check_experiment: Refuses an experiment whose runs could only fail.
        executor: What the jobs run on, by name.
        run_timeout_s: Wall-clock seconds that a run may take.
    """

    read_experiment: Callable[[Mapping[str, Any], str], Experiment] = experiment_of
    run_job: RunJob = run_job
    plan_job: RunJob = plan_job
    drive: Callable[[Job], Episode] = drive
    warm_up: Callable[[], object] | None = warm_up
    check_experiment: Callable[[Experiment], object] = check_experiment
    executor: str = "processes"
    run_timeout_s: float = RUN_TIMEOUT_SECONDS

    def evaluator(self, store: ResultStore, workers: int, kind: type[E]) -> E:
        """Return an evaluator of some kind that drives the runs of a study, and keeps their results in a store."""
        return kind(
            self.answer_job,
            store,
            workers=workers,
            warm_up=self.warm_up,
            executor=self.executor,
            timeout_s=self.run_timeout_s,
        )

    @property
    def answer_job(self) -> RunJob:
        """The function that workers call: it drives or plans, as the job asks."""
        return partial(_answer, self.run_job, self.plan_job)


NAV2 = Engine()
"""Nav2's controllers in this project's simulation."""


def _answer(run_job: RunJob, plan_job: RunJob, job: Job) -> RunResult:
    return (plan_job if job.controller == PLANNER else run_job)(job)
