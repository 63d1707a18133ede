"""Keys of a ``nav2_params.yaml`` in which configurations differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from controllers.nav2_params import NavigationParams, write_nav2_params
from controllers.nav2_params.filters_writing import filter_values
from controllers.nav2_params.values import COSTMAPS
from evolution.benchmark.configurations import Configuration
from evolution.driving import JobPlan
from evolution.files import Row
from gym_mapbench.costmap import FILTERS
from gym_mapbench.ros_params import leaves


def parameter_rows(configurations: Sequence[Configuration]) -> tuple[Row, ...]:
    """Return a row for each key whose value is not the same in all configurations.

    The keys are those of ROS without ``ros__parameters``; those of the robot and of the world have ``world.`` in front.
    A configuration that does not have a key has an empty text.
    """
    values = {one.label: keys_of(one.plan) for one in configurations}
    names = dict.fromkeys(name for found in values.values() for name in found)
    rows = [{"key": name, **{label: found.get(name, "") for label, found in values.items()}} for name in names]
    return tuple(row for row in rows if len({row[one.label] for one in configurations}) > 1)


def keys_of(plan: JobPlan) -> dict[str, str]:
    """Return all values of a plan's world and navigation as texts, by key; of controllers only those that run.

    A costmap filter has its mask and the numbers of its info server under its own name.
    """
    navigation, world = plan.settings.navigation, plan.settings.environment.model_dump(mode="json", exclude_none=True)
    costmaps = {name: getattr(navigation, name) for name in COSTMAPS}
    bare = {name: one.replace(**{kind: {} for kind in FILTERS}) for name, one in costmaps.items()}
    document = write_nav2_params(navigation.replace(**bare), use_sim_time=True)
    keys = {_short(name): value for name, value in leaves(document)}
    keys |= dict(leaves({name: filter_values(one) for name, one in costmaps.items()}))
    others = tuple(f"controller_server.{name}." for name in _others(navigation, plan))
    kept = {name: value for name, value in keys.items() if not name.startswith(others)}
    kept.pop("controller_server.controller_plugins", None)
    kept |= {f"world.{name}": value for name, value in leaves(world)}
    kept |= {f"{spec.name}.{name}": value for spec in plan.controllers for name, value in leaves(spec.params)}
    return {name: _text(value) for name, value in kept.items()}


def _others(navigation: NavigationParams, plan: JobPlan) -> list[str]:
    """Return the names of the controllers that do not run."""
    used = {spec.registered_name for spec in plan.controllers}
    kinds: Mapping[str, Any] = navigation.controllers
    return [name for name, one in kinds.items() if not {name, one.kind} & used]


def _short(name: str) -> str:
    """Return a key without ``ros__parameters`` and without the second name of a costmap."""
    node, _, key = name.partition(".ros__parameters.")
    return f"{node.rpartition('.')[2]}.{key}"


def _text(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
