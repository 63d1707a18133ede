"""Proximity: the distance from the robot's outline to the nearest moving body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.kernels.people import nearest_gap, nearest_gaps
from gym_mapbench.world.robot import RobotSpec

Floats = NDArray[np.float64]
NO_CORNERS: Floats = np.empty((0, 2))


class Proximity:
    """Measures how near bodies are to a robot.

    Args:
        robot: Its shape.
    """

    def __init__(self, robot: RobotSpec) -> None:
        outline = robot.footprint
        self._corners = NO_CORNERS if outline is None else counter_clockwise(np.asarray(outline, dtype=np.float64))
        self._radius = robot.radius

    def gaps(self, states: Floats, places: Floats, radii: Floats) -> Floats:
        """Return the distance from the robot's outline to that of the nearest body, ``(n,)`` m; inf without bodies.

        Args:
            states: ``(n, 3)`` poses of the robot, m, rad.
            places: ``(n, bodies, 3)`` poses of the bodies.
            radii: ``(n, bodies)`` radii of the bodies, m; 0 stands for no body.
        """
        gaps: Floats = nearest_gaps(states, places, radii, self._radius, self._corners)
        return gaps

    def gap(self, state: Floats, places: Floats, radii: Floats) -> float:
        """Return what :meth:`gaps` returns, for one robot ``(3,)`` among bodies ``(bodies, 3)`` and ``(bodies,)``."""
        gap: float = nearest_gap(state, places, radii, self._radius, self._corners)
        return gap


def counter_clockwise(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners ``(n, 2)`` of a polygon in counter-clockwise order."""
    x, y = corners.T
    area = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    return np.ascontiguousarray(corners if area > 0 else corners[::-1])
