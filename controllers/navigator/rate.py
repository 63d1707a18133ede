"""Times in simulated seconds: a clock, and a loop rate.

Source: rclcpp (Humble and Jazzy) include/rclcpp/rate.hpp.
"""

from __future__ import annotations

from dataclasses import dataclass

TIME_RESOLUTION = 1e-9
"""Times closer than this (s) count as equal: they are sums of periods, which are no exact binary fractions."""
NEVER = float("inf")
"""The time of what is not going to happen, s."""


@dataclass
class Clock:
    """The time at which the tree is; a node that waits for an answer moves it on.

    Attributes:
        now: The time, s.
        is_woken: Whether a result has come for which BehaviorTree.CPP 4 (Jazzy) ticks the tree once more.
    """

    now: float = 0.0
    is_woken: bool = False

    def __call__(self) -> float:
        """Return the time, s."""
        return self.now


class Rate:
    """Says when the next cycle of a loop begins; copied from rclcpp with its quirk.

    A cycle that takes longer than its period delays the next one. After a cycle that takes longer than two periods,
    every pause lasts a whole period from the end of a cycle on, until these delays add up to a period.

    Args:
        period: Seconds between the beginnings of two cycles.
        restarts: Whether every cycle that lasts too long starts the rate again, as in the controller server.
    """

    def __init__(self, period: float, *, restarts: bool = False) -> None:
        self._restarts = restarts
        self._period = int(period * 1e9)  # Nav2 counts whole nanoseconds, and so does this rate: it need not round
        self._last = 0

    def start(self, now: float) -> None:
        """Begin the first cycle at ``now``, s."""
        self._last = round(now * 1e9)

    def next_after(self, now: float) -> float:
        """Return when the next cycle begins, s, if this one has ended at ``now``."""
        before, self._last = self._last, self._last + self._period
        is_behind = now < before / 1e9 - TIME_RESOLUTION
        due = round(now + self._period / 1e9, 9) if is_behind else self._last / 1e9
        if due > now + TIME_RESOLUTION:
            return due
        if self._restarts:
            self._last = round(now * 1e9)
        elif now > due + self._period / 1e9 + TIME_RESOLUTION:
            self._last = round(now * 1e9) + self._period
        return now
