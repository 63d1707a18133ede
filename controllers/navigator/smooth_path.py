"""SmoothPath: the leaf that has a path smoothed.

Source: nav2_behavior_tree (Humble, Jazzy and Lyrical) plugins/action/smooth_path_action.cpp.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from controllers.navigator.action_nodes import ActionNode
from controllers.navigator.actions import ActionServer, Outcome, Result
from controllers.navigator.latency import Latency
from controllers.navigator.navigate_to_pose import Blackboard
from controllers.navigator.smoother_server import SmoothGoal


class SmoothPath(ActionNode):
    """Asks the smoother server to smooth a path of the blackboard; a path that cannot be smoothed stays in force.

    Args:
        board: The blackboard.
        server: The smoother server.
        latency: How long messages take.
        ports: The ports of the node.
        smoother_id: Name of the smoother; empty for the only one.
    """

    def __init__(
        self, board: Blackboard, server: ActionServer, latency: Latency, ports: Mapping[str, Any], smoother_id: str
    ) -> None:
        super().__init__(board.clock, server, latency)
        self._board, self._ports, self._smoother_id = board, ports, smoother_id

    def make_goal(self) -> SmoothGoal:
        """Return the path, even if there is none: the server then aborts."""
        ports, path = self._ports, self._board.path_named(self._ports["unsmoothed_path"])
        return SmoothGoal(path, self._smoother_id, ports["max_smoothing_duration"], ports["check_for_collisions"])

    def on_result(self, outcome: Outcome) -> None:
        """Put the smoothed path and what is known of it on the blackboard, or remember why there is none."""
        board, ports = self._board, self._ports
        board.codes[ports["error_code_id"]] = outcome.code
        if outcome.result is Result.SUCCEEDED:
            made = outcome.value
            board.write(ports["smoothed_path"], made.smoothed.path)
            board.values[ports["was_completed"]] = made.smoothed.was_completed
            board.values[ports["smoothing_duration"]] = made.smoothing_duration
        elif outcome.result is Result.ABORTED:
            board.failure = "planner_failure", f"SmoothPath: {outcome.reason}"
            board.log("smoothing_failure", outcome.reason)
