"""Leaves of the tree that ask a server, and how long they wait for its answers.

Source: nav2_behavior_tree (Humble and Jazzy) include/nav2_behavior_tree/bt_action_node.hpp, bt_service_node.hpp.
Times are truncated to milliseconds where Nav2 does so.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Any

from controllers.navigator.actions import ActionServer, GoalHandle, Outcome, Result
from controllers.navigator.behavior_tree import Node, Rest, Status
from controllers.navigator.latency import Latency
from controllers.navigator.rate import NEVER, TIME_RESOLUTION, Clock

SERVER_TIMEOUT = 0.02
"""Seconds after which a leaf fails because its server has not answered (``default_server_timeout``)."""
LONGEST_WAIT = 0.005
"""Seconds that a tick waits at most for the answer to a goal or to a service: half of ``bt_loop_duration``."""


class ActionNode(Node):
    """A leaf that sends a goal to an action server when it is first ticked, and then waits for the result.

    Args:
        clock: The time at which the tree is.
        server: The server.
        latency: How long messages take.
    """

    def __init__(self, clock: Clock, server: ActionServer, latency: Latency) -> None:
        self._clock, self._server = clock, server
        self._message, self._round_trip = latency.message, 2.0 * latency.message
        self._patience = 0.0 if latency.is_ideal else SERVER_TIMEOUT
        self._sent: list[GoalHandle] = []
        self._accepted: dict[GoalHandle, float] = {}
        self._awaited: GoalHandle | None = None
        self._goal: GoalHandle | None = None
        self._outcome: Outcome | None = None

    @abstractmethod
    def make_goal(self) -> Any:
        """Return the goal; None makes the leaf fail."""

    def newer_goal(self) -> Any:
        """Return a goal that replaces the running one; None for none."""
        return None

    @abstractmethod
    def on_result(self, outcome: Outcome) -> None:
        """Take the result, also that of a goal that has been cancelled."""

    def tick(self) -> Status:
        """Send the goal, or look whether there is an answer, a newer goal, or the result."""
        if self.status is not Status.RUNNING:
            goal = self.make_goal()
            if goal is None:
                return Status.FAILURE
            self._send(goal)
        if (waiting := self._wait_for_answer()) is not None:
            return waiting
        if self._outcome is None and (newer := self.newer_goal()) is not None:
            self._send(newer)
            if (waiting := self._wait_for_answer()) is not None:
                return waiting
        self._spin(self._clock.now)
        return Status.RUNNING if self._outcome is None else self._end(self._outcome)

    def rest(self) -> Rest | None:
        """Rest until there is a message, once the goal has been answered; for a newer goal, another node is ticked."""
        return Rest(NEVER, self._has_news) if self._awaited is None else None

    def halt(self) -> None:
        """Cancel the goal, and wait a little for the answer and then for the result.

        A goal that has ended, or that another node has had cancelled, is left alone.
        """
        if self.status is not Status.RUNNING:
            return
        goal, self._goal, self._awaited = self._goal, None, None
        self._spin(self._clock.now)
        if goal is None or self._is_known_to_end(goal):
            return
        answered = self._server.request_cancel(goal, self._clock.now)
        self._spin_until(lambda: False, min(answered, self._clock.now + self._patience))
        self._spin_until(lambda: goal not in self._accepted, self._clock.now + self._patience)
        self.on_result(Outcome(Result.CANCELED))

    def _is_known_to_end(self, goal: GoalHandle) -> bool:
        """Whether the server has said that a goal has ended, or that it is being cancelled."""
        said = min(goal.ended + self._round_trip, goal.cancel_arrives + self._message)
        return said <= self._clock.now + TIME_RESOLUTION

    def _has_news(self) -> bool:
        """Let the server work until now; whether a message has come."""
        now = self._clock.now
        self._server.advance(now)
        return self._next_message() <= now + TIME_RESOLUTION

    def _take_result(self, handle: GoalHandle) -> None:
        """Take a result that has come; only that of the goal in force counts."""
        del self._accepted[handle]
        handle.seen = self._clock.now
        if self._awaited is None and handle is self._goal:
            self._outcome, self._clock.is_woken = handle.outcome, True

    def _send(self, goal: Any) -> None:
        self._outcome = None
        self._awaited = self._server.send(goal, self._clock.now)
        self._sent.append(self._awaited)

    def _wait_for_answer(self) -> Status | None:
        """Wait for the answer to the goal; the status if that is not there in time or is a refusal, else None."""
        awaited = self._awaited
        if awaited is None:
            return None
        elapsed = milliseconds(self._clock.now - awaited.sent)
        wait = min(SERVER_TIMEOUT - elapsed, LONGEST_WAIT)
        if wait <= TIME_RESOLUTION:
            self._awaited = None
            return Status.FAILURE
        if self._spin_until(lambda: awaited not in self._sent, self._clock.now + wait):
            self._awaited = None
            if not awaited.is_accepted:
                return Status.FAILURE
            self._goal = awaited
            return None
        if elapsed + wait < SERVER_TIMEOUT - TIME_RESOLUTION:
            return Status.RUNNING
        self._awaited = None
        return Status.FAILURE

    def _end(self, outcome: Outcome) -> Status:
        """Take the result of the goal; a goal that another node has had cancelled counts as a success."""
        self._goal = None
        self.on_result(outcome)
        return Status.FAILURE if outcome.result is Result.ABORTED else Status.SUCCESS

    def _spin_until(self, done: Callable[[], bool], deadline: float) -> bool:
        """Let time pass and take messages until something is done; False if it is not done by the deadline."""
        while not done():
            self._server.advance(self._clock.now)
            next_message = self._next_message()
            if next_message <= self._clock.now + TIME_RESOLUTION:
                self._take_message()
                continue
            next_time = min(self._server.next_time, next_message)
            if next_time > deadline + TIME_RESOLUTION or self._clock.now >= deadline - TIME_RESOLUTION:
                self._clock.now = max(self._clock.now, deadline)
                return done()
            self._clock.now = next_time
        return True

    def _spin(self, now: float) -> None:
        """Take all messages that have come by ``now``, in the order in which they came."""
        self._server.advance(now)
        while self._next_message() <= now + TIME_RESOLUTION:
            self._take_message()

    def _next_message(self) -> float:
        """When the next message comes, s, as far as is known now."""
        soonest = self._sent[0].answered if self._sent else NEVER
        for handle in self._accepted:
            if handle.ended < NEVER:
                soonest = min(soonest, self._result_comes(handle))
        return soonest

    def _take_message(self) -> None:
        """Take the next message: the answer to a goal, or a result."""
        first = min(self._accepted, key=self._result_comes, default=None)
        if first is not None and (not self._sent or self._result_comes(first) <= self._sent[0].answered):
            self._take_result(first)
            return
        answered = self._sent.pop(0)
        if answered.is_accepted:
            self._accepted[answered] = max(self._clock.now, answered.answered)

    def _result_comes(self, handle: GoalHandle) -> float:
        """When the result of an accepted goal comes, s: it is asked for when the answer to the goal has come."""
        return max(handle.ended, self._accepted[handle] + self._round_trip) + self._round_trip


class ServiceNode(Node):
    """A leaf that calls a service when it is first ticked, and waits for its answer.

    Args:
        clock: The time at which the tree is.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._is_sent = False

    @abstractmethod
    def call(self) -> float:
        """Call the service; returns how long its answer takes, s."""

    def tick(self) -> Status:
        """Call the service, or look whether there is an answer."""
        if not self._is_sent:
            self._is_sent, self._sent = True, self._clock.now
            self._answered = self._clock.now + self.call()
        wait = min(SERVER_TIMEOUT - milliseconds(self._clock.now - self._sent), LONGEST_WAIT)
        if wait > TIME_RESOLUTION:
            deadline = self._clock.now + wait
            self._clock.now = max(self._clock.now, min(self._answered, deadline))
            if self._answered <= deadline + TIME_RESOLUTION:
                self._is_sent = False
                return Status.SUCCESS
            if milliseconds(self._clock.now - self._sent) < SERVER_TIMEOUT - TIME_RESOLUTION:
                return Status.RUNNING
        self._is_sent = False
        return Status.FAILURE

    def halt(self) -> None:
        """Forget the call."""
        self._is_sent = False


def milliseconds(seconds: float) -> float:
    """Return a duration truncated to whole milliseconds, s."""
    return int((seconds + TIME_RESOLUTION) * 1000.0) / 1000.0
