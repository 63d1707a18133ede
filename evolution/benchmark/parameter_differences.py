"""Keys of a ``nav2_params.yaml`` in which configurations differ."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

from controllers.behaviors import BehaviorTree
from controllers.nav2_params import write_nav2_params
from controllers.nav2_params.file.tree import NAVIGATOR, TREE_FILE
from controllers.nav2_params.filters_writing import filter_values
from evolution.benchmark.configurations import Configuration
from evolution.driving import JobPlan
from evolution.files import Row
from gym_mapbench.ros_params import leaves

SERVER = "controller_server."
DEFAULT_TREE = "Nav2's default tree"


def parameter_rows(configurations: Sequence[Configuration]) -> tuple[Row, ...]:
    """Return a row for each key whose value is not the same in all configurations.

    The keys are those of ROS without ``ros__parameters``; those of the robot and of the world have ``world.`` in front.
    A configuration that does not have a key has an empty text. Files may call one controller differently: if two
    configurations each run one controller of a kind, its keys have the name that it has in the first configuration.
    """
    first = _names_by_kind(configurations[0].plan)
    values = {one.label: _renamed(keys_of(one.plan), _new_names(one.plan, first)) for one in configurations}
    names = dict.fromkeys(name for found in values.values() for name in found)
    rows = [{"key": name, **{label: found.get(name, "") for label, found in values.items()}} for name in names]
    differ = (row for row in rows if len({row[one.label] for one in configurations}) > 1)
    return tuple(row for row in differ if not _has_other_tree(row))


def keys_of(plan: JobPlan) -> dict[str, str]:
    """Return all values of a plan's world and navigation as texts, by key; of controllers only those that run.

    A costmap filter has its mask and the numbers of its info server under its own name.
    """
    navigation, world = plan.settings.navigation, plan.settings.environment.model_dump(mode="json", exclude_none=True)
    bare = {name: one.without_filters() for name, one in navigation.costmaps.items()}
    document = write_nav2_params(navigation.replace(**bare), use_sim_time=True)
    keys = {_short(name): value for name, value in leaves(document)}
    keys |= dict(leaves({name: filter_values(one) for name, one in navigation.costmaps.items()}))
    keys |= {f"{NAVIGATOR}.{name}": value for name, value in _tree_values(navigation.bt).items()}
    others = tuple(f"{SERVER}{name}." for name in {*navigation.controllers} - {*_running(plan)})
    kept = {name: value for name, value in keys.items() if not name.startswith(others)}
    kept.pop(f"{SERVER}controller_plugins", None)
    kept |= {f"world.{name}": value for name, value in leaves(world)}
    kept |= {f"{spec.name}.{name}": value for spec in plan.controllers for name, value in leaves(spec.params)}
    return {name: _text(value) for name, value in kept.items()}


def _tree_values(tree: BehaviorTree) -> dict[str, Any]:
    """Return the numbers of Nav2's default tree, or what tells a user's tree from others."""
    if not tree.xml:
        return {TREE_FILE: DEFAULT_TREE, **tree.model_dump(mode="json")}
    digest = hashlib.blake2b(tree.xml.encode(), digest_size=4).hexdigest()
    return {TREE_FILE: f"a tree of its own ({digest})", "latency": tree.latency}


def _has_other_tree(row: Row) -> bool:
    """Whether the row is about a number of the default tree, and some configuration has another tree."""
    node, _, name = str(row["key"]).partition(".")
    return node == NAVIGATOR and name in BehaviorTree.model_fields and "" in row.values()


def _running(plan: JobPlan) -> dict[str, str]:
    """Return the kind of each controller of the parameter file that runs, by its name there."""
    used = {spec.registered_name for spec in plan.controllers}
    plugins: Mapping[str, Any] = plan.settings.navigation.controllers
    return {name: one.kind for name, one in plugins.items() if {name, one.kind} & used}


def _names_by_kind(plan: JobPlan) -> dict[str, str]:
    """Return the name of the controller that runs of each kind; a kind of which several run is left out."""
    running = _running(plan)
    kinds = list(running.values())
    return {kind: name for name, kind in running.items() if kinds.count(kind) == 1}


def _new_names(plan: JobPlan, first: Mapping[str, str]) -> dict[str, str]:
    """Return the names of controllers in the first configuration, by their names in this one.

    Nothing is renamed if another controller of this configuration has one of these names.
    """
    found = {name: first[kind] for kind, name in _names_by_kind(plan).items() if kind in first}
    return {} if {*found.values()} & ({*_running(plan)} - {*found}) else found


def _renamed(keys: Mapping[str, str], names: Mapping[str, str]) -> dict[str, str]:
    """Return values by key with other names of controllers."""
    found = {}
    for key, value in keys.items():
        name, dot, rest = key.removeprefix(SERVER).partition(".")
        is_controller = key.startswith(SERVER) and dot and name in names
        found[f"{SERVER}{names[name]}.{rest}" if is_controller else key] = value
    return found


def _short(name: str) -> str:
    """Return a key without ``ros__parameters`` and without the second name of a costmap."""
    node, _, key = name.partition(".ros__parameters.")
    return f"{node.rpartition('.')[2]}.{key}"


def _text(value: object) -> str:
    """Return a value as a parameter file has it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_text, value))}]"
    return f"{value:g}" if isinstance(value, float) else str(value)
