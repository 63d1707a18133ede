from __future__ import annotations

import heapq
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.task import OUTCOMES, DistanceToGoal, Task, open_cells
from gym_mapbench.kernels.task import decide_outcome
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose, Scenario
from gym_mapbench.world.state import Worlds
from gym_mapbench.world.world import BODY, WALL
from tests.worlds import ROOM, ROOM_GOAL, ROOM_START

SMALL = RobotSpec(radius=0.05)
SCENARIO = Scenario(GridMap.from_rows(ROOM, 0.1), Pose(*ROOM_START), Pose(*ROOM_GOAL))
WORLDS = Worlds()


def begin(config, scenario=SCENARIO):
    return Task(config, scenario, scenario.start, WORLDS)


def step(task, pose, touched=0):
    """Judge a step that ends at a pose."""
    for name, value in zip(("x", "y", "yaw"), pose, strict=True):
        WORLDS.robots[name] = value
    return task.step(touched)


def judged(task, pose, touched=0):
    """Judge a step; return the terms of its reward."""
    now = step(task, pose, touched)
    assert now.reward == pytest.approx(sum(now.terms.values()), abs=1e-12)
    return now.terms


def test_outcomes_by_precedence():
    def outcome(*ends):
        return OUTCOMES[decide_outcome(*ends)]

    assert outcome(False, False, False) == "running"
    assert outcome(True, True, True) == "collision"
    assert outcome(False, True, True) == "goal"
    assert outcome(False, False, True) == "timeout"


def test_reward_terms_by_hand():
    config = EnvConfig(reward={"progress": 2.0, "time": 0.1, "collision": 5.0, "goal": 7.0})
    task = begin(config)
    x, y, yaw = SCENARIO.start
    assert judged(task, Pose(x + 0.3, y + 0.3, yaw)) == pytest.approx(
        {"progress": 0.6 * math.sqrt(2), "time": -0.005, "collision": 0.0, "goal": 0.0}
    )
    assert judged(task, SCENARIO.start, touched=WALL) == pytest.approx(
        {"progress": -0.6 * math.sqrt(2), "time": -0.005, "collision": -5.0, "goal": 0.0}
    )
    assert judged(task, SCENARIO.goal, touched=WALL) == pytest.approx(
        {"progress": 2.8 * math.sqrt(2), "time": -0.005, "collision": 0.0, "goal": 7.0}
    )


def test_a_position_once_reached_stays_reached():
    x, y, yaw = SCENARIO.goal

    def ends(*poses):
        task = begin(EnvConfig())
        for pose in poses:
            now = step(task, pose)
        return now.outcome == "goal"

    assert not ends(Pose(x + 0.3, y, yaw))
    assert not ends(Pose(x + 0.25, y, yaw - 1.0))
    assert not ends(Pose(x + 0.25, y, yaw - 1.0), Pose(x + 0.5, y, yaw - 0.26))
    assert ends(Pose(x + 0.25, y, yaw - 1.0), Pose(x + 0.5, y, yaw + 0.24))
    opposite = Scenario(SCENARIO.map, SCENARIO.start, Pose(x, y, math.pi))
    task = begin(EnvConfig(), opposite)
    assert step(task, Pose(x, y, -math.pi + 0.24)).outcome == "goal"


