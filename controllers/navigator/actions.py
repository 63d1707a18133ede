"""ActionServer: the rules by which Nav2's servers take goals, give them up and end them.

Source: nav2_util (Humble and Jazzy) include/nav2_util/simple_action_server.hpp.
"""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple, Protocol

from controllers.navigator.latency import Latency
from controllers.navigator.rate import NEVER, TIME_RESOLUTION


class Result(StrEnum):
    """How a goal ended."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELED = "canceled"


class Outcome(NamedTuple):
    """How a goal ended and what came of it.

    Args:
        result: How it ended.
        code: Jazzy's error code; 0 for none.
        reason: Why it failed, in one line.
        value: What it produced, such as a path.
        delay: Seconds between the step in which it ended and its end.
    """

    result: Result
    code: int = 0
    reason: str = ""
    value: Any = None
    delay: float = 0.0


class Executor(Protocol):
    """What an action server executes, one goal at a time.

    Attributes:
        next_time: When :meth:`step` has something to do, s.
    """

    next_time: float

    @property
    def listens(self) -> bool:
        """Whether cancellations and new goals are looked at before the next step."""
        return True

    def accepts(self, goal: Any) -> bool:
        """Return whether a goal is taken at all."""
        return True

    @abstractmethod
    def begin(self, goal: Any, now: float) -> None:
        """Begin a goal; the first step follows."""

    def update(self, goal: Any, now: float) -> bool:
        """Go on with a newer goal; False if the newer goal has to begin instead."""
        return False

    @abstractmethod
    def step(self, now: float) -> Outcome | None:
        """Do what is due; None while the goal is not ended."""

    @abstractmethod
    def cancel(self) -> None:
        """Stop the robot, because the goal has been cancelled or replaced."""


@dataclass(eq=False)
class GoalHandle:
    """A goal on its way: what client and server know of it.

    Args:
        goal: The goal.
        sent: When the client sent it, s.
        arrives: When the server gets it, s.

    Attributes:
        answered: When the client gets the server's answer, s.
        is_accepted: The answer; None before the server gets the goal.
        cancel_arrives: When the server gets the request to cancel it, s.
        ended: When it ended, s.
        outcome: How it ended; None before.
        seen: When the client took the result, s.
    """

    goal: Any
    sent: float
    arrives: float
    answered: float = NEVER
    is_accepted: bool | None = None
    cancel_arrives: float = NEVER
    ended: float = NEVER
    outcome: Outcome | None = None
    seen: float = NEVER


class ActionServer:
    """Takes goals one after the other, in simulated time: it is asked to advance, and does all that was due until then.

    Without latencies it looks at new goals and cancellations at once, not at the next cycle of what it executes.

    Args:
        executor: What it executes.
        latency: How long messages take.

    Attributes:
        next_time: When the server has something to do, s, as far as is known now.
    """

    def __init__(self, executor: Executor, latency: Latency) -> None:
        self.executor = executor
        self._latency = latency
        self._is_ideal = latency.is_ideal
        self._arriving: deque[GoalHandle] = deque()
        self._current: GoalHandle | None = None
        self._pending: GoalHandle | None = None
        self.next_time = NEVER

    def send(self, goal: Any, now: float) -> GoalHandle:
        """Send a goal to the server."""
        arrives = now + self._latency.message
        handle = GoalHandle(goal, now, arrives, answered=arrives + self._latency.message)
        self._arriving.append(handle)
        self.next_time = self._find_next_time()
        return handle

    def request_cancel(self, handle: GoalHandle, now: float) -> float:
        """Ask the server to cancel a goal; returns when its answer comes, s."""
        handle.cancel_arrives = min(handle.cancel_arrives, now + self._latency.message)
        self.next_time = self._find_next_time()
        return now + 2.0 * self._latency.message

    def request_cancel_before(self, arrival: float, now: float) -> float:
        """Ask the server to cancel the goals that it got until ``arrival``, s; returns when its answer comes, s."""
        for handle in (self._current, self._pending):
            if handle is not None and handle.arrives <= arrival + TIME_RESOLUTION:
                self.request_cancel(handle, now)
        return now + 2.0 * self._latency.message

    def advance(self, now: float) -> None:
        """Do all that is due until ``now``, s."""
        while (time := self.next_time) <= now + TIME_RESOLUTION:
            if self._arriving and self._arriving[0].arrives <= time and (self._is_ideal or self._is_idle(time)):
                self._receive(self._arriving.popleft(), time)
            else:
                self._work(time)
            self.next_time = self._find_next_time()

    def end(self, handle: GoalHandle, outcome: Outcome, now: float) -> None:
        """End a goal."""
        handle.outcome, handle.ended = outcome, now + outcome.delay

    def _find_next_time(self) -> float:
        """Return when the next message arrives or the running goal needs work, s."""
        arrival = self._arriving[0].arrives if self._arriving else NEVER
        if self._current is None:
            return arrival
        return min(arrival, self.executor.next_time, self._prompt_cancel(self._current))

    def _is_in_time(self, arrival: float, now: float) -> bool:
        """Whether a message that has come counts for a cycle; one that comes with the beginning of it is too late."""
        return arrival <= now if self._is_ideal else arrival < now - TIME_RESOLUTION

    def _is_idle(self, now: float) -> bool:
        """Whether no step is due: a goal that comes with the beginning of a cycle is too late for that cycle."""
        return self._current is None or self.executor.next_time > now + TIME_RESOLUTION

    def _prompt_cancel(self, current: GoalHandle) -> float:
        """When a cancellation is looked at without waiting for the next cycle, s."""
        if current.cancel_arrives == NEVER or not (self._is_ideal and self.executor.listens):
            return NEVER
        return current.cancel_arrives

    def _receive(self, handle: GoalHandle, now: float) -> None:
        """Take a goal: begin it, or keep it until the running one is given up or ended."""
        handle.is_accepted = self.executor.accepts(handle.goal)
        if not handle.is_accepted:
            return
        if self._current is None:
            self._begin(handle, now)
            return
        if self._pending is not None:
            self.end(self._pending, Outcome(Result.ABORTED), now)
        self._pending = handle
        if self._is_ideal and self.executor.listens:
            self._replace(now)

    def _begin(self, handle: GoalHandle, now: float) -> None:
        self._current, self._pending = handle, None
        self.executor.begin(handle.goal, now)

    def _work(self, now: float) -> None:
        """Look at cancellations and newer goals, then do a step."""
        if self._has_orders() and self.executor.listens and (self._is_cancelled(now) or self._replace(now)):
            return
        outcome = self.executor.step(now)
        if outcome is not None:
            self._finish(outcome, now)

    def _has_orders(self) -> bool:
        """Whether a newer goal or a cancellation is on its way to the running goal."""
        return self._pending is not None or (self._current is not None and self._current.cancel_arrives < NEVER)

    def _is_cancelled(self, now: float) -> bool:
        """End all goals if the newest one is to be cancelled."""
        current, newest = self._current, self._pending or self._current
        if current is None or newest is None or not self._is_in_time(newest.cancel_arrives, now):
            return False
        self.executor.cancel()
        if self._pending is not None:
            self.end(self._pending, Outcome(Result.CANCELED), now)
            self._pending = None
        self._finish(Outcome(Result.CANCELED), now)
        return True

    def _replace(self, now: float) -> bool:
        """Give up the running goal for a newer one; returns whether the newer one begins instead of going on."""
        current, newer = self._current, self._pending
        if current is None or newer is None:
            return False
        if self.executor.update(newer.goal, now):
            self.end(current, Outcome(Result.ABORTED), now)
            self._current, self._pending = newer, None
            return False
        self.executor.cancel()
        self._finish(Outcome(Result.ABORTED), now)
        return True

    def _finish(self, outcome: Outcome, now: float) -> None:
        """End the running goal and begin the one that waits."""
        current, self._current = self._current, None
        if current is not None:
            self.end(current, outcome, now)
        if self._pending is not None:
            self._begin(self._pending, now)
