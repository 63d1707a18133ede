"""run_tuning(): search, validation stage and test in one directory; it can be killed at any moment and continued."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from evolution.benchmark import map_options
from evolution.driving import DEFAULT_RESOURCES, OnRun, Resources, run_job
from evolution.files import csv_of, make_directory, write_json, write_text
from evolution.runs import exclusive_evaluator
from evolution.tuning.figures import write_figures
from evolution.tuning.outcome import Outcome
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
from evolution.tuning.rounds import matrix, search_in_rounds
from evolution.tuning.search import OnTrial
from evolution.tuning.validation import front_of, judge, validate
from gym_mapbench.mapio import check_map_set_size, group_scenarios
from gym_mapbench.mapio.map_set_file import write_map_set

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
        _write(Outcome(rounds, finalists, front, of_rounds, test), text, path)
    return load_tuning(path)


def _options(document: Mapping[str, Any]) -> object:
    """Return the options of a document, as errors name them: maps by name."""
    options = document["tuning"]
    if not isinstance(options, dict) or not all(isinstance(options.get(key), dict) for key in MAPS_OF):
        return options
    found = {key: value for key, value in options.items() if key not in MAPS_OF}
    for key, kind in MAPS_OF.items():
        found |= map_options(options[key], kind)
    return found


def _write(outcome: Outcome, text: ParameterText, path: Path) -> None:
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