def dijkstra(free, row, col):
    """The plain twin: distances over 8 neighbours, a diagonal only between two free cells."""
    distance = np.full(free.shape, np.inf)
    distance[row, col] = 0.0
    heap = [(0.0, row, col)]
    while heap:
        here, r, c = heapq.heappop(heap)
        if here > distance[r, c]:
            continue
        for dr in (-1, 0, 1):
            for dc in (-1, 0, 1):
                near = r + dr, c + dc
                if not (0 <= near[0] < free.shape[0] and 0 <= near[1] < free.shape[1] and free[near]):
                    continue
                if free[r, near[1]] and free[near[0], c] and here + math.hypot(dr, dc) < distance[near] - 1e-12:
                    distance[near] = here + math.hypot(dr, dc)
                    heapq.heappush(heap, (distance[near], *near))
    return distance


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_distances_run_around_walls(seed):
    rng = np.random.default_rng(seed)
    cells = rng.random((25, 25)) < 0.25
    cells[3, 3] = cells[20, 20] = False
    grid = GridMap(cells, 0.2, (1.0, -3.0))
    scenario = Scenario(grid, Pose(*grid.cell_to_world(3, 3)), Pose(*grid.cell_to_world(20, 20)))
    field = DistanceToGoal(scenario, SMALL)
    free = open_cells(scenario, SMALL)
    expected = dijkstra(free, 20, 20)
    assert field.solvable == np.isfinite(expected[3, 3])
    for row, col in zip(*np.nonzero(np.isfinite(expected)), strict=True):
        assert field.at(*grid.cell_to_world(row, col)) == pytest.approx(expected[row, col] * 0.2, abs=1e-9)


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_the_distance_is_continuous_everywhere(seed):
    rng = np.random.default_rng(seed)
    cells = rng.random((20, 20)) < 0.3
    cells[3, 3] = cells[15, 15] = False
    grid = GridMap(cells, 0.2)
    scenario = Scenario(grid, Pose(*grid.cell_to_world(3, 3)), Pose(*grid.cell_to_world(15, 15)))
    field = DistanceToGoal(scenario, SMALL)
    before = None
    for x, y in np.linspace(rng.uniform(0, 4, 2), rng.uniform(0, 4, 2), 2000):
        here = field.at(x, y)
        assert math.isfinite(here)
        if before is not None:
            assert abs(here - before) < 0.25
        before = here


def test_start_and_goal_beside_walls_stay_open():
    grid = GridMap.from_rows(["#" * 20, *["#" + "." * 18 + "#"] * 8, "#" * 20], 0.1)
    robot = RobotSpec(radius=0.2)
    scenario = Scenario(grid, Pose(0.31, 0.31), Pose(1.69, 0.69))
    assert DistanceToGoal(scenario, robot).solvable
    assert not open_cells(scenario, robot)[0].any()


def test_progress_adds_up_to_the_distance():
    config = EnvConfig(reward={"time": 0.0})
    task = begin(config)
    points = np.linspace(SCENARIO.start[:2], SCENARIO.goal[:2], 50)[1:]
    total = sum(judged(task, Pose(x, y, 0.0))["progress"] for x, y in points)
    assert total == pytest.approx(1.4 * math.sqrt(2), abs=1e-6)


def test_a_contact_with_a_body_begins_beside_one_with_a_wall():
    task = begin(EnvConfig(collision_ends_episode=False))
    touched = [WALL, WALL | BODY, BODY, WALL, 0, WALL | BODY, WALL | BODY]
    assert [judged(task, SCENARIO.start, one)["collision"] for one in touched] == [-10, -10, 0, -10, 0, -10, 0]


def test_every_contact_and_the_goal_count_once():
    config = EnvConfig(collision_ends_episode=False, goal_ends_episode=False, reward={"progress": 0.0, "time": 0.0})
    task = begin(config)
    at_start, at_goal = SCENARIO.start, SCENARIO.goal
    contacts = [WALL, WALL, 0, WALL, 0]
    assert [judged(task, at_start, contact)["collision"] for contact in contacts] == [-10, 0, 0, -10, 0]
    assert [judged(task, at_goal)["goal"] for _ in range(3)] == [10, 0, 0]
    assert task.standing().outcome == "running"
    assert not task.over


def test_the_clock_runs_in_control_steps():
    task = begin(EnvConfig(time_limit=0.15))
    steps = [step(task, SCENARIO.start) for _ in range(3)]
    assert [now.outcome for now in steps] == ["running", "running", "timeout"]
    assert task.standing() == steps[-1]
    assert steps[-1].time == pytest.approx(0.15)
    assert task.over


def test_without_weight_on_progress_no_field_is_computed():
    task = begin(EnvConfig(reward={"progress": 0.0}))
    assert task.field.size == 0
    assert judged(task, SCENARIO.goal)["progress"] == 0.0
