"""Reads the controller server's section: its checkers, and the controllers that are built here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from controllers.checkers import (
    GOAL_CHECKER_KEYS,
    GOAL_CHECKERS,
    PROGRESS_CHECKER_KEYS,
    PROGRESS_CHECKERS,
    GoalChecker,
    ProgressChecker,
)
from controllers.mppi.release_tables import HANDLED
from controllers.nav2_params.file import keys
from controllers.nav2_params.file.tree_ids import CONTROLLER, GOAL_CHECKER, PATH_HANDLER, PROGRESS_CHECKER, TreeIds
from controllers.nav2_params.navigation import ControllerServer
from controllers.nav2_params.plugin_settings import ControllerPlugin
from controllers.nav2_params.plugins import CONTROLLERS, controller_kind, is_shim, names_in_ros, primary_class, strays
from controllers.path_handler import PATH_HANDLER_ID, PATH_HANDLER_KEYS, PATH_HANDLERS, PathHandler
from controllers.rotation_shim.plugin import PRIMARY, unfold
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import Section, nearest_class, parameter_names, take_class

TREES_CHOICE = "FollowPath"
"""The controller that Nav2's default tree asks for."""
HANDLER_LIST = "path_handler_plugins"
CHECKER_LIST = "progress_checker_plugins"
HUMBLES_CHECKER = "progress_checker_plugin"


@dataclass(frozen=True)
class ControllersFound:
    """The content of a controller server's section.

    Args:
        server: The server, its checkers included.
        controllers: Controllers that are built here, by their names in the file.
        foreign: Names of the other controllers -> why they cannot drive here.
        asked_for: The controller for which the tree asks, ``FollowPath`` in Nav2's default tree, or else the first.
    """

    server: ControllerServer = field(default_factory=ControllerServer)
    controllers: Mapping[str, ControllerPlugin] = field(default_factory=dict)
    foreign: Mapping[str, str] = field(default_factory=dict)
    asked_for: str = ""


def read_controllers(server: Section, ids: TreeIds) -> ControllersFound:
    """Read ``controller_server`` with its checkers and controllers.

    Args:
        server: The section.
        ids: The plugins that the tree names.

    Raises:
        ConfigError: If a value is wrong, a controller has no class, or does not start with the rate of the server, or
            the server refuses every path because the tree does not name one of its plugins.
    """
    default = (TREES_CHOICE,) if TREES_CHOICE in server.values else ()
    names = server.take_names("controller_plugins", default)
    controllers: dict[str, ControllerPlugin] = {}
    foreign: dict[str, str] = {}
    lyrical = server.findings.release == "lyrical"
    plugins: dict[str, Any] = {"path_handler": _read_path_handler(server, ids)} if lyrical else {}
    handler = {} if lyrical else _take_path_handler(server)
    for name in names:
        found = _read_controller(server.take_group(name), names == (TREES_CHOICE,), handler)
        if isinstance(found, ControllerPlugin):
            controllers[name] = found
        else:
            foreign[name] = found
    plugins["progress_checker"] = _read_progress_checker(server, ids)
    plugins["goal_checker"] = _read_goal_checker(server, ids)
    server.leave_groups()
    settings = server.make(ControllerServer, {**server.read(keys.CONTROLLER_SERVER, _scalars()), **plugins})
    for name, plugin in controllers.items():
        _check_period(f"{server.name}.{name}", plugin, 1.0 / settings.controller_frequency)
    choice = ids.names.get(CONTROLLER, TREES_CHOICE)
    return ControllersFound(settings, controllers, foreign, choice if choice in names else (*names, "")[0])


def _check_period(full: str, plugin: ControllerPlugin, control_period: float) -> None:
    """Refuse a controller that does not start with the rate of the server."""
    try:
        CONTROLLERS[plugin.kind].check_period(plugin.params, control_period)
    except ConfigError as error:
        raise ConfigError(f"{full}.{error}") from None


