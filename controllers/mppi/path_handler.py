"""The part of the global plan that MPPI looks at, in Humble and Jazzy; Lyrical's server cuts it.

Source: nav2_mppi_controller/src/path_handler.cpp (Humble and Jazzy).
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.params import MppiParams
from controllers.path_handler import PathHandler as Handling
from controllers.plan_window import Path, PlanAhead
from gym_mapbench.costmap import Costmap
from gym_mapbench.kernels.geometry import normalize_angle
from gym_mapbench.world.scenario import Pose


def handling_of(params: MppiParams) -> Handling:
    """Return how the plan is cut: as MPPI's parameters say, in Lyrical as the path handler of Nav2's code does."""
    given = {name: getattr(params, name) for name in Handling.model_fields if hasattr(params, name)}
    return Handling(**{name: value for name, value in given.items() if value is not None})


def end_of(path: Path) -> tuple[float, float]:
    """Return the place of a path's last pose in single precision, m."""
    x, y = path[-1, :2].astype(np.float32).tolist()
    return x, y


def first_cusp(path: Path) -> int:
    """Return how many poses lie before the path turns back on itself, all of them if it does not."""
    steps = np.diff(path[:, :2], axis=0).astype(np.float32)
    back = np.flatnonzero((steps[:-1] * steps[1:]).sum(axis=1) < 0.0)
    return int(back[0]) + 2 if len(back) else len(path)


class PathHandler(PlanAhead):
    """Keeps the plan of a run and cuts the local path from it.

    Args:
        params: MPPI's parameters.
    """

    def __init__(self, params: MppiParams) -> None:
        self._release = params.release
        last_of_equals = params.release != "humble"
        super().__init__(handling_of(params), normalize_angle, last_of_equals=last_of_equals, keeps_segment=False)

    def first_turn(self, path: Path) -> int:
        """Return how many poses lie before the first cusp if inversions are enforced."""
        return first_cusp(path) if self._params.enforce_path_inversion else len(path)

    def local_path(self, pose: Pose, costmap: Costmap) -> Path:
        """Return the poses ahead, ``(m, 3)``, and forget those that were passed.

        Raises:
            InvalidPath: If there are no poses ahead.
        """
        return self._next_window(pose, costmap)[0]

    def goal(self, window: Path) -> tuple[float, float]:
        """Return the goal in the sense of the critics, m: the end of the plan in Jazzy, else of the local path."""
        if self._release == "humble":
            return end_of(window)
        x, y = self._plan[-1, :2].tolist()
        return x, y
