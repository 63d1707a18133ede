"""Signs: the keys and values of a parameter file that only some releases of Nav2 understand.

Files of Kilted, which lies between Jazzy and Lyrical, are read as Jazzy's: they start there. ``KILTED`` tells them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from fnmatch import fnmatchcase
from typing import NamedTuple

from controllers.nav2_params.file.document import PARAMETERS
from controllers.nav2_params.file.nodes import Node, is_wildcard
from controllers.nav2_params.plugins import CONTROLLERS, controller_kind
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES, Release
from gym_mapbench.ros_params import leaves, nest_dotted

Releases = tuple[Release, ...]

STARTS, DRIVES, IGNORED = 3, 2, 1
"""How strong a sign is: other releases do not start with the key, drive differently without it, or ignore it."""


class Marks(NamedTuple):
    """Keys that other releases ignore. Where no keys are listed, the node itself is the sign.

    Args:
        releases: The releases that have these keys.
        keys: Node -> patterns of its keys; both with wildcards.
        strength: Strength of these signs.
    """

    releases: Releases
    keys: Mapping[str, tuple[str, ...]]
    strength: int = IGNORED


KILTED: Mapping[str, tuple[str, ...]] = {
    "*": ("service_introspection_mode",),
    "bt_navigator": ("error_code_name_prefixes",),
}
"""Node -> keys of Kilted that Jazzy does not have."""
MARKS = (
    Marks(
        ("humble",),
        {
            "controller_server": ("progress_checker_plugin", "goal_checker_plugin"),
            "behavior_server": ("costmap_topic", "footprint_topic"),
            "recoveries_server": (),
            "bt_navigator": ("plugin_lib_names", "default_bt_xml_filename", "groot_zmq_*", "enable_groot_monitoring"),
            "bt_navigator*_rclcpp_node": (),
            "*_costmap_client": (),
            "dwb_controller": (),
        },
    ),
    Marks(
        ("jazzy",),
        {
            "bt_navigator": ("error_code_names",),
            "velocity_smoother": ("stamp_smoothed_velocity_with_smoothing_time",),
        },
    ),
    Marks(
        ("jazzy", "lyrical"),
        {
            "controller_server": (
                "progress_checker_plugins",
                "costmap_update_timeout",
                "use_realtime_priority",
                "enable_stamped_cmd_vel",
            ),
            "planner_server": ("costmap_update_timeout",),
            "behavior_server": ("local_costmap_topic", "local_footprint_topic", "global_costmap_topic", "local_frame"),
            "bt_navigator": ("error_code_name_prefixes", "navigators"),
            "velocity_smoother": ("enable_stamped_cmd_vel",),
            "docking_server": (),
            "route_server": (),
            "loopback_simulator": (),
        },
    ),
    Marks(("jazzy",), {"*": KILTED["*"]}),
    Marks(("humble", "jazzy"), {"*": ("action_server_result_timeout",)}),
    Marks(("lyrical",), {"controller_server": ("path_handler_plugins", "*.path_length_tolerance")}, DRIVES),
    Marks(
        ("lyrical",),
        {
            "controller_server": ("*.max_linear_vel",),
            "planner_server": ("allow_partial_planning", "*.max_cycles_factor"),
            "smoother_server": ("*.window_size", "*.poly_order"),
            "bt_navigator": ("bt_search_directories",),
            "*": ("introspection_mode",),
        },
    ),
)

OF_CLASSES = ("nav2_navfn_", "nav2_smac_", "nav2_theta_star_", "nav2_behaviors", "nav2_recoveries")
"""Beginnings of the names of the packages with Nav2's planners and behaviours."""
CLASSES = ("planner_server", "behavior_server")
"""Nodes whose classes are written with ``/`` up to Iron and with ``::`` since Jazzy; else Nav2 does not start.

A ``recoveries_server``, which no release since Humble has, keeps none from starting.
"""


class Sign(NamedTuple):
    """A key that tells the release.

    Args:
        strength: ``STARTS``, ``DRIVES`` or ``IGNORED``.
        releases: The releases that understand the key.
        name: Full name of the key.
    """

    strength: int
    releases: Releases
    name: str


def signs_of(node: Node) -> Iterator[Sign]:
    """Yield the signs of one node."""
    yield from marks_of(node)
    parameters = _parameters(node)
    if node.name in CLASSES or is_wildcard(node.name):
        yield from _class_signs(node, parameters)
    if node.section == "controller_server" or is_wildcard(node.name):
        for name, group in parameters.items():
            yield from _controller_signs(f"{node.full}.{name}", group)


def marks_of(node: Node) -> Iterator[Sign]:
    """Yield the signs of one node by :data:`MARKS`."""
    parameters = _parameters(node)
    for marks in MARKS:
        for name, patterns in marks.keys.items():
            if fnmatchcase(node.name, name):
                found = _matching(parameters, patterns)
                yield from (Sign(marks.strength, marks.releases, f"{node.full}{key}") for key in found)


def kilted_key(nodes: Iterable[Node]) -> str:
    """Return the full name of the first key that tells a file of Kilted from one of Jazzy; empty if there is none."""
    found = (
        f"{node.full}{key}"
        for node in nodes
        for name, patterns in KILTED.items()
        if fnmatchcase(node.name, name)
        for key in _matching(_parameters(node), patterns)
    )
    return next(found, "")


def _parameters(node: Node) -> Mapping[str, object]:
    """Return the parameters of a node, nested; none if they are no group, which is an error where they are read."""
    try:
        return nest_dotted(node.group[PARAMETERS]) if node.group else {}
    except (ConfigError, AttributeError):
        return {}


def _matching(parameters: Mapping[str, object], patterns: tuple[str, ...]) -> list[str]:
    """Return the matching keys of a node, each after a dot; without patterns, an empty text for the node itself."""
    if not patterns:
        return [""]
    return [f".{key}" for key, _ in leaves(parameters) if any(fnmatchcase(key, pattern) for pattern in patterns)]


def _class_signs(node: Node, parameters: Mapping[str, object]) -> Iterator[Sign]:
    """Yield the classes of Nav2's planners or behaviours; a section for several nodes may hold other plugins, too."""
    packages = OF_CLASSES if is_wildcard(node.name) else ("nav2_",)
    for key, value in leaves(parameters):
        named = str(value)
        if key.endswith(".plugin") and named.startswith(packages) and ("/" in named or "::" in named):
            yield Sign(STARTS, ("jazzy", "lyrical") if "::" in named else ("humble",), f"{node.full}.{key}")


def _controller_signs(full: str, group: object) -> Iterator[Sign]:
    """Yield the parameters of a controller that not every release has, by the tables of the controller's own module."""
    kind = controller_kind(group) if isinstance(group, Mapping) else None
    if kind is None or not isinstance(group, Mapping):
        return
    plugin = CONTROLLERS[kind]
    for key, releases in plugin.forms(group).items():
        yield Sign(STARTS, releases, f"{full}.{key}")
    missing, untelling = plugin.keys.missing, plugin.keys.untelling
    for key, _ in leaves(group):
        having = tuple(release for release in RELEASES if key not in missing.get(release, {}))
        if 0 < len(having) < len(RELEASES) and key not in untelling:
            yield Sign(DRIVES, having, f"{full}.{key}")