def _read_path_handler(server: Section, ids: TreeIds) -> PathHandler:
    """Read the path handler that the tree names, or else the only one."""
    name, _ = ids.choose(PATH_HANDLER, server, HANDLER_LIST, (PATH_HANDLER_ID,))
    group = server.take_group(name, PATH_HANDLER_ID)
    default = PATH_HANDLERS["feasible"]["lyrical"] if name == PATH_HANDLER_ID else None
    take_class(group, default, PATH_HANDLERS, "path handler")
    return group.build(PathHandler, PATH_HANDLER_KEYS)


def _take_path_handler(server: Section) -> dict[str, Any]:
    """Take out the parameters of Lyrical's path handler, where a file of Lyrical is read as an older release's."""
    name, *_ = (*server.take_names(HANDLER_LIST, ()), "")
    handler = server.values.pop(name, None) if name else None
    if not isinstance(handler, Mapping):
        return {}
    server.findings.add("renamed", f"{server.name}.{name}", "its parameters are those of each controller here")
    return {key: handler[key] for key in HANDLED if key in handler}


def _read_controller(group: Section, has_default: bool, handler: Mapping[str, Any]) -> ControllerPlugin | str:
    """Read one controller, or return why it cannot drive here; Nav2 has a class for its own list alone."""
    if has_default:
        group.values.setdefault("plugin", CONTROLLERS["dwb"].names[group.findings.release])
    if "plugin" not in group.values:
        raise ConfigError(f"{group.name}.plugin: expected the class of this controller, got none")
    shim = is_shim(group.values["plugin"])
    if shim:
        unfold(group)
    kind = controller_kind(group.values)
    if kind is None:
        key, ros_class = (PRIMARY, primary_class(group.values)) if shim else ("plugin", group.values["plugin"])
        near = nearest_class(ros_class, names_in_ros(CONTROLLERS))
        hint = f" (did you mean {near!r}?)" if near else ""
        return f"{group.name}.{key}: the controller {str(ros_class)!r} is not built here{hint}"
    group.values.pop("plugin", None)
    inherited = {key: value for key, value in handler.items() if key in CONTROLLERS[kind].parameters}
    group.values = {**inherited, **group.values}
    return ControllerPlugin(kind=kind, params=CONTROLLERS[kind].read(group, strays(kind)))


def _read_progress_checker(server: Section, ids: TreeIds) -> ProgressChecker:
    """Read the progress checker that the tree names, or else the only one; Humble has one, Lyrical may have none."""
    _take_the_releases_list(server)
    least = 0 if server.findings.release == "lyrical" else 1
    name, is_default = ids.choose(PROGRESS_CHECKER, server, CHECKER_LIST, ("progress_checker",), least)
    if not name:
        return ProgressChecker(plugin="none")
    group = server.take_group(name, "progress_checker")
    default = PROGRESS_CHECKERS["simple"][group.findings.release] if is_default else None
    kind = take_class(group, default, PROGRESS_CHECKERS, "progress checker")
    return group.build(ProgressChecker, PROGRESS_CHECKER_KEYS, plugin=kind)


def _take_the_releases_list(server: Section) -> None:
    """Keep the key of the progress checkers that the release has, as a list; it does not read the other one."""
    humble = server.findings.release == "humble"
    counts, other = (HUMBLES_CHECKER, CHECKER_LIST) if humble else (CHECKER_LIST, HUMBLES_CHECKER)
    if other in server.values:
        del server.values[other]
        server.findings.add("other_release", f"{server.name}.{other}", f"{counts} counts")
    if humble:
        server.values[CHECKER_LIST] = [server.take_name(HUMBLES_CHECKER, "progress_checker")]


def _read_goal_checker(server: Section, ids: TreeIds) -> GoalChecker:
    """Read the goal checker that the tree names, or else the only one."""
    name, is_default = ids.choose(GOAL_CHECKER, server, "goal_checker_plugins", ("goal_checker",))
    group = server.take_group(name, "goal_checker")
    default = GOAL_CHECKERS["simple"][group.findings.release] if is_default else None
    kind = take_class(group, default, GOAL_CHECKERS, "goal checker")
    return group.build(GoalChecker, GOAL_CHECKER_KEYS, plugin=kind)


def _scalars() -> list[str]:
    return [name for name in parameter_names(ControllerServer) if "." not in name]
