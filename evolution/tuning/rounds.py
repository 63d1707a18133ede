"""Rounds of a tuning: search for values, evolve maps against the best of them, and search on with these maps.

Each round searches on all training maps so far. It begins with the user's own values and the best of the round before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import fmean

from controllers.nav2_params.values import Value
from evolution.driving import Evaluator
from evolution.files import Row
from evolution.tuning.against import evolve_against
from evolution.tuning.plan import TuningPlan, jobs_on
from evolution.tuning.search import OnTrial, Searched, Trial, costs_of, search
from gym_mapbench.world.scenario import Scenario

CONTINUED = 3
"""Trials of a round with which the next one begins, besides the user's own values."""


@dataclass(frozen=True)
class Round:
    """One round.

    Args:
        plan: The tuning with the training maps of this round.
        searched: Its trials.
    """

    plan: TuningPlan
    searched: Searched

    @property
    def best(self) -> Trial:
        """The best trial; the user's own values if no other one meets the requirements."""
        return best_trials(self.searched.trials, 1)[0]


def search_in_rounds(plan: TuningPlan, evaluator: Evaluator, on_trial: OnTrial | None = None) -> list[Round]:
    """Run all rounds; a tuning that is not against evolved maps has a single one."""
    against = plan.settings.against
    rounds = 1 if against is None else against.rounds
    trials, done = plan.settings.trials, list[Round]()
    runs = plan.settings.runs and max(plan.settings.runs // rounds, 1)
    for number in range(1, rounds + 1):
        share = trials * number // rounds - trials * (number - 1) // rounds
        start = [one.values for one in best_trials(done[-1].searched.trials, CONTINUED)] if done else []
        of_round = replace(plan, settings=plan.settings.replace(trials=share, runs=runs, against=None))
        done.append(Round(plan, search(of_round, evaluator, on_trial, start, number)))
        if against is not None and number < rounds:
            hard = evolve_against(plan, done[-1].best.values, number, against, evaluator)
            plan = replace(plan, train=(*plan.train, *hard))
    return done


def best_trials(trials: Sequence[Trial], count: int) -> list[Trial]:
    """Return the best trials that meet the requirements, by cost; the first trial if there are none."""
    good = sorted((one for one in trials if one.feasible), key=lambda one: (one.estimate, one.number))
    return good[:count] or list(trials[:1])


def matrix(rounds: Sequence[Round], final: dict[str, Value], evaluator: Evaluator) -> list[Row]:
    """Return the mean first cost of each round's best values on the training maps and on each round's evolved maps.

    All runs have held-out seeds. The rows are the user's own values, the best values of each round, and the final ones.

    Args:
        rounds: The finished rounds.
        final: The values that the tuning chose.
        evaluator: Drives the runs.
    """
    plan, groups = rounds[-1].plan, groups_of(rounds)
    values = {"own": plan.own, **{f"round {n}": one.best.values for n, one in enumerate(rounds, 1)}, "tuned": final}
    repeats = range(1, 1 + plan.settings.validation_repeats)
    plans = {name: plan.jobs_with(one) for name, one in values.items()}
    jobs = {
        (name, group): jobs_on(jobs, maps, repeats) for name, jobs in plans.items() for group, maps in groups.items()
    }
    results = iter(evaluator.run([job for some in jobs.values() for job in some]))
    costs = {place: fmean(costs_of(plan, job, next(results))[0] for job in some) for place, some in jobs.items()}
    return [{"values": name, **{group: costs[name, group] for group in groups}} for name in values]


def groups_of(rounds: Sequence[Round]) -> dict[str, tuple[Scenario, ...]]:
    """Return the training maps by their origin: the user's, and those evolved after each round."""
    groups = {"training maps": rounds[0].plan.train}
    for number, (before, after) in enumerate(pairwise(rounds), start=1):
        groups[f"evolved after round {number}"] = after.plan.train[len(before.plan.train) :]
    return {name: maps for name, maps in groups.items() if maps}
