"""TreeLoop: ticks a behaviour tree until it has ended.

Source: nav2_behavior_tree (Humble and Jazzy) src/behavior_tree_engine.cpp.
"""

from __future__ import annotations

from collections.abc import Callable

from controllers.navigator.behavior_tree import MOST_ROUNDS, Node, Rest, Status
from controllers.navigator.rate import TIME_RESOLUTION, Clock, Rate
from gym_mapbench.releases import Release


class TreeLoop:
    """One navigation: the tree is ticked at a rate; a tick that lasts too long delays the next one.

    Args:
        tree: The root of the tree.
        clock: The time at which the tree is; its nodes move it on.
        period: Seconds between two ticks.
        before_tick: Called before every tick, with the time, s.
        release: The release of Nav2. Jazzy ticks a tree that runs again at once if a result has come meanwhile.

    Attributes:
        status: RUNNING, or how the tree ended.
        next_tick: When the next tick begins, s; after the last tick when the navigation ends.
    """

    def __init__(
        self,
        tree: Node,
        clock: Clock,
        period: float,
        before_tick: Callable[[float], None],
        release: Release = "humble",
    ) -> None:
        self._tree, self._clock, self._before_tick = tree, clock, before_tick
        self._ticks_again = release != "humble"
        self._rate = Rate(period)
        self._rate.start(clock.now)
        self._rest: Rest | None = None
        self.status = Status.RUNNING
        self.next_tick = clock.now

    def run_until(self, now: float) -> Status:
        """Do all ticks that begin until ``now``, s."""
        while self.status is Status.RUNNING and self.next_tick <= now + TIME_RESOLUTION:
            self.tick()
        return self.status

    def tick(self) -> None:
        """Do the next tick."""
        self._clock.now = self.next_tick
        self._before_tick(self._clock.now)
        if not self._rests():
            self._tick_tree()
        self.next_tick = self._rate.next_after(self._clock.now)

    def _rests(self) -> bool:
        """Whether a tick of the tree now would change nothing."""
        rest = self._rest
        return rest is not None and self._clock.now < rest.until - 2.0 * TIME_RESOLUTION and not rest.has_news()

    def _tick_tree(self) -> None:
        self.status = self._tree.execute_tick()
        for _ in range(MOST_ROUNDS):
            if not (self._ticks_again and self.status is Status.RUNNING and self._clock.is_woken):
                break
            self._clock.is_woken = False
            self.status = self._tree.execute_tick()
        self._rest = self._tree.rest() if self.status is Status.RUNNING else None

    def cancel(self) -> None:
        """Cancel the navigation instead of the next tick; the tree may wait for what it has to stop."""
        self._clock.now = self.next_tick
        self._tree.stop()
