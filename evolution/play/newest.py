"""Newest: a place for one task, in which a newer task replaces one that nobody has taken yet."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Newest(Generic[T]):
    """Hands the newest task from one thread to another."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._task: T | None = None
        self._closed = False

    def put(self, task: T | None, end_former: Callable[[], object]) -> None:
        """Replace the waiting task; with None, no task waits.

        Args:
            task: The task.
            end_former: Ends the work on the task that was taken last; nobody takes the new one before that.
        """
        with self._changed:
            self._task = task
            end_former()
            self._changed.notify()

    def take(self) -> T | None:
        """Wait for a task and return it; None once the place is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._task is not None or self._closed)
            task, self._task = self._task, None
            return None if self._closed else task

    def is_empty(self) -> bool:
        """Whether no task waits."""
        return self._task is None

    def close(self) -> None:
        """Let every ``take`` return None."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
