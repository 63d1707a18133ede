"""run_tuning(): search, validation stage and test in one directory; it can be killed at any moment and continued."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from controllers.nav2_params.values import Value
from evolution.benchmark import map_options, maps_in_words, place_of_task
from evolution.driving import DEFAULT_RESOURCES, OnRun, Resources, run_job
from evolution.files import Row, counted, csv_of, make_directory, write_json, write_text
from evolution.runs import exclusive_evaluator
from evolution.tuning.figures import write_figures
from evolution.tuning.parameter_text import ParameterText
from evolution.tuning.plan import TuningPlan
from evolution.tuning.results import (
    EVOLVED_MAPS,
    FRONT,
    PARAMS,
    SUMMARY,
    TEST,
    TEST_MAPS,
    TRIALS,
    TUNING,
    Tuning,
    digest_of,
    load_tuning,
)
from evolution.tuning.rounds import Round, matrix, search_in_rounds
from evolution.tuning.search import OnTrial, Searched, Trial
from evolution.tuning.validation import Finalist, front_of, judge, validate
from evolution.tuning.verdict import verdict_of
from gym_mapbench.mapio import check_map_set_size, group_scenarios
from gym_mapbench.mapio.map_set_file import write_map_set
from gym_mapbench.world.scenario import Scenario

MAPS_OF = {"train": "training map", "test": "test map"}
"""Keys of a tuning that hold maps, and what one of them is called."""


def run_tuning(
    plan: TuningPlan,
    text: ParameterText,
    path: Path,
    *,
    resume: bool = False,
    resources: Resources = DEFAULT_RESOURCES,
    on_trial: OnTrial | None = None,
    on_run: OnRun | None = None,
) -> Tuning:
    """Run or continue a tuning.

    Args:
        plan: Controller, world, search space, maps and options.
        text: The parameter file that gets the tuned values.
        path: Its directory.
        resume: Whether to continue a tuning that was begun there.
        resources: Workers, executor and time limits; the results do not depend on it.
        on_trial: Called after each trial with the number of runs so far.
        on_run: Called after each run with its job, its result, and the number of remaining runs of its batch.

    Raises:
        ConfigError: If a map has no way to the goal, the test maps are too large for their file, the directory holds
            something else, or another tuning was begun there.
        RunError: If no worker starts, or nothing can be written.
    """
    text.with_values(plan.own)
    plan.check_ways()
    check_map_set_size(group_scenarios(plan.test))
    TUNING.begin_or_resume(path, {"tuning": plan.document()}, _options, resume=resume)
    with exclusive_evaluator(TUNING, path, resources, run_job, [plan.jobs_with(plan.own)], on_run) as evaluator:
        rounds = search_in_rounds(plan, evaluator, on_trial)
        finalists = validate(rounds[-1].plan, rounds[-1].searched.trials, evaluator)
        front = front_of(finalists)
        winner = front[0]
        of_rounds = matrix(rounds, winner.values, evaluator) if len(rounds) > 1 else []
        test = judge(plan, winner, evaluator)
        _write(_Outcome(rounds, finalists, front, of_rounds, test), text, path)
    return load_tuning(path)


@dataclass(frozen=True)
class _Outcome:
    """All that was found."""

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


def _options(document: Mapping[str, Any]) -> object:
    """Return the options of a document, as errors name them: maps by name."""
    options = document["tuning"]
    if not isinstance(options, dict) or not all(isinstance(options.get(key), dict) for key in MAPS_OF):
        return options
    found = {key: value for key, value in options.items() if key not in MAPS_OF}
    for key, kind in MAPS_OF.items():
        found |= map_options(options[key], kind)
    return found


def _write(outcome: _Outcome, text: ParameterText, path: Path) -> None:
    """Write all files; the summary is the last, since it marks a finished tuning."""
    text.write(path / PARAMS, outcome.changed(outcome.winner.values))
    if len(outcome.plan.settings.objectives) > 1:
        make_directory(path / FRONT)
        for one in outcome.front:
            text.write(path / FRONT / f"trial_{one.number}.yaml", outcome.changed(one.values))
    write_map_set(group_scenarios(outcome.plan.test), path / TEST_MAPS)
    if outcome.evolved:
        write_map_set(group_scenarios(outcome.evolved), path / EVOLVED_MAPS)
    write_text(path / TRIALS, csv_of(outcome.trial_rows()))
    write_text(path / TEST, csv_of(outcome.test))
    summary = {"tuning": digest_of(TUNING.open(path)), **outcome.summary()}
    write_figures(path, summary)
    write_json(path / SUMMARY, summary)
