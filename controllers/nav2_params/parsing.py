"""The content of a ``nav2_params.yaml`` becomes :class:`~controllers.nav2_params.navigation.NavigationParams`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from controllers.nav2_params import keys
from controllers.nav2_params.costmap_section import read_costmap
from controllers.nav2_params.findings import Findings
from controllers.nav2_params.navigation import (
    BehaviorServer,
    BehaviorTree,
    ControllerPlugin,
    ControllerServer,
    GoalChecker,
    NavigationParams,
    PlannerPlugin,
    ProgressChecker,
    VelocitySmoother,
    default_tree,
)
from controllers.nav2_params.plugins import (
    BEHAVIORS,
    CONTROLLERS,
    GOAL_CHECKERS,
    PLANNERS,
    PROGRESS_CHECKERS,
    Plugin,
    name_of_class,
)
from controllers.nav2_params.section import Section, parameter_names
from controllers.releases import Release
from gym_mapbench.errors import ConfigError, nearest_name

MAX_VALUES = 100_000
RELEASE = "release"
PARAMETERS = "ros__parameters"
SECTIONS = (
    "controller_server",
    "planner_server",
    "local_costmap",
    "global_costmap",
    "behavior_server",
    "bt_navigator",
    "velocity_smoother",
)


@dataclass(frozen=True)
class Nav2Params:
    """What a parameter file says.

    Args:
        navigation: The parameters.
        ignored: Full names of what only ROS needs: keys, groups and whole nodes.
        defaulted: Sections and controllers that the file does not configure and the preset does.
        unused: Full names of what the robot's own Nav2 does not use either: plugins in no list, or not asked for.
        unmodelled: Full names of what nothing here stands for; it may change how the real robot drives.
    """

    navigation: NavigationParams
    ignored: tuple[str, ...] = ()
    defaulted: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    unmodelled: tuple[str, ...] = ()


def parse_nav2_params(
    document: object, preset: NavigationParams | None = None, release: Release = "humble"
) -> Nav2Params:
    """Read the content of a ``nav2_params.yaml``.

    A parameter that a section does not give has the default of Nav2's code, as in ROS.

    Args:
        document: What the YAML file holds.
        preset: Gives the sections that are missing as a whole, but for the velocity smoother, and the kinds of
            controllers that are not configured; None for the defaults of Nav2's code and no further controllers.
        release: The distribution.

    Raises:
        ConfigError: If a parameter is unknown or has a wrong value, or a plugin is not built here.
    """
    _refuse_bomb(document)
    findings = Findings(release)
    try:
        sections = {name: Section(*node, findings) for name, node in _find_nodes(document, findings)}
        found = _read_sections(sections)
    finally:  # a misspelt name is said first, since it may be why something else is missing
        findings.refuse()
    base = preset or NavigationParams(release=release)
    left_out = [name for name in SECTIONS if name not in sections and name != "velocity_smoother"]
    known = found.get("controllers", {})
    kinds = {plugin.kind for plugin in known.values()}
    extra = {name: p for name, p in base.controllers.items() if p.kind not in kinds and name not in known}
    return Nav2Params(
        base.replace(**{"velocity_smoother": None, **found, "controllers": {**known, **extra}}),
        ignored=tuple(findings.ros_only),
        defaulted=(*(left_out if preset else ()), *(f"controllers.{name}" for name in extra)),
        unused=tuple(findings.unused),
        unmodelled=tuple(findings.unmodelled),
    )


def _read_sections(sections: Mapping[str, Section]) -> dict[str, Any]:
    """Read every section that is there into options of :class:`NavigationParams`."""
    found: dict[str, Any] = {}
    if "controller_server" in sections:
        found |= _read_controllers(sections["controller_server"])
    for name, (field, read) in READERS.items():
        if name in sections:
            found[field] = read(sections[name])
    return found


def _refuse_bomb(document: object) -> None:
    """Refuse a document whose aliases unfold to more than can be read, or to themselves."""
    pending, seen = [document], 0
    while pending:
        value = pending.pop()
        seen += 1
        if seen > MAX_VALUES:
            raise ConfigError(f"expected at most {MAX_VALUES} values, aliases unfolded, got more")
        if isinstance(value, Mapping):
            pending.extend(value.values())
        elif isinstance(value, (list, tuple, set)):
            pending.extend(value)


def _find_nodes(document: object, findings: Findings) -> Iterator[tuple[str, tuple[str, object]]]:
    """Name, full name and parameters of every node that is read; the findings get all others."""
    if document is None:
        raise ConfigError("expected the nodes of a nav2_params.yaml, but the file is empty")
    if not isinstance(document, Mapping):
        raise ConfigError(f"expected the nodes of a nav2_params.yaml, got {type(document).__name__}")
    found: dict[str, str] = {}
    for path, parameters in _walk(document, ()):
        full, name = ".".join(path), path[-1].rsplit("/", 1)[-1]
        if name not in SECTIONS:
            _check_misspelt(full, name)
            (findings.ros_only if _serves_ros(name, parameters) else findings.unmodelled).append(full)
        elif parameters is None:
            raise ConfigError(f"{full}: expected a group {PARAMETERS!r} in it, as in ROS")
        elif name in found:
            raise ConfigError(f"{full}: expected one section for {name}, got a second beside {found[name]}")
        else:
            found[name] = full
            yield name, (full, parameters[PARAMETERS])
    if not found:
        raise ConfigError(f"expected a section of at least one of {', '.join(SECTIONS)}, found none")


def _walk(
    group: Mapping[Any, Any], path: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], Mapping[Any, Any] | None]]:
    """Every node with its path, namespaces included; what is no node comes with None."""
    for key, value in group.items():
        here = (*path, str(key))
        if isinstance(value, Mapping) and PARAMETERS in value:
            yield here, value
        elif isinstance(value, Mapping) and any(isinstance(inner, Mapping) for inner in value.values()):
            yield from _walk(value, here)
        else:
            yield here, None


def _serves_ros(name: str, node: Mapping[Any, Any] | None) -> bool:
    """Whether a node does not drive, or is given nothing but parameters that serve ROS alone."""
    if name in keys.ROS_ONLY_NODES or name.endswith(keys.INNER_NODES):
        return True
    parameters = None if node is None else node[PARAMETERS]
    return isinstance(parameters, Mapping) and all(keys.Keys().is_ros_only(str(key)) for key in parameters)


def _check_misspelt(full: str, name: str) -> None:
    near = nearest_name(name, SECTIONS, cutoff=0.85)
    if near:
        raise ConfigError(f"{full}: unknown section; did you mean {near!r}?")


def _read_controllers(server: Section) -> dict[str, Any]:
    """Read ``controller_server`` with its checkers and controllers."""
    default = ("FollowPath",) if "FollowPath" in server.values else ()
    controllers = {}
    for name in server.take_names("controller_plugins", default):
        group = server.take_group(name)
        ros_class = CONTROLLERS["dwb"].ros_class if name == "FollowPath" else None
        kind = _take_class(group, ros_class, _classes(CONTROLLERS), "controller")
        controllers[name] = ControllerPlugin(kind=kind, params=_read_params(group, CONTROLLERS[kind]))
    progress, goal = _read_progress_checker(server), _read_goal_checker(server)
    server.leave_groups()
    values = server.read(keys.CONTROLLER_SERVER, _scalars(ControllerServer))
    settings = server.make(ControllerServer, {**values, "progress_checker": progress, "goal_checker": goal})
    return {"controller_server": settings, "controllers": controllers}


def _read_progress_checker(server: Section) -> ProgressChecker:
    """Read the progress checker; newer releases have a list of them, of which the first counts."""
    name = server.take_name("progress_checker_plugin", "progress_checker")
    name = server.take_names("progress_checker_plugins", (name,), least=1)[0]
    group = server.take_group(name)
    kind = _take_class(group, PROGRESS_CHECKERS["simple"], PROGRESS_CHECKERS, "progress checker")
    return group.build(ProgressChecker, keys.PROGRESS_CHECKER, plugin=kind)


def _read_goal_checker(server: Section) -> GoalChecker:
    """Read the first of the goal checkers; the default tree asks for none by name."""
    first, *others = server.take_names("goal_checker_plugins", ("goal_checker",), least=1)
    for name in others:
        server.leave(name)
    group = server.take_group(first)
    kind = _take_class(group, GOAL_CHECKERS["simple"], GOAL_CHECKERS, "goal checker")
    return group.build(GoalChecker, keys.GOAL_CHECKER, plugin=kind)


def _read_planner(server: Section) -> PlannerPlugin:
    """Read the planner that the default tree asks for, or else the first."""
    names = server.take_names("planner_plugins", ("GridBased",), least=1)
    chosen = "GridBased" if "GridBased" in names else names[0]
    group = server.take_group(chosen)
    kind = _take_class(group, PLANNERS["navfn"].ros_class, _classes(PLANNERS), "planner")
    server.leave_groups()
    server.read(keys.PLANNER_SERVER, ())
    return PlannerPlugin(name=kind, params=_read_params(group, PLANNERS[kind]))


def _read_behaviors(server: Section) -> BehaviorServer:
    names = server.take_names("behavior_plugins", ("spin", "backup", "drive_on_heading", "wait"))
    for name in names:
        if name not in BEHAVIORS:
            server.leave(name)
            continue
        group = server.take_group(name)
        _take_class(group, BEHAVIORS[name], {name: BEHAVIORS[name]}, "behaviour")
        for key, value in group.values.items():
            if value != 0:
                raise ConfigError(f"{group.name}.{key}: expected 0 (the behaviours have no ramps), got {value!r}")
    server.leave_groups()
    enabled = tuple(name for name in names if name in BEHAVIORS)
    return server.build(BehaviorServer, keys.BEHAVIOR_SERVER, behavior_plugins=enabled)


def _read_tree(section: Section) -> BehaviorTree:
    speed = default_tree(section.findings.release).backup_speed
    values = section.read(keys.BT_NAVIGATOR, parameter_names(BehaviorTree))
    return section.make(BehaviorTree, {"backup_speed": speed, **values})


def _read_smoother(section: Section) -> VelocitySmoother:
    return section.build(VelocitySmoother, keys.VELOCITY_SMOOTHER)


READERS: dict[str, tuple[str, Any]] = {
    "planner_server": ("planner", _read_planner),
    "local_costmap": ("local_costmap", read_costmap),
    "global_costmap": ("global_costmap", read_costmap),
    "behavior_server": ("behavior_server", _read_behaviors),
    "bt_navigator": ("bt", _read_tree),
    "velocity_smoother": ("velocity_smoother", _read_smoother),
}


def _read_params(group: Section, plugin: Plugin) -> dict[str, Any]:
    """Read a plugin's own parameters; they are checked here, where their full names are known."""
    release = group.findings.release
    values = group.read(plugin.keys_of(release), plugin.parameters_of(release))
    if RELEASE in plugin.params.model_fields:
        values[RELEASE] = release
    group.make(plugin.params, values)
    return values


def _take_class(group: Section, default: str | None, classes: Mapping[str, str], what: str) -> str:
    """Take the class of a plugin out of its group and return our name of it."""
    ros_class = group.values.pop("plugin", default)
    if ros_class is None:
        raise ConfigError(f"{group.name}.plugin: expected the class of this {what}, got none")
    return name_of_class(ros_class, classes, f"{group.name}.plugin", what)


def _classes(plugins: Mapping[str, Plugin]) -> dict[str, str]:
    return {name: plugin.ros_class for name, plugin in plugins.items()}


def _scalars(settings: type[ControllerServer]) -> list[str]:
    return [name for name in parameter_names(settings) if "." not in name]
