"""The Savitzky-Golay smoother: a polynomial is fitted to the points around each point.

Source: nav2_smoother/src/savitzky_golay_smoother.cpp (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.smoothing import filter_along
from gym_mapbench.planners.base import Path
from gym_mapbench.quantities import Natural
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import Keys, ReleaseSettings, RosPlugin, in_every_release
from gym_mapbench.smoothers.base import Smoothed, SmootherEntry, segments_of, turn_along
from gym_mapbench.smoothers.simple import ALWAYS_CUT, Refinements

SEVEN = np.array([-2.0, 3.0, 6.0, 7.0, 6.0, 3.0, -2.0]) / 21.0
"""Humble's and Jazzy's window: a cubic through seven points."""
_BEFORE_LYRICAL = {
    "enforce_path_inversion": ALWAYS_CUT,
    "window_size": "the window has 7 points",
    "poly_order": "the polynomial is a cubic",
}


class SavitzkyGolayParams(ReleaseSettings):
    """Options of the Savitzky-Golay smoother, named and defaulted as in Nav2.

    Args:
        do_refinement: Whether to smooth the smoothed path again.
        refinement_num: How many times.
        enforce_path_inversion: Lyrical: whether to smooth by itself each part on which the robot keeps its direction.
        window_size: Lyrical: number of points to which the polynomial is fitted, odd; 7 in older releases.
        poly_order: Lyrical: order of the polynomial, below ``window_size``; 3 in older releases.
        release: Release of Nav2.
    """

    MISSING: ClassVar[Mapping[Release, Mapping[str, str]]] = {"humble": _BEFORE_LYRICAL, "jazzy": _BEFORE_LYRICAL}
    DEFAULTS: ClassVar[Mapping[Release, Mapping[str, Any]]] = {
        "lyrical": {"enforce_path_inversion": True, "window_size": 7, "poly_order": 3},
    }

    do_refinement: bool = True
    refinement_num: Refinements = 2
    enforce_path_inversion: bool | None = None
    window_size: Annotated[int, Field(ge=3, le=1001)] | None = None
    poly_order: Natural | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.window_size is None or self.poly_order is None:
            return self
        if self.window_size % 2 == 0:
            raise ConfigError(f"window_size: expected an odd number of 3 or more, got {self.window_size}")
        if self.poly_order >= self.window_size:
            raise ConfigError(f"poly_order: expected less than window_size {self.window_size}, got {self.poly_order}")
        return self


@dataclass(frozen=True)
class SavitzkyGolaySmoother:
    """Smooth by a Savitzky-Golay filter along the path; it does not look at the costmap."""

    params: SavitzkyGolayParams = field(default_factory=SavitzkyGolayParams)

    def smooth(self, costmap: Costmap, path: Path) -> Smoothed:
        """Return a path with the same number of poses and the same ends; see ``PathSmoother.smooth``."""
        params, smoothed = self.params, path.copy()
        cut, longer_than = params.enforce_path_inversion is not False, len(self.coefficients) + 2
        for part in segments_of(path, cut=cut, longer_than=longer_than):
            points = np.ascontiguousarray(path[part, :2])
            for _ in range(1 + (params.refinement_num if params.do_refinement else 0)):
                points = filter_along(points, self.coefficients, params.release == "humble")
            smoothed[part, :2] = points
            turn_along(smoothed[part])
        return Smoothed(smoothed)

    @cached_property
    def coefficients(self) -> NDArray[np.float64]:
        """Weights ``(w,)`` of the points of the window: the fitted polynomial's value in the middle."""
        size, order = self.params.window_size, self.params.poly_order
        if size is None or order is None:
            return SEVEN
        powers = np.vander(np.arange(size) - size // 2, order + 1, increasing=True).astype(np.float64)
        weights: NDArray[np.float64] = np.linalg.pinv(powers)[0]
        return np.ascontiguousarray(weights)


SAVITZKY_GOLAY = SmootherEntry(
    SavitzkyGolayParams,
    SavitzkyGolaySmoother,
    nav2=RosPlugin(
        in_every_release("nav2_smoother::SavitzkyGolaySmoother"),
        "the Savitzky-Golay smoother",
        SavitzkyGolayParams,
        Keys(
            ros_only=frozenset({"plugin"}),
            elsewhere=dict.fromkeys(
                ("tolerance", "max_its", "w_data", "w_smooth"), "a parameter of the simple smoother"
            ),
        ),
    ),
)
