"""Parallel: a control node that ticks all of its children.

Source: BehaviorTree.CPP 3.8 and 4.7 src/controls/parallel_node.cpp.
"""

from __future__ import annotations

from controllers.navigator.behavior_tree import Control, Node, Status


class Parallel(Control):
    """Ticks all children that have not ended, and ends when enough of them have succeeded, or failed.

    It also fails as soon as too few children are left for a success. A number below 0 counts from all of the children
    down: -1 means all, -2 all but one. Humble counts in each tick anew, along the children: a child that ended in an
    earlier tick counts only after the children before it have been ticked.

    Args:
        *children: The children.
        successes: Number of successes that make the node succeed; not 0.
        failures: Number of failures that make the node fail; not 0.
        counts_anew: Whether the node counts as Humble's does (BehaviorTree.CPP 3.8).
    """

    def __init__(self, *children: Node, successes: int, failures: int, counts_anew: bool = False) -> None:
        super().__init__(*children)
        self._counts_anew = counts_anew
        self._successes, self._failures = (
            count if count > 0 else len(children) + 1 + count for count in (successes, failures)
        )
        self._ended: dict[Node, Status] = {}

    def tick(self) -> Status:
        """Tick the children in their order until the node ends."""
        for index, child in enumerate(self.children):
            if child not in self._ended:
                status = child.execute_tick()
                if status is Status.RUNNING:
                    continue
                self._ended[child] = status
            counted = self.children[: index + 1] if self._counts_anew else self.children
            if (end := self._end([self._ended[one] for one in counted if one in self._ended])) is not None:
                self.halt()
                return end
        return Status.RUNNING

    def _end(self, results: list[Status]) -> Status | None:
        """Return how the node ends with these results of its children; None if it does not."""
        succeeded, failed = results.count(Status.SUCCESS), results.count(Status.FAILURE)
        if succeeded >= self._successes:
            return Status.SUCCESS
        hopeless = len(self.children) - failed < self._successes
        return Status.FAILURE if hopeless or failed >= self._failures else None

    def halt(self) -> None:
        """Stop all children and begin with all of them next time."""
        super().halt()
        self._ended = {}
