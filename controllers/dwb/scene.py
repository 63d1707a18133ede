"""What the critics are told of one cycle, and the map grids they share."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import Twist
from controllers.dwb.kernels.plan import distance_field, seed_cells
from gym_mapbench.costmap import Costmap
from gym_mapbench.footprint import Footprint
from gym_mapbench.scenario import Pose


class Field(NamedTuple):
    """Manhattan distances in cells near the robot.

    Args:
        distances: ``(cells,)`` int32, some whole rows of the map, filled within reach of the robot.
        skipped: Number of cells of the map before them.
        reached: Whether there is any seed; without one all distances are ``cells of the map + 1``.
    """

    distances: NDArray[np.int32]
    skipped: int
    reached: bool


@dataclass
class Scene:
    """One cycle.

    Args:
        pose: Pose of the robot.
        velocity: Its velocity.
        goal: Last pose of the global plan.
        plan: ``(n, 3)`` the part of the global plan near the robot.
        costmap: The local costmap.
        footprint: The padded footprint.
        now: Seconds since the start of the run.
        reach: Distance from the robot within which all scored points lie, m.
    """

    pose: Pose
    velocity: Twist
    goal: Pose
    plan: NDArray[np.float64]
    costmap: Costmap
    footprint: Footprint
    now: float
    reach: float
    _seeds: NDArray[np.int64] | None = field(default=None, repr=False)
    _path_field: Field | None = field(default=None, repr=False)

    def goal_distance(self) -> float:
        """Distance from the robot to the goal, squared, m^2."""
        dx, dy = self.pose.x - self.goal.x, self.pose.y - self.goal.y
        return dx * dx + dy * dy

    def seeds(self) -> NDArray[np.int64]:
        """Flat indices of the plan's cells, from the first on the known map to the first that is not."""
        if self._seeds is None:
            self._seeds = self.cells_of(self.plan)
        return self._seeds

    def cells_of(self, plan: NDArray[np.float64]) -> NDArray[np.int64]:
        """As :meth:`seeds`, of another plan."""
        c = self.costmap
        cells: NDArray[np.int64] = seed_cells(plan, c.costs, c.origin_x, c.origin_y, c.resolution)
        return cells

    def path_field(self) -> Field:
        """Distances to the plan; made once, for PathDist and PathAlign."""
        if self._path_field is None:
            self._path_field = self.field_of(self.seeds())
        return self._path_field

    def field_of(self, seeds: NDArray[np.int64]) -> Field:
        """Return the distances to the nearest of ``seeds`` in the part of the map within ``reach``."""
        c = self.costmap
        x, y = self.pose.x - c.origin_x, self.pose.y - c.origin_y
        distances, skipped = distance_field(seeds, c.costs.shape, x, y, self.reach, c.resolution)
        return Field(distances, skipped, len(seeds) > 0)
