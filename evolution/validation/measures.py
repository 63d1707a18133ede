"""Measures: a measure is one number, with the number of its cases and the worst of them."""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass, field

import numpy as np

BOUNDS = {"<=": operator.le, ">=": operator.ge, "<": operator.lt}


@dataclass(frozen=True)
class Measure:
    """One line of the table.

    Args:
        key: Name of the measure.
        value: The number; NaN where there was no case.
        count: Number of cases.
        worst: The worst case in words; empty where none stands out.
        target: What it should reach: a bound such as ``<= 1e-6``, or words if there is no bound.
    """

    key: str
    value: float
    count: int
    worst: str = ""
    target: str = ""

    @property
    def missed(self) -> bool:
        """Whether there were cases, and they did not reach the bound."""
        symbol, _, bound = self.target.partition(" ")
        if symbol not in BOUNDS or self.count == 0:
            return False
        return math.isnan(self.value) or not BOUNDS[symbol](self.value, float(bound))


@dataclass
class Cases:
    """The errors of single cases with their names, from which a measure is made."""

    key: str
    target: str
    errors: list[float] = field(default_factory=list)
    names: list[str] = field(default_factory=list)

    def add(self, error: float, name: str) -> None:
        """Add one case: its error (0 is perfect) and its name."""
        self.errors.append(float(error))
        self.names.append(name)

    def largest(self) -> Measure:
        """The largest error."""
        return self._measure(float(np.max(self.errors)) if self.errors else np.nan)

    def median(self) -> Measure:
        """The median error."""
        return self._measure(float(np.median(self.errors)) if self.errors else np.nan)

    def mean(self) -> Measure:
        """The mean error."""
        return self._measure(float(np.mean(self.errors)) if self.errors else np.nan)

    def percentile(self, share: float, key: str, target: str) -> Measure:
        """The error that ``share`` (0 to 100) per cent of the cases do not exceed, as a measure of its own."""
        value = float(np.percentile(self.errors, share)) if self.errors else np.nan
        return Measure(key, value, len(self.errors), self._worst(), target)

    def agreement(self, count: int | None = None) -> Measure:
        """One minus the mean error: the share of comparisons that agree, where an error is the share that differs.

        Args:
            count: Number of single comparisons, if a case consists of many; the number of cases if None.
        """
        return self._measure(1.0 - float(np.mean(self.errors)) if self.errors else np.nan, count)

    def share_within(self, bound: float, key: str, target: str) -> Measure:
        """The share of cases with an error of at most ``bound``."""
        within = float(np.mean(np.asarray(self.errors) <= bound)) if self.errors else np.nan
        return Measure(key, within, len(self.errors), self._worst(), target)

    def _measure(self, value: float, count: int | None = None) -> Measure:
        return Measure(self.key, value, len(self.errors) if count is None else count, self._worst(), self.target)

    def _worst(self) -> str:
        if not self.errors or max(self.errors) == 0:
            return ""
        position = int(np.argmax(self.errors))
        return f"{self.names[position]}: {self.errors[position]:.3g}"
