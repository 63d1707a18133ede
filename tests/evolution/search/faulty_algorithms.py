"""Algorithms of a third party that fail in their second generation, each in its own way."""

from __future__ import annotations

from typing import Any

import numpy as np
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.population import Population


class _Second(GA):  # type: ignore[misc]
    """Behaves in the first generation."""

    asked = 0

    def ask(self) -> Any:
        """Return the offspring, in the second generation what the fault makes of them."""
        self.asked += 1
        return super().ask() if self.asked < 2 else self.spoil(super().ask())

    def spoil(self, offspring: Population) -> Any:
        """Return the offspring with the fault."""
        return offspring


class Raises(_Second):
    """Fails when it is asked."""

    def spoil(self, offspring: Population) -> Any:
        """Raise."""
        raise ZeroDivisionError("no parents")


class Exits(_Second):
    """Ends the program as if all was well."""

    def spoil(self, offspring: Population) -> Any:
        """Exit."""
        raise SystemExit(0)


class Lists(_Second):
    """Returns numbers."""

    def spoil(self, offspring: Population) -> Any:
        """Return other things than individuals."""
        return [1.0, 2.0]


class Vectors(_Second):
    """Returns individuals of numbers."""

    def spoil(self, offspring: Population) -> Any:
        """Return other individuals than map sets."""
        return Population.new(X=np.zeros((2, 1)))


class Forgets(_Second):
    """Selects nothing."""

    def _advance(self, infills: Any = None, **options: Any) -> Any:
        self.pop = Population()


class Stumbles(_Second):
    """Fails when it is told."""

    def _advance(self, infills: Any = None, **options: Any) -> Any:
        raise LookupError("no survivor")


def nothing(**_options: Any) -> None:
    """Make no algorithm."""
