"""Tables of the keys of a parameter file: those that only ROS needs, that have other names, that other releases have.

A parameter that a plugin has here is read. All other keys are listed as ignored; the tables say why, where a reason
helps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from controllers.releases import Release

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
ROS_ONLY_NODES = frozenset(
    {
        "amcl",
        "docking_server",
        "following_server",
        "lifecycle_manager",
        "lifecycle_manager_localization",
        "lifecycle_manager_navigation",
        "loopback_simulator",
        "map_saver",
        "map_server",
        "robot_state_publisher",
        "route_server",
        "smoother_server",
        "waypoint_follower",
    }
)
"""Nodes that have no part in driving to a pose with the default tree; the robot knows its pose here."""

LOCALISATION = ("amcl", "ekf", "localization", "slam", "ukf")
"""Parts of the names of nodes that localise the robot, which knows its pose here."""

FILTER_NODES = ("filter_info_server", "filter_mask_server")
"""Ends of the names of nodes that serve costmap filters; the filters themselves are listed with their costmap."""

UNMODELLED_NODES = {"collision_monitor": "it would slow down or stop the robot close to obstacles"}
"""Nodes that are not modelled here -> what they would do."""

INNER_NODES = ("_client", "_rclcpp_node")
"""Ends of the names of nodes that Nav2's servers have for their own use."""

FRAMES = frozenset({"global_frame", "local_frame", "robot_base_frame", "transform_tolerance"})


@dataclass(frozen=True)
class Keys:
    """What is known about the keys of one section, besides the parameters that it has here.

    Args:
        ros_only: Keys, or groups of keys, that mean nothing without ROS; those of every node are added.
        renamed: Name in another release -> name here. A parameter that is also given under its name here counts first.
        missing: Release -> parameter of other releases that it does not have -> what it does instead.
        elsewhere: Key of an older release, of one newer than both, or of another plugin -> what happens here.
        left_out: Keys that are not modelled here, though they may change how the real robot drives.
        shape: Parameters of the robot's shape; a template without a value leaves them to the robot.
    """

    ros_only: frozenset[str] = frozenset()
    renamed: Mapping[str, str] = field(default_factory=dict)
    missing: Mapping[Release, Mapping[str, str]] = field(default_factory=dict)
    elsewhere: Mapping[str, str] = field(default_factory=dict)
    left_out: frozenset[str] = frozenset()
    shape: frozenset[str] = frozenset()

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


