"""The plugins of the servers as :class:`~controllers.nav2_params.navigation.NavigationParams` holds them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from pydantic import Field, ValidationInfo, field_validator

from controllers.nav2_params.plugins import CONTROLLERS
from gym_mapbench.errors import ConfigError, refuse_unknown
from gym_mapbench.planners import PLANNERS
from gym_mapbench.quantities import Positive
from gym_mapbench.registry import Registry
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import RELEASE
from gym_mapbench.settings import Settings
from gym_mapbench.smoothers import SMOOTHERS


class PlannerPlugin(Settings):
    """The global planner.

    Args:
        name: ``navfn``, ``smac_2d``, ``theta_star``, or a third party's (see :mod:`gym_mapbench.planners`).
        params: Its parameters; they are checked, completed and brought into a form that JSON can hold.
        costmap_update_timeout: Seconds after which the planner server gives up to wait for a cleared costmap (since
            Jazzy).
    """

    name: str = "navfn"
    params: dict[str, Any] = Field(default_factory=dict, validate_default=True)
    costmap_update_timeout: Positive = 1.0

    @field_validator("name")
    @classmethod
    def _known(cls, value: str) -> str:
        PLANNERS.get(value)
        return value

    @field_validator("params")
    @classmethod
    def _complete(cls, value: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        return _completed(PLANNERS, info.data["name"], value) if "name" in info.data else value


class SmootherPlugin(Settings):
    """One path smoother.

    Args:
        kind: ``simple``, ``savitzky_golay``, or a third party's (see :mod:`gym_mapbench.smoothers`).
        params: Its parameters; they are checked, completed and brought into a form that JSON can hold.
    """

    kind: str = "simple"
    params: dict[str, Any] = Field(default_factory=dict, validate_default=True)

    @field_validator("kind")
    @classmethod
    def _known(cls, value: str) -> str:
        SMOOTHERS.get(value)
        return value

    @field_validator("params")
    @classmethod
    def _complete(cls, value: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        return _completed(SMOOTHERS, info.data["kind"], value) if "kind" in info.data else value


class ControllerPlugin(Settings):
    """One controller.

    Args:
        kind: Its plugin, by the name in :data:`~controllers.nav2_params.plugins.CONTROLLERS`.
        params: Its parameters; they are checked, completed and brought into a form that JSON can hold.
    """

    kind: str
    params: dict[str, Any] = Field(default_factory=dict, validate_default=True)

    @field_validator("kind")
    @classmethod
    def _known(cls, value: str) -> str:
        refuse_unknown("controller", value, CONTROLLERS)
        return value

    @field_validator("params")
    @classmethod
    def _complete(cls, value: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        return CONTROLLERS[info.data["kind"]].complete(value) if "kind" in info.data else value


def with_release(values: Mapping[str, Any], release: Release) -> dict[str, Any]:
    """Return options of the navigation whose planner and smoothers are of a release."""
    filled = {**values, "planner": _of_release(values["planner"], "name", PLANNERS, release)}
    if isinstance(smoothers := values.get("smoothers"), Mapping):
        filled["smoothers"] = {name: _of_release(one, "kind", SMOOTHERS, release) for name, one in smoothers.items()}
    return filled


def _of_release(plugin: object, key: str, registry: Registry[Any], release: Release) -> Any:
    """Return the mapping of a plugin, of a release if its parameters depend on that and do not name it.

    Args:
        plugin: The mapping; anything else is returned as it is.
        key: The option with the plugin's name in the registry; by default it is the first there.
        registry: Where the plugin is registered.
        release: The release.
    """
    if not isinstance(plugin, Mapping) or not isinstance(params := plugin.get("params", {}), Mapping):
        return plugin
    name = plugin.get(key, registry.built_in[0])
    with suppress(ConfigError):  # a name that is none is refused with the other values
        if isinstance(name, str) and RELEASE in registry.get(name).params.model_fields:
            return {**plugin, "params": {RELEASE: release, **params}}
    return plugin


def _completed(registry: Registry[Any], name: str, params: dict[str, Any]) -> dict[str, Any]:
    """Return the parameters of a plugin, checked and completed, in a form that JSON can hold."""
    made: Settings = registry.get(name).params(**params)
    return made.model_dump(mode="json", exclude_none=True)
