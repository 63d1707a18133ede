"""Changes of any map near the path that Nav2 plans."""

from __future__ import annotations

import numpy as np
import pytest

from evolution.search import change_near_way
from gym_mapbench.generator import find_way
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose, Scenario

ROBOT = RobotSpec()


@pytest.fixture(scope="module")
def office():
    return load_scenarios("examples/office.yaml")[0]


@pytest.mark.parametrize("seed", range(5))
def test_task_edge_and_the_places_of_the_robot_stay(office, seed):
    changed, names = change_near_way(office, ROBOT, np.random.default_rng(seed))
    again, _ = change_near_way(office, ROBOT, np.random.default_rng(seed))
    before, after = office.map.occupancy, changed.map.occupancy
    assert changed.digest == again.digest != office.digest
    assert set(names) <= {"nudge", "near_way", "door"}
    assert (changed.start, changed.goal) == (office.start, office.goal)
    edge = np.ones_like(before)
    edge[1:-1, 1:-1] = False
    assert (before == after)[edge].all()
    rows, cols = np.indices(before.shape)
    x, y = office.map.cell_to_world(rows, cols)
    for pose in (office.start, office.goal):
        near = np.hypot(x - pose.x, y - pose.y) < ROBOT.radius
        assert (before == after)[near].all()


@pytest.mark.parametrize("seed", range(5))
def test_the_robot_gets_to_the_goal_on_the_changed_map(office, seed):
    changed, _ = change_near_way(office, ROBOT, np.random.default_rng(seed))
    assert find_way(changed.map, changed.start, changed.goal, ROBOT) is not None


def test_a_map_without_a_way_has_no_change():
    walls = np.zeros((40, 40), dtype=np.bool_)
    walls[:, 20] = True
    scenario = Scenario(GridMap(walls), Pose(0.5, 1.0), Pose(1.5, 1.0))
    assert change_near_way(scenario, ROBOT, np.random.default_rng(0)) is None


@pytest.mark.parametrize("seed", range(5))
def test_a_wall_on_an_unknown_cell_is_written_and_read_as_a_wall(office, seed):
    walls = office.map.occupancy
    scenario = Scenario(GridMap(walls, unknown=~walls), office.start, office.goal)
    changed, _ = change_near_way(scenario, ROBOT, np.random.default_rng(seed))
    assert GridMap.from_rows(changed.map.to_rows()) == changed.map
