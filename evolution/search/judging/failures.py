"""Failure policies: what a failed run counts when maps are judged."""

from __future__ import annotations

from typing import ClassVar

from evolution.driving import RunResult
from gym_mapbench.registry import Registry, must_be_subclass


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


class Exclude(FailurePolicy):
    """A map with a failed run has no value (thesis, section 4.1.11)."""

    excludes = True


class Censor(FailurePolicy):
    """A failed run counts as the time limit."""

    metric = "time"

    def value(self, run: RunResult, time_limit: float) -> float:
        """Return the time limit, s."""
        return time_limit


class Par2(FailurePolicy):
    """A failed run counts as twice the time limit.

    Source: the penalized average runtime of algorithm selection.
    """

    metric = "time"

    def value(self, run: RunResult, time_limit: float) -> float:
        """Return twice the time limit, s."""
        return 2.0 * time_limit


FAILURES: Registry[type[FailurePolicy]] = Registry(
    "failure policy",
    "failure_policies",
    {"exclude": Exclude, "censor": Censor, "par2": Par2},
    check=must_be_subclass(FailurePolicy),
)
"""The failure policies by name."""
