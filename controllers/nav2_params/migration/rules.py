"""The rules by which a node's parameters are migrated, as data; ``*`` stands for every node of Nav2.

Source: Nav2's migration guides.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from controllers.nav2_params.file.keys import CODES, ENDING, PREFIXES
from controllers.nav2_params.file.signs import OF_CLASSES
from gym_mapbench.releases import RELEASES, Release


class Rename(NamedTuple):
    """A parameter that gets another name.

    Args:
        node: Name of the node, with wildcards.
        old: Old dotted name, with wildcards.
        new: The last part of the new name.
        listed: True if its value, one name, becomes a list; False if a list becomes its first name; None for neither.
        ending: What stands at the end of the names of its list before, and after.
        sources: The releases whose files have the old name.
    """

    node: str
    old: str
    new: str
    listed: bool | None = None
    ending: tuple[str, str] = ("", "")
    sources: tuple[Release, ...] = RELEASES


OLD_TREE = "default_bt_xml_filename"
"""Name of the behaviour tree's file before Humble; as a value, a word that launch files of that time replace."""
SINCE_HUMBLE = (
    Rename("bt_navigator", OLD_TREE, "default_nav_to_pose_bt_xml"),
    Rename("controller_server", "goal_checker_plugin", "goal_checker_plugins", True),
    Rename("recoveries_server", "recovery_plugins", "behavior_plugins"),
    Rename("*", "transform_timeout", "transform_tolerance"),
    Rename("*_costmap", "*.obstacle_range", "obstacle_max_range"),
    Rename("*_costmap", "*.raytrace_range", "raytrace_max_range"),
    Rename("controller_server", "*.max_allowed_time_to_collision", "max_allowed_time_to_collision_up_to_carrot"),
)
"""Names of releases before Humble."""
SINCE_JAZZY = (
    *SINCE_HUMBLE,
    Rename("controller_server", "progress_checker_plugin", "progress_checker_plugins", True),
    Rename("behavior_server", "costmap_topic", "local_costmap_topic"),
    Rename("behavior_server", "footprint_topic", "local_footprint_topic"),
    Rename("behavior_server", "global_frame", "local_frame"),
    Rename("recoveries_server", "costmap_topic", "local_costmap_topic"),
    Rename("recoveries_server", "footprint_topic", "local_footprint_topic"),
    Rename("recoveries_server", "global_frame", "local_frame"),
)
"""Names of Humble and of releases before it."""
FROM_LYRICAL = Rename("controller_server", "*.max_linear_vel", "desired_linear_vel", sources=("lyrical",))
RENAMES: Mapping[Release, tuple[Rename, ...]] = {
    "humble": (
        *SINCE_HUMBLE,
        FROM_LYRICAL,
        Rename("controller_server", "progress_checker_plugins", "progress_checker_plugin", False),
        Rename("behavior_server", "local_costmap_topic", "costmap_topic"),
        Rename("behavior_server", "local_footprint_topic", "footprint_topic"),
        Rename("behavior_server", "local_frame", "global_frame"),
    ),
    "jazzy": (
        *SINCE_JAZZY,
        FROM_LYRICAL,
        Rename("bt_navigator", PREFIXES, CODES, ending=("", ENDING), sources=("lyrical",)),
    ),
    "lyrical": (
        *SINCE_JAZZY,
        Rename("controller_server", "*.desired_linear_vel", "max_linear_vel"),
        Rename("bt_navigator", CODES, PREFIXES, ending=(ENDING, "")),
    ),
}
LYRICALS = {
    "*": ("introspection_mode",),
    "*_costmap": ("*.custom_inscribed_radius", "*.num_threads"),
    "bt_navigator": ("bt_search_directories",),
    "collision_monitor": ("enabled", "*.trigger_consecutive_points", "*.release_consecutive_points"),
    "controller_server": ("*.path_length_tolerance", "*.xy_goal_tolerance_buffer"),
    "planner_server": ("allow_partial_planning", "*.max_cycles_factor"),
}
"""Node -> keys of Lyrical's files that mean nothing in older releases; those of controllers are in their own tables."""
UNKNOWN: Mapping[Release, Mapping[str, tuple[str, ...]]] = {
    "humble": {
        "*": ("enable_stamped_cmd_vel", "use_realtime_priority", "costmap_update_timeout", "*introspection_mode"),
        "*_costmap": ("*.override_lethal_cost", "*.lethal_override_cost"),
        "behavior_server": ("global_costmap_topic", "global_footprint_topic"),
        "bt_navigator": ("error_code_name*", "navigators", "navigate_to_pose", "navigate_through_poses"),
        "collision_monitor": ("*.sources_names",),
        "velocity_smoother": ("stamp_smoothed_velocity_with_smoothing_time",),
    },
    "jazzy": {"bt_navigator": ("groot_zmq_*", "enable_groot_monitoring")},
    "lyrical": {
        "*": ("action_server_result_timeout",),
        "bt_navigator": ("groot_zmq_*",),
        "velocity_smoother": ("stamp_smoothed_velocity_with_smoothing_time",),
    },
}
"""Release -> node -> keys that mean nothing there."""
OVERTAKEN: Mapping[Release, Mapping[str, str]] = {"humble": {"global_frame": "local_frame"}}
"""Release -> key of the behaviour server that is taken out -> the key that then gets its name."""
RESPELT = frozenset({"planner_server", "behavior_server", "recoveries_server", "bt_navigator"})
"""Nodes whose plugins' classes are written with ``/`` in Humble and with ``::`` since Jazzy."""
RESPELT_PACKAGES = (*OF_CLASSES, "nav2_bt_navigator")
"""Beginnings of the names of the packages with these plugins."""
STAMPED = "enable_stamped_cmd_vel"
STAMPED_NODES = frozenset(
    {"behavior_server", "collision_monitor", "controller_server", "docking_server", "velocity_smoother"}
)
"""Nodes that publish TwistStamped instead of Twist if ``STAMPED`` says so: by default since Kilted."""
NEW_DEFAULTS: Mapping[str, Mapping[str, str]] = {
    "controller_server": {
        "nav2_controller::*GoalChecker": "path_length_tolerance 1.0: the goal is not reached while more of the local "
        "plan is left",
    },
    "behavior_server": {
        "*BackUp": "acceleration_limit 2.5, deceleration_limit -2.5, minimum_speed 0.1: the robot slows down before "
        "the end",
        "*DriveOnHeading": "acceleration_limit 2.5, deceleration_limit -2.5, minimum_speed 0.1: the robot slows down "
        "before the end",
    },
}
"""Node -> class of a plugin -> parameters that only Lyrical has, with their defaults and what they do."""
