"""The outcome of a tuning: what the search, the validation stage and the test found, as the rows of its files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from controllers.nav2_params.values import Value
from evolution.benchmark import maps_in_words, place_of_task
from evolution.files import Row, counted
from evolution.tuning.plan import TuningPlan
from evolution.tuning.results import FRONT
from evolution.tuning.rounds import Round
from evolution.tuning.search import Searched, Trial
from evolution.tuning.validation import Finalist
from evolution.tuning.verdict import verdict_of
from gym_mapbench.world.scenario import Scenario


@dataclass(frozen=True)
class Outcome:
    """All that was found.

    Args:
        rounds: The rounds of the search.
        finalists: The trials of the validation stage.
        front: Those on the Pareto front.
        matrix: The result of :func:`~evolution.tuning.rounds.matrix`; empty for a single round.
        test: A row for each run on the test maps.
    """

    rounds: list[Round]
    finalists: list[Finalist]
    front: list[Finalist]
    matrix: list[Row]
    test: list[Row]

    @property
    def plan(self) -> TuningPlan:
        """The tuning with all training maps."""
        return self.rounds[-1].plan

    @property
    def searched(self) -> Searched:
        """The last round, whose best trials are the finalists."""
        return self.rounds[-1].searched

    @property
    def evolved(self) -> tuple[Scenario, ...]:
        """The evolved maps that joined the training maps."""
        return self.plan.train[len(self.rounds[0].plan.train) :]

    @property
    def winner(self) -> Finalist:
        """The finalist with the lowest first cost."""
        return self.front[0]

    def changed(self, values: dict[str, Value]) -> dict[str, Value]:
        """Return the values that differ from the user's."""
        return {name: value for name, value in values.items() if value != self.plan.own[name]}

    def summary(self) -> dict[str, Any]:
        """Return the content of ``summary.json``."""
        changed = self.changed(self.winner.values)
        trials = [trial for one in self.rounds for trial in one.searched.trials]
        validated = len(self.finalists) * self.plan.settings.validation_repeats * len(self.plan.train)
        return {
            "verdict": verdict_of(self.plan, self.searched, self.winner, self.test)
            + self._of_front()
            + self._of_rounds(),
            "maps": ", ".join(
                maps_in_words(map(place_of_task, maps), kind)
                for maps, kind in ((self.rounds[0].plan.train, "training map"), (self.plan.test, "test map"))
            ),
            "controller": self.plan.controller,
            "objectives": list(self.plan.settings.objectives),
            "winner": self.winner.number,
            "runs": {"search": sum(len(one.rows) for one in trials), "validation": validated, "test": len(self.test)},
            "changes": [{"parameter": k, "before": self.plan.own[k], "after": v} for k, v in changed.items()],
            "finalists": [self._finalist_row(one) for one in self.finalists],
            "front": [one.number for one in self.front],
            "importances": self._importances(),
            "trials": self.trial_rows(),
            "test": self.test,
            **({"rounds": self.matrix} if self.matrix else {}),
        }

    def _finalist_row(self, one: Finalist) -> Row:
        costs = dict(zip(self._cost_names(), one.costs, strict=True))
        return {"trial": one.number, **costs, "success": one.success, "meets requirements": one.feasible}

    def _importances(self) -> list[Row]:
        """Return a row for each parameter, the most important for the first objective first."""
        names = self.searched.importances[0]
        of_each = list(zip(self.plan.settings.objectives, self.searched.importances, strict=True))
        return [{"parameter": name, **{key: found.get(name, 0.0) for key, found in of_each}} for name in names]

    def trial_rows(self) -> list[Row]:
        """Return a row for each trial."""
        if len(self.rounds) == 1:
            return [self._trial_row(trial) for trial in self.searched.trials]
        return [
            {"round": number, **self._trial_row(trial)}
            for number, one in enumerate(self.rounds, start=1)
            for trial in one.searched.trials
        ]

    def _of_front(self) -> list[str]:
        """Say where the Pareto front is; nothing for a single objective."""
        objectives = self.plan.settings.objectives
        if len(objectives) == 1:
            return []
        whose = "tuned" if self.winner.number else "own"
        return [
            f"The Pareto front of {' and '.join(objectives)} has {counted(len(self.front), 'trial')}, with a parameter "
            f"file for each in {FRONT}/; the {whose} values have the lowest cost {objectives[0]} of them."
        ]

    def _of_rounds(self) -> list[str]:
        """Say how many maps were evolved; nothing for a single round."""
        if len(self.rounds) == 1:
            return []
        earlier = sum(len(one.searched.trials) for one in self.rounds[:-1])
        return [
            f"It was the last of {len(self.rounds)} rounds; those before made {counted(earlier, 'trial')}. Among the "
            f"training maps {counted(len(self.evolved), 'was', 'were')} evolved against the best values of a round."
        ]

    def _trial_row(self, trial: Trial) -> Row:
        costs = trial.estimate or (None,) * len(self.plan.settings.objectives)
        return {
            "trial": trial.number,
            "state": trial.state,
            "maps": len(trial.rows),
            "success": trial.success if trial.rows else None,
            **dict(zip(self._cost_names(), costs, strict=True)),
            **{f"misses {name} by": value for name, value in trial.violations.items()},
            **trial.values,
        }

    def _cost_names(self) -> Sequence[str]:
        return [f"cost {name}" for name in self.plan.settings.objectives]
