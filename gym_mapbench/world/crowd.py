"""Crowds: where all bodies of a scenario are, those included that walk by social forces.

A crowd moves on in steps of 0.05 s; in between, its people move evenly. A person who sees the robot sees it where it
was at the last control step, so a recorded run says where everybody was.
"""

from __future__ import annotations

import copy
import functools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.kernels.social_force import PERSON, STEP, walk_people
from gym_mapbench.world.bodies import Body, place_bodies
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.pedestrians import SocialForce
from gym_mapbench.world.state import Records

Floats = NDArray[np.float64]

CHUNK = 512
"""Steps of a crowd that are computed at once where nobody sees the robot."""
POINTS_PER_METRE = 10.0
"""Number of points by which PySocialForce replaces a metre of wall."""


class Track(NamedTuple):
    """The robot of a run, as people see it.

    Args:
        period: Time between two states, s.
        states: ``(n, 5)`` x, y (m), yaw (rad), v (m/s), omega (rad/s) from time 0 on; then the last one stays.
    """

    period: float
    states: Floats


def place_crowd(grid: GridMap, bodies: Sequence[Body], times: Floats, track: Track | None = None) -> Floats:
    """Return where bodies are: ``(times, bodies, 3)`` x, y (m), yaw (rad).

    Args:
        grid: The walls.
        bodies: The bodies of a scenario.
        times: ``(n,)`` simulated seconds since the start.
        track: The robot that people see; None if there is none.

    Raises:
        ConfigError: If a motion returns anything but a finite pose for every time.
        PluginError: If a third party's motion fails.
    """
    bodies = tuple(bodies)
    if not any(isinstance(body.motion.motion, SocialForce) for body in bodies):
        return place_bodies(bodies, times)
    after = np.ceil(_steps_until(times)).astype(np.int64)
    steps = int(after.max(initial=0))
    if track is None or not sees_robot(bodies):
        rows = _walked_alone(grid, bodies, steps)
    else:
        seen = np.floor(np.arange(steps) * STEP / track.period + 1e-6).astype(np.int64)
        rows = Crowd(grid, bodies).walk(track.states[np.minimum(seen, len(track.states) - 1)])
    rows = np.concatenate([Crowd(grid, bodies).poses[None], rows])
    return _between(rows[np.maximum(after - 1, 0)], rows[after], (after - _steps_until(times))[:, None, None])


def sees_robot(bodies: Sequence[Body]) -> bool:
    """Return whether anybody sees the robot."""
    motions = (body.motion.motion for body in bodies)
    return any(isinstance(motion, SocialForce) and motion.sees_robot for motion in motions)


class Crowd:
    """The bodies of a scenario, which walk on step by step from time 0.

    Args:
        grid: The walls.
        bodies: The bodies.

    Attributes:
        poses: ``(bodies, 3)`` where they are after the last step: x, y (m), yaw (rad).
    """

    def __init__(self, grid: GridMap, bodies: tuple[Body, ...]) -> None:
        self._bodies, self._walls = bodies, wall_points(grid)
        self._people, self._goals = _gathered(bodies)
        self._step = self._first = 0
        self._others = self._others_from(0)
        self.poses = self._others[0].copy()
        walks = self._people["walks"]
        self.poses[walks] = np.stack([self._people[name][walks] for name in ("x", "y", "yaw")], axis=1)
        self._before = self.poses

    def walk(self, robots: Floats) -> Floats:
        """Take a step for every row of ``robots``; return the poses after each, ``(steps, bodies, 3)``.

        Args:
            robots: ``(steps, 5)`` as in :class:`Track`; not finite where there is none.
        """
        walked = np.empty((len(robots), len(self._bodies), 3))
        for begin in range(0, len(robots), CHUNK):
            self._walk(robots[begin : begin + CHUNK], walked[begin : begin + CHUNK])
        return walked

    def follow(self, time: float, robot: Floats) -> Floats:
        """Walk on until a time, s, past a robot ``(5,)`` as in :class:`Track`; return the poses then."""
        until = float(_steps_until(np.array(time)))
        steps = math.ceil(until) - self._step
        self.walk(np.repeat(robot[None], max(steps, 0), axis=0))
        return _between(self._before, self.poses, np.array(self._step - until))

    def _walk(self, robots: Floats, poses: Floats) -> None:
        """Take at most ``CHUNK`` steps, and write the poses after each."""
        walk_people(self._people, self._goals, self._others_for(len(poses)), self._walls, robots, poses)
        self._step += len(poses)
        self._before, self.poses = np.concatenate([self.poses[None], poses])[-2:]

    def _others_for(self, steps: int) -> Floats:
        """Return the poses of the bodies that no social force moves, now and after each of some steps."""
        if self._step + steps - self._first >= len(self._others):
            self._first, self._others = self._step, self._others_from(self._step)
        begin = self._step - self._first
        return self._others[begin : begin + steps + 1]

    def _others_from(self, step: int) -> Floats:
        """Compute them, ``(CHUNK + 1, bodies, 3)``; zeros stand for people who walk by social forces."""
        poses = np.zeros((CHUNK + 1, len(self._bodies), 3))
        others = np.flatnonzero(~self._people["walks"])
        times = STEP * np.arange(step, step + CHUNK + 1, dtype=np.float64)
        poses[:, others] = place_bodies([self._bodies[i] for i in others], times)
        return poses


