"""Which keys of a parameter file are ours, which only ROS needs, and which only newer releases have.

The behaviour built is that of Humble. A key is read under its name in Humble or in a newer release,
listed if it serves ROS alone, and refused otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

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
"""Nodes that have no part in following a path to a pose with Humble's default tree; the robot knows its pose here."""

INNER_NODES = ("_client", "_rclcpp_node")
"""How the names of the nodes end that Nav2's servers keep for themselves."""

FRAMES = frozenset({"global_frame", "local_frame", "robot_base_frame", "transform_tolerance"})


@dataclass(frozen=True)
class Keys:
    """What is known of the keys of one section, besides the parameters it has here.

    Args:
        ros_only: Keys, or groups of keys, that mean nothing without ROS; those of every node are added.
        newer_only: Parameters of newer releases -> what Humble does.
        renamed: Names in newer or older releases -> names in Humble.
        unmodelled: Keys that nothing here stands for, and that may change how the real robot drives.
    """

    ros_only: frozenset[str] = frozenset()
    newer_only: Mapping[str, str] = field(default_factory=dict)
    renamed: Mapping[str, str] = field(default_factory=dict)
    unmodelled: frozenset[str] = frozenset()

    def is_ros_only(self, name: str) -> bool:
        """Whether a dotted name, or a group it belongs to, serves ROS alone."""
        parts = name.split(".")
        groups = {".".join(parts[: i + 1]) for i in range(len(parts))}
        return not groups.isdisjoint(self.ros_only | EVERY_NODE)


CONTROLLER_SERVER = Keys(
    ros_only=frozenset({"costmap_update_timeout", "odom_duration", "odom_topic", "speed_limit_topic"}),
    newer_only={
        "path_handler_plugins": "in Humble every controller prunes the path itself",
        "search_window": "in Humble every controller prunes the path itself",
    },
)
PROGRESS_CHECKER = Keys(ros_only=frozenset({"plugin"}))
GOAL_CHECKER = Keys(
    ros_only=frozenset({"plugin"}),
    newer_only={"path_length_tolerance": "Humble looks at the distance to the goal, not along the path"},
)
PLANNER_SERVER = Keys(ros_only=frozenset({"costmap_update_timeout", "expected_planner_frequency"}))
NAVFN = Keys(ros_only=frozenset({"plugin"}))
SMAC_2D = Keys(ros_only=frozenset({"plugin", "max_planning_time", "terminal_checking_interval"}))
THETA_STAR = Keys(ros_only=frozenset({"plugin", "terminal_checking_interval"}))
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
)
BT_NAVIGATOR = Keys(
    ros_only=FRAMES
    | {
        "always_reload_bt_xml",
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
    unmodelled=frozenset({"default_nav_to_pose_bt_xml"}),
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
        "publish_frequency",
        "subscribe_to_stamped_footprint",
    }
)
LAYERS = {
    "static_layer": Keys(
        ros_only=frozenset(
            {
                "map_subscribe_transient_local",
                "map_topic",
                "plugin",
                "subscribe_to_updates",
                "transform_tolerance",
            }
        ),
        newer_only={
            "footprint_clearing_enabled": "in Humble the static layer does not clear the footprint",
            "restore_cleared_footprint": "in Humble the static layer does not clear the footprint",
        },
    ),
    "obstacle_layer": Keys(
        ros_only=frozenset(
            {
                "map_vis_z",
                "observation_sources",
                "plugin",
                "tf_filter_tolerance",
                "transform_tolerance",
            }
        ),
    ),
    "voxel_layer": Keys(
        ros_only=frozenset(
            {
                "map_vis_z",
                "observation_sources",
                "plugin",
                "publish_voxel_map",
                "tf_filter_tolerance",
                "transform_tolerance",
            }
        ),
    ),
    "inflation_layer": Keys(ros_only=frozenset({"plugin"})),
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
)
"""Of an observation source; the robots here have one lidar, whose beams lie in the plane."""