CONTROLLER_SERVER = Keys(
    ros_only=frozenset(
        {
            "odom_duration",
            "odom_topic",
            "speed_limit_topic",
            "publish_path",
            "transform_tolerance",
        }
    ),
    elsewhere={
        "controller_plugin_ids": "Eloquent's name of controller_plugins",
        "controller_plugin_types": "each plugin's own 'plugin' counts since Foxy",
        "goal_checker_plugin": "goal_checker_plugins is given as well, and counts",
        "progress_checker_plugin": "progress_checker_plugins is given as well, and counts",
        "search_window": "every controller here prunes the path itself",
    },
)
PROGRESS_CHECKER = Keys(ros_only=frozenset({"plugin"}))
GOAL_CHECKER = Keys(
    ros_only=frozenset({"plugin"}),
    elsewhere={
        "path_length_tolerance": "the distance to the goal counts here, not the way along the path",
        "xy_goal_tolerance_buffer": "newer releases only",
    },
)
PLANNER_SERVER = Keys(
    ros_only=frozenset({"expected_planner_frequency"}),
    elsewhere={
        "allow_partial_planning": "a goal that cannot be planned to fails here",
        "planner_plugin_ids": "Eloquent's name of planner_plugins",
        "planner_plugin_types": "each plugin's own 'plugin' counts since Foxy",
    },
)
NAVFN = Keys(ros_only=frozenset({"plugin"}), elsewhere={"max_cycles_factor": "newer releases only"})
SMAC_2D = Keys(
    ros_only=frozenset({"plugin", "max_planning_time", "terminal_checking_interval"}),
    elsewhere=dict.fromkeys(
        (
            "analytic_expansion_max_cost",
            "analytic_expansion_max_length",
            "analytic_expansion_ratio",
            "angle_quantization_bins",
            "cache_obstacle_heuristic",
            "change_penalty",
            "cost_penalty",
            "debug_visualizations",
            "goal_heading_mode",
            "lattice_filepath",
            "lookup_table_size",
            "minimum_turning_radius",
            "motion_model_for_search",
            "non_straight_penalty",
            "retrospective_penalty",
            "reverse_penalty",
            "rotation_penalty",
            "smooth_path",
            "smoother.optimizer",
            "smoother.smoother",
        ),
        "a parameter of Hybrid-A*, State Lattice or an older Smac planner",
    ),
)
THETA_STAR = Keys(
    ros_only=frozenset({"plugin", "terminal_checking_interval"}),
    elsewhere={"w_heuristic_cost": "Theta* computes it from w_euc_cost"},
)
BEHAVIOR_SERVER = Keys(
    ros_only=FRAMES
    | {
        "costmap_topic",
        "footprint_topic",
        "global_costmap_topic",
        "global_footprint_topic",
        "local_costmap_topic",
        "local_footprint_topic",
    },
    renamed={"projection_time": "simulate_ahead_time"},
    missing={"jazzy": {"backup": "its back-up has one speed"}},
    elsewhere={"transform_timeout": "an older name of transform_tolerance"},
)
BT_NAVIGATOR = Keys(
    ros_only=FRAMES
    | {
        "always_reload_bt_xml",
        "bt_log_topic",
        "bt_search_directories",
        "default_cancel_timeout",
        "default_nav_through_poses_bt_xml",
        "default_server_timeout",
        "enable_groot_monitoring",
        "error_code_name_prefixes",
        "error_code_names",
        "filter_duration",
        "goal_blackboard_id",
        "goals_blackboard_id",
        "groot_server_port",
        "groot_zmq_publisher_port",
        "groot_zmq_server_port",
        "navigate_through_poses",
        "navigate_to_pose",
        "navigators",
        "odom_topic",
        "path_blackboard_id",
        "plugin_lib_names",
        "wait_for_service_timeout",
    },
    elsewhere={
        "bt_xml_filename": "an older name of default_nav_to_pose_bt_xml; the default tree drives here",
        "default_bt_xml_filename": "an older name of default_nav_to_pose_bt_xml; the default tree drives here",
        "transform_timeout": "an older name of transform_tolerance",
    },
    left_out=frozenset({"default_nav_to_pose_bt_xml"}),
)
VELOCITY_SMOOTHER = Keys(
    ros_only=frozenset({"odom_topic", "stamp_smoothed_velocity_with_smoothing_time"}),
)
COSTMAP = Keys(
    ros_only=FRAMES
    | {
        "always_send_full_costmap",
        "initial_transform_timeout",
        "map_topic",
        "map_vis_z",
        "subscribe_to_stamped_footprint",
    },
    elsewhere={
        "custom_inscribed_radius": "newer releases only",
        "observation_sources": "every layer names its own",
        "plugin_names": "an older name of plugins",
        "plugin_types": "each layer's own 'plugin' counts since Foxy",
        "transform_timeout": "an older name of transform_tolerance",
    },
    shape=frozenset({"footprint", "robot_radius"}),
)
STATIC_LAYER = Keys(
    ros_only=frozenset(
        {"map_subscribe_transient_local", "map_topic", "plugin", "subscribe_to_updates", "transform_tolerance"}
    ),
    elsewhere={
        "footprint_clearing_enabled": "the static layer does not clear the footprint here",
        "restore_cleared_footprint": "the static layer does not clear the footprint here",
    },
)
OBSTACLE_LAYER = Keys(
    ros_only=frozenset({"map_vis_z", "observation_sources", "plugin", "tf_filter_tolerance", "transform_tolerance"}),
)
VOXEL_LAYER = Keys(ros_only=OBSTACLE_LAYER.ros_only | {"publish_voxel_map"})
INFLATION_LAYER = Keys(
    ros_only=frozenset({"plugin"}),
    elsewhere={
        "cost_scaling_factor_left": "newer releases only",
        "cost_scaling_factor_right": "newer releases only",
        "num_threads": "it changes the computing time only",
    },
)
LAYERS = {
    "static_layer": STATIC_LAYER,
    "obstacle_layer": OBSTACLE_LAYER,
    "voxel_layer": VOXEL_LAYER,
    "inflation_layer": INFLATION_LAYER,
}
SOURCE = Keys(
    ros_only=frozenset(
        {
            "data_type",
            "expected_update_rate",
            "sensor_frame",
            "topic",
            "transport_type",
        }
    ),
    renamed={"obstacle_range": "obstacle_max_range", "raytrace_range": "raytrace_max_range"},
    left_out=frozenset({"observation_persistence"}),
)
"""Keys of an observation source; the robots here have one lidar, whose beams lie in a horizontal plane."""
