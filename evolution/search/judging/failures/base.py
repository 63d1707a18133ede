"""The base class of failure policies: what a failed run counts."""

from __future__ import annotations

from typing import ClassVar

from evolution.driving import RunResult


class FailurePolicy:
    """Says what a failed run counts when maps are judged.

    Subclass it, and register the subclass in :data:`~evolution.search.judging.FAILURES`, or name it
    ``module:attribute``. Failed runs always lower the success rate of Eq. 4.5; the policy decides about their value.

    Attributes:
        excludes: Whether a map with a failed run has no value at all. Then :meth:`value` is never called.
        metric: The only metric that the values of this policy can be compared with; None for any metric.
    """

    excludes: ClassVar[bool] = False
    metric: ClassVar[str | None] = None

    def value(self, run: RunResult, time_limit: float) -> float:
        """Return the value of a failed run, in the unit of the search's metric.

        Args:
            run: The run, as far as it came.
            time_limit: Simulated seconds after which a run is a timeout.
        """
        raise NotImplementedError
