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
    """Simulate the turn in steps of one control period, and check the cost under the outline.

    The check ends at the heading at which the primary controller would take over. As in Nav2 the angles are compared
    with their signs, so as long as ``turn_left`` is positive only a turn to the right can end the check.

    Args:
        grid: ``(costs, resolution, origin_x, origin_y, track_unknown)`` of the costmap.
        corners: ``(k, 2)`` padded footprint, m.
        x: Pose of the robot, m.
        y: Pose of the robot, m.
        yaw: Pose of the robot, rad.
        turn_rate: Turn rate, rad/s.
        turn_left: Angle after which the primary controller would take over, rad.
        period: One control period, s.
        ahead: How long to look ahead, s.
        max_cost: Cost from which on the turn is not free.
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
