"""The nodes of behaviour trees that are built here, with their ports and Nav2's defaults.

Source: nav2_behavior_tree (Humble, Jazzy and Lyrical) plugins; BehaviorTree.CPP 3.8 and 4.7.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from gym_mapbench.releases import RELEASES, Release


class Number(NamedTuple):
    """A port with a number: its default, which a whole number makes a port of whole numbers, and its least value.

    Numbers are finite unless the default is infinite.
    """

    default: float
    least: float = -math.inf


class Above(NamedTuple):
    """A port with a number above 0, and its default."""

    default: float


class Required(NamedTuple):
    """A port with a whole number that has to be given.

    Args:
        pattern: Pattern of its text.
        expected: What the text has to be, in words.
        value_of: Returns the value of a text.
    """

    pattern: str
    expected: str
    value_of: Callable[[str], float] = int


class Switch(NamedTuple):
    """A port with ``true`` or ``false``, and its default."""

    default: bool


class Variable(NamedTuple):
    """A port with the name of a variable on the blackboard; it has no default if that is empty."""

    default: str = ""


class Key(NamedTuple):
    """A port with the name of a variable, written without braces; it has to be given."""


class Text(NamedTuple):
    """A port with a text without variables; it has to be given."""


class Name(NamedTuple):
    """A port with a name, or with the name of a variable that holds it."""

    default: str = ""


Port = Number | Above | Required | Switch | Variable | Key | Text | Name
TIMES = Required(r"-1|\+?0*[1-9]\d{0,9}", "a whole number above 0, or -1 for no end")
WHOLE = Required(r"[-+]?\d{1,9}", "a whole number")
MILLISECONDS = Required(r"\+?\d{1,9}", "a whole number of milliseconds", lambda text: int(text) / 1000.0)


class NodeType(NamedTuple):
    """What can stand in a tree.

    Args:
        children: The number of children; -1 for one or more.
        ports: Its ports by name.
        releases: The releases of Nav2 that have it.
    """

    children: int = 0
    ports: Mapping[str, Port] = {}
    releases: tuple[Release, ...] = RELEASES


class TreeNode(NamedTuple):
    """A node of a tree as it was read.

    Args:
        name: Its type, one of :data:`NODES`.
        ports: The values of all its ports.
        children: Its children, in order.
        label: Its type and the name that the tree gives it, for messages.
    """

    name: str
    ports: Mapping[str, Any]
    children: tuple[TreeNode, ...]
    label: str

    def walk(self) -> Iterator[TreeNode]:
        """Yield the node and all below it."""
        yield self
        for child in self.children:
            yield from child.walk()


SOME, ONE, TWO = -1, 1, 2
SINCE_JAZZY: tuple[Release, ...] = ("jazzy", "lyrical")
PATH = Variable("path")
RECOVERY: dict[str, Port] = {
    "time_allowance": Number(10.0, 0),
    "is_recovery": Switch(True),
    "disable_collision_checks": Switch(False),
}
"""Ports of behaviours that move the robot."""

CLEAR = "ClearEntireCostmap"
REGION_CLEARS = {"ClearCostmapAroundRobot": False, "ClearCostmapExceptRegion": True}
"""Nodes that clear a square around the robot -> whether they clear all but the square."""
CLEARS = {
    CLEAR: "clear_entirely",
    "ClearCostmapAroundRobot": "clear_around",
    "ClearCostmapExceptRegion": "clear_except",
}
"""Nodes that clear a costmap -> the beginnings of the names of their services."""
BEHAVIOR_NODES = {"Spin": "spin", "BackUp": "backup", "Wait": "wait", "DriveOnHeading": "drive_on_heading"}
"""Nodes that run a behaviour -> the behaviour."""
CANCELS = {f"Cancel{name}": kind for name, kind in BEHAVIOR_NODES.items()}
"""Nodes that cancel a behaviour -> the behaviour."""

SELECTORS = {
    "PlannerSelector": "planner",
    "ControllerSelector": "controller",
    "SmootherSelector": "smoother",
    "GoalCheckerSelector": "goal_checker",
    "ProgressCheckerSelector": "progress_checker",
    "PathHandlerSelector": "path_handler",
}
"""Nodes that put a plugin's name on the blackboard -> of what; nobody publishes another one than their default."""

