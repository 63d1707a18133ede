"""PAR2: a failed run counts as twice the time limit (penalized average runtime, from algorithm selection)."""

from __future__ import annotations

from evolution.driving import RunResult
from evolution.search.judging.failures.base import FailurePolicy


class Par2(FailurePolicy):
    """A failed run counts as twice the time limit."""

    metric = "time"

    def value(self, run: RunResult, time_limit: float) -> float:
        """Return twice the time limit, s."""
        return 2.0 * time_limit
