"""Keys: the keys of a section besides its parameters.

A parameter that a plugin has here is read. All other keys are listed as ignored; the tables say why, where a reason
helps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from gym_mapbench.releases import Release

EVERY_NODE = frozenset(
    {
        "action_server_result_timeout",
        "allow_parameter_qos_overrides",
        "bond_heartbeat_period",
        "bond_timeout",
        "enable_stamped_cmd_vel",
        "introspection_mode",
        "qos_overrides",
        "service_introspection_mode",
        "start_type_description_service",
        "use_realtime_priority",
        "use_sim_time",
    }
)
"""Keys that mean nothing without ROS, whatever the node."""


@dataclass(frozen=True)
class Keys:
    """The keys of one section besides its parameters.

    Args:
        ros_only: Keys, or groups of keys, that mean nothing without ROS; those of every node are added.
        renamed: Name in another release -> name here. A parameter that is also given under its name here counts first.
        missing: Release -> parameter of other releases that it does not have -> what it does instead.
        elsewhere: Key of an older release, of one newer than both, or of another plugin -> what happens here.
        left_out: Keys that are not modelled here, though they may change how the real robot drives.
        shape: Parameters of the robot's shape; a template without a value leaves them to the robot.
        untelling: Parameters that a release besides ours has as well, so that they do not tell the release of a file.
    """

    ros_only: frozenset[str] = frozenset()
    renamed: Mapping[str, str] = field(default_factory=dict)
    missing: Mapping[Release, Mapping[str, str]] = field(default_factory=dict)
    elsewhere: Mapping[str, str] = field(default_factory=dict)
    left_out: frozenset[str] = frozenset()
    shape: frozenset[str] = frozenset()
    untelling: frozenset[str] = frozenset()

    def is_ros_only(self, name: str) -> bool:
        """Whether a dotted name, or a group it belongs to, serves ROS alone."""
        return not _groups(name).isdisjoint(self.ros_only | EVERY_NODE)

    def why_not(self, name: str, release: Release) -> str | None:
        """Return what happens instead of a parameter that only others have; None if the key is not such a parameter."""
        known = {**self.elsewhere, **self.missing.get(release, {})}
        return next((known[group] for group in sorted(_groups(name)) if group in known), None)


def _groups(name: str) -> set[str]:
    """Return a dotted name and all groups that it belongs to."""
    parts = name.split(".")
    return {".".join(parts[: i + 1]) for i in range(len(parts))}
