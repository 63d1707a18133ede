"""Whether a turn on the spot touches anything.

Source: nav2_rotation_shim_controller: src/nav2_rotation_shim_controller.cpp, ``isCollisionFree`` (Humble and Jazzy).
"""

from __future__ import annotations

from gym_mapbench.kernels.footprint import footprint_cost
from gym_mapbench.kernels.geometry import normalize_angle
from gym_mapbench.kernels.jit import kernel

NO_INFORMATION = 255


@kernel
def turn_is_free(grid, corners, x, y, yaw, turn_rate, turn_left, period, ahead, max_cost):
    """Turn for a time in steps of one control period, and look at the cost under the outline.

    The check ends where the turn has come as far as the primary controller would take over. Nav2 compares with a sign:
    where that is still ahead, only a turn to the right ends so.

    Args:
        grid: ``(costs, resolution, origin_x, origin_y, track_unknown)`` of the costmap.
        corners: ``(k, 2)`` padded footprint, m.
        x: Pose of the robot, m.
        y: Pose of the robot, m.
        yaw: Pose of the robot, rad.
        turn_rate: rad/s.
        turn_left: Angle after which the primary controller would take over, rad.
        period: One control period, s.
        ahead: How long to look ahead, s.
        max_cost: From which cost on the turn is not free.
    """
    costs, resolution, origin_x, origin_y, track_unknown = grid
    time = 0.0
    while time < ahead:
        time += period
        heading = yaw + turn_rate * time
        if normalize_angle(yaw - heading) >= turn_left:
            return True
        cost = footprint_cost(costs, resolution, origin_x, origin_y, x, y, heading, corners)
        if cost >= max_cost or (cost == NO_INFORMATION and track_unknown):
            return False
    return True
