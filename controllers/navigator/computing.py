"""Computing: what servers of paths execute; they compute once for each goal, and hand the result over later."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

from controllers.navigator.actions import Executor, Outcome
from controllers.navigator.rate import NEVER


class Computing(Executor):
    """Computes the result of a goal at once, and hands it over when the time for it has passed.

    It does not look at cancellations, and takes a new goal when it is done with the old one.

    Args:
        seconds: Seconds that a computation takes, in simulated time.

    Attributes:
        next_time: When it has something to do, s.
    """

    listens = False

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._outcome: Outcome | None = None
        self.next_time = NEVER

    @abstractmethod
    def compute(self) -> Outcome:
        """Compute the result of the goal in ``self.goal``."""

    def begin(self, goal: Any, now: float) -> None:
        """Begin with a goal."""
        self.goal, self._outcome, self.next_time = goal, None, now

    def step(self, now: float) -> Outcome | None:
        """Compute, or hand over the result."""
        if self._outcome is not None:
            return self._outcome
        self._outcome, self.next_time = self.compute(), now + self._seconds
        return None

    def cancel(self) -> None:
        """Do nothing: a computation does not move the robot."""
