"""Reads the controller server's section: its checkers, and the controllers that are built here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from controllers.nav2_params import keys
from controllers.nav2_params.controller_keys import OLD_CRITICS
from controllers.nav2_params.navigation import ControllerPlugin, ControllerServer, GoalChecker, ProgressChecker
from controllers.nav2_params.plugins import (
    CONTROLLERS,
    GOAL_CHECKERS,
    PROGRESS_CHECKERS,
    SHIM_CLASS,
    SHIMS,
    controller_kind,
    known_class,
    read_params,
    take_class,
)
from controllers.nav2_params.section import Section, parameter_names
from controllers.releases import RELEASES, Release
from gym_mapbench.errors import ConfigError

TREES_CHOICE = "FollowPath"
"""The controller that Nav2's default tree asks for."""
HANDLED = (
    "prune_distance",
    "max_robot_pose_search_dist",
    "enforce_path_inversion",
    "inversion_xy_tolerance",
    "inversion_yaw_tolerance",
)
"""Parameters that moved from the controllers to Lyrical's path handler."""
SIDEWAYS = ("min_vel_y", "max_vel_y")
MODELS = {"DiffDriveMotionModel": "DiffDrive", "AckermannMotionModel": "Ackermann", "OmniMotionModel": "Omni"}
"""Lyrical's classes of MPPI's motion models -> their older names."""


@dataclass(frozen=True)
class ControllersFound:
    """What a controller server's section says.

    Args:
        server: The server, its checkers included.
        controllers: Controllers that are built here, by their names in the file.
        foreign: Names of the other controllers -> why they cannot drive here.
        asked_for: The controller that Nav2's default tree asks for: ``FollowPath``, or else the first.
    """

    server: ControllerServer = field(default_factory=ControllerServer)
    controllers: Mapping[str, ControllerPlugin] = field(default_factory=dict)
    foreign: Mapping[str, str] = field(default_factory=dict)
    asked_for: str = ""


def read_controllers(server: Section) -> ControllersFound:
    """Read ``controller_server`` with its checkers and controllers.

    Raises:
        ConfigError: If a value is wrong, or a controller has no class.
    """
    default = (TREES_CHOICE,) if TREES_CHOICE in server.values else ()
    names = server.take_names("controller_plugins", default)
    controllers: dict[str, ControllerPlugin] = {}
    foreign: dict[str, str] = {}
    handler = _take_path_handler(server)
    for name in names:
        found = _read_controller(server.take_group(name), name, handler)
        if isinstance(found, ControllerPlugin):
            controllers[name] = found
        else:
            foreign[name] = found
    progress, goal = _read_progress_checker(server), _read_goal_checker(server)
    server.leave_groups()
    values = server.read(keys.CONTROLLER_SERVER, _scalars())
    settings = server.make(ControllerServer, {**values, "progress_checker": progress, "goal_checker": goal})
    return ControllersFound(settings, controllers, foreign, TREES_CHOICE if TREES_CHOICE in names else (*names, "")[0])


def _take_path_handler(server: Section) -> dict[str, Any]:
    """Take out the parameters of the path handler, which in Lyrical prunes the path for all controllers."""
    name, *_ = (*server.take_names("path_handler_plugins", ()), "")
    handler = server.values.pop(name, None) if name else None
    if not isinstance(handler, Mapping):
        return {}
    server.findings.add("renamed", f"{server.name}.{name}", "its parameters are those of each controller here")
    return {key: handler[key] for key in HANDLED if key in handler}


def _read_controller(group: Section, name: str, handler: Mapping[str, Any]) -> ControllerPlugin | str:
    """Read one controller, or return why it cannot drive here."""
    if name == TREES_CHOICE:
        group.values.setdefault("plugin", CONTROLLERS["dwb"].ros_class)
    if "plugin" not in group.values:
        raise ConfigError(f"{group.name}.plugin: expected the class of this controller, got none")
    is_shim = known_class(group.values["plugin"], {"shim": SHIM_CLASS}) is not None
    if is_shim:
        _unfold_shim(group)
    kind = controller_kind(group.values)
    if kind is None:
        key = "primary_controller" if is_shim else "plugin"
        return f"{group.name}.{key}: the controller {str(group.values[key])!r} is not built here"
    if is_shim:
        del group.values["primary_controller"]
    group.values.pop("plugin", None)
    inherited = {key: value for key, value in handler.items() if key in CONTROLLERS[kind].parameters}
    group.values = {**inherited, **group.values}
    {"dwb": _adapt_dwb, "mppi": _adapt_mppi}.get(SHIMS.get(kind, kind), lambda _: None)(group)
    return ControllerPlugin(kind=kind, params=read_params(group, CONTROLLERS[kind]))


