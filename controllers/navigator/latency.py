"""Latency: how long messages, plans and smoothings take between the tree and the servers."""

from __future__ import annotations

from dataclasses import dataclass

from controllers.behaviors import LatencyModel


@dataclass(frozen=True)
class Latency:
    """How long the parts of the navigator wait for each other.

    Args:
        message: Seconds that a message of an action takes one way.
        service: Seconds from a service's request to its answer.
        planning: Seconds that a plan takes.
        smoothing: Seconds that the smoothing of a path takes.
    """

    message: float = 0.0
    service: float = 0.0
    planning: float = 0.0
    smoothing: float = 0.0

    @property
    def is_ideal(self) -> bool:
        """Whether messages take no time; servers then look at them at once."""
        return self.message == 0.0


LATENCIES: dict[LatencyModel, Latency] = {
    "ideal": Latency(),
    "nav2": Latency(message=0.0005, service=0.002, planning=0.02, smoothing=0.005),
}
"""``ideal``: everything is answered at once. ``nav2``: an idle computer that plans in 20 ms and smooths in 5 ms."""
