"""search(): samples trials in batches, runs each on the training maps in an order of its own, and stops bad ones.

Sampling and stopping depend on finished batches only, so the trials are the same with any number of workers. All
results are in the store, so a continued search repeats its decisions and runs only what is missing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import fmean
from typing import Literal

import numpy as np

from controllers.nav2_params.values import Value
from evolution.benchmark import bench_row
from evolution.driving import Evaluator, Job, JobPlan, RunResult
from evolution.files import Row
from evolution.tuning.objectives import OBJECTIVES
from evolution.tuning.plan import TuningPlan
from evolution.tuning.sampling import Sampling
from gym_mapbench.errors import ConfigError

State = Literal["running", "complete", "stopped", "refused"]


@dataclass
class Trial:
    """One set of values, and its runs so far.

    Args:
        number: Number of the trial; 0 has the user's own values.
        values: Values of the tuned parameters.
        plan: Its runs; None if the controller refuses the values.
        order: Numbers of the training maps, in the order of its runs.
        state: ``complete`` after all maps, ``stopped`` after some, ``refused`` without a run.
        rows: A row for each run.
        costs: For each objective, the costs by the number of the map.
        estimate: For each objective, the mean cost; of a stopped trial, estimated from the differences to the best.
        violations: By how much it misses each requirement, at most 0 if it meets the requirement.
    """

    number: int
    values: dict[str, Value]
    plan: JobPlan | None
    order: tuple[int, ...]
    state: State = "running"
    rows: list[Row] = field(default_factory=list)
    costs: tuple[dict[int, float], ...] = ()
    estimate: tuple[float, ...] = ()
    violations: dict[str, float] = field(default_factory=dict)

    @property
    def feasible(self) -> bool:
        """Whether it ran on all maps and meets all requirements."""
        return self.state == "complete" and all(value <= 0 for value in self.violations.values())

    @property
    def success(self) -> float:
        """Share of the runs that reached the goal."""
        return fmean(row["outcome"] == "goal" for row in self.rows) if self.rows else 0.0


OnTrial = Callable[[Trial, int], None]
"""Called with a finished trial and the number of runs so far."""


@dataclass(frozen=True)
class Searched:
    """A finished search.

    Args:
        trials: All trials in order.
        importances: For each objective, the importance of each parameter; empty for too few trials.
    """

    trials: list[Trial]
    importances: list[dict[str, float]]


def search(
    plan: TuningPlan,
    evaluator: Evaluator,
    on_trial: OnTrial | None = None,
    start: Sequence[dict[str, Value]] = (),
    number: int = 1,
) -> Searched:
    """Run the search, and return all trials.

    Args:
        plan: The tuning.
        evaluator: Drives the runs.
        on_trial: Called after each trial.
        start: Values of the trials after the first, which has the user's own.
        number: Number of the round; the sampler's seed depends on it.
    """
    settings, trials = plan.settings, list[Trial]()
    sampling = Sampling(plan.space, plan.own, settings, start, settings.seed + 1_000_000 * (number - 1))
    while len(trials) < settings.trials and not _spent(plan, trials):
        size = min(settings.batch, settings.trials - len(trials))
        batch = [_begin(plan, sampling, len(trials) + place) for place in range(size)]
        while running := [trial for trial in batch if trial.state == "running"]:
            _step(plan, sampling, trials, running, evaluator)
        for trial in batch:
            _finish(plan, sampling, trial)
            trials.append(trial)
            if on_trial is not None:
                on_trial(trial, sum(len(one.rows) for one in trials))
    return Searched(trials, sampling.importances())


def _spent(plan: TuningPlan, trials: Sequence[Trial]) -> bool:
    """Whether the budget of runs is used up."""
    return plan.settings.runs is not None and sum(len(one.rows) for one in trials) >= plan.settings.runs


def _begin(plan: TuningPlan, sampling: Sampling, number: int) -> Trial:
    """Sample a trial; the first has the user's own values."""
    sampled = sampling.ask()
    values = plan.space.completed(sampled) if number else plan.own
    rng = np.random.default_rng((plan.settings.seed, number))
    order = tuple(int(one) for one in rng.permutation(len(plan.train)))
    try:
        jobs = plan.jobs_with(values if number else None)
    except ConfigError:
        return Trial(number, values, None, order, "refused")
    return Trial(number, values, jobs, order, costs=tuple({} for _ in plan.settings.objectives))


def _step(
    plan: TuningPlan, sampling: Sampling, before: Sequence[Trial], running: Sequence[Trial], evaluator: Evaluator
) -> None:
    """Run every trial of a batch on its next maps, and decide which go on."""
    jobs = {(trial.number, place): _job(plan, trial, place) for trial in running for place in _next(plan, trial)}
    results = dict(zip(jobs, evaluator.run(list(jobs.values())), strict=True))
    for trial in running:
        places = _next(plan, trial)
        for place in places:
            _add(plan, trial, place, jobs[trial.number, place], results[trial.number, place])
        sampling.report(trial.number, {place: trial.costs[0][place] for place in places})
        _decide(plan, sampling, before, trial)


def _next(plan: TuningPlan, trial: Trial) -> tuple[int, ...]:
    done = len(trial.rows)
    return trial.order[done : done + plan.settings.step]


def _job(plan: TuningPlan, trial: Trial, place: int) -> Job:
    assert trial.plan is not None
    return trial.plan.job(plan.train[place], 0, 0)


def _add(plan: TuningPlan, trial: Trial, place: int, job: Job, result: RunResult) -> None:
    """Add one run to a trial."""
    trial.rows.append(row_of(job, result))
    for costs, cost in zip(trial.costs, costs_of(plan, job, result), strict=True):
        costs[place] = cost


def row_of(job: Job, result: RunResult) -> Row:
    """Return the fields of a run without wall-clock values, which differ between repetitions."""
    return bench_row(job, replace(result, timings={}))


def costs_of(plan: TuningPlan, job: Job, result: RunResult) -> tuple[float, ...]:
    """Return the cost of a run for each objective."""
    scale = plan.scales[job.scenario.digest]
    return tuple(OBJECTIVES[name](result, scale) for name in plan.settings.objectives)


def _decide(plan: TuningPlan, sampling: Sampling, before: Sequence[Trial], trial: Trial) -> None:
    """Complete or stop a trial, or let it go on."""
    if len(trial.rows) == len(plan.train):
        trial.state, trial.estimate = "complete", tuple(fmean(costs.values()) for costs in trial.costs)
        return
    best = sampling.best() if sampling.should_stop(trial.number) else None
    if best is None:
        return
    more = _difference(trial.costs[0], before[best].costs[0])
    if more > 0:
        trial.state, trial.estimate = "stopped", (before[best].estimate[0] + more,)


def _difference(costs: Mapping[int, float], others: Mapping[int, float]) -> float:
    """Return the mean difference of two trials over the maps of the first."""
    return fmean(costs[place] - others[place] for place in costs)


def _finish(plan: TuningPlan, sampling: Sampling, trial: Trial) -> None:
    """Tell the sampler the result of a trial."""
    trial.violations = {one.text: one.violation(trial.rows) for one in plan.requirements} if trial.rows else {}
    sampling.tell(trial.number, trial.estimate or None, trial.violations)
