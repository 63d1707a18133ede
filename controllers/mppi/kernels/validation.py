"""Whether the chosen trajectory collides (Lyrical).

Source: nav2_mppi_controller (Lyrical): optimal_trajectory_validator.hpp, and Optimizer::integrateStateVelocities.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.elementary import sin_cos
from controllers.mppi.kernels.window import INSCRIBED, LETHAL
from gym_mapbench.kernels.footprint import footprint_cost
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel


@kernel
def _touches(costs, call, x, y, yaw, corners, by_footprint):
    """Whether a pose collides; the centre of a robot may lie off the map, its footprint may not."""
    resolution, origin_x, origin_y = call.resolution, call.origin_x, call.origin_y
    if by_footprint:
        return footprint_cost(costs, resolution, origin_x, origin_y, x, y, yaw, corners) == LETHAL
    rows, cols = costs.shape
    cell = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
    cost = 0 if cell < 0 else costs[cell // cols, cell % cols]
    return cost in (LETHAL, INSCRIBED)


@kernel
def collides_along(call_of, dt, v, w, points, costs, corners, by_footprint):
    """Whether any of the first points of the trajectory of a control sequence collides.

    Args:
        call_of: ``(1,)`` record of the call.
        dt: Period, s.
        v: ``(time_steps,)`` control sequence, m/s.
        w: The same, rad/s.
        points: How many points are checked.
        costs: ``(rows, cols)`` uint8 costmap.
        corners: ``(n, 2)`` footprint, m.
        by_footprint: Whether the outline of the footprint is checked, rather than the cell of the centre.
    """
    call, period = call_of[0], np.float32(dt)
    x, y, yaw = np.float32(call.x), np.float32(call.y), np.float32(call.yaw)
    for t in range(min(points, len(v))):
        sin, cos = sin_cos(yaw)
        x, y, yaw = x + (v[t] * cos) * period, y + (v[t] * sin) * period, yaw + w[t] * period
        if _touches(costs, call, np.float64(x), np.float64(y), np.float64(yaw), corners, by_footprint):
            return True
    return False
