"""Many worlds moved on by one kernel, against the same worlds moved on one by one."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gym_mapbench.env.traffic import Traffic
from gym_mapbench.kernels.bodies import farthest_step, is_near_body, see_bodies
from gym_mapbench.world.bodies import Body, Disc
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import LidarSettings, directions
from gym_mapbench.world.motions import MotionSpec
from gym_mapbench.world.proximity import Proximity
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.state import Worlds, drive_of, ground_of
from gym_mapbench.world.world import LOOK_AHEAD, NO_POSES, World
from tests.worlds import ROOM, line, social

GRID = GridMap.from_rows(ROOM, 0.1)
ROBOT = make_robot("turtlebot3_waffle")
PERIOD, HZ = 5, 100.0


def walk(name, **options):
    return Body(shape=Disc(radius=0.2), motion=MotionSpec(name=name, options=options))


BODIES = [
    line((2.5, 0.8), (0.5, 0.8), 0.3),
    walk("scripted", waypoints=[[0.5, 0.5], [2.0, 0.6], [1.5, 2.5]], speed=0.9, phase=0.3),
    walk("scripted", waypoints=[[2.5, 0.5], [2.5, 2.5], [0.5, 2.5]], speed=1.3, loop=True),
    walk("wander", centre=[1.5, 1.5], reach=0.8, speed=0.7, seed=4),
    social((0.5, 1.5), (2.5, 1.4), sees_robot=False),
    social((2.4, 2.2), (0.6, 0.9), (2.4, 0.6)),
]
"""One of every kind of motion, and more."""
crowds = st.lists(st.sampled_from(BODIES), max_size=4, unique=True)


class Twins:
    """Worlds in a Traffic, and the same worlds by themselves, each with its own clock."""

    def __init__(self, crowds):
        self.records = Worlds(len(crowds))
        self.records.robots["x"] = np.linspace(0.8, 2.0, len(crowds))
        self.records.robots["y"] = 1.1
        self.records.grounds[:] = ground_of(GRID)
        self.traffic = Traffic(self.records.clocks, PERIOD)
        self.plain = [None] * len(crowds)
        for index, bodies in enumerate(crowds):
            self.begin(index, bodies)

    def begin(self, index, bodies):
        member = World(GRID, bodies, HZ, PERIOD, self.records.only(index).clocks)
        self.plain[index] = World(GRID, bodies, HZ, PERIOD)
        for world in (member, self.plain[index]):
            world.watch(self.records.only(index).robots)
        self.traffic.settle(index, member)
        assert member.poses.tobytes() == self.plain[index].poses.tobytes()

    def advance(self, ticks, running):
        self.traffic.advance(ticks, running)
        for world, runs in zip(self.plain, running, strict=True):
            if runs and world.bodies:
                world.advance(ticks)

    def near(self, drive):
        """In which worlds the robot is not driven; no wall is near it."""
        worlds, waiting = copy.deepcopy(self.records), np.ones(len(self.plain), bool)
        commands, walls = np.full((len(waiting), 2), 0.3), np.tile(GRID.framed.reshape(1, -1), (len(waiting), 1))
        self.traffic.drive(worlds, commands, waiting, PERIOD, drive, walls)
        assert ((worlds.robots["x"] != self.records.robots["x"]) == ~waiting).all()
        return waiting

    def check_all(self):
        robots, count = self.records.robots, len(self.plain)
        states = np.stack([robots[name] for name in ("x", "y", "yaw")], axis=1)
        drive, settings = drive_of(ROBOT, HZ), LidarSettings(beams=16)
        proximity = Proximity(ROBOT)
        scanner = np.zeros(3), directions(settings), settings.range_max
        scans = np.full((count, 16), settings.range_max, np.float32)
        self.traffic.scan(robots, np.ones(count, bool), scanner, scans)
        gaps, near = self.traffic.gaps(proximity, states), self.near(drive)
        for i, world in enumerate(self.plain):
            assert (self.traffic.poses[i, : len(world.bodies)] == world.poses).all()
            ranges = np.full(16, settings.range_max, np.float32)
            see_bodies(world.poses, world.radii, *states[i], scanner[1], settings.range_max, ranges)
            assert ranges.tobytes() == scans[i].tobytes()
            assert gaps[i] == (proximity.gap(states[i], world.poses, world.radii) if world.bodies else np.inf)
            assert near[i] == is_near_body(robots, i, 0.3, world.poses, world.radii, world.pace, drive, PERIOD)


@settings(max_examples=40)
@given(st.data())
def test_many_worlds_are_the_worlds_one_by_one(data):
    twins = Twins(data.draw(st.lists(crowds, min_size=1, max_size=4)))
    flags = st.lists(st.booleans(), min_size=len(twins.plain), max_size=len(twins.plain))
    for _ in range(data.draw(st.integers(1, 12))):
        again = data.draw(st.none() | st.integers(0, len(twins.plain) - 1))
        if again is not None:
            twins.begin(again, data.draw(crowds))
        running, late = np.array(data.draw(flags)), data.draw(st.integers(0, PERIOD - 1))
        twins.records.robots["x"] += 0.01
        for ticks in (late, PERIOD - late):
            twins.advance(ticks, running)
            twins.check_all()


@pytest.mark.parametrize("bodies", [BODIES[:4], BODIES])
def test_a_table_that_ends_is_followed_by_the_next(bodies):
    twins = Twins([bodies, [], bodies[:1]])
    running = np.ones(3, bool)
    for step in range(LOOK_AHEAD + 20):
        twins.advance(PERIOD, running)
        if step > LOOK_AHEAD - 20:
            twins.check_all()


def test_a_clock_that_was_put_back_is_followed():
    twins, running = Twins([BODIES[:4]]), np.ones(1, bool)
    for _ in range(LOOK_AHEAD + 5):
        twins.advance(PERIOD, running)
    member = World(GRID, BODIES[:4], HZ, PERIOD, twins.records.clocks)
    twins.plain[0] = World(GRID, BODIES[:4], HZ, PERIOD)
    twins.advance(PERIOD, running)
    twins.check_all()
    assert (member.poses == twins.plain[0].poses).all()


def test_the_poses_of_a_table_do_not_depend_on_where_it_begins():
    world = World(GRID, BODIES[:4], HZ, PERIOD)
    for step in range(LOOK_AHEAD + 40):
        expected = World(GRID, BODIES[:4], HZ, PERIOD).after(step * PERIOD) if step % 9 == 0 else world.poses
        assert world.poses.tobytes() == expected.tobytes()
        world.advance(PERIOD)


@given(st.integers(1, 6), st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_the_longest_step_of_a_table(steps, bodies, seed):
    table = np.random.default_rng(seed).normal(size=(steps, bodies, 3)).round(1)
    squared, number = farthest_step(table)
    moved = (np.diff(table[:, :, :2], axis=0) ** 2).sum(axis=2)
    assert squared == moved.max(initial=0.0)
    assert number == (moved.max(axis=0).argmax() if squared else 0)
    assert farthest_step(NO_POSES) == (0.0, 0)
