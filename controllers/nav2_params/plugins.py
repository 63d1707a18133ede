"""The plugins that are built here, by their names in ROS, and how they are read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from typing import Any

from controllers.nav2_params.controller_keys import DWB, GRACEFUL, MPPI, RPP, SHIM
from controllers.nav2_params.keys import NAVFN, SMAC_2D, THETA_STAR, Keys
from controllers.nav2_params.section import RELEASE, Section, parameter_names
from controllers.parameters import value_at
from controllers.releases import Release
from gym_mapbench.errors import ConfigError, nearest_name
from gym_mapbench.settings import Settings


@dataclass(frozen=True)
class Plugin:
    """A plugin with parameters of its own; its module is imported when they are asked for.

    Args:
        ros_class: Its class in ROS.
        module: Where its parameters are.
        settings: Name of the parameters' class there.
        other_keys: What is known about the other keys of its section. A controller's own module adds to it with the
            constants ``ROS_ONLY_KEYS`` and ``RENAMED_KEYS``, and with ``MISSING`` of its parameters.
        title: Its name in a sentence.
    """

    ros_class: str
    module: str
    settings: str
    other_keys: Keys
    title: str

    @cached_property
    def params(self) -> type[Settings]:
        """The class of its parameters."""
        params: type[Settings] = getattr(import_module(self.module), self.settings)
        return params

    @cached_property
    def keys(self) -> Keys:
        """What is known about the other keys of its section."""
        module, known = import_module(self.module), self.other_keys
        return replace(
            known,
            elsewhere={**self._strays(), **known.elsewhere},
            ros_only=known.ros_only | getattr(module, "ROS_ONLY_KEYS", frozenset()),
            renamed={**known.renamed, **getattr(module, "RENAMED_KEYS", {})},
            missing=getattr(self.params, "MISSING", {}),
        )

    @cached_property
    def our_keys(self) -> frozenset[str]:
        """Dotted names of those of its parameters that Nav2 does not have."""
        ours: frozenset[str] = getattr(self.params, "OURS", frozenset({RELEASE}))
        return ours

    def default(self, name: str, release: Release) -> Any:
        """Return the default of a parameter in a release; None if the release does not have the parameter."""
        first, _, rest = name.partition(".")
        of_class = self.params.model_fields[first].default
        usual = value_at(of_class, rest) if rest else of_class
        return getattr(self.params, "DEFAULTS", {}).get(release, {}).get(name, usual)

    def changed_defaults(self, source: Release, target: Release) -> dict[str, Any]:
        """Return, by dotted name, the source's defaults that differ in the target; both must have the parameter."""
        pairs = {name: (self.default(name, source), self.default(name, target)) for name in self.parameters}
        return {name: old for name, (old, new) in pairs.items() if None not in (old, new) and old != new}

    @property
    def parameters(self) -> list[str]:
        """Dotted names of its parameters, except the release."""
        return [name for name in parameter_names(self.params) if name != RELEASE]

    def _strays(self) -> dict[str, str]:
        """Return the parameters of other controllers, which are often left over after a change of the plugin."""
        own = set(self.parameters)
        others = [plugin for plugin in PRIMARIES.values() if self in CONTROLLERS.values() and plugin is not self]
        named = {name: f"a parameter of {plugin.title}" for plugin in others for name in plugin.parameters}
        shim = dict.fromkeys(SHIM, "a parameter of the Rotation Shim") if others else {}
        return {name: why for name, why in {**named, **shim}.items() if name not in own}

    def complete(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Check parameters and fill in the defaults; the result can be written as JSON and leaves out what is None."""
        return self.params(**values).model_dump(mode="json", exclude_none=True)


PRIMARIES = {
    "dwb": Plugin("dwb_core::DWBLocalPlanner", "controllers.dwb.params", "DwbParams", DWB, "DWB"),
    "mppi": Plugin("nav2_mppi_controller::MPPIController", "controllers.mppi.params", "MppiParams", MPPI, "MPPI"),
    "rpp": Plugin(
        "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
        "controllers.rpp.params",
        "RppParams",
        RPP,
        "Regulated Pure Pursuit",
    ),
    "graceful": Plugin(
        "nav2_graceful_controller::GracefulController",
        "controllers.graceful.params",
        "GracefulParams",
        GRACEFUL,
        "the Graceful Controller",
    ),
}
"""The controllers that drive by themselves."""
SHIM_CLASS = "nav2_rotation_shim_controller::RotationShimController"
SHIMS = {f"shim_{name}": name for name in PRIMARIES}
"""A Rotation Shim around a controller -> that controller."""
CONTROLLERS = PRIMARIES | {
    shim: Plugin(
        SHIM_CLASS,
        "controllers.rotation_shim.params",
        f"Shim{PRIMARIES[name].settings}",
        PRIMARIES[name].other_keys,
        f"the Rotation Shim around {PRIMARIES[name].title}",
    )
    for shim, name in SHIMS.items()
}
PLANNERS = {
    "navfn": Plugin("nav2_navfn_planner/NavfnPlanner", "gym_mapbench.planners", "NavfnParams", NAVFN, "NavFn"),
    "smac_2d": Plugin("nav2_smac_planner/SmacPlanner2D", "gym_mapbench.planners", "Smac2DParams", SMAC_2D, "Smac 2D"),
    "theta_star": Plugin(
        "nav2_theta_star_planner/ThetaStarPlanner", "gym_mapbench.planners", "ThetaStarParams", THETA_STAR, "Theta*"
    ),
}
PROGRESS_CHECKERS = {
    "simple": "nav2_controller::SimpleProgressChecker",
    "pose": "nav2_controller::PoseProgressChecker",
}
GOAL_CHECKERS = {
    "simple": "nav2_controller::SimpleGoalChecker",
    "stopped": "nav2_controller::StoppedGoalChecker",
    "position": "nav2_controller::PositionGoalChecker",
}
COSTMAP_LAYERS = {
    "static_layer": "nav2_costmap_2d::StaticLayer",
    "obstacle_layer": "nav2_costmap_2d::ObstacleLayer",
    "voxel_layer": "nav2_costmap_2d::VoxelLayer",
    "inflation_layer": "nav2_costmap_2d::InflationLayer",
}
MISSPELT = 0.9
"""Similarity from which on an unknown class is probably a misspelt known one."""
BEHAVIORS = {"spin": "nav2_behaviors/Spin", "backup": "nav2_behaviors/BackUp", "wait": "nav2_behaviors/Wait"}


def known_class(ros_class: object, classes: Mapping[str, str]) -> str | None:
    """Return our name of a plugin class, None if it is not built here; ``/`` and ``::`` both separate its package."""
    given = str(ros_class).replace("/", "::")
    return next((name for name, known in classes.items() if given == known.replace("/", "::")), None)


def controller_kind(group: Mapping[str, Any]) -> str | None:
    """Return our name of the controller that a group of parameters is for, None if it is not built here.

    The kind of a Rotation Shim also names its primary controller, whose parameters are in the same group.
    """
    kind = known_class(group.get("plugin"), {**classes(PRIMARIES), "shim": SHIM_CLASS})
    if kind != "shim":
        return kind
    primary = group.get("primary_controller")
    inside = known_class(primary.get("plugin") if isinstance(primary, Mapping) else primary, classes(PRIMARIES))
    return f"shim_{inside}" if inside else None


def name_of_class(ros_class: object, classes: Mapping[str, str], where: str, what: str) -> str:
    """Return our name of a plugin class; ``/`` and ``::`` both separate its package.

    Raises:
        ConfigError: If the class is not built here; the error gives the nearest that is.
    """
    name = known_class(ros_class, classes)
    if name is not None:
        return name
    near = nearest_name(str(ros_class), classes.values(), MISSPELT)
    hint = f"did you mean {near!r}?" if near else f"expected one of: {', '.join(classes.values())}"
    raise ConfigError(f"{where}: {what} {str(ros_class)!r} is not built here ({hint})")


def classes(plugins: Mapping[str, Plugin]) -> dict[str, str]:
    """Return a table of our names of plugins -> their classes in ROS."""
    return {name: plugin.ros_class for name, plugin in plugins.items()}


def take_class(group: Section, default: str | None, known: Mapping[str, str], what: str) -> str:
    """Take the class of a plugin out of its group and return our name of it.

    Raises:
        ConfigError: If there is none, or it is not built here.
    """
    ros_class = group.values.pop("plugin", default)
    if ros_class is None:
        raise ConfigError(f"{group.name}.plugin: expected the class of this {what}, got none")
    return name_of_class(ros_class, known, f"{group.name}.plugin", what)


def read_params(group: Section, plugin: Plugin) -> dict[str, Any]:
    """Read a plugin's own parameters; they are checked here, where their full names are known.

    Raises:
        ConfigError: If a value is wrong.
    """
    values = group.read(plugin.keys, plugin.parameters)
    if RELEASE in plugin.params.model_fields:
        values[RELEASE] = group.findings.release
    group.make(plugin.params, values)
    return values
