"""The validation stage and the test: the best trials on held-out seeds, then the winner on the test maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean

from controllers.nav2_params.values import Value
from evolution.driving import Evaluator
from evolution.files import Row
from evolution.tuning.plan import TuningPlan, jobs_on
from evolution.tuning.search import Trial, costs_of, row_of

OWN, TUNED = "own", "tuned"
"""Labels of the user's values and of the winner's in the rows of the test."""


@dataclass(frozen=True)
class Finalist:
    """A trial on all training maps with held-out seeds.

    Args:
        number: Number of the trial.
        values: Values of the tuned parameters.
        costs: Mean cost of each objective.
        success: Share of the runs that reached the goal.
        feasible: Whether it meets all requirements.
    """

    number: int
    values: dict[str, Value]
    costs: tuple[float, ...]
    success: float
    feasible: bool


def validate(plan: TuningPlan, trials: Sequence[Trial], evaluator: Evaluator) -> list[Finalist]:
    """Re-run the best trials, and the user's values, on all training maps with held-out seeds."""
    chosen = finalists_among(trials, plan.settings.finalists)
    repeats = range(1, 1 + plan.settings.validation_repeats)
    jobs = [jobs_on(plan.jobs_with(trial.values), plan.train, repeats) for trial in chosen]
    results = iter(evaluator.run([job for of_trial in jobs for job in of_trial]))
    found = []
    for trial, of_trial in zip(chosen, jobs, strict=True):
        pairs = [(job, next(results)) for job in of_trial]
        rows = [row_of(job, result) for job, result in pairs]
        costs = zip(*(costs_of(plan, job, result) for job, result in pairs), strict=True)
        met = all(one.violation(rows) <= 0 for one in plan.requirements)
        success = fmean(row["outcome"] == "goal" for row in rows)
        found.append(Finalist(trial.number, trial.values, tuple(map(fmean, costs)), success, met))
    return found


def finalists_among(trials: Sequence[Trial], count: int) -> list[Trial]:
    """Return the user's trial and the best others, by cost, or spread over the Pareto front of several objectives."""
    others = [trial for trial in trials[1:] if trial.feasible]
    several = bool(others) and len(others[0].estimate) > 1
    if several:
        others = [one for one in others if not any(dominates(two.estimate, one.estimate) for two in others)]
    others.sort(key=lambda trial: (trial.estimate, trial.number))
    last = min(count, len(others)) - 1
    places = [round(k * (len(others) - 1) / max(last, 1)) for k in range(last + 1)] if several else range(last + 1)
    return [trials[0], *(others[place] for place in places)]


def front_of(finalists: Sequence[Finalist]) -> list[Finalist]:
    """Return the finalists that meet the requirements and that no other dominates, by the first cost."""
    candidates = [one for one in finalists if one.feasible] or list(finalists[:1])
    kept = [one for one in candidates if not any(dominates(two.costs, one.costs) for two in candidates)]
    return sorted(kept, key=lambda one: (one.costs, one.number))


def dominates(first: Sequence[float], second: Sequence[float]) -> bool:
    """Whether the first costs are nowhere higher than the second, and somewhere lower."""
    pairs = list(zip(first, second, strict=True))
    return all(a <= b for a, b in pairs) and any(a < b for a, b in pairs)


def judge(plan: TuningPlan, winner: Finalist, evaluator: Evaluator) -> list[Row]:
    """Run the user's values and the winner's on the test maps; returns a row for each run.

    If the winner has the user's values, only these are run.
    """
    plans = {OWN: plan.jobs_with(plan.own)}
    if winner.number:
        plans[TUNED] = plan.jobs_with(winner.values)
    repeats = range(plan.settings.test_repeats)
    jobs = [(label, job) for label, one in plans.items() for job in jobs_on(one, plan.test, repeats)]
    results = evaluator.run([job for _, job in jobs])
    return [
        {**row_of(job, result), "controller": label, "cost": costs_of(plan, job, result)[0]}
        for (label, job), result in zip(jobs, results, strict=True)
    ]
