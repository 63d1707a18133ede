"""Rate: a loop rate in simulated time."""

from __future__ import annotations

TIME_RESOLUTION = 1e-9
"""Times closer than this (s) count as equal: they are sums of control periods, which are no exact binary fractions."""


class Rate:
    """Says when the next cycle of a server is due.

    Args:
        hz: Cycles per second.
    """

    def __init__(self, hz: float) -> None:
        self._period = 1.0 / hz
        self._next = 0.0

    def start(self, now: float) -> None:
        """Make the first cycle due now, s."""
        self._next = now

    def is_due(self, now: float) -> bool:
        """Return whether a cycle is due at ``now`` (s); it then counts as done."""
        if now < self._next - TIME_RESOLUTION:
            return False
        self._next += self._period
        return True
