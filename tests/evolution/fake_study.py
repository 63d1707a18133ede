"""A study whose runs take no time: fake results, straight trajectories."""

from __future__ import annotations

import hashlib

import numpy as np

from evolution.driving.jobs import ControllerSpec, Job, RunResult
from evolution.search.experiment import Experiment
from evolution.studies import Engine, StudySettings
from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.metrics.episode import Episode, Event
from gym_mapbench.settings import Settings
from tests.evolution.fake_runs import CONTROLLERS, SMALL, FakeRunSettings


class FakeRobot(Settings):
    """As much of a robot as a replay shows."""

    radius: float = 0.1


class FakeEnvironment(Settings):
    """As much of an env as a study knows of."""

    robot: FakeRobot = FakeRobot()
    noise: str = "none"


class FakeWorld(Settings):
    """As much of a world as a study knows of."""

    time_limit: float = 150.0
    environment: FakeEnvironment = FakeEnvironment()

    robot = FakeRunSettings.robot


def read_experiment(document, where="experiment"):
    """Build an experiment of fake runs on small maps."""
    controllers = document.get("controllers", [spec.model_dump() for spec in CONTROLLERS])
    search = {"shapes": SMALL.model_dump(), **document.get("search", {})}
    whole = {"search": search, "controllers": controllers, "run": document.get("run", {})}
    return Experiment.from_document(whole, FakeWorld, where)


def run_job(job: Job) -> RunResult:
    """Times that belong to map and controller; noise adds a little that belongs to the seed."""
    text = f"{job.scenario.map.digest} {job.controller.name}"
    rng = np.random.default_rng(int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "big"))
    luck = np.random.default_rng(job.seed)
    time_s = float(5.0 + rng.gamma(2.0, 3.0))
    noisy = job.settings.environment.noise != "none"
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


def check_experiment(experiment: Experiment) -> None:
    """There are three controllers."""
    known = {spec.name for spec in CONTROLLERS}
    for spec in experiment.controllers:
        if spec.registered_name not in known:
            raise unknown_name("controller", spec.registered_name, known)


ENGINE = Engine(read_experiment, run_job, plan_job, drive, warm_up=None, check_experiment=check_experiment)


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
    return StudySettings.from_mapping({**document, **changes}, "small")


__all__ = ["ENGINE", "ConfigError", "ControllerSpec", "small_study"]
