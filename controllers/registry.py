"""Controllers by name: Nav2's own, those of third parties, and learned policies from their files.

A third party provides a callable that makes its controller. It is named ``module:attribute``, or registered here or
in the entry point group ``gym_mapbench.controllers`` (see :mod:`gym_mapbench.registry`). It is called with the
parameters that the user gave, and with ``navigation=`` (a :class:`~controllers.nav2_params.NavigationParams`) if it has
a parameter of that name, and returns a :class:`~controllers.base.Controller`.
:class:`~controllers.navigator.navigator.Navigator` makes a controller of a path follower.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

from controllers.base import Controller, PathFollower
from controllers.nav2_params import ControllerPlugin, NavigationParams, load_preset, plugins
from controllers.navigator.navigator import Navigator
from controllers.rl import load_sb3
from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.registry import Registry, accepted_keywords, required_keywords, takes_any_keyword
from gym_mapbench.ros_params import Findings, Section, overlay
from gym_mapbench.trust import about_to_run

FOLLOWERS: dict[str, Callable[[Any], PathFollower]] = {
    name: plugin.make for name, plugin in plugins.CONTROLLERS.items()
}
"""Nav2's controllers, and the Rotation Shim around each of them; each is made from its own parameters."""

HINT = "; controllers.rl.as_controller makes a controller of a policy"


def _hint(thing: object) -> str:
    """Say how a policy becomes a controller, if something may be one."""
    return HINT if hasattr(thing, "predict") or callable(thing) else ""


def _must_make(entry: Any) -> Any:
    """Accept what can be called to make a controller; raises ``ConfigError`` otherwise."""
    if not callable(entry):
        got = type(entry).__name__
        raise ConfigError(f"expected a class, or a function that makes a controller, got a {got}{_hint(entry)}")
    return entry


CONTROLLERS: Registry[Callable[..., Any]] = Registry("controller", "controllers", FOLLOWERS, check=_must_make)
"""All controllers; those of third parties are called as described at the top of this module."""


def relative_cost(name: str, navigation: NavigationParams) -> float:
    """Return the CPU time of a controller's runs, relative to Regulated Pure Pursuit.

    Args:
        name: As in :func:`make_controller`.
        navigation: Has the controllers with names of their own.

    Returns:
        The cost that the controller's description or a third party's attribute ``relative_cost`` states; infinite where
        neither does, as for models.

    Raises:
        ConfigError: If a third party's attribute is no number.
    """
    kind = navigation.controllers[name].kind if name in navigation.controllers else name
    if kind in plugins.CONTROLLERS:
        return plugins.CONTROLLERS[kind].relative_cost
    cost = math.inf if kind.endswith(".zip") else getattr(CONTROLLERS.get(kind), "relative_cost", math.inf)
    if not isinstance(cost, int | float):
        raise ConfigError(f"controller {kind!r}: expected relative_cost as a number, got {cost!r:.80}")
    return float(cost)


def make_controller(
    name: str,
    *,
    navigation: NavigationParams | None = None,
    preset: str = "thesis",
    label: str | None = None,
    **nav2_params: Any,
) -> Controller:
    """Make a controller, ready for ``reset``.

    Args:
        name: ``dwb``, ``mppi``, ``rpp`` or ``graceful``; ``shim_dwb`` and so on for a Rotation Shim around one of them;
            a controller of ``navigation`` by its own name; a third party's (a name or ``module:attribute``); or the
            file of a Stable-Baselines3 model, ``path/to/model.zip`` or ``NAME=path/to/model.zip``.
        navigation: Parameters of the whole navigation, e.g. from ``read_nav2_params``; None for the preset's.
        preset: One of :data:`~controllers.nav2_params.PRESETS`; not used if ``navigation`` is given.
        label: Name under which the controller is reported; ``name`` if None. A third party's controller names itself.
        nav2_params: Parameters of this controller to change, under Nav2's names; dotted names are given as
            ``**{"PathAlign.scale": 24.0}``. Names of newer releases are understood, and keys that only ROS reads are
            accepted without effect.

    Raises:
        ConfigError: If the controller or a parameter is unknown (the error gives the nearest valid name), or a value
            or a file is bad.
        PluginError: If a third party's callable fails.
    """
    navigation = navigation or load_preset(preset)
    if name.endswith(".zip") and name not in navigation.controllers:
        return _load_model(name, label, nav2_params)
    if name in FOLLOWERS or name in navigation.controllers:
        follower = _make_follower(name, navigation.controller(name), nav2_params)
        return Navigator(follower, navigation, label or name)
    return _make_third_party(name, CONTROLLERS.get(name, others=navigation.controllers), navigation, nav2_params)


def _load_model(spec: str, label: str | None, params: Mapping[str, Any]) -> Controller:
    """Load ``path/to/model.zip``; without a label, ``NAME=path/to/model.zip`` gives one."""
    name, path = "", spec
    if label is None and "=" in spec:
        name, _, path = spec.partition("=")
    if params:
        raise ConfigError(f"{spec}: a model takes no parameters, got {', '.join(params)}")
    about_to_run(path)
    return load_sb3(path, label or name or Path(path).stem)


def _make_follower(name: str, plugin: ControllerPlugin, changes: Mapping[str, Any]) -> PathFollower:
    """Make one of Nav2's controllers with some of its parameters changed."""
    kind, release = plugins.CONTROLLERS[plugin.kind], plugin.params["release"]
    section = Section(name, changes, Findings(release))
    params = overlay(plugin.params, kind.given(section, plugins.strays(plugin.kind)))
    section.findings.refuse()
    return FOLLOWERS[plugin.kind](section.make(kind.params, params))


def _make_third_party(
    name: str, make: Callable[..., Any], navigation: NavigationParams, params: Mapping[str, Any]
) -> Controller:
    """Call a third party's callable and check the controller that it returns."""
    accepted = accepted_keywords(make)
    for key in params:
        if key not in accepted and not takes_any_keyword(make):
            raise unknown_name(f"parameter of {name}", key, accepted - {"navigation"})
    given = {"navigation": navigation} if "navigation" in accepted else {}
    if needed := required_keywords(make) - {*given, *params}:
        got = f"a callable that needs {', '.join(sorted(needed))}"
        raise ConfigError(
            f"controller {name!r}: expected a class, or a function that makes a controller, got {got}{HINT}"
        )
    with CONTROLLERS.blamed(name):
        made = make(**given, **params)
        missing = [part for part in ("observation_keys", "reset", "act") if not hasattr(made, part)]
    if missing:
        got = f"a {type(made).__name__}{_hint(made)}"
        raise ConfigError(f"controller {name!r}: expected one with {missing[0]!r}, got {got}")
    return cast("Controller", made)
