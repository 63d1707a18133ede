"""The part of a plan near the robot, as Regulated Pure Pursuit and the Graceful Controller take it.

``tuning`` is a record with ``max_robot_pose_search_dist`` (m; NaN for half the costmap) and the switches that say how
the release searches: ``last_of_equals``, ``keeps_segment`` and ``searches_width``.

Source: nav2_regulated_pure_pursuit_controller: src/regulated_pure_pursuit_controller.cpp (Humble) and
src/path_handler.cpp (Jazzy); nav2_graceful_controller: src/path_handler.cpp.
"""

from __future__ import annotations

import math

from gym_mapbench.kernels.jit import kernel


def search_distance(max_robot_pose_search_dist: float | None) -> float:
    """Return the parameter as kernels take it, m: NaN for half the costmap, infinity for the whole path."""
    if max_robot_pose_search_dist is None:
        return math.nan
    return math.inf if max_robot_pose_search_dist < 0.0 else max_robot_pose_search_dist


@kernel
def distance(path, i, x, y):
    """Distance from a point to pose i of the path, m."""
    dx, dy = path[i, 0] - x, path[i, 1] - y
    return math.sqrt(dx * dx + dy * dy)


@kernel
def nearest_pose(path, steps, begin, x, y, search_dist, tuning):
    """Index of the pose nearest to the robot among those within ``search_dist`` (m) along the path.

    ``steps[i]`` is the distance from pose i to i + 1. Of equally near poses the first is taken, or with
    ``last_of_equals`` the last. If that is the last pose searched, ``keeps_segment`` takes the one before it, so that a
    segment remains.
    """
    first, nearest, travelled, bound = begin, math.inf, 0.0, len(path)
    for i in range(begin, len(path)):
        if i > begin:
            travelled += steps[i - 1]
            if travelled > search_dist:
                bound = i
                break
        away = distance(path, i, x, y)
        if away < nearest or (tuning.last_of_equals and away == nearest):
            first, nearest = i, away
    return first - 1 if tuning.keeps_segment and first == bound - 1 and first > begin else first


@kernel
def plan_window(path, steps, begin, x, y, costs, resolution, tuning):
    """First and past-the-last index of the poses to follow; equal when there are none.

    The window begins at the pose nearest to the robot and ends before the first pose farther from it than half the
    costmap.
    """
    extent = (max(costs.shape) - 0.5) * resolution / 2.0
    search_dist = tuning.max_robot_pose_search_dist
    if math.isnan(search_dist):
        search_dist = (costs.shape[1] - 0.5) * resolution / 2.0 if tuning.searches_width else extent
    first = last = nearest_pose(path, steps, begin, x, y, search_dist, tuning)
    while last < len(path) and distance(path, last, x, y) <= extent:
        last += 1
    return first, last


@kernel
def in_robot_frame(path, i, x, y, cos, sin):
    """Point i of the path in the robot's frame, m."""
    dx, dy = path[i, 0] - x, path[i, 1] - y
    return cos * dx + sin * dy, cos * dy - sin * dx
