from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gym_mapbench.errors import ConfigError
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Pose, Scenario, wrap_angle

GRID = GridMap.from_rows(["####", "#..#", "#..#", "####"], 1.0)
START, GOAL = Pose(1.5, 1.5, 0.0), Pose(2.5, 2.5, 1.0)


@given(st.floats(-1e4, 1e4))
def test_angles_are_wrapped_to_the_half_open_turn(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.remainder(wrapped - angle, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_pi_stays_pi():
    assert wrap_angle(math.pi) == math.pi
    assert wrap_angle(-math.pi) == math.pi


@pytest.mark.parametrize(
    ("start", "message"),
    [
        (Pose(0.5, 0.5), "start: expected a free cell, got an obstacle"),
        (Pose(-1.0, 1.0), "start: expected a point on the map"),
        (Pose(float("nan"), 1.0), "start: expected finite"),
        ((1.5, "a", 0), "start: expected .x, y, yaw."),
        (3, "start: expected .x, y, yaw."),
    ],
)
def test_impossible_starts_are_refused(start, message):
    with pytest.raises(ConfigError, match=message):
        Scenario(GRID, start, GOAL)


def test_a_start_beyond_all_numbers_is_off_the_map():
    grid = GridMap.from_rows(["####", "#..#", "####"], 0.05)
    with pytest.raises(ConfigError, match="start: expected a point on the map"):
        Scenario(grid, Pose(1e308, 0.1), Pose(0.12, 0.07))


def test_a_name_is_a_text_that_can_be_printed():
    assert Scenario(GRID, START, GOAL, "[/x]\x1b[31m").name == "[/x]\\x1b[31m"


def test_poses_become_poses_and_yaws_are_wrapped():
    scenario = Scenario(GRID, (1.5, 1.5, 7.0), [2.5, 2.5, 0.0])
    assert scenario.start == Pose(1.5, 1.5, wrap_angle(7.0))
    assert isinstance(scenario.goal, Pose)


def test_the_digest_is_of_map_and_task_not_of_the_name():
    one = Scenario(GRID, START, GOAL, "a")
    assert one.digest == Scenario(GRID, START, GOAL, "b").digest
    assert one.digest != Scenario(GRID, START, START).digest
    assert pickle.loads(pickle.dumps(one)) == one


def test_what_is_no_map_is_refused():
    with pytest.raises(ConfigError, match="map: expected a GridMap, got dict"):
        Scenario({"rows": ["..."]}, START, GOAL)


def test_map_sets_are_the_same_in_any_order():
    one, two = Scenario(GRID, START, GOAL), Scenario(GRID, GOAL, START)
    assert MapSet((one, two)).digest == MapSet([two, one]).digest
    assert MapSet((one, one)).digest != MapSet((one, two)).digest
    assert len(MapSet((one, two))) == 2
    assert list(MapSet((one, two))) == [one, two]
    assert MapSet((one, two))[1] == two
    with pytest.raises(ConfigError, match="at least one scenario"):
        MapSet(())
    with pytest.raises(ConfigError, match=r"map set\.1: expected a Scenario, got tuple"):
        MapSet((one, (GRID, START, GOAL)))
    assert np.array_equal(MapSet((one,))[0].map.occupancy, GRID.occupancy)
