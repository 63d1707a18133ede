"""Parallel: a control node that ticks all of its children.

Source: BehaviorTree.CPP 3.8 and 4.7 src/controls/parallel_node.cpp.
"""

from __future__ import annotations

from controllers.navigator.behavior_tree import Control, Node, Status


class Parallel(Control):
    """Ticks all children that have not ended, and ends when enough of them have succeeded, or failed.

    It also fails as soon as too few children are left for a success. A number below 0 counts from all of the children
    down: -1 means all, -2 all but one.

    Args:
        *children: The children.
        successes: Number of successes that make the node succeed; not 0.
        failures: Number of failures that make the node fail; not 0.
    """

    def __init__(self, *children: Node, successes: int, failures: int) -> None:
        super().__init__(*children)
        self._successes, self._failures = (
            count if count > 0 else len(children) + 1 + count for count in (successes, failures)
        )
        self._ended: dict[Node, Status] = {}

    def tick(self) -> Status:
        """Tick the children in their order until the node ends."""
        for child in self.children:
            if child in self._ended:
                continue
            status = child.execute_tick()
            if status is Status.RUNNING:
                continue
            self._ended[child] = status
            if (end := self._end()) is not None:
                self.halt()
                return end
        return Status.RUNNING

    def _end(self) -> Status | None:
        """Return how the node ends; None if it does not."""
        results = list(self._ended.values())
        succeeded, failed = results.count(Status.SUCCESS), results.count(Status.FAILURE)
        if succeeded >= self._successes:
            return Status.SUCCESS
        hopeless = len(self.children) - failed < self._successes
        return Status.FAILURE if hopeless or failed >= self._failures else None

    def halt(self) -> None:
        """Stop all children and begin with all of them next time."""
        super().halt()
        self._ended = {}
