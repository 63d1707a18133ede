from __future__ import annotations

import heapq
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.env.task import CautiousDistance, distance_to_goal
from gym_mapbench.kernels.caution import weighted_distance
from gym_mapbench.kernels.distance import geodesic_distance
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario


def plain_distance(costs, row, col):
    """Dijkstra's algorithm as in the textbook."""
    costs = costs.copy()
    costs[row, col] = 1.0
    distance = np.full(costs.shape, np.inf)
    distance[row, col] = 0.0
    waiting = [(0.0, row, col)]
    while waiting:
        here, r, c = heapq.heappop(waiting)
        for dr in (-1, 0, 1):
            for dc in (-1, 0, 1):
                near = r + dr, c + dc
                if not (0 <= near[0] < costs.shape[0] and 0 <= near[1] < costs.shape[1]) or near == (r, c):
                    continue
                if dr and dc and np.inf in (costs[r + dr, c], costs[r, c + dc]):
                    continue
                length = here + costs[near] * math.hypot(dr, dc)
                if length < distance[near]:
                    distance[near] = length
                    heapq.heappush(waiting, (length, *near))
    return distance


COSTS = arrays(np.float64, (7, 9), elements=st.one_of(st.floats(1.0, 9.0), st.just(np.inf)))


@given(COSTS, st.integers(0, 6), st.integers(0, 8))
def test_it_is_the_least_cost(costs, row, col):
    assert weighted_distance(costs, row, col) == pytest.approx(plain_distance(costs, row, col), rel=1e-12)


@given(arrays(np.bool_, (7, 9)), st.integers(0, 6), st.integers(0, 8))
def test_where_every_cell_costs_the_same_it_is_the_length(blocked, row, col):
    blocked[row, col] = False
    costs = np.where(blocked, np.inf, 1.0)
    assert weighted_distance(costs, row, col) == pytest.approx(geodesic_distance(blocked, row, col))


WALL = ["#" * 80, *["#" + "." * 78 + "#"] * 78, "#" * 80]
for line in range(40, 79):
    WALL[line] = "#" + "." * 38 + "##" + "." * 38 + "#"
AROUND = Scenario(GridMap.from_rows(WALL), Pose(1.0, 0.5), Pose(3.0, 0.5))


def test_the_way_around_a_corner_keeps_away_from_it():
    robot = EnvConfig().robot
    plain, cautious = distance_to_goal(AROUND, robot), CautiousDistance(AROUND, robot, 4.0, 0.4)
    assert cautious.solvable
    above = [2.3, 2.6]  # along the line over the wall's end: touching it, and with room
    assert plain.at(2.0, above[0]) < plain.at(2.0, above[1])
    assert cautious.at(2.0, above[0]) > plain.at(2.0, above[0])
    assert cautious.at(1.0, 3.5) >= plain.at(1.0, 3.5)


def test_the_reward_follows_the_cautious_way():
    rewards = []
    for caution in (0.0, 4.0):
        env = MapBenchEnv(scenarios=[AROUND], reward={"caution": caution, "time": 0.0}, observation=["goal"])
        env.reset(seed=0, options={"start": (1.7, 1.5, math.pi), "goal": (3.0, 0.5)})
        rewards.append(sum(env.step((0.5, 0.0))[1] for _ in range(5)))
    # Away from the wall, where the robot has 0.03 m of room: a detour, and yet progress for who counts the room.
    assert rewards[0] < 0 < rewards[1]
