"""Nav2Controller: the description of a controller of Nav2, for the registry and for parameter files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from controllers.base import PathFollower
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import RosPlugin

Limits = dict[str, float]
"""Limit of a robot, by its name in :class:`~gym_mapbench.world.robot.RobotSpec` -> its value, SI units."""


def _no_forms(group: Mapping[str, Any]) -> Mapping[str, tuple[Release, ...]]:
    """Find no key: every release starts with the section."""
    return {}


def _any_period(params: Mapping[str, Any], control_period: float) -> None:
    """Accept any control period."""


@dataclass(frozen=True, kw_only=True)
class Nav2Controller(RosPlugin):
    """A controller plugin of Nav2.

    Args:
        make: Makes the path follower from the parameters.
        limits: Given the parameters, returns the limits of the robot that they state.
        advice: Given the parameters, says where they make the robot slow or stop, and what helps; empty if nothing is
            known (see ``docs/howto/slow.md``).
        relative_cost: CPU time of a run, relative to Regulated Pure Pursuit. Only the order counts: searches drive the
            cheapest controller first.
        old_critics: Release -> critic that only this release has, and that is not built here -> the nearest critic.
        exchanged: Dotted name of a parameter of one release -> its last part in the other, and value -> value there.
        needs_no_section: Whether a file without a section for the controller still has it, with Nav2's defaults.
        forms: Given its section, returns the keys with values of a form that not every release starts with -> the
            releases that do.
        check_period: Given the parameters and the control period, s, raises ``ConfigError`` if the controller server
            does not start with both.
    """

    make: Callable[[Any], PathFollower]
    limits: Callable[[Mapping[str, Any]], Limits]
    relative_cost: float
    advice: Callable[[Mapping[str, Any]], str]
    old_critics: Mapping[Release, Mapping[str, str]] = field(default_factory=dict)
    exchanged: Mapping[str, tuple[str, Mapping[str, str]]] = field(default_factory=dict)
    needs_no_section: bool = False
    forms: Callable[[Mapping[str, Any]], Mapping[str, tuple[Release, ...]]] = _no_forms
    check_period: Callable[[Mapping[str, Any], float], None] = _any_period


def named_limits(params: Mapping[str, Any], sources: Mapping[str, str]) -> Limits:
    """Return the limits that single parameters state.

    Args:
        params: The parameters of a controller.
        sources: Limit -> the parameter that states it; the limit of reversing is negative there. A parameter that is 0
            or missing states no limit.
    """
    found = {limit: params.get(name) or 0.0 for limit, name in sources.items()}
    found["max_reverse_velocity"] = max(0.0, -found.get("max_reverse_velocity", 0.0))
    return {limit: float(value) for limit, value in found.items() if value > 0}


def highest(limits: Iterable[Limits]) -> Limits:
    """Return the highest value of each limit."""
    both = list(limits)
    return {name: max(one.get(name, 0.0) for one in both) for name in {name for one in both for name in one}}
