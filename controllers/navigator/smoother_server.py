"""SmootherServer: Nav2's SmoothPath action around one or more path smoothers.

Source: nav2_smoother (Humble, Jazzy and Lyrical) src/nav2_smoother.cpp.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from controllers.navigator import error_codes
from controllers.navigator.actions import Outcome, Result
from controllers.navigator.computing import Computing
from controllers.navigator.topic_collisions import is_collision_free
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import SmoothingError
from gym_mapbench.releases import Release
from gym_mapbench.smoothers import PathSmoother, Smoothed
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose


class SmoothGoal(NamedTuple):
    """A path to be smoothed.

    Args:
        path: The path, ``(n, 3)`` on the map; of no length if there is none.
        smoother_id: Name of the smoother; empty for the only one.
        max_smoothing_duration: Longest time for it, s.
        check_for_collisions: Whether the smoothed path has to be free.
    """

    path: Any
    smoother_id: str = ""
    max_smoothing_duration: float = 3.0
    check_for_collisions: bool = False


class SmootherServer(Computing):
    """Smooths paths on the global costmap as it was last published.

    A smoothing takes ``seconds``, however long the path is. If its goal leaves less, Humble's path stays as it was and
    counts as not completed; since Jazzy the smoothing fails.

    Args:
        smoothers: The smoothers by name.
        costmap: Returns the global costmap as it was last published; None if it never was.
        footprint: The padded footprint of the global costmap.
        seconds: Seconds that a smoothing takes, in simulated time.
        release: The release of Nav2.
    """

    goal: SmoothGoal

    def __init__(
        self,
        smoothers: Mapping[str, PathSmoother],
        costmap: Callable[[], Costmap | None],
        footprint: Footprint,
        seconds: float = 0.0,
        release: Release = "humble",
    ) -> None:
        super().__init__(seconds)
        self._smoothers, self._costmap, self._footprint, self._release = smoothers, costmap, footprint, release

    def compute(self) -> Outcome:
        """Smooth the path of the goal."""
        goal, costmap = self.goal, self._costmap()
        names = list(self._smoothers)
        name = names[0] if not goal.smoother_id and len(names) == 1 else goal.smoother_id
        if name not in names:
            return _failed(error_codes.INVALID_SMOOTHER, f"expected one of the smoothers {names}, got {name!r}")
        if not len(goal.path):
            return _failed(error_codes.INVALID_SMOOTHED_PATH, "expected a path of one pose or more, got none")
        if costmap is None:
            return _failed(error_codes.SMOOTHER_UNKNOWN, "there is no costmap yet")
        late = goal.max_smoothing_duration <= 0.0 or goal.max_smoothing_duration < self._seconds
        if late and self._release != "humble":
            allowed = f"more than the allowed {goal.max_smoothing_duration:g} s"
            return _failed(error_codes.SMOOTHER_TIMED_OUT, f"the smoothing takes {self._seconds:g} s, {allowed}")
        smoothed = Smoothed(goal.path, was_completed=False)
        if not late:
            try:
                smoothed = self._smoothers[name].smooth(costmap, goal.path)
            except SmoothingError as error:
                return _failed(error_codes.FAILED_TO_SMOOTH_PATH, str(error))
        return self._checked(smoothed, costmap)

    def _checked(self, smoothed: Smoothed, costmap: Costmap) -> Outcome:
        """Return the path that a smoother made, unless it has to be free and is not."""
        for pose in map(Pose._make, smoothed.path.tolist()) if self.goal.check_for_collisions else ():
            if not is_collision_free(pose, costmap, self._footprint):
                where = f"({pose.x:.3f}, {pose.y:.3f}, {pose.yaw:.3f})"
                return _failed(error_codes.SMOOTHED_PATH_IN_COLLISION, f"the smoothed path collides at {where}")
        return Outcome(Result.SUCCEEDED, value=smoothed)


def _failed(code: int, reason: str) -> Outcome:
    return Outcome(Result.ABORTED, code, reason)
