"""search(): samples trials in batches, runs each on the training maps in an order of its own, and stops bad ones.

Sampling and stopping depend on finished batches only, so the trials are the same with any number of workers. All
results are in the store, so a continued search repeats its decisions and runs only what is missing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
        order: Numbers of the training maps, in the order of its runs.
        state: ``complete`` after all maps, ``stopped`` after some, ``refused`` without a run.
        rows: A row for each run.
        costs: For each objective, the costs by the number of the map.
        estimate: For each objective, the mean cost; of a stopped trial, estimated from the differences to the best.
        violations: By how much it misses each requirement, at most 0 if it meets the requirement.
    """

    number: int
    values: dict[str, Value]
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
    searching = _Search(plan, evaluator, start, number)
    while not searching.is_over:
        searching.run_batch(on_trial)
    return Searched(searching.trials, searching.sampling.importances())


class _Search:
    """A running search; arguments as for :func:`search`."""

    def __init__(self, plan: TuningPlan, evaluator: Evaluator, start: Sequence[dict[str, Value]], number: int) -> None:
        seed = plan.settings.seed + 1_000_000 * (number - 1)
        self.plan = plan
        self.evaluator = evaluator
        self.sampling = Sampling(plan.space, plan.own, plan.settings, start, seed)
        self.trials: list[Trial] = []
        self._plans: dict[int, JobPlan] = {}

    @property
    def runs(self) -> int:
        """Runs of the finished trials."""
        return sum(len(one.rows) for one in self.trials)

    @property
    def is_over(self) -> bool:
        """Whether all trials are finished, or the budget of runs is used up."""
        settings = self.plan.settings
        return len(self.trials) >= settings.trials or (settings.runs is not None and self.runs >= settings.runs)

    def run_batch(self, on_trial: OnTrial | None) -> None:
        """Sample some trials, and run them until each is complete, stopped or refused."""
        first, settings = len(self.trials), self.plan.settings
        batch = [self._begin(number) for number in range(first, min(first + settings.batch, settings.trials))]
        while running := [trial for trial in batch if trial.state == "running"]:
            self._step(running)
        for trial in batch:
            trial.violations = {one.text: one.violation(trial.rows) for one in self.plan.requirements if trial.rows}
            self.sampling.tell(trial.number, trial.estimate or None, trial.violations)
            self.trials.append(trial)
            if on_trial is not None:
                on_trial(trial, self.runs)

    def _begin(self, number: int) -> Trial:
        """Sample a trial; the first has the user's own values."""
        sampled = self.sampling.ask()
        values = self.plan.space.completed(sampled) if number else self.plan.own
        rng = np.random.default_rng((self.plan.settings.seed, number))
        order = tuple(int(one) for one in rng.permutation(len(self.plan.train)))
        try:
            self._plans[number] = self.plan.jobs_with(values)
        except ConfigError:
            return Trial(number, values, order, "refused")
        return Trial(number, values, order, costs=tuple({} for _ in self.plan.settings.objectives))

    def _step(self, running: Sequence[Trial]) -> None:
        """Run every trial of a batch on its next maps, and decide which go on."""
        step = self.plan.settings.step
        asked = [(trial, place) for trial in running for place in trial.order[len(trial.rows) :][:step]]
        jobs = [self._plans[trial.number].job(self.plan.train[place], 0, 0) for trial, place in asked]
        for (trial, place), job, result in zip(asked, jobs, self.evaluator.run(jobs), strict=True):
            trial.rows.append(row_of(job, result))
            for costs, cost in zip(trial.costs, costs_of(self.plan, job, result), strict=True):
                costs[place] = cost
            self.sampling.report(trial.number, place, trial.costs[0][place])
        for trial in running:
            self._decide(trial)

    def _decide(self, trial: Trial) -> None:
        """Complete or stop a trial, or let it go on."""
        if len(trial.rows) == len(self.plan.train):
            trial.state, trial.estimate = "complete", tuple(fmean(costs.values()) for costs in trial.costs)
            return
        best = self.sampling.best() if self.sampling.should_stop(trial.number) else None
        if best is None:
            return
        others = self.trials[best]
        more = fmean(cost - others.costs[0][place] for place, cost in trial.costs[0].items())
        if more > 0:
            trial.state, trial.estimate = "stopped", (others.estimate[0] + more,)


def row_of(job: Job, result: RunResult) -> Row:
    """Return the fields of a run without wall-clock values, which differ between repetitions."""
    return bench_row(job, replace(result, timings={}))


def costs_of(plan: TuningPlan, job: Job, result: RunResult) -> tuple[float, ...]:
    """Return the cost of a run for each objective."""
    scale = plan.scales[job.scenario.digest]
    return tuple(OBJECTIVES[name](result, scale) for name in plan.settings.objectives)
