"""The Rotation Shim as Nav2 names it, and as parameter files hold it: one plugin around each other controller."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from controllers.descriptor import Limits, Nav2Controller, highest, named_limits
from controllers.releases import Release
from controllers.rotation_shim.controller import RotationShimFollower
from controllers.rotation_shim.params import RotationShimParams, params_around
from controllers.rpp.plugin import TURNING
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import RELEASE, Section, in_every_release

NAMES = in_every_release("nav2_rotation_shim_controller::RotationShimController")
PRIMARY = "primary_controller"
OWN_KEYS = {*RotationShimParams.model_fields, PRIMARY} - {RELEASE, *TURNING.values()}
"""Parameters that no primary controller has."""


def around(primary: Nav2Controller, primaries: Iterable[Nav2Controller]) -> Nav2Controller:
    """Describe the Rotation Shim around a controller.

    Args:
        primary: The controller inside.
        primaries: All controllers that can be inside; keys of any of them that mean nothing without ROS, or have other
            names in other releases, are recognised.
    """

    def adapt(section: Section) -> None:
        section.values.pop(PRIMARY, None)
        primary.adapt(section)

    def more_keys(values: Mapping[str, Any], release: Release) -> Mapping[str, Any]:
        return {**primary.more_keys(values, release), PRIMARY: primary.names[release]}

    def limits(params: Mapping[str, Any]) -> Limits:
        return highest([primary.limits(params), named_limits(params, TURNING)])

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
        adapt=adapt,
        more_keys=more_keys,
        make=partial(RotationShimFollower, primary.make),
        limits=limits,
    )


def unfold(section: Section) -> None:
    """Put the parameters of a Rotation Shim's primary controller, in Lyrical a group of their own, beside the shim's.

    Raises:
        ConfigError: If there is no primary controller.
    """
    primary = section.values.get(PRIMARY)
    if isinstance(primary, Mapping):
        section.findings.add("renamed", f"{section.name}.{PRIMARY}", "its parameters stand beside the shim's")
        section.values = {**primary, **section.values, PRIMARY: primary.get("plugin")}
    if section.values.get(PRIMARY) is None:
        raise ConfigError(f"{section.name}.{PRIMARY}: expected the class of the controller inside, got none")
