"""The state of many worlds in arrays of records, which one kernel reads and writes for all of them."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.kernels.motion import BOX, DRIVE, GROUND, ROBOT
from gym_mapbench.kernels.task import TASK
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.plant import PLANTS, PlantName
from gym_mapbench.world.robot import RobotSpec

Records = NDArray[Any]
"""An array of records, whose type is in the kernels."""


class Worlds:
    """The state of ``count`` worlds, and where their maps lie.

    Attributes:
        robots: ``(count,)`` :data:`~gym_mapbench.kernels.motion.ROBOT`.
        boxes: ``(count,)`` :data:`~gym_mapbench.kernels.motion.BOX`.
        tasks: ``(count,)`` :data:`~gym_mapbench.kernels.task.TASK`.
        grounds: ``(count,)`` :data:`~gym_mapbench.kernels.motion.GROUND`.
        clocks: ``(count,)`` physics ticks since the start, in worlds with bodies.
        commands: ``(count, 2)`` the last command, m/s and rad/s, with the error of the motors.
    """

    def __init__(self, count: int = 1) -> None:
        self.robots: Records = np.zeros(count, ROBOT)
        self.boxes: Records = np.zeros(count, BOX)
        self.tasks: Records = np.zeros(count, TASK)
        self.grounds: Records = np.zeros(count, GROUND)
        self.clocks: NDArray[np.int64] = np.zeros(count, np.int64)
        self.commands: NDArray[np.float64] = np.zeros((count, 2))

    def only(self, index: int) -> Worlds:
        """Return one of the worlds, which shares its arrays with all."""
        one = Worlds(0)
        for name, records in vars(self).items():
            setattr(one, name, records[index : index + 1])
        return one


def ground_of(grid: GridMap) -> tuple[Any, ...]:
    """Return the GROUND of a map."""
    return grid.resolution, *grid.origin, *grid.shape


@functools.lru_cache(maxsize=8)
def drive_of(robot: RobotSpec, physics_hz: float, plant: PlantName = "ideal") -> Records:
    """Return the ``(1,)`` DRIVE of a robot; cached, as every episode asks for it."""
    tick, late = 1.0 / physics_hz, PLANTS[plant].late
    substeps = PLANTS[plant].substeps(tick)
    speeds = robot.max_linear_velocity, robot.max_reverse_velocity, robot.max_angular_velocity
    changes = (
        robot.max_linear_acceleration * tick / substeps,
        robot.max_angular_acceleration * tick / substeps,
    )
    return np.array([(tick, *speeds, *changes, robot.circumscribed_radius, substeps, late)], DRIVE)
