"""Censor: a failed run counts as the time limit."""

from __future__ import annotations

from evolution.driving import RunResult
from evolution.search.judging.failures.base import FailurePolicy


class Censor(FailurePolicy):
    """A failed run counts as the time limit."""

    metric = "time"

    def value(self, run: RunResult, time_limit: float) -> float:
        """Return the time limit, s."""
        return time_limit
