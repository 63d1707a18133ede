"""World: the walls of a map and the bodies that move among them, and the one clock that moves the bodies on.

Whatever sees or touches the world asks here: the scanner (:mod:`gym_mapbench.world.lidar`), Box2D
(:mod:`gym_mapbench.world.box2d`), the env's pictures, and the vector env. A recorded run is drawn from the same
functions, through :func:`~gym_mapbench.world.crowd.place_crowd`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.bodies import bodies_near, farthest_step
from gym_mapbench.kernels.motion import MAX_TICK_TRAVEL
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.crowd import Crowd, place_crowd, sees_robot
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.state import Records

Floats = NDArray[np.float64]

WALL, BODY = 1, 2
"""What the robot touched; the values add up where it touched both, and 0 stands for nothing."""

STANDS = 0.01
"""Largest speed that counts as standing still, m/s and rad/s."""

LOOK_AHEAD = 512
"""Control steps for which the poses of all bodies are computed at once."""

NO_POSES: Floats = np.empty((1, 0, 3))


class World:
    """One world from the start of an episode on. A world without bodies never changes.

    Motions say where bodies are at every control step; in between, bodies move evenly.

    Args:
        grid: The walls; unknown cells are free, the map's edge is a wall.
        bodies: What moves.
        physics_hz: Ticks per second.
        ticks: Ticks per control step.
        clock: Holds the time of the world, ``(1,)`` ticks since the start; None for a clock of its own.

    Attributes:
        radii: ``(bodies,)`` radius of every body, m.
        table: ``(steps, bodies, 3)`` where the bodies are at control steps: x, y (m), yaw (rad).
        first: Number of the control step with which the table begins.
        pace: Longest distance that a body moves in a tick, m, as far as the table knows.

    Raises:
        ConfigError: If a motion has no finite pose, or is too fast for Box2D.
    """

    def __init__(
        self,
        grid: GridMap,
        bodies: Sequence[Body] = (),
        physics_hz: float = 100.0,
        ticks: int = 1,
        clock: NDArray[np.int64] | None = None,
    ) -> None:
        self.grid, self.bodies, self.physics_hz = grid, tuple(bodies), physics_hz
        self.radii: Floats = np.array([body.shape.radius for body in self.bodies])
        self._ticks = ticks
        self._clock = np.zeros(1, np.int64) if clock is None else clock
        self._clock[0] = 0
        self._crowd: Crowd | None = None
        self._robots: Records | None = None
        self.table, self.first, self.pace = NO_POSES, 0, 0.0
        if self.bodies:
            self.look_ahead()
        self._placed: tuple[int, Floats] = (0, self.table[0])

    def watch(self, robots: Records) -> None:
        """Let people who see the robot see this one, ``(1,)`` ROBOT, from time 0 on.

        They look at the beginning of every control step, so :meth:`advance` has to stop there from now on.
        """
        if sees_robot(self.bodies):
            self._crowd, self._robots = Crowd(self.grid, self.bodies), robots
            self.look_ahead()

    def advance(self, ticks: int) -> None:
        """Let time pass: the bodies move on by some physics ticks."""
        now = self._clock.item(0) + ticks
        self._clock[0] = now
        if now // self._ticks + 1 - self.first >= len(self.table):
            self.look_ahead()

    def look_ahead(self) -> None:
        """Compute the table anew, from now on; :meth:`advance` does where a table ends."""
        step = self._clock.item(0) // self._ticks
        self.table = self._poses_from(step, LOOK_AHEAD) if self._robots is None else self._seen_from(step)
        self.first = step
        self._measure_pace()

    @property
    def poses(self) -> Floats:
        """``(bodies, 3)`` where the bodies are now: x, y (m), yaw (rad)."""
        now = self._clock.item(0)
        if now != self._placed[0]:
            self._placed = now, self.after(0)
        return self._placed[1]

    def after(self, ticks: int) -> Floats:
        """Return where the bodies are after some more ticks, ``(bodies, 3)``."""
        step, rest = divmod(self._clock.item(0) + ticks, self._ticks)
        table, row = self.table, step - self.first
        if not rest and 0 <= row < len(table):
            now: Floats = table[row]
            return now
        if self._robots is None and not 0 <= row < len(table) - 1:
            table, row = self._poses_from(step, 1), 0
        poses: Floats = table[row].copy()
        poses[:, :2] += rest / self._ticks * (table[row + 1] - table[row])[:, :2]
        return poses

    @property
    def velocities(self) -> Floats:
        """``(bodies, 2)`` how fast the bodies move on, m/s."""
        if not self.bodies:
            return np.empty((0, 2))
        moved: Floats = (self.after(1) - self.poses)[:, :2] * self.physics_hz
        return moved

    def near(self, x: float, y: float, drive: Records, ticks: int) -> list[int]:
        """Return the numbers of the bodies that a robot might meet within the next ticks.

        Args:
            x: Position of the robot, m.
            y: The same.
            drive: ``(1,)`` DRIVE of the robot.
            ticks: Number of physics steps.
        """
        met: list[int] = bodies_near(self.poses, self.radii, self.pace, x, y, drive, ticks).tolist()
        return met

    def _poses_from(self, step: int, steps: int) -> Floats:
        """Return the poses ``(steps + 1, bodies, 3)`` from a control step on, without robot."""
        ticks = np.arange(step, step + steps + 1) * self._ticks
        return place_crowd(self.grid, self.bodies, ticks / self.physics_hz)

    def _seen_from(self, step: int) -> Floats:
        """Return the poses ``(2, bodies, 3)`` now and at the end of a control step, as people see the robot now."""
        assert self._crowd is not None
        assert self._robots is not None
        x, y, yaw, _, _, v, w, *_ = self._robots.item(0)
        end = (step + 1) * self._ticks / self.physics_hz
        return np.stack([self.poses, self._crowd.follow(end, np.array([x, y, yaw, v, w]))])

    def _measure_pace(self) -> None:
        """Measure the pace over the table; refuse what Box2D cannot follow."""
        squared, number = farthest_step(self.table)
        self.pace = math.sqrt(squared) / self._ticks
        if self.pace > MAX_TICK_TRAVEL * (1 + 1e-9):
            limit, speed = MAX_TICK_TRAVEL * self.physics_hz, self.pace * self.physics_hz
            raise ConfigError(
                f"body {number} ({self.bodies[number].motion.name}): expected at most {limit:g} m/s at "
                f"{self.physics_hz:g} physics steps per second, got {speed:g} m/s"
            )


def stands_still(velocities: ArrayLike) -> NDArray[np.bool_]:
    """Return whether a robot stands still, at velocities ``(..., 2)`` m/s and rad/s.

    A contact is the body's if the robot stood still at the beginning of the control step in which it is felt.
    """
    stands: NDArray[np.bool_] = np.abs(velocities).max(axis=-1) <= STANDS
    return stands
