"""Path smoothers by name; a third party's is a :class:`SmootherEntry`, or a callable that takes no arguments."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gym_mapbench.costmap import Costmap
from gym_mapbench.planners.base import Path, checked_path
from gym_mapbench.plugin_entries import entry_or_callable, make_plugin
from gym_mapbench.registry import Registry
from gym_mapbench.smoothers.base import PathSmoother, Smoothed, SmootherEntry
from gym_mapbench.smoothers.savitzky_golay import SAVITZKY_GOLAY, SavitzkyGolayParams, SavitzkyGolaySmoother
from gym_mapbench.smoothers.simple import SIMPLE, SimpleSmoother, SimpleSmootherParams

__all__ = [
    "SMOOTHERS",
    "PathSmoother",
    "SavitzkyGolayParams",
    "SavitzkyGolaySmoother",
    "SimpleSmoother",
    "SimpleSmootherParams",
    "Smoothed",
    "SmootherEntry",
    "make_smoother",
]


SMOOTHERS: Registry[SmootherEntry] = Registry(
    "smoother",
    "smoothers",
    {"simple": SIMPLE, "savitzky_golay": SAVITZKY_GOLAY},
    check=entry_or_callable(SmootherEntry),
)


def make_smoother(name: str, **params: Any) -> PathSmoother:
    """Make a smoother by name, with Nav2's parameter names.

    Raises:
        ConfigError: If there is no such smoother, or it has no such parameter.
        PluginError: If a third party's cannot be made.
    """
    smoother: PathSmoother = make_plugin(SMOOTHERS, name, params, "smooth")
    return smoother if name in SMOOTHERS.built_in else _GuardedSmoother(name, smoother)


class _GuardedSmoother:
    """A third party's smoother: its errors and wrong paths are reported with its name, and it smooths copies."""

    def __init__(self, name: str, smoother: PathSmoother) -> None:
        self._name, self._smoother = name, smoother

    def smooth(self, costmap: Costmap, path: Path) -> Smoothed:
        with SMOOTHERS.blamed(self._name):
            smoothed, was_completed = self._smoother.smooth(replace(costmap, costs=costmap.costs.copy()), path.copy())
        return Smoothed(checked_path(smoothed, f"smoother {self._name!r}"), bool(was_completed))
