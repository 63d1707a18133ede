"""The Rotation Shim as Nav2 names it, and as parameter files hold it: one plugin around each other controller."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from controllers.descriptor import Limits, Nav2Controller, highest, named_limits
from controllers.rotation_shim.lyrical import make_shim
from controllers.rotation_shim.params import RotationShimParams, params_around
from controllers.rpp.plugin import TURNING
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import RELEASE, Section, in_every_release

NAMES = in_every_release("nav2_rotation_shim_controller::RotationShimController")
PRIMARY = "primary_controller"
START = "without which Nav2 Lyrical does not start"
OWN_KEYS = {*RotationShimParams.model_fields, PRIMARY} - {RELEASE, *TURNING.values()}
"""Parameters that no primary controller has."""
OWN_OF_SHIM = frozenset({*OWN_KEYS, *TURNING.values(), "plugin"})
"""Parameters that the Rotation Shim itself reads."""


def around(primary: Nav2Controller, primaries: Iterable[Nav2Controller]) -> Nav2Controller:
    """Describe the Rotation Shim around a controller.

    Args:
        primary: The controller inside.
        primaries: All controllers that can be inside; keys of any of them that mean nothing without ROS, or have other
            names in other releases, are recognised.
    """
    every = [one.other_keys for one in primaries]
    keys = replace(
        primary.other_keys,
        ros_only=frozenset().union(*(keys.ros_only for keys in every)),
        renamed={new: old for keys in every for new, old in keys.renamed.items()},
    )
    return replace(
        primary,
        names=NAMES,
        title=f"the Rotation Shim around {primary.title}",
        params=params_around(primary.params),
        other_keys=keys,
        adapt=partial(_adapt, primary),
        arrange=partial(_arrange, primary),
        forms=partial(_forms, primary),
        make=partial(make_shim, primary.make),
        limits=partial(_limits, primary),
    )


def _adapt(primary: Nav2Controller, section: Section) -> None:
    """Leave the class of the primary controller out, and of its group what the shim does not share with it."""
    inside = section.values.pop(PRIMARY, None)
    if section.findings.release == "lyrical":
        section.values[PRIMARY] = {name: value for name, value in inside.items() if name in TURNING.values()}
    primary.adapt(section)


def _arrange(primary: Nav2Controller, values: dict[str, Any], release: Release) -> dict[str, Any]:
    """Name the primary controller; in Lyrical, put its parameters into its own group."""
    if release != "lyrical":
        return {**primary.arrange(values, release), PRIMARY: primary.names[release]}
    own = {name: value for name, value in values.items() if name in RotationShimParams.model_fields}
    apart = own.pop(PRIMARY, {})
    inside = {name: value for name, value in values.items() if name not in RotationShimParams.model_fields}
    return {**own, PRIMARY: {"plugin": primary.names[release], **primary.arrange(inside, release), **apart}}


def _forms(primary: Nav2Controller, group: Mapping[str, Any]) -> Mapping[str, tuple[Release, ...]]:
    """Return the keys with a form that not every release starts with -> the releases that do."""
    inside = group[PRIMARY]
    if not isinstance(inside, Mapping):
        return {PRIMARY: ("humble", "jazzy"), **primary.forms(group)}
    return {PRIMARY: ("lyrical",), **{f"{PRIMARY}.{key}": found for key, found in primary.forms(inside).items()}}


def _limits(primary: Nav2Controller, params: Mapping[str, Any]) -> Limits:
    """Return the limits of the robot that the parameters of both state."""
    return highest([primary.limits(params), named_limits(params, TURNING)])


def configured_inside(params: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of a controller as those of a shim around it, whose other parameters have their defaults.

    In Lyrical the controller keeps its own turn on the spot.
    """
    own = {name: params[name] for name in TURNING.values() if name in params}
    return {**params, PRIMARY: own} if own and params["release"] == "lyrical" else {**params}


def unfold(section: Section) -> None:
    """Put the parameters of a Rotation Shim's primary controller, in Lyrical a group of their own, beside the shim's.

    Raises:
        ConfigError: If there is no primary controller, or the release does not start with this form of it.
    """
    primary, where = section.values.get(PRIMARY), f"{section.name}.{PRIMARY}"
    if (primary.get("plugin") if isinstance(primary, Mapping) else primary) is None:
        raise ConfigError(f"{where}: expected the class of the controller inside, got none")
    if section.findings.release == "lyrical":
        if not isinstance(primary, Mapping):
            raise ConfigError(f"{where}: expected a group with the class as its plugin, {START}, got {primary!r}")
        _leave_others(section)
    elif isinstance(primary, Mapping):
        section.findings.add("renamed", where, "its parameters stand beside the shim's")
    if isinstance(primary, Mapping):
        section.values = {**primary, **section.values}


def _leave_others(section: Section) -> None:
    """List the parameters beside the shim's own; Lyrical reads those of the primary controller from its group alone."""
    for name in [name for name in section.values if name not in {*OWN_KEYS, *TURNING.values(), "plugin"}]:
        section.values.pop(name)
        section.findings.add("unused", f"{section.name}.{name}", f"Lyrical looks for it in {PRIMARY}")
