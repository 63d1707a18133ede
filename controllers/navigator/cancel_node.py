"""CancelGoals: the leaf behind ``CancelControl``, ``CancelSpin`` and the like.

Source: nav2_behavior_tree (Humble, Jazzy and Lyrical) include/nav2_behavior_tree/bt_cancel_action_node.hpp.
"""

from __future__ import annotations

from controllers.navigator.action_nodes import SERVER_TIMEOUT
from controllers.navigator.actions import ActionServer
from controllers.navigator.behavior_tree import Question, Status
from controllers.navigator.rate import TIME_RESOLUTION, Clock

YOUNGEST = 0.010
"""Age from which on goals are cancelled, s."""


class CancelGoals(Question):
    """Cancels the goals of an action server, whoever sent them, and succeeds once the server has answered.

    Args:
        server: The server.
        clock: The time at which the tree is; it waits for the answer.
    """

    def __init__(self, server: ActionServer, clock: Clock) -> None:
        self._server, self._clock = server, clock

    def tick(self) -> Status:
        """Cancel all goals that are not too young, and wait for the answer."""
        now = self._clock.now
        self._server.advance(now)
        answered = self._server.request_cancel_before(now - YOUNGEST, now)
        self._clock.now = min(answered, now + SERVER_TIMEOUT)
        self._server.advance(self._clock.now)
        return Status.SUCCESS if answered <= now + SERVER_TIMEOUT + TIME_RESOLUTION else Status.FAILURE
