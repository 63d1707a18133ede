"""Global planners by name; a third party's is a :class:`PlannerEntry`, or a callable that takes no arguments."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gym_mapbench.costmap import Costmap
from gym_mapbench.planners.base import GlobalPlanner, Path, PlannerEntry, checked_path
from gym_mapbench.planners.navfn import NAVFN, NavfnParams, NavfnPlanner
from gym_mapbench.planners.smac_2d import SMAC_2D, Smac2DParams, Smac2DPlanner, SmootherParams
from gym_mapbench.planners.theta_star import THETA_STAR, ThetaStarParams, ThetaStarPlanner
from gym_mapbench.plugin_entries import entry_or_callable, make_plugin
from gym_mapbench.registry import Registry
from gym_mapbench.world.scenario import Pose

__all__ = [
    "PLANNERS",
    "GlobalPlanner",
    "NavfnParams",
    "NavfnPlanner",
    "Path",
    "PlannerEntry",
    "Smac2DParams",
    "Smac2DPlanner",
    "SmootherParams",
    "ThetaStarParams",
    "ThetaStarPlanner",
    "make_planner",
]


PLANNERS: Registry[PlannerEntry] = Registry(
    "planner",
    "planners",
    {
        "navfn": NAVFN,
        "smac_2d": SMAC_2D,
        "theta_star": THETA_STAR,
    },
    check=entry_or_callable(PlannerEntry),
)


def make_planner(name: str, **params: Any) -> GlobalPlanner:
    """Make a planner by name, with Nav2's parameter names.

    Raises:
        ConfigError: If there is no such planner, or it has no such parameter.
        PluginError: If a third party's cannot be made.
    """
    planner: GlobalPlanner = make_plugin(PLANNERS, name, params, "plan")
    return planner if name in PLANNERS.built_in else _GuardedPlanner(name, planner)


class _GuardedPlanner:
    """A third party's planner: its errors and wrong paths are reported with its name, and it plans on a copy."""

    def __init__(self, name: str, planner: GlobalPlanner) -> None:
        self._name, self._planner = name, planner

    def plan(self, costmap: Costmap, start: Pose, goal: Pose) -> Path:
        with PLANNERS.blamed(self._name):
            path: object = self._planner.plan(replace(costmap, costs=costmap.costs.copy()), start, goal)
        return checked_path(path, f"planner {self._name!r}")
