"""Global planners by name; a third party's is a :class:`PlannerEntry`, or a callable that takes no arguments."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.planners.base import GlobalPlanner, Path, PlannerEntry
from gym_mapbench.planners.navfn import NAVFN, NavfnParams, NavfnPlanner
from gym_mapbench.planners.smac_2d import SMAC_2D, Smac2DParams, Smac2DPlanner, SmootherParams
from gym_mapbench.planners.theta_star import THETA_STAR, ThetaStarParams, ThetaStarPlanner
from gym_mapbench.registry import Registry, must_be_subclass
from gym_mapbench.settings import Settings
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


class NoParams(Settings):
    """Options of a planner that has none."""


def _entry(made: Any) -> PlannerEntry:
    """Accept an entry, or a callable that makes a planner without arguments."""
    if isinstance(made, PlannerEntry):
        must_be_subclass(Settings)(made.params)
        return made
    if not callable(made):
        raise ConfigError(f"expected a PlannerEntry or a callable, got {type(made).__name__}")
    return PlannerEntry(NoParams, lambda _: made())


PLANNERS: Registry[PlannerEntry] = Registry(
    "planner",
    "planners",
    {
        "navfn": NAVFN,
        "smac_2d": SMAC_2D,
        "theta_star": THETA_STAR,
    },
    check=_entry,
)


def make_planner(name: str, **params: Any) -> GlobalPlanner:
    """Make a planner by name, with Nav2's parameter names.

    Raises:
        ConfigError: If there is no such planner, or it has no such parameter.
        PluginError: If a third party's cannot be made.
    """
    entry = PLANNERS.get(name)
    settings = entry.params.from_mapping(params, name)
    with PLANNERS.blamed(name):
        planner = entry.make(settings)
    if not callable(getattr(planner, "plan", None)):
        raise ConfigError(f"planner {name!r}: expected one with 'plan', got a {type(planner).__name__}")
    return planner if name in PLANNERS.built_in else _GuardedPlanner(name, planner)


class _GuardedPlanner:
    """A third party's planner: its errors are reported in one line with its name, and it plans on a copy."""

    def __init__(self, name: str, planner: GlobalPlanner) -> None:
        self._name, self._planner = name, planner

    def plan(self, costmap: Costmap, start: Pose, goal: Pose) -> Path:
        with PLANNERS.blamed(self._name):
            return self._planner.plan(replace(costmap, costs=costmap.costs.copy()), start, goal)
