"""SmoothPath: the leaf that has a path smoothed.

Source: nav2_behavior_tree (Humble, Jazzy and Lyrical) plugins/action/smooth_path_action.cpp.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from controllers.navigator.action_nodes import ActionNode
from controllers.navigator.actions import ActionServer, Outcome, Result
from controllers.navigator.latency import Latency
from controllers.navigator.navigate_to_pose import Blackboard
from controllers.navigator.smoother_server import SmoothGoal


class SmoothPath(ActionNode):
    """Asks the smoother server to smooth a path of the blackboard; a path that cannot be smoothed stays in force.

    What is smoothed in every tick is a new path only where it has changed: Nav2 compares poses and the plan's stamp.

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
        self._made_of: tuple[Any, Any] = (None, None)

    def make_goal(self) -> SmoothGoal:
        """Return the path, even if there is none: the server then aborts."""
        ports = self._ports
        self._path = self._board.path_named(ports["unsmoothed_path"])
        return SmoothGoal(self._path, self._smoother_id, ports["max_smoothing_duration"], ports["check_for_collisions"])

    def on_result(self, outcome: Outcome) -> None:
        """Put the smoothed path on the blackboard, or remember why there is none."""
        board, ports = self._board, self._ports
        board.codes[ports["error_code_id"]] = outcome.code
        if outcome.result is Result.SUCCEEDED:
            board.write(ports["smoothed_path"], self._known(outcome.value.path))
        elif outcome.result is Result.ABORTED:
            board.failure = "planner_failure", f"SmoothPath: {outcome.reason}"
            board.log("smoothing_failure", outcome.reason)

    def _known(self, smoothed: Any) -> Any:
        """Return the path itself, or what was made of it before, if that has the same poses; else the new path."""
        source, made = self._made_of
        known = (self._path, made) if source is self._path else (self._path,)
        same = next((path for path in known if np.array_equal(path, smoothed)), smoothed)
        self._made_of = self._path, same
        return same
