"""World: the walls of a map and the bodies that move among them, and the one clock that moves the bodies on.

Whatever sees or touches the world asks here: the scanner (:mod:`gym_mapbench.world.lidar`), Box2D
(:mod:`gym_mapbench.world.box2d`), the env's pictures, and the vector env. A recorded run is drawn from the same
function of time, :func:`~gym_mapbench.world.bodies.place_bodies`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.bodies import bodies_near
from gym_mapbench.kernels.motion import MAX_TICK_TRAVEL
from gym_mapbench.world.bodies import Body, place_bodies
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.state import Records

Floats = NDArray[np.float64]

WALL, BODY = 1, 2
"""What the robot touched; the values add up where it touched both, and 0 stands for nothing."""

LOOK_AHEAD = 1024
"""Physics ticks for which the poses of all bodies are computed at once."""

NO_POSES: Floats = np.empty((1, 0, 3))


class World:
    """One world from the start of an episode on. A world without bodies never changes.

    Args:
        grid: The walls; unknown cells are free, the map's edge is a wall.
        bodies: What moves.
        physics_hz: Ticks per second.

    Attributes:
        radii: ``(bodies,)`` radius of every body, m.
        poses: ``(bodies, 3)`` where the bodies are now: x, y (m), yaw (rad).

    Raises:
        ConfigError: If a motion has no finite pose, or is too fast for Box2D.
    """

    def __init__(self, grid: GridMap, bodies: Sequence[Body] = (), physics_hz: float = 100.0) -> None:
        self.grid, self.bodies, self.physics_hz = grid, tuple(bodies), physics_hz
        self.radii: Floats = np.array([body.shape.radius for body in self.bodies])
        self._now = self._first = 0
        self._table = self._poses_from(0, LOOK_AHEAD) if self.bodies else NO_POSES
        self.poses: Floats = self._table[0]

    def advance(self, ticks: int) -> None:
        """Let time pass: the bodies move on by some physics ticks."""
        self.poses = self.course(ticks)[-1]
        self._now += ticks

    def course(self, ticks: int) -> Floats:
        """Return where the bodies are now and after each of the next ticks, ``(ticks + 1, bodies, 3)``."""
        begin = self._now - self._first
        if begin + ticks >= len(self._table):
            self._table = self._poses_from(self._now, max(ticks, LOOK_AHEAD))
            self._first, begin = self._now, 0
        return self._table[begin : begin + ticks + 1]

    def near(self, x: float, y: float, drive: Records, ticks: int) -> list[int]:
        """Return the numbers of the bodies that a robot might meet within the next ticks.

        Args:
            x: Position of the robot, m.
            y: The same.
            drive: ``(1,)`` DRIVE of the robot.
            ticks: Number of physics steps.
        """
        met: list[int] = bodies_near(self.poses, self.radii, x, y, drive, ticks).tolist()
        return met

    def _poses_from(self, first: int, ticks: int) -> Floats:
        """Compute the poses ``(ticks + 1, bodies, 3)`` from a tick on."""
        poses = place_bodies(self.bodies, np.arange(first, first + ticks + 1) / self.physics_hz)
        travelled = np.hypot(*np.moveaxis(np.diff(poses[:, :, :2], axis=0), 2, 0)).max(axis=0)
        number = int(travelled.argmax())
        if travelled[number] > MAX_TICK_TRAVEL * (1 + 1e-9):
            name, fastest = self.bodies[number].motion.name, MAX_TICK_TRAVEL * self.physics_hz
            raise ConfigError(
                f"body {number} ({name}): expected at most {fastest:g} m/s at {self.physics_hz:g} physics steps per "
                f"second, got {travelled[number] * self.physics_hz:g} m/s"
            )
        return poses
