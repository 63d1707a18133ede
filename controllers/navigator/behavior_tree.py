"""Behaviour tree: the control nodes of Nav2's trees, with their exact semantics.

A node is ticked until it is no longer RUNNING. A parent that is done with a child stops it, which calls ``halt`` only
if the child is RUNNING (BehaviorTree.CPP 3.8). Sources: nav2_behavior_tree (Humble) plugins/control and
plugins/decorator; BehaviorTree.CPP 3.8 for sequences and fallbacks.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from enum import Enum, auto
from typing import ClassVar, NamedTuple

from controllers.navigator.rate import TIME_RESOLUTION

MOST_ROUNDS = 100
"""How often a loop goes round within one tick; then it goes on in the next tick, where Nav2 would hang."""


class Status(Enum):
    """State of a node; IDLE before its first tick and after a halt."""

    IDLE = auto()
    RUNNING = auto()
    SUCCESS = auto()
    FAILURE = auto()


def no_news() -> bool:
    """Return False: a node that waits for its time alone gets no messages."""
    return False


class Rest(NamedTuple):
    """Why a RUNNING node need not be ticked: a tick would only ask for news.

    Args:
        until: The time before which this holds, s.
        has_news: Whether something has come meanwhile that a tick has to take.
    """

    until: float
    has_news: Callable[[], bool] = no_news


class Node(ABC):
    """A node of the tree; ``status`` is that of its last tick."""

    status: Status = Status.IDLE

    def execute_tick(self) -> Status:
        """Tick the node and remember its status."""
        self.status = self.tick()
        return self.status

    def stop(self) -> None:
        """Make the node IDLE; it is halted first if it is RUNNING."""
        if self.status is Status.RUNNING:
            self.halt()
        self.status = Status.IDLE

    def rest(self) -> Rest | None:
        """Return until when ticks of this RUNNING node would change nothing; None if any tick may change something."""
        return None

    @abstractmethod
    def tick(self) -> Status:
        """Do one tick; ``self.status`` is still that of the tick before."""

    @abstractmethod
    def halt(self) -> None:
        """Stop whatever is running."""


class Question(Node):
    """A leaf that is never RUNNING."""

    def halt(self) -> None:
        """Do nothing: there is nothing to stop."""


class Condition(Question):
    """A leaf that asks whether something holds: SUCCESS for yes, FAILURE for no."""

    def __init__(self, holds: Callable[[], bool]) -> None:
        self._holds = holds

    def tick(self) -> Status:
        """Ask the question."""
        return Status.SUCCESS if self._holds() else Status.FAILURE


class Control(Node):
    """A node with children."""

    def __init__(self, *children: Node) -> None:
        self.children = children

    def halt(self) -> None:
        """Stop all children."""
        for child in self.children:
            child.stop()


def halt_tree(root: Node) -> None:
    """Halt every node, RUNNING or not, as Jazzy does when navigation ends (BehaviorTree.CPP 4)."""
    root.halt()
    root.status = Status.IDLE
    for child in root.children if isinstance(root, Control) else ():
        halt_tree(child)


class InOrder(Control):
    """Ticks its children in order, each until it ends with ``goes_on``; the first other end is the node's own."""

    goes_on: ClassVar[Status]

    def __init__(self, *children: Node) -> None:
        super().__init__(*children)
        self._current = 0

    def tick(self) -> Status:
        """Go on with the current child."""
        while self._current < len(self.children):
            status = self.children[self._current].execute_tick()
            if status is Status.RUNNING:
                return status
            if status is not self.goes_on:
                self.give_up()
                return status
            self._current += 1
        self.halt()
        return self.goes_on

    def give_up(self) -> None:
        """End because of a child."""
        self.halt()

    def halt(self) -> None:
        """Stop all children and begin with the first one next time."""
        super().halt()
        self._current = 0


class Sequence(InOrder):
    """Ticks its children in order, each until it succeeds; it fails as soon as one of them fails."""

    goes_on = Status.SUCCESS


class Fallback(InOrder):
    """Ticks its children in order, each until it fails; it succeeds as soon as one of them succeeds."""

    goes_on = Status.FAILURE


class SequenceWithMemory(Sequence):
    """A Sequence that begins, after a failure, with the child that failed (``SequenceStar`` in Humble)."""

    def give_up(self) -> None:
        """Stop all children; the current one keeps its turn."""
        Control.halt(self)


class Reactive(Control):
    """Ticks its children from the first one on at every tick, as long as they end with ``goes_on``.

    Args:
        *children: The children.
        halts_later: Whether a RUNNING child stops those after it, too (since Jazzy), not only those before it.
    """

    goes_on: ClassVar[Status]

    def __init__(self, *children: Node, halts_later: bool = False) -> None:
        super().__init__(*children)
        self._halts_later = halts_later

    def tick(self) -> Status:
        """Tick the children from the first one on."""
        for index, child in enumerate(self.children):
            status = child.execute_tick()
            if status is Status.RUNNING:
                later = self.children[index + 1 :] if self._halts_later else ()
                for other in (*self.children[:index], *later):
                    other.stop()
                return status
            if status is not self.goes_on:
                self.halt()
                return status
        self.halt()
        return self.goes_on


