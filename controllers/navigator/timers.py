"""Decorators that measure time: Timeout and Delay.

Source: BehaviorTree.CPP 3.8 and 4.7 src/decorators/timeout_node.cpp, delay_node.cpp. Their timers run
in threads of their own; here a tick sees that the time is up.
"""

from __future__ import annotations

from controllers.navigator.behavior_tree import Control, Node, Status
from controllers.navigator.rate import NEVER, TIME_RESOLUTION, Clock


class Timer:
    """Is up some time after it was started; BehaviorTree.CPP 4 then ticks the tree once more.

    Args:
        seconds: The time, s.
        clock: The time at which the tree is.
        wakes: Whether the tree is woken.
    """

    def __init__(self, seconds: float, clock: Clock, *, wakes: bool) -> None:
        self._seconds, self._clock, self._wakes = seconds, clock, wakes
        self.stop()

    @property
    def runs(self) -> bool:
        """Whether the timer has been started and not been stopped."""
        return self._started < NEVER

    def start(self) -> None:
        """Start the timer."""
        self._started, self._rings = self._clock(), True

    def stop(self) -> None:
        """Stop the timer."""
        self._started, self._rings = NEVER, False

    def is_up(self) -> bool:
        """Return whether the time is up; the tree is woken at the first call at which it is."""
        if self._clock() - self._started < self._seconds - TIME_RESOLUTION:
            return False
        if self._rings and self._wakes:
            self._clock.is_woken = True
        self._rings = False
        return True


class _Timed(Control):
    """A decorator with a timer, which stops when the child ends."""

    _timer: Timer

    def halt(self) -> None:
        """Stop the child and the timer."""
        super().halt()
        self._timer.stop()

    def _tick_child(self) -> Status:
        (child,) = self.children
        status = child.execute_tick()
        if status is not Status.RUNNING:
            self.halt()
        return status


class Timeout(_Timed):
    """Fails, and halts its child, if that is still RUNNING after some time.

    Args:
        child: The child.
        seconds: The time, s; 0 for no end.
        clock: The time at which the tree is.
        wakes: Whether the tree is ticked once more when the time is up (BehaviorTree.CPP 4).
    """

    def __init__(self, child: Node, seconds: float, clock: Clock, *, wakes: bool) -> None:
        super().__init__(child)
        self._timer = Timer(seconds or NEVER, clock, wakes=wakes)

    def tick(self) -> Status:
        """Tick the child while there is time."""
        (child,) = self.children
        if not self._timer.runs:
            self._timer.start()
        if child.status is Status.RUNNING and self._timer.is_up():
            self.halt()
            return Status.FAILURE
        return self._tick_child()


class Delay(_Timed):
    """Ticks its child some time after its own first tick.

    Args:
        child: The child.
        seconds: The time, s; without any, the child is ticked in the next tick.
        clock: The time at which the tree is.
        is_version_4: Whether the tree is ticked once more when the time is up, and the child in each tick from then on;
            BehaviorTree.CPP 3 delays each tick of the child.
    """

    def __init__(self, child: Node, seconds: float, clock: Clock, *, is_version_4: bool) -> None:
        super().__init__(child)
        self._timer = Timer(seconds, clock, wakes=is_version_4)
        self._is_version_4 = is_version_4

    def tick(self) -> Status:
        """Tick the child when its time has come."""
        if not self._timer.runs:
            self._timer.start()
            return Status.RUNNING
        if not self._timer.is_up():
            return Status.RUNNING
        if not self._is_version_4:
            self._timer.stop()
        return self._tick_child()
