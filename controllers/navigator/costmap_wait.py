"""Waiting for a costmap that has been cleared: the planner and the controller server do so before they compute.

Source: nav2_costmap_2d (Humble and Jazzy) src/costmap_2d_ros.cpp, clear_costmap_service.cpp and the layers'
``current_``; nav2_planner src/planner_server.cpp; nav2_controller src/controller_server.cpp.
"""

from __future__ import annotations

from typing import Protocol

from controllers.navigator.rate import NEVER, TIME_RESOLUTION
from gym_mapbench.costmap import Costmap

POLL_PERIOD = 0.01
"""Seconds between two looks at the costmap."""


class ScheduledCostmap:
    """A costmap that is updated at a rate, and knows whether it has been updated since it was cleared.

    Args:
        update_frequency: Updates per second, Hz.
        phase: Time of the first update, s.

    Attributes:
        next_update: When the next update is due, s.
    """

    def __init__(self, update_frequency: float, phase: float = 0.0) -> None:
        self._period, self._phase, self._updates = 1.0 / update_frequency, phase, 0
        self._current_from = -NEVER
        self.next_update = round(phase, 9)

    def is_due(self, now: float) -> bool:
        """Return whether an update is due at ``now`` (s); it then counts as done."""
        if now < self.next_update - TIME_RESOLUTION:
            return False
        self._updates += 1
        self.next_update = round(self._phase + self._updates * self._period, 9)
        self._current_from = min(self._current_from, now)
        return True

    def outdate(self) -> None:
        """Let those who need a current costmap wait for its next update."""
        self._current_from = NEVER

    def is_current(self, now: float) -> bool:
        """Whether the costmap, at ``now`` (s), has been updated since it was cleared."""
        return self._current_from <= now + TIME_RESOLUTION


class UpdatedCostmap(Protocol):
    """A costmap that is updated from time to time."""

    @property
    def next_update(self) -> float:
        """When the next update is due, s."""
        ...

    def is_current(self, now: float) -> bool:
        """Whether the costmap, at ``now`` (s), has been updated since it was cleared."""
        ...


class ServedCostmap(UpdatedCostmap, Protocol):
    """The local or the global costmap, which a server reads."""

    @property
    def costmap(self) -> Costmap:
        """The costmap as of its last update."""
        ...


class CostmapWait:
    """The wait of one server for one costmap.

    Args:
        costmap: The costmap.
        timeout: Seconds after which the server gives up.

    Attributes:
        is_waiting: Whether the server waits.
        has_failed: Whether the last wait took too long.
        next_time: When the server looks again, s.
    """

    def __init__(self, costmap: UpdatedCostmap, timeout: float) -> None:
        self._costmap, self._timeout = costmap, timeout
        self.forget()

    def forget(self) -> None:
        """Wait for nothing."""
        self.is_waiting = self.has_failed = False
        self.next_time = NEVER

    def is_over(self, now: float) -> bool:
        """Whether the server can go on at ``now`` (s), because the costmap is current or the wait has failed."""
        if self._costmap.is_current(now):
            self.forget()
            return True
        if not self.is_waiting:
            self.is_waiting, self._since = True, now
        self.has_failed = now - self._since > self._timeout + TIME_RESOLUTION
        update, poll = self._costmap.next_update, now + POLL_PERIOD
        self.next_time = update if now + TIME_RESOLUTION < update < poll else poll
        return self.has_failed