class ReactiveSequence(Reactive):
    """Ticks its children from the first one on at every tick; the first that does not succeed decides."""

    goes_on = Status.SUCCESS


class ReactiveFallback(Reactive):
    """Ticks its children from the first one on at every tick; the first that does not fail decides."""

    goes_on = Status.FAILURE


class RecoveryNode(Control):
    """Retries its first child up to ``number_of_retries`` times, each time after its second child succeeded.

    The count of retries begins anew only when the node ends: a child that failed once, was retried and is running
    now has one retry fewer left.
    """

    def __init__(self, number_of_retries: int, child: Node, recovery: Node) -> None:
        super().__init__(child, recovery)
        self.number_of_retries = number_of_retries
        self.retry_count = 0
        self._recovering = False

    def tick(self) -> Status:
        """Alternate between the two children until one is RUNNING or the node ends."""
        child, recovery = self.children
        for _ in range(2 * MOST_ROUNDS):
            active = recovery if self._recovering else child
            status = active.execute_tick()
            if status is Status.RUNNING:
                return status
            if self._ends_with(status):
                self.halt()
                return status
            active.stop()
            self.retry_count += self._recovering
            self._recovering = not self._recovering
        return Status.RUNNING

    def rest(self) -> Rest | None:
        """Rest as the first child does, if it is RUNNING."""
        child, _ = self.children
        return child.rest() if child.status is Status.RUNNING else None

    def _ends_with(self, status: Status) -> bool:
        """Whether this result of the active child ends the node; otherwise it is the other child's turn."""
        if self._recovering:
            return status is Status.FAILURE
        return status is Status.SUCCESS or self.retry_count >= self.number_of_retries

    def halt(self) -> None:
        """Stop both children and forget the retries."""
        super().halt()
        self.retry_count = 0
        self._recovering = False


class PipelineSequence(Control):
    """Ticks all children reached so far at every tick; a RUNNING one blocks only those not yet reached."""

    def __init__(self, *children: Node) -> None:
        super().__init__(*children)
        self._reached = 0

    def tick(self) -> Status:
        """Tick the children from the first one on."""
        for index, child in enumerate(self.children):
            status = child.execute_tick()
            if status is Status.FAILURE:
                self.halt()
                return status
            if status is Status.RUNNING and index >= self._reached:
                self._reached = index
                return status
        self.halt()
        return Status.SUCCESS

    def rest(self) -> Rest | None:
        """Rest as the child that was reached, unless the time of one before it comes first."""
        reached = self.children[self._reached].rest()
        for child in self.children[: self._reached]:
            earlier = child.rest()
            if reached is None or earlier is None or earlier.has_news is not no_news:
                return None
            reached = Rest(min(reached.until, earlier.until), reached.has_news)
        return reached

    def halt(self) -> None:
        """Stop all children and begin with the first one next time."""
        super().halt()
        self._reached = 0


class RoundRobin(Control):
    """Tries its children in turn, beginning after the last one that succeeded; fails when all of them fail.

    It keeps its place after a success, because the parent's halt reaches RUNNING nodes only.

    Args:
        *children: The children.
        wrap_around: Whether the first child follows the last; if not (Lyrical), the node fails when the last one ends.
    """

    def __init__(self, *children: Node, wrap_around: bool = True) -> None:
        super().__init__(*children)
        self._wraps = wrap_around
        self._current = 0
        self._failed = 0

    def tick(self) -> Status:
        """Tick the child whose turn it is, and the next ones while they fail."""
        while self._failed < len(self.children):
            status = self.children[self._current].execute_tick()
            if status is Status.RUNNING:
                return status
            self._current = (self._current + 1) % len(self.children)
            if self._current == 0 and not self._wraps:
                break
            if status is Status.SUCCESS:
                self._failed = 0
                super().halt()
                return status
            self._failed += 1
        self.halt()
        return Status.FAILURE

    def halt(self) -> None:
        """Stop all children and begin with the first one next time."""
        super().halt()
        self._current = 0
        self._failed = 0


class RateController(Control):
    """Ticks its child at first, while the child is RUNNING, and once one period has passed since it last succeeded.

    Args:
        hz: The rate, Hz.
        clock: Returns the time, s.
        child: The node that is ticked.
    """

    def __init__(self, hz: float, clock: Callable[[], float], child: Node) -> None:
        super().__init__(child)
        self._period = 1.0 / hz
        self._clock = clock
        self._start = 0.0

    def tick(self) -> Status:
        """Tick the child if it is due."""
        (child,) = self.children
        first = self.status is Status.IDLE
        if first:
            self._start = self._clock()
        due = self._clock() - self._start >= self._period - TIME_RESOLUTION
        if not (first or due or child.status is Status.RUNNING):
            return Status.RUNNING
        status = child.execute_tick()
        if status is Status.SUCCESS:
            self._start = self._clock()
        return status

    def rest(self) -> Rest | None:
        """Rest until the next period begins."""
        (child,) = self.children
        waits = self.status is Status.RUNNING and child.status is not Status.RUNNING
        return Rest(self._start + self._period) if waits else None
