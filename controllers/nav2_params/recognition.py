"""Recognises by its keys for which distribution a parameter file is written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import NamedTuple

from controllers.nav2_params.document import PARAMETERS
from controllers.nav2_params.nodes import Node
from controllers.nav2_params.plugins import CONTROLLERS, controller_kind
from controllers.releases import RELEASES, Release
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import leaves, nest_dotted

CLEAR_MAJORITY = 2
"""Where there are signs of both releases, one needs more than this many times the signs of the other."""

Patterns = Mapping[Release, Mapping[str, tuple[str, ...]]]

OTHER: Patterns = {
    "humble": {
        "controller_server": ("progress_checker_plugin", "goal_checker_plugin"),
        "behavior_server": ("costmap_topic", "footprint_topic"),
        "recoveries_server": (),
        "bt_navigator": ("plugin_lib_names", "default_bt_xml_filename", "groot_zmq_*", "enable_groot_monitoring"),
        "bt_navigator*_rclcpp_node": (),
        "*_costmap_client": (),
        "dwb_controller": (),
    },
    "jazzy": {
        "controller_server": (
            "progress_checker_plugins",
            "costmap_update_timeout",
            "use_realtime_priority",
            "enable_stamped_cmd_vel",
        ),
        "planner_server": ("costmap_update_timeout",),
        "behavior_server": ("local_costmap_topic", "local_footprint_topic", "global_costmap_topic", "local_frame"),
        "bt_navigator": ("error_code_name*", "navigators"),
        "velocity_smoother": ("stamp_smoothed_velocity_with_smoothing_time", "enable_stamped_cmd_vel"),
        "docking_server": (),
        "route_server": (),
        "loopback_simulator": (),
    },
}
"""Release -> node -> keys that the other release ignores, and that do not change how a controller drives.

Where no keys are listed, the node itself is the sign.
"""

STARTING = {"planner_server": "*.plugin", "behavior_server": "*.plugin"}
"""Where a class is written with ``/`` up to Iron and with ``::`` since Jazzy; misspelt, Nav2 does not start."""


class Sign(NamedTuple):
    """A key that tells the release.

    Args:
        strength: 3 if the other release does not start with it, 2 if it changes how a controller drives, else 1.
        release: The release that it tells.
        name: Full name of the key.
    """

    strength: int
    release: Release
    name: str


@dataclass(frozen=True)
class Recognition:
    """As which distribution a file is read, and why.

    Args:
        release: The distribution.
        told_by: Full names of the keys that say so, the strongest first; empty if none does, or if the user said it.
        against: Full names of the keys that speak for the other distribution.
        given: Whether the user named the distribution.
    """

    release: Release
    told_by: tuple[str, ...] = ()
    against: tuple[str, ...] = ()
    given: bool = False


def recognise(nodes: list[Node], given: Release | None = None) -> Recognition:
    """Return the distribution that a file is written for, and the keys that tell; Humble if none does.

    The strongest signs there are decide, if a clear majority of them speaks for one release; weaker signs then do not
    count. Among signs of the weakest strength any majority decides, and without one the file is Humble's. The reason is
    that only a class in the wrong spelling keeps Nav2 from starting, and that only some keys change how it drives; the
    others are often leftovers.

    Args:
        nodes: The nodes of the file.
        given: The distribution that the user names, which counts before all signs.

    Raises:
        ConfigError: If stronger signs have no clear majority, so that the file mixes the distributions.
    """
    signs = [sign for node in nodes for sign in _signs(node)]
    release = given or _decide(signs)
    named = {name: tuple(sign.name for sign in _of(name, signs)) for name in RELEASES}
    other = next(name for name in RELEASES if name != release)
    return Recognition(release, () if given else named[release], named[other], given is not None)


def _decide(signs: list[Sign]) -> Release:
    for strength, majority in ((3, CLEAR_MAJORITY), (2, CLEAR_MAJORITY), (1, 1)):
        strong = [sign for sign in signs if sign.strength == strength]
        humble, jazzy = ([sign for sign in strong if sign.release == name] for name in RELEASES)
        if len(humble) > majority * len(jazzy):
            return "humble"
        if len(jazzy) > majority * len(humble):
            return "jazzy"
        if strong and strength > 1:
            raise _mixture(humble[0].name, jazzy[0].name)
    return "humble"


def _mixture(humble: str, jazzy: str) -> ConfigError:
    return ConfigError(
        f"{jazzy}: the file mixes the distributions: this is Jazzy's, but {humble} is Humble's; say which one with "
        "--nav2 humble or --nav2 jazzy"
    )


def _of(release: Release, signs: list[Sign]) -> list[Sign]:
    return sorted((sign for sign in signs if sign.release == release), key=lambda sign: -sign.strength)


def _signs(node: Node) -> Iterator[Sign]:
    """Yield the signs of one node."""
    try:
        parameters = nest_dotted(node.group[PARAMETERS]) if node.group else {}
    except (ConfigError, AttributeError):
        return  # the error is raised where the section is read
    for release, of_nodes in OTHER.items():
        for name, patterns in of_nodes.items():
            if fnmatchcase(node.name, name):
                yield from (Sign(1, release, f"{node.full}{key}") for key in _matching(parameters, patterns))
    for key, value in leaves(parameters):
        if _starts_only_one(node.section, key, str(value)):
            yield Sign(3, "jazzy" if "::" in str(value) else "humble", f"{node.full}.{key}")
    if node.section == "controller_server":
        for name, group in parameters.items():
            yield from _driving_signs(f"{node.full}.{name}", group)


def _driving_signs(full: str, group: object) -> Iterator[Sign]:
    """Yield the parameters of a controller that only one release has, by the tables of the controller's own module."""
    kind = controller_kind(group) if isinstance(group, Mapping) else None
    if kind is None or not isinstance(group, Mapping):
        return
    missing = CONTROLLERS[kind].keys.missing
    for key, _ in leaves(group):
        without = [release for release in RELEASES if key in missing.get(release, {})]
        if len(without) == 1:
            yield Sign(2, next(release for release in RELEASES if release not in without), f"{full}.{key}")


def _matching(parameters: Mapping[str, object], patterns: tuple[str, ...]) -> list[str]:
    """Return the matching keys of a node, each after a dot; without patterns, an empty text for the node itself."""
    if not patterns:
        return [""]
    return [f".{key}" for key, _ in leaves(parameters) if any(fnmatchcase(key, pattern) for pattern in patterns)]


def _starts_only_one(section: str, key: str, named: str) -> bool:
    return (
        section in STARTING
        and fnmatchcase(key, STARTING[section])
        and named.startswith("nav2_")
        and ("/" in named or "::" in named)
    )
