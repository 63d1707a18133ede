"""Error codes by which Jazzy's tree decides whether a recovery may help.

Source: nav2_msgs (Jazzy) action/FollowPath.action, ComputePathToPose.action; nav2_behavior_tree
plugins/condition/would_a_controller_recovery_help_condition.cpp, would_a_planner_recovery_help_condition.cpp.
"""

from __future__ import annotations

NONE = 0

CONTROLLER_UNKNOWN = 101
CONTROLLER_TF_ERROR = 103
INVALID_PATH = 104
PATIENCE_EXCEEDED = 105
FAILED_TO_MAKE_PROGRESS = 106
NO_VALID_CONTROL = 107
CONTROLLER_TIMED_OUT = 108

PLANNER_UNKNOWN = 201
START_OR_GOAL_OUTSIDE = 204
PLANNER_TIMED_OUT = 208
NO_VALID_PATH = 209

CONTROLLER_RECOVERY_HELPS = (CONTROLLER_UNKNOWN, PATIENCE_EXCEEDED, FAILED_TO_MAKE_PROGRESS, NO_VALID_CONTROL)
PLANNER_RECOVERY_HELPS = (PLANNER_UNKNOWN, PLANNER_TIMED_OUT, NO_VALID_PATH)