RETRIES = ("RetryUntilSuccessful", "RetryUntilSuccesful")
"""Names of the node that retries; BehaviorTree.CPP 3.8 knows its misspelt one, too."""

PORT_RELEASES: dict[str, tuple[Release, ...]] = {
    "success_threshold": ("humble",),
    "failure_threshold": ("humble",),
    "success_count": SINCE_JAZZY,
    "failure_count": SINCE_JAZZY,
    "disable_collision_checks": SINCE_JAZZY,
    "error_code_id": SINCE_JAZZY,
    "progress_checker_id": SINCE_JAZZY,
    "path_handler_id": ("lyrical",),
    "plugins": ("lyrical",),
    "wrap_around": ("lyrical",),
}
"""Ports that not every release has."""

NODES: dict[str, NodeType] = {
    "Sequence": NodeType(SOME),
    "SequenceStar": NodeType(SOME, releases=("humble",)),
    "SequenceWithMemory": NodeType(SOME, releases=SINCE_JAZZY),
    "ReactiveSequence": NodeType(SOME),
    "Fallback": NodeType(SOME),
    "ReactiveFallback": NodeType(SOME),
    "PipelineSequence": NodeType(SOME),
    "RoundRobin": NodeType(SOME, {"wrap_around": Switch(False)}),
    "Parallel": NodeType(
        SOME,
        {
            "success_threshold": WHOLE,
            "failure_threshold": Number(1),
            "success_count": Number(-1),
            "failure_count": Number(1),
        },
    ),
    "RecoveryNode": NodeType(TWO, {"number_of_retries": Number(1, 0)}),
    "Inverter": NodeType(ONE),
    "ForceSuccess": NodeType(ONE),
    "ForceFailure": NodeType(ONE),
    "KeepRunningUntilFailure": NodeType(ONE),
    RETRIES[0]: NodeType(ONE, {"num_attempts": TIMES}),
    RETRIES[1]: NodeType(ONE, {"num_attempts": TIMES}, ("humble",)),
    "Repeat": NodeType(ONE, {"num_cycles": TIMES}),
    "GoalUpdater": NodeType(ONE, {"input_goal": Variable("goal"), "output_goal": Variable()}),
    "SingleTrigger": NodeType(ONE),
    "RateController": NodeType(ONE, {"hz": Above(10.0)}),
    "DistanceController": NodeType(ONE, {"distance": Number(1.0, 0)}),
    "SpeedController": NodeType(
        ONE,
        {
            "min_rate": Above(0.1),
            "max_rate": Above(1.0),
            "min_speed": Number(0.0, 0),
            "max_speed": Above(0.5),
        },
    ),
    "GoalUpdatedController": NodeType(ONE),
    "Timeout": NodeType(ONE, {"msec": MILLISECONDS}),
    "Delay": NodeType(ONE, {"delay_msec": MILLISECONDS}),
    "PathLongerOnApproach": NodeType(ONE, {"path": PATH, "prox_len": Number(3.0), "length_factor": Number(2.0)}),
    "SetBlackboard": NodeType(0, {"value": Text(), "output_key": Key()}),
    "AlwaysSuccess": NodeType(),
    "AlwaysFailure": NodeType(),
    "IsBatteryLow": NodeType(0, {"min_battery": Number(0.0), "battery_topic": Name(), "is_voltage": Switch(False)}),
    "IsBatteryCharging": NodeType(0, {"battery_topic": Name()}),
    "IsStuck": NodeType(),
    "GoalUpdated": NodeType(),
    "GlobalUpdatedGoal": NodeType(),
    "GoalReached": NodeType(0, {"goal": Variable("goal")}),
    "InitialPoseReceived": NodeType(),
    "TransformAvailable": NodeType(0, {"parent": Name(), "child": Name()}),
    "IsPathValid": NodeType(0, {"path": PATH}),
    "ValidatePath": NodeType(0, {"path": PATH}, ("lyrical",)),
    "IsGoalNearby": NodeType(
        0,
        {"path": PATH, "proximity_threshold": Number(1.0), "max_robot_pose_search_dist": Number(math.inf)},
        ("lyrical",),
    ),
    "TruncatePathLocal": NodeType(
        0,
        {
            "input_path": PATH,
            "output_path": PATH,
            "distance_forward": Number(8.0),
            "distance_backward": Number(4.0, 0),
            "angular_distance_weight": Number(0.0, 0),
            "max_robot_pose_search_dist": Number(math.inf),
        },
    ),
    "TruncatePath": NodeType(0, {"input_path": PATH, "output_path": PATH, "distance": Number(1.0)}),
    "PathExpiringTimer": NodeType(0, {"path": PATH, "seconds": Number(1.0, 0)}),
    "TimeExpired": NodeType(0, {"seconds": Number(1.0, 0)}),
    "DistanceTraveled": NodeType(0, {"distance": Number(1.0, 0)}),
    "WouldAPlannerRecoveryHelp": NodeType(0, {"error_code": Variable()}, SINCE_JAZZY),
    "WouldAControllerRecoveryHelp": NodeType(0, {"error_code": Variable()}, SINCE_JAZZY),
    "WouldASmootherRecoveryHelp": NodeType(0, {"error_code": Variable()}, SINCE_JAZZY),
    "ComputePathToPose": NodeType(
        0, {"goal": Variable("goal"), "path": PATH, "planner_id": Name(), "error_code_id": Variable()}
    ),
    "SmoothPath": NodeType(
        0,
        {
            "unsmoothed_path": Variable(),
            "smoothed_path": Variable(),
            "smoother_id": Name(),
            "max_smoothing_duration": Number(3.0),
            "check_for_collisions": Switch(False),
            "smoothing_duration": Variable(),
            "was_completed": Variable(),
            "error_code_id": Variable(),
        },
    ),
    "FollowPath": NodeType(
        0,
        {
            "path": PATH,
            "controller_id": Name(),
            "goal_checker_id": Name(),
            "progress_checker_id": Name(),
            "path_handler_id": Name(),
            "error_code_id": Variable(),
        },
    ),
    CLEAR: NodeType(0, {"service_name": Name(), "plugins": Name()}),
    **{
        name: NodeType(0, {"service_name": Name(), "plugins": Name(), "reset_distance": Number(1.0)})
        for name in REGION_CLEARS
    },
    "CancelControl": NodeType(),
    **{name: NodeType() for name in CANCELS},
    "Spin": NodeType(0, {"spin_dist": Number(1.57), **RECOVERY}),
    "Wait": NodeType(0, {"wait_duration": Number(1.0, 0)}),
    "BackUp": NodeType(
        0,
        {
            "backup_dist": Number(0.15, 0),
            "backup_speed": Above(0.025),
            **RECOVERY,
        },
    ),
    "DriveOnHeading": NodeType(
        0,
        {
            "dist_to_travel": Number(0.15),
            "speed": Number(0.025),
            "time_allowance": Number(10.0, 0),
            "disable_collision_checks": Switch(False),
        },
    ),
    **{
        name: NodeType(
            0, {f"selected_{of}": Variable(), f"default_{of}": Name()}, PORT_RELEASES.get(f"{of}_id", RELEASES)
        )
        for name, of in SELECTORS.items()
    },
}
"""All nodes by their names."""

WITHOUT_EFFECT = frozenset(
    {
        "ID",
        "_description",
        "_uid",
        "error_msg",
        "global_frame",
        "name",
        "robot_base_frame",
        "robot_frame",
        "server_name",
        "server_timeout",
        "topic_name",
        "tracking_feedback",
        "transform_tolerance",
    }
)
"""Ports that mean nothing here: there are no other servers, topics and frames, and each server answers in time."""
