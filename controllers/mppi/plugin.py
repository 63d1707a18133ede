"""MPPI as Nav2 names it, and as parameter files hold it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from controllers.descriptor import Nav2Controller, named_limits
from controllers.mppi.controller import MppiFollower
from controllers.mppi.motion_model import arrange, forms, take_motion_model
from controllers.mppi.params import RENAMED_KEYS, ROS_ONLY_KEYS, MppiParams
from controllers.mppi.records import refuse_short_step
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES, Release
from gym_mapbench.ros_params import Keys, Section, in_every_release

LARGEST_SHARE = 0.6
"""Largest ``threshold_to_consider``, as a share of ``prune_distance``, that leaves PathFollowCritic on in bends."""
LEAST_DEVIATION = 0.25
"""Least ``vx_std`` (m/s) with which enough samples turn into an oblique gap (``docs/howto/slow.md``)."""
VALIDATOR = "mppi::DefaultOptimalTrajectoryValidator"
"""The trajectory validator of Lyrical that is built here."""
OLD_CRITICS: Mapping[Release, Mapping[str, str]] = {"humble": {"PathAlignLegacyCritic": "PathAlignCritic"}}
EXCHANGED = {
    "PathAngleCritic.forward_preference": ("mode", {"true": "0", "false": "1"}),
    "PathAngleCritic.mode": ("forward_preference", {"0": "true", "1": "false"}),
}
"""Mode 2 has no counterpart in Humble."""
LIMITS = {
    "max_linear_velocity": "vx_max",
    "max_reverse_velocity": "vx_min",
    "max_angular_velocity": "wz_max",
    "max_linear_acceleration": "ax_max",
    "max_angular_acceleration": "az_max",
}


def adapt(section: Section) -> None:
    """Choose a motion model and critics that are built here."""
    take_motion_model(section)
    _take_validator(section)
    section.correct("sgf_order", (1, 2), 2)
    _drop_zero(section, "vy_std")
    if section.values.get("motion_model") != "Ackermann":
        _drop_zero(section, "AckermannConstraints.min_turning_r")
    if section.values.get("motion_model") == "Omni":
        section.values["motion_model"] = "DiffDrive"
        why = "driven as DiffDrive: the robots here cannot move sideways"
        section.findings.add("replaced", f"{section.name}.motion_model", why)
    _replace_old_critics(section)


def _take_validator(section: Section) -> None:
    """Take the class out of Lyrical's trajectory validator.

    Raises:
        ConfigError: If it is not Nav2's own.
    """
    validator = section.values.get("TrajectoryValidator")
    if section.findings.release != "lyrical" or not isinstance(validator, dict) or "plugin" not in validator:
        return
    given = validator.pop("plugin")
    if given != VALIDATOR:
        raise ConfigError(
            f"{section.name}.TrajectoryValidator.plugin: the validator {str(given)!r} is not built here "
            f"(expected {VALIDATOR!r})"
        )


def _drop_zero(section: Section, key: str) -> None:
    """Leave out a 0, which is not a valid value, of a parameter that the motion model does not read."""
    *inner, name = key.split(".")
    holder = section.values.get(inner[0], {}) if inner else section.values
    if isinstance(holder, dict) and holder.get(name) in (0, 0.0):
        del holder[name]
        section.findings.add("unused", f"{section.name}.{key}", "this motion model does not read it")


def _replace_old_critics(section: Section) -> None:
    """Let today's critic stand in for the older one that a release still has beside it."""
    critics = section.values.get("critics")
    for other in (release for release in RELEASES if release != section.findings.release):
        _refuse_critics_of(other, section)
    for old, new in OLD_CRITICS.get(section.findings.release, {}).items():
        if isinstance(critics, list) and old in critics and new not in critics:
            critics = section.values["critics"] = [new if name == old else name for name in critics]
            section.values[new] = section.values.pop(old, {})
            section.findings.add("replaced", f"{section.name}.{old}", f"{new} stands in for it")


def _refuse_critics_of(release: Release, section: Section) -> None:
    """Refuse the critics that only another release has.

    Raises:
        ConfigError: If there is one; the error names the critic that comes nearest to it.
    """
    critics = section.values.get("critics")
    for old, new in OLD_CRITICS.get(release, {}).items():
        if isinstance(critics, list) and old in critics:
            raise ConfigError(
                f"{section.name}.critics: only Nav2 {release.capitalize()} has the critic {old!r} (--nav2 {release}); "
                f"{new!r} comes nearest to it in {section.findings.release.capitalize()}"
            )


def advice(params: Mapping[str, Any]) -> str:
    """Say that PathFollowCritic may be off, which only Humble's can be, or that samples are narrow.

    Humble gets one advice, because both changes together lead to contacts (``docs/howto/slow.md``).
    """
    return _of_critic(params) if params["release"] == "humble" else _of_samples(params)


def _of_critic(params: Mapping[str, Any]) -> str:
    """Say that PathFollowCritic may be off; Humble takes the end of the local path for the goal."""
    if "PathFollowCritic" not in params["critics"]:
        return ""
    critic, ahead = params["PathFollowCritic"], params["prune_distance"]
    off = critic["threshold_to_consider"]
    if not critic["enabled"] or off <= LARGEST_SHARE * ahead:
        return ""
    return (
        f"PathFollowCritic.threshold_to_consider {off:g}, prune_distance {ahead:g}: where the path winds, the end of "
        "the local path is nearer than the threshold, the critic is off, and MPPI gets slow; a threshold of at most "
        f"{LARGEST_SHARE:g} times prune_distance helps"
    )


def _of_samples(params: Mapping[str, Any]) -> str:
    """Say that few samples turn into a gap that the path crosses obliquely."""
    if (deviation := params["vx_std"]) >= LEAST_DEVIATION:
        return ""
    return (
        f"vx_std {deviation:g}: where the path crosses a gap obliquely, few samples turn into it, and MPPI gets slow; "
        "0.3 helps, and passes walls a little more closely"
    )


def check_period(params: Mapping[str, Any], control_period: float) -> None:
    """Refuse a ``model_dt`` shorter than the control period; raises ``ConfigError``."""
    refuse_short_step(params["model_dt"], control_period)


MPPI = Nav2Controller(
    in_every_release("nav2_mppi_controller::MPPIController"),
    "MPPI",
    MppiParams,
    Keys(
        ros_only=ROS_ONLY_KEYS | {"Visualization"},
        renamed=RENAMED_KEYS,
        elsewhere={
            "vy_min": "no release reads it; vy_max counts for both sides",
            "OptimalTrajectoryValidator": "Lyrical reads TrajectoryValidator",
            "TwirlingCritic.twirling_cost_power": "an older name of cost_power",
            "TwirlingCritic.twirling_cost_weight": "an older name of cost_weight",
        },
    ),
    adapt=adapt,
    arrange=arrange,
    forms=forms,
    make=MppiFollower,
    limits=partial(named_limits, sources=LIMITS),
    advice=advice,
    relative_cost=4.0,
    old_critics=OLD_CRITICS,
    exchanged=EXCHANGED,
    check_period=check_period,
)
