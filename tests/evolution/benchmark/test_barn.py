"""BARN's rules: clock, score and robot, on a world made here in its format."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from evolution.benchmark.barn import (
    barn_settings,
    correlation_with,
    load_barn,
    official_lengths,
    reference_of,
    refined,
    score_runs,
)
from evolution.benchmark.runs import bench
from evolution.driving.jobs import ControllerSpec, JobPlan, RunResult
from evolution.driving.worker import DriveSettings
from gym_mapbench.world.gridmap import GridMap
from tests.oracle_data import DATA, needs_data


def test_refined_cells_cover_the_same_ground():
    grid = GridMap(np.eye(3, dtype=bool), 0.15, (-1.0, 2.0))
    fine = refined(grid, 3)
    assert fine.shape == (9, 9)
    assert fine.bounds == pytest.approx(grid.bounds)
    for x, y in ((-0.98, 2.01), (-0.8, 2.2), (-0.7, 2.05)):
        assert fine.occupancy[fine.world_to_cell(x, y)] == grid.occupancy[grid.world_to_cell(x, y)]


def test_rules():
    settings = barn_settings(DriveSettings(navigation="thesis"))
    assert settings.environment.robot.name == "jackal"
    assert settings.environment.time_limit == 100.0
    assert settings.environment.collision_ends_episode
    assert (settings.environment.xy_goal_tolerance, settings.environment.yaw_goal_tolerance) == (1.0, math.pi)
    assert not settings.own_goal_check
    footprint = settings.navigation.local_costmap.make_footprint(settings.environment.robot)
    assert footprint.inscribed_radius == pytest.approx(0.165 + 0.1)


@needs_data
def test_scores_by_hand():
    source = f"barn:{DATA / 'barn'}"
    scenarios = {scenario.name: scenario for scenario in load_barn(source)}
    plan = JobPlan((ControllerSpec(name="rpp"),), DriveSettings(navigation="thesis"))

    def scored(outcome, time, low=2.0):
        result = RunResult(outcome, time, 10.0, metrics={"motion_start": 0.5})
        answers = SimpleNamespace(run=lambda jobs: [result for _ in jobs])
        return score_runs(bench([scenarios["world_42"]], plan, answers), official_lengths(source), low)[0]

    assert scored("goal", 0.5).score == pytest.approx(1 / 2)
    assert scored("goal", 1e6).score == pytest.approx(1 / 8)
    assert scored("goal", 0.5, low=4.0).score == pytest.approx(1 / 4)
    assert scored("collision", 10.0).score == 0.0
    assert scored("goal", 20.5).time == 20.0


@needs_data
def test_published_reference():
    reference = reference_of(f"barn:{DATA / 'barn'}")
    assert reference["world_42"] == pytest.approx(19.22, abs=0.01)
    assert correlation_with(reference, [])[3] == 0
