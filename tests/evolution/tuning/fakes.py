"""Tunings whose runs take no time: a run is the faster, the nearer the lookahead distance of RPP is to 0.9 m."""

from __future__ import annotations

import numpy as np

from evolution.driving import DriveSettings, Job, RunResult
from evolution.tuning import ParameterText, SearchSpace, TuneSettings, TuningPlan, text_of_settings
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenario
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Scenario
from tests.evolution.fake_runs import SMALL
from tests.evolution.fake_study import drive as straight

WORLD = DriveSettings(
    navigation="thesis",
    environment=EnvConfig(robot=RobotSpec(radius=0.05), shapes=SMALL, noise="nominal", time_limit=60.0),
)
SPACE = SearchSpace.from_mapping(
    {
        "parameters": {
            "lookahead_dist": {"low": 0.2, "high": 1.2},
            "use_rotate_to_heading": {"choices": [True, False]},
            "local_costmap.inflation_layer.cost_scaling_factor": {"low": 1.0, "high": 10.0, "log": True},
            "inflation_cost_scaling_factor": {"same_as": "local_costmap.inflation_layer.cost_scaling_factor"},
        }
    },
    "space",
)


def maps(count: int, seed: int) -> tuple[Scenario, ...]:
    """Random small maps with names of their own."""
    rng = np.random.default_rng(seed)
    drawn = [draw_scenario(WORLD.environment, rng) for _ in range(count)]
    return tuple(Scenario(one.map, one.start, one.goal, f"map_{seed}_{n}") for n, one in enumerate(drawn))


def run_job(job: Job) -> RunResult:
    """A run that the lookahead distance decides; bad ones time out on some maps."""
    rng = np.random.default_rng(job.seed)
    ahead = job.settings.navigation.controller("rpp").params["lookahead_dist"]
    miss = abs(ahead - 0.9)
    time_s = 10.0 + 20.0 * miss + float(rng.uniform(0, 1))
    outcome = "timeout" if rng.random() < miss else "goal"
    return RunResult(outcome, time_s, 3.0, seed=job.seed, metrics={"min_clearance": 0.3 - 0.2 * ahead})


def drive(job: Job) -> Episode:
    """A straight run."""
    return straight(job)


def plan(count: int = 8, **options: object) -> TuningPlan:
    """A tuning of RPP on small maps."""
    settings = TuneSettings(**{"trials": 24, "validation_repeats": 1, "finalists": 3, **options})
    return TuningPlan("rpp", WORLD, SPACE, maps(count, 1), maps(8, 2), settings)


def text() -> ParameterText:
    """The parameter file of the plan."""
    return text_of_settings(WORLD, "rpp")