def _unfold_shim(group: Section) -> None:
    """Put the parameters of a Rotation Shim's primary controller, in Lyrical a group of their own, beside the shim's.

    Raises:
        ConfigError: If there is no primary controller.
    """
    primary = group.values.get("primary_controller")
    if isinstance(primary, Mapping):
        group.findings.add("renamed", f"{group.name}.primary_controller", "its parameters stand beside the shim's")
        group.values = {**primary, **group.values, "primary_controller": primary.get("plugin")}
    if group.values.get("primary_controller") is None:
        raise ConfigError(f"{group.name}.primary_controller: expected the class of the controller inside, got none")


def _adapt_dwb(group: Section) -> None:
    """Set the speeds sideways to 0, since the robots here cannot move so."""
    for key in SIDEWAYS:
        value = group.values.get(key)
        if isinstance(value, (int, float)) and not isinstance(value, bool) and value != 0:
            group.values[key] = 0.0
            group.findings.add("replaced", f"{group.name}.{key}", "taken as 0: the robots here cannot move sideways")


def _adapt_mppi(group: Section) -> None:
    """Choose a motion model and critics that are built here."""
    model = group.values.get("motion_model")
    block = group.values.get(model) if isinstance(model, str) else None
    if isinstance(model, str) and isinstance(block, Mapping) and "plugin" in block:
        group.values["motion_model"] = MODELS.get(str(block["plugin"]).rpartition("::")[2], block["plugin"])
        group.values.setdefault("AckermannConstraints", block.get("AckermannConstraints", {}))
        del group.values[model]
        group.findings.add("renamed", f"{group.name}.{model}", "motion_model")
    for key in ("vy_std", "AckermannConstraints.min_turning_r"):
        _drop_zero(group, key)
    if group.values.get("motion_model") == "Omni":
        group.values["motion_model"] = "DiffDrive"
        why = "driven as DiffDrive: the robots here cannot move sideways"
        group.findings.add("replaced", f"{group.name}.motion_model", why)
    _replace_old_critics(group)


def _drop_zero(group: Section, key: str) -> None:
    """Leave out a 0, which is not a valid value, if the motion model does not read it."""
    *inner, name = key.split(".")
    holder = group.values.get(inner[0], {}) if inner else group.values
    if isinstance(holder, dict) and holder.get(name) in (0, 0.0) and group.values.get("motion_model") != "Ackermann":
        del holder[name]
        group.findings.add("unused", f"{group.name}.{key}", "this motion model does not read it")


def _replace_old_critics(group: Section) -> None:
    """Let today's critic stand in for the older one that a release still has beside it."""
    critics = group.values.get("critics")
    for other in (release for release in RELEASES if release != group.findings.release):
        _refuse_critics_of(other, group)
    for old, new in OLD_CRITICS[group.findings.release].items():
        if isinstance(critics, list) and old in critics and new not in critics:
            critics = group.values["critics"] = [new if name == old else name for name in critics]
            group.values[new] = group.values.pop(old, {})
            group.findings.add("replaced", f"{group.name}.{old}", f"{new} stands in for it")


def _refuse_critics_of(release: Release, group: Section) -> None:
    """Refuse the critics that only another release has.

    Raises:
        ConfigError: If there is one; the error names the critic that comes nearest to it.
    """
    critics = group.values.get("critics")
    for old, new in OLD_CRITICS[release].items():
        if isinstance(critics, list) and old in critics:
            raise ConfigError(
                f"{group.name}.critics: only Nav2 {release.capitalize()} has the critic {old!r} (--nav2 {release}); "
                f"{new!r} comes nearest to it in {group.findings.release.capitalize()}"
            )


def _read_progress_checker(server: Section) -> ProgressChecker:
    """Read the first of the progress checkers; Humble has only one."""
    name = server.take_name("progress_checker_plugin", "progress_checker")
    name, *others = server.take_names("progress_checker_plugins", (name,), least=1)
    for other in others:
        server.leave(other)
    group = server.take_group(name, "progress_checker")
    kind = take_class(group, PROGRESS_CHECKERS["simple"], PROGRESS_CHECKERS, "progress checker")
    return group.build(ProgressChecker, keys.PROGRESS_CHECKER, plugin=kind)


def _read_goal_checker(server: Section) -> GoalChecker:
    """Read the first of the goal checkers, since the default tree asks for none by name."""
    first, *others = server.take_names("goal_checker_plugins", ("goal_checker",), least=1)
    for name in others:
        server.leave(name)
    group = server.take_group(first, "goal_checker")
    kind = take_class(group, GOAL_CHECKERS["simple"], GOAL_CHECKERS, "goal checker")
    if kind == "position" and group.findings.release == "humble":
        raise ConfigError(f"{group.name}.plugin: Nav2 Humble has no PositionGoalChecker; --nav2 jazzy has")
    return group.build(GoalChecker, keys.GOAL_CHECKER, plugin=kind)


def _scalars() -> list[str]:
    return [name for name in parameter_names(ControllerServer) if "." not in name]
