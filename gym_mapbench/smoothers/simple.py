"""The simple smoother: it pulls each point towards the middle of its neighbours and towards where it was.

Source: nav2_smoother/src/simple_smoother.cpp (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from gym_mapbench.costmap import Costmap
from gym_mapbench.kernels.smoothing import smooth_and_refine
from gym_mapbench.planners.base import Path
from gym_mapbench.quantities import Natural, NonNegative
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import Keys, ReleaseSettings, RosPlugin, in_every_release
from gym_mapbench.smoothers.base import Smoothed, SmootherEntry, segments_of, turn_along

HUMBLES_REFINEMENTS = 4
"""How often Humble refines a whole path, whatever the number of its parts."""
LONGER_THAN: Mapping[Release, int] = {"humble": 9, "jazzy": 9, "lyrical": 3}
"""Release -> number of steps above which a part of a path is smoothed."""
ALWAYS_CUT = "paths are always cut where the robot changes its direction"
Refinements = Annotated[Natural, Field(le=100)]


class SimpleSmootherParams(ReleaseSettings):
    """Options of the simple smoother, named and defaulted as in Nav2.

    Args:
        tolerance: A round that moves all points together by less than this is the last, m.
        max_its: A smoothing has less rounds than this.
        w_data: Pull towards the path as it was planned.
        w_smooth: Pull towards the neighbours' middle.
        do_refinement: Whether to smooth the smoothed path again.
        refinement_num: How many times (since Jazzy); in Humble 4 times.
        enforce_path_inversion: Lyrical: whether to smooth by itself each part on which the robot keeps its direction.
        release: Release of Nav2.
    """

    MISSING: ClassVar[Mapping[Release, Mapping[str, str]]] = {
        "humble": {
            "refinement_num": f"a path is refined {HUMBLES_REFINEMENTS} times",
            "enforce_path_inversion": ALWAYS_CUT,
        },
        "jazzy": {"enforce_path_inversion": ALWAYS_CUT},
    }
    DEFAULTS: ClassVar[Mapping[Release, Mapping[str, Any]]] = {
        "jazzy": {"refinement_num": 2},
        "lyrical": {"refinement_num": 2, "enforce_path_inversion": True},
    }

    tolerance: NonNegative = 1e-10
    max_its: Annotated[int, Field(le=1_000_000)] = 1000
    w_data: NonNegative = 0.2
    w_smooth: NonNegative = 0.3
    do_refinement: bool = True
    refinement_num: Refinements | None = None
    enforce_path_inversion: bool | None = None


@dataclass(frozen=True)
class SimpleSmoother:
    """Smooth by pulling each point towards its neighbours and towards the plan.

    A part stays at its last round without a collision, or at round ``max_its``. In Humble the parts behind it then stay
    as they are, and the path counts as not completed.
    """

    params: SimpleSmootherParams = field(default_factory=SimpleSmootherParams)

    def smooth(self, costmap: Costmap, path: Path) -> Smoothed:
        """Return a path with the same number of poses and the same ends; see ``PathSmoother.smooth``."""
        params, humble = self.params, self.params.release == "humble"
        weights = params.w_data, params.w_smooth, params.tolerance, params.max_its
        smoothed, refinements = path.copy(), self._refinements
        cut = params.enforce_path_inversion is not False
        for part in segments_of(path, cut=cut, longer_than=LONGER_THAN[params.release]):
            points = np.ascontiguousarray(path[part, :2])
            smoothed[part, :2], rests, done = smooth_and_refine(points, *costmap.grid, *weights, refinements)
            turn_along(smoothed[part])
            if humble and not rests:
                return Smoothed(smoothed, was_completed=False)
            refinements -= done if humble else 0
        return Smoothed(smoothed)

    @property
    def _refinements(self) -> int:
        if not self.params.do_refinement:
            return 0
        wanted = self.params.refinement_num
        return HUMBLES_REFINEMENTS if wanted is None else wanted


SIMPLE = SmootherEntry(
    SimpleSmootherParams,
    SimpleSmoother,
    nav2=RosPlugin(
        in_every_release("nav2_smoother::SimpleSmoother"),
        "the simple smoother",
        SimpleSmootherParams,
        Keys(
            ros_only=frozenset({"plugin"}),
            elsewhere=dict.fromkeys(("window_size", "poly_order"), "a parameter of the Savitzky-Golay smoother"),
        ),
    ),
)
