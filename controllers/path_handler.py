"""Lyrical's path handler: its parameters, and how parameter files name it.

Source: nav2_controller (Lyrical) plugins/feasible_path_handler.cpp.
"""

from __future__ import annotations

from gym_mapbench.quantities import NonNegative
from gym_mapbench.ros_params import Keys, RosNames, since
from gym_mapbench.settings import Settings


class PathHandler(Settings):
    """The path handler: the part of the plan that every controller is given.

    Args:
        prune_distance: Length of that part, m.
        max_robot_pose_search_dist: Length of the plan that is searched for the nearest pose, m; None for half the
            longer side of the local costmap, negative for the whole plan.
        enforce_path_inversion: Whether the plan ends at its next cusp until the robot is there.
        enforce_path_rotation: Whether the plan ends at its next turn on the spot until the robot is there.
        inversion_xy_tolerance: Distance to the end within which the robot is there, m.
        inversion_yaw_tolerance: Difference of the headings within which the robot is there, rad.
        minimum_rotation_angle: Least change of the heading that counts as a turn on the spot, rad.
        reject_unit_path: Whether a plan of one pose is no path.
    """

    prune_distance: NonNegative = 2.0
    max_robot_pose_search_dist: float | None = None
    enforce_path_inversion: bool = False
    enforce_path_rotation: bool = False
    inversion_xy_tolerance: NonNegative = 0.2
    inversion_yaw_tolerance: NonNegative = 0.4
    minimum_rotation_angle: NonNegative = 0.785
    reject_unit_path: bool = False


PATH_HANDLERS: dict[str, RosNames] = {"feasible": since("lyrical", "nav2_controller::FeasiblePathHandler")}
"""Our names of the path handlers -> their classes in ROS."""
PATH_HANDLER_KEYS = Keys(ros_only=frozenset({"plugin", "transform_tolerance"}))
PATH_HANDLER_ID = "PathHandler"
"""Name of the path handler in a file that does not name it."""