@functools.lru_cache(maxsize=16)
def wall_points(grid: GridMap) -> Floats:
    """Return points on the walls, the map's edge included: ``(n, 3)`` x, y (m), and a weight.

    The weight is the number of points of PySocialForce that a point stands for. Every side of an occupied cell that a
    free cell touches gets as many points as PySocialForce gives it, but at least one.
    """
    count = max(1, round(grid.resolution * POINTS_PER_METRE))
    sides = [_sides_of(grid.framed), _sides_of(grid.framed.T)[:, [1, 0, 3, 2]]]
    ends = np.concatenate(sides)
    shares = (np.arange(count) + 0.5) / count
    points = (ends[:, None, :2] + shares[:, None] * (ends[:, None, 2:] - ends[:, None, :2])).reshape(-1, 2)
    weights = np.full((len(points), 1), grid.resolution * POINTS_PER_METRE / count)
    return np.hstack([points * grid.resolution + np.array(grid.origin), weights])


def _sides_of(framed: NDArray[np.bool_]) -> Floats:
    """Return the sides between an occupied and a free cell of one row: ``(n, 4)`` x, y of both ends, in cells."""
    row, col = np.nonzero(framed[:, 1:] != framed[:, :-1])
    ends: Floats = np.stack([col, row - 1, col, row], axis=1).astype(np.float64)
    return ends


def _gathered(bodies: Sequence[Body]) -> tuple[Records, Floats]:
    """Return the bodies as PERSON records at time 0, and the goals ``(k, 2)`` of all."""
    people, goals = np.zeros(len(bodies), PERSON), list[tuple[float, float]]()
    for person, body in zip(people, bodies, strict=True):
        motion = body.motion.motion
        person["radius"] = body.shape.radius
        if isinstance(motion, SocialForce):
            (x, y), (to_x, to_y) = motion.waypoints[0], motion.goals[0]
            yaw = math.atan2(to_y - y, to_x - x)
            person["x"], person["y"], person["yaw"], person["speed"] = x, y, yaw, motion.speed
            person["vx"], person["vy"] = motion.speed * math.cos(yaw), motion.speed * math.sin(yaw)
            person["wall_factor"] = motion.wall_factor
            person["first"], person["count"] = len(goals), len(motion.goals)
            person["walks"], person["sees_robot"] = True, motion.sees_robot
            goals += motion.goals
    return people, np.array(goals).reshape(-1, 2)


def _walked_alone(grid: GridMap, bodies: tuple[Body, ...], steps: int) -> Floats:
    """Return the poses ``(steps, bodies, 3)`` after every step without robot, from the chunks that are kept."""
    chunks = [_chunk(grid, bodies, number)[1] for number in range(math.ceil(steps / CHUNK))]
    return np.concatenate([np.empty((0, len(bodies), 3)), *chunks])[:steps]


@functools.lru_cache(maxsize=64)
def _chunk(grid: GridMap, bodies: tuple[Body, ...], number: int) -> tuple[Crowd, Floats]:
    """Return a crowd after some chunks without robot, and its poses ``(CHUNK, bodies, 3)`` during the last of them."""
    crowd = copy.deepcopy(_chunk(grid, bodies, number - 1)[0]) if number else Crowd(grid, bodies)
    return crowd, crowd.walk(np.full((CHUNK, 5), np.nan))


def _steps_until(times: Floats) -> Floats:
    """Return times as numbers of steps; whole numbers are exact."""
    steps: Floats = times / STEP
    whole = np.rint(steps)
    return np.where(np.abs(steps - whole) < 1e-6, whole, steps)


def _between(before: Floats, after: Floats, left: Floats) -> Floats:
    """Return the poses between two steps; ``left`` is the share of the step that is not walked yet."""
    poses = after.copy()
    poses[..., :2] -= left * (after - before)[..., :2]
    return poses
