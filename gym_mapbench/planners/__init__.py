"""Global planners by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from gym_mapbench.errors import unknown_name
from gym_mapbench.planners.base import GlobalPlanner, Path
from gym_mapbench.planners.navfn import NavfnParams, NavfnPlanner
from gym_mapbench.planners.smac_2d import Smac2DParams, Smac2DPlanner, SmootherParams
from gym_mapbench.planners.theta_star import ThetaStarParams, ThetaStarPlanner
from gym_mapbench.settings import Settings

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


class PlannerEntry(NamedTuple):
    """How one planner is made: the type of its options, and the planner for such options."""

    params: type[Settings]
    make: Callable[[Any], GlobalPlanner]


PLANNERS: dict[str, PlannerEntry] = {
    "navfn": PlannerEntry(NavfnParams, NavfnPlanner),
    "smac_2d": PlannerEntry(Smac2DParams, Smac2DPlanner),
    "theta_star": PlannerEntry(ThetaStarParams, ThetaStarPlanner),
}


def make_planner(name: str, **params: Any) -> GlobalPlanner:
    """Make a planner by name, with Nav2's parameter names.

    Raises:
        ConfigError: If there is no such planner, or it has no such parameter.
    """
    if name not in PLANNERS:
        raise unknown_name("planner", name, PLANNERS)
    entry = PLANNERS[name]
    return entry.make(entry.params.from_mapping(params, name))
