"""The nodes of a parameter file, and the keys of the nodes that are read.

The keys of a plugin's section stand beside the plugin.
"""

from __future__ import annotations

from gym_mapbench.ros_params import Keys

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
        "waypoint_follower",
    }
)
"""Nodes that have no part in driving to a pose with the default tree; the robot knows its pose here."""
LOCALISATION = ("amcl", "ekf", "localization", "slam", "ukf")
"""Parts of the names of nodes that localise the robot, which knows its pose here."""
INNER_NODES = ("_client", "_rclcpp_node")
"""Ends of the names of nodes that Nav2's servers have for their own use."""
FRAMES = frozenset({"global_frame", "local_frame", "robot_base_frame", "transform_tolerance"})
CONTROLLER_SERVER = Keys(
    ros_only=frozenset(
        {
            "odom_duration",
            "odom_topic",
            "speed_limit_topic",
            "publish_path",
            "search_window",
            "transform_tolerance",
        }
    ),
    elsewhere={
        "controller_plugin_ids": "Eloquent's name of controller_plugins",
        "controller_plugin_types": "each plugin's own 'plugin' counts since Foxy",
        "goal_checker_plugin": "goal_checker_plugins is given as well, and counts",
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
    missing={
        "jazzy": {
            "backup": "its back-up has one speed",
            "drive_on_heading": "its drive on the heading has one speed",
        }
    },
    elsewhere={"transform_timeout": "an older name of transform_tolerance"},
)
CODES, PREFIXES, ENDING = "error_code_names", "error_code_name_prefixes", "_error_code"
"""The error codes that the navigator reports, Lyrical's without their ending."""
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
        CODES,
        PREFIXES,
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
        "search_window",
        "wait_for_service_timeout",
    },
    elsewhere={
        "bt_xml_filename": "an older name of default_nav_to_pose_bt_xml; the default tree drives here",
        "default_bt_xml_filename": "an older name of default_nav_to_pose_bt_xml; the default tree drives here",
        "transform_timeout": "an older name of transform_tolerance",
    },
)
SMOOTHER_SERVER = Keys(
    ros_only=FRAMES | {"costmap_topic", "footprint_topic"},
    elsewhere={"transform_timeout": "an older name of transform_tolerance"},
)
VELOCITY_SMOOTHER = Keys(
    ros_only=frozenset({"odom_topic", "stamp_smoothed_velocity_with_smoothing_time"}),
)
_ALWAYS_ON = "its monitor is always on"
COLLISION_MONITOR = Keys(
    ros_only=frozenset(
        {
            "base_frame_id",
            "cmd_vel_in_topic",
            "cmd_vel_out_topic",
            "collision_points_marker_3d",
            "odom_frame_id",
            "source_timeout",
            "state_topic",
            "stop_pub_timeout",
            "transform_tolerance",
        }
    ),
    missing={"humble": {"enabled": _ALWAYS_ON}, "jazzy": {"enabled": _ALWAYS_ON}},
)
_EACH_ALONE = "every command counts alone"
_CONSECUTIVE = {"trigger_consecutive_points": _EACH_ALONE, "release_consecutive_points": _EACH_ALONE}
MONITOR_POLYGON = Keys(
    ros_only=frozenset(
        {
            "footprint_topic",
            "polygon_pub_topic",
            "polygon_sub_topic",
            "polygon_subscribe_transient_local",
            "visualize",
        }
    ),
    missing={
        "humble": {
            "min_points": "max_points counts, and one point more triggers the action",
            "linear_limit": "it has no action 'limit'",
            "angular_limit": "it has no action 'limit'",
            "sources_names": "the points of all sources count",
            "holonomic": "it has no velocity polygons",
            **_CONSECUTIVE,
        },
        "jazzy": _CONSECUTIVE,
    },
)
MONITOR_SOURCE = Keys(
    ros_only=frozenset(
        {
            "cost_threshold",
            "max_height",
            "min_height",
            "min_range",
            "obstacles_angle",
            "sampling_distance",
            "source_timeout",
            "topic",
            "transport_type",
            "treat_unknown_as_obstacle",
            "use_global_height",
        }
    ),
)
_NO_OVERRIDE = "a robot in a keepout zone sees the costs of the zone"
KEEPOUT_FILTER = Keys(
    ros_only=frozenset({"transform_tolerance"}),
    missing={"humble": {"override_lethal_cost": _NO_OVERRIDE, "lethal_override_cost": _NO_OVERRIDE}},
)
SPEED_FILTER = Keys(
    ros_only=frozenset({"transform_tolerance"}),
    elsewhere=dict.fromkeys(
        ("enable_path_lookahead", "max_decel", "max_lookahead", "min_lookahead", "odom_topic", "path_topic"),
        "newer than Lyrical; the limit at the robot counts",
    ),
)
INFO_SERVER = Keys()
MASK_SERVER = Keys(ros_only=frozenset({"frame_id"}))
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
        "inscribed_obstacle_cost_value": "maps here hold free, occupied and unknown cells alone",
        "observation_sources": "every layer names its own",
        "plugin_names": "an older name of plugins",
        "plugin_types": "each layer's own 'plugin' counts since Foxy",
        "transform_timeout": "an older name of transform_tolerance",
    },
    shape=frozenset({"footprint", "robot_radius"}),
)
