"""Costs and requirements, worked by hand."""

from __future__ import annotations

import pytest

from evolution.driving import DriveSettings, RunResult
from evolution.tuning.objectives import OBJECTIVES, Scale, read_requirement, scale_of
from evolution.tuning.settings import TuneSettings
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

SCALE = Scale(length=6.0, time=12.0, limit=60.0)


def run(outcome="goal", **metrics):
    return RunResult(outcome, 18.0, 7.5, metrics=metrics)


def test_costs_by_hand():
    good = run(min_clearance=0.25)
    assert {name: cost(good, SCALE) for name, cost in OBJECTIVES.items()} == {
        "time": 1.5,  # 18 s of 12 s
        "length": 1.25,  # 7.5 m of 6 m
        "clearance": -0.25,
    }


@pytest.mark.parametrize("outcome", ["timeout", "collision", "error", "planner_failure", "controller_failure"])
def test_failures_cost_twice_the_limit(outcome):
    assert OBJECTIVES["time"](run(outcome), SCALE) == OBJECTIVES["length"](run(outcome), SCALE) == 10.0
    assert OBJECTIVES["clearance"](run(outcome), SCALE) == 0.0


def test_the_scale_is_the_shortest_path_at_maximum_speed():
    grid = GridMap.from_rows(["." * 60] * 20, 0.1)
    world = DriveSettings(navigation="thesis", environment=EnvConfig(time_limit=30.0))
    scale = scale_of(Scenario(grid, Pose(1.0, 1.0, 0.0), Pose(4.0, 1.0, 0.0), "room"), world)
    assert scale.length == pytest.approx(3.0, abs=0.1)
    assert scale.time == pytest.approx(scale.length / world.robot.max_linear_velocity)
    assert scale.failure == pytest.approx(60.0 / scale.time)


def test_a_map_without_a_way_to_the_goal_is_refused():
    grid = GridMap.from_rows(["." * 20 + "#" + "." * 20] * 20, 0.1)
    world = DriveSettings(navigation="thesis")
    with pytest.raises(ConfigError, match="split: expected a map with a way to the goal"):
        scale_of(Scenario(grid, Pose(1.0, 1.0), Pose(3.0, 1.0), "split"), world)


def test_requirements_by_hand():
    rows = [
        {"outcome": "goal", "time_s": 10.0, "min_clearance": 0.2},
        {"outcome": "collision", "time_s": 3.0, "min_clearance": 0.0},
    ]
    assert read_requirement("clearance >= 0.1").violation(rows) == pytest.approx(-0.1)
    assert read_requirement("clearance>=0.3").violation(rows) == pytest.approx(0.1)
    assert read_requirement("collisions<=0").violation(rows) == 1.0
    assert read_requirement("success>=0.5").violation(rows) == 0.0
    assert read_requirement("clearance>=0.1").violation(rows[1:]) == 1.0  # nothing reached the goal


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("clearance>0.1", "expected a condition like clearance>=0.1, got 'clearance>0.1'"),
        ("clearance>=much", "expected a condition like"),
        ("clearence>=0.1", "unknown measure 'clearence'; did you mean 'clearance'?"),
    ],
)
def test_bad_requirements_are_refused(text, message):
    with pytest.raises(ConfigError) as error:
        TuneSettings(requirements=(text,))
    assert message in str(error.value)


def test_unknown_and_repeated_objectives_are_refused():
    with pytest.raises(ConfigError, match="unknown objective 'tme'"):
        TuneSettings(objectives=("tme",))
    with pytest.raises(ConfigError, match="expected different names"):
        TuneSettings(objectives=("time", "time"))
