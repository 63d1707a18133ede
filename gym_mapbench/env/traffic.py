"""The bodies of many worlds side by side, for the kernels of the vector env."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.kernels.bodies import drive_robots_among, move_bodies, scan_bodies
from gym_mapbench.world.proximity import Proximity
from gym_mapbench.world.state import Records, Worlds
from gym_mapbench.world.world import LOOK_AHEAD, World

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Traffic:
    """Moves the bodies of many worlds on, and asks the kernels about them; false where no world has bodies.

    Args:
        clocks: ``(count,)`` ticks since the start of every world.
        period: Ticks per control step.

    Attributes:
        poses: ``(count, bodies, 3)`` where the bodies are now: x, y (m), yaw (rad); zeros beyond the last one.
    """

    def __init__(self, clocks: Records, period: int) -> None:
        self._clocks, self._period = clocks, period
        self._worlds: dict[int, World] = {}
        self._firsts = np.zeros(len(clocks), np.int64)
        self._counts = np.zeros(len(clocks), np.int64)
        self._tables = np.zeros((len(clocks), LOOK_AHEAD + 1, 0, 3))
        self.poses = np.zeros((len(clocks), 0, 3))
        self._radii = np.zeros((len(clocks), 0))
        self._paces = np.zeros(len(clocks))

    def __bool__(self) -> bool:
        return bool(self._worlds)

    def settle(self, index: int, world: World) -> None:
        """Take over the bodies of a world whose episode begins."""
        self._worlds.pop(index, None)
        self._counts[index] = 0
        self._radii[index], self.poses[index] = 0.0, 0.0
        if world.bodies:
            self._make_room(len(world.bodies))
            self._worlds[index] = world
            self._radii[index, : len(world.bodies)] = world.radii
            self._take(index)

    def advance(self, ticks: int, running: Mask) -> None:
        """Let time pass in the worlds that are running."""
        ending = move_bodies(
            self._clocks, running, ticks, self._period, self._firsts, self._counts, self._tables, self.poses
        )
        for index in ending.tolist():
            self._worlds[index].look_ahead()
            self._take(index)

    def _take(self, index: int) -> None:
        """Copy the table of a world."""
        world = self._worlds[index]
        self._firsts[index], self._counts[index], self._paces[index] = world.first, len(world.table), world.pace
        self._tables[index, : len(world.table), : len(world.bodies)] = world.table
        self.poses[index, : len(world.bodies)] = world.poses

    def _make_room(self, bodies: int) -> None:
        """Let every world have so many bodies."""
        more = bodies - self._radii.shape[1]
        if more > 0:
            self._tables = np.pad(self._tables, ((0, 0), (0, 0), (0, more), (0, 0)))
            self.poses = np.pad(self.poses, ((0, 0), (0, more), (0, 0)))
            self._radii = np.pad(self._radii, ((0, 0), (0, more)))

    def drive(self, worlds: Worlds, commands: Floats, waiting: Mask, ticks: int, drive: Records, walls: Mask) -> None:
        """Drive the robots that nothing is near, as :func:`~gym_mapbench.kernels.bodies.drive_robots_among`."""
        robots, boxes, grounds = worlds.robots, worlds.boxes, worlds.grounds
        bodies = self.poses, self._radii, self._paces
        drive_robots_among(robots, boxes, commands, waiting, ticks, drive, grounds, walls, *bodies)

    def gaps(self, proximity: Proximity, poses: Floats) -> Floats:
        """Return the distance from every robot, at poses ``(count, 3)``, to its nearest body, ``(count,)`` m."""
        return proximity.gaps(poses, self.poses, self._radii) if self else np.full(len(poses), np.inf)

    def scan(
        self,
        robots: Records,
        seen: Mask,
        scanner: tuple[Floats, Floats, float],
        ranges: Records,
    ) -> None:
        """Shorten the ranges ``(count, beams)`` where a body is nearer than the wall.

        Args:
            robots: ``(count,)`` ROBOT.
            seen: ``(count,)`` which worlds to look at.
            scanner: Place on the robot, directions of the beams, and longest range.
            ranges: Out, m.
        """
        scan_bodies(robots, seen, self.poses, self._radii, *scanner, ranges)
