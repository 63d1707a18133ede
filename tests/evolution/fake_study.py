"""A study whose runs take no time: fake results, straight trajectories."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Collection
from pathlib import Path

import numpy as np
import pytest

from evolution.driving import EXECUTORS
from evolution.driving.jobs import Job, RunResult
from evolution.search import experiment_of
from evolution.studies import StudySettings
from evolution.studies.path_length import PLANNER
from gym_mapbench.metrics.episode import Episode, Event
from gym_mapbench.ros_params import overlay
from tests.evolution.fake_runs import SMALL, WORLD, InProcess

OPTIONS = {
    "search": {"shapes": SMALL.model_dump(mode="json")},
    "run": {"environment": {"robot": {"radius": WORLD.robot.radius}}},
}
"""An experiment on small maps, with a robot that fits there."""


def read_experiment(document, where="experiment"):
    """Build an experiment on small maps."""
    return experiment_of(overlay(OPTIONS, document), where)


def run_job(job: Job) -> RunResult:
    """Times that belong to map and controller; noise adds a little that belongs to the seed."""
    text = f"{job.scenario.map.digest} {job.controller.name}"
    rng = np.random.default_rng(int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "big"))
    luck = np.random.default_rng(job.seed)
    time_s = float(5.0 + rng.gamma(2.0, 3.0))
    noisy = job.settings.environment.noise.scan > 0
    if noisy:
        time_s *= float(np.exp(0.1 * luck.standard_normal()))
    unlucky = luck.random() < (0.05 if noisy else 0.02)
    outcome = "timeout" if unlucky or time_s > job.settings.time_limit else "goal"
    metrics = {"min_clearance": 0.2, "n_recoveries": float(rng.integers(3))}
    return RunResult(outcome, time_s, 0.5 * time_s, seed=job.seed, metrics=metrics)


def plan_job(job: Job) -> RunResult:
    """A path the longer the more walls there are."""
    share = float(job.scenario.map.occupancy.mean())
    return RunResult("goal", 0.0, 5.0 + 10.0 * share)


def drive(job: Job) -> Episode:
    """The way from start to goal in a straight line, with a recovery in the middle."""
    result = run_job(job)
    start, goal = job.scenario.start, job.scenario.goal
    share = np.linspace(0.0, 1.0, max(3, round(result.time_s / 0.05)))[:, None]
    trajectory = np.zeros((len(share), 5))
    trajectory[:, :2] = (1 - share) * start[:2] + share * goal[:2]
    return Episode(
        scenario=job.scenario,
        controller=job.controller.name,
        seed=job.seed,
        outcome=result.outcome,
        reason="",
        time=result.time_s,
        control_period=0.05,
        trajectory=trajectory,
        commands=np.zeros((len(share) - 1, 2)),
        events=(Event(result.time_s / 2, "spin"), Event(result.time_s / 3, "contact")),
    )


def run_study_job(job: Job) -> RunResult:
    """Drive or plan, as the job asks."""
    return (plan_job if job.controller == PLANNER else run_job)(job)


def use_fakes(patch: pytest.MonkeyPatch) -> None:
    """Let studies and pages call the functions of this module in place of those that drive."""
    patch.setattr("evolution.studies.running.run_study_job", run_study_job)
    patch.setattr("evolution.runs.exclusive.preparation_of", lambda _: None)
    patch.setattr("evolution.pictures.run_figures.drive", drive)


def use_no_workers(patch: pytest.MonkeyPatch) -> None:
    """Run the jobs of this process in this process, unless their executor is named."""
    patch.setitem(EXECUTORS._entries, "processes", InProcess)


def small_study(**changes) -> StudySettings:
    """Every method, two runs each, few evaluations."""
    document = {
        "name": "small",
        "runs": 2,
        "budget": 24,
        "configurations": [
            {"name": "gini_6", "experiment": {"search": {"pop_size": 6}}},
            {"name": "gini_12", "experiment": {"search": {"pop_size": 12}}},
            {"name": "random", "method": "random", "experiment": {"search": {"pop_size": 12}}},
            {"name": "best_of_random", "method": "best_triple", "of": "random"},
            {"name": "cellular", "method": "cellular", "experiment": {"search": {"pop_size": 12}}},
            {"name": "path_length", "method": "path_length", "experiment": {"search": {"pop_size": 6}}},
            {
                "name": "cluster",
                "experiment": {"search": {"fitness": "cluster"}},
                "pop_size_from": ["gini_6", "gini_12"],
                "cluster_scale_from": ["gini_6", "gini_12"],
            },
        ],
        "reevaluation": {"seeds": 4},
    }
    experiment = overlay(OPTIONS, changes.pop("experiment", {}))
    return StudySettings.from_mapping({**document, **changes, "experiment": experiment}, "small")


def part_of(study: Path, copy: Path, names: Collection[str]) -> Path:
    """Copy a finished study as if only some of its configurations had been run; returns the copy."""
    shutil.copytree(study, copy)
    for runs in (copy / "runs").iterdir():
        if runs.name not in names:
            shutil.rmtree(runs)
    return copy
