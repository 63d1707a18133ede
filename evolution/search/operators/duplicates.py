"""Duplicate elimination: of individuals with the same maps, one is kept (thesis, section 4.1.7)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.duplicate import DuplicateElimination


class MapSetDuplicates(DuplicateElimination):  # type: ignore[misc]
    """Marks individuals whose :attr:`MapSet.digest` occurred before; the order of the maps does not matter.

    The thesis compares the tensors, in which the maps have an order; its section 4.1.4 calls the order irrelevant.

    pymoo's own elimination compares every pair of variables; its hashing variant hashes individuals, not their content.
    """

    def _do(self, pop: Any, other: Any, is_duplicate: NDArray[np.bool_]) -> NDArray[np.bool_]:
        seen = set() if other is None else {individual.X[0].digest for individual in other}
        for index, individual in enumerate(pop):
            digest = individual.X[0].digest
            is_duplicate[index] = digest in seen
            seen.add(digest)
        return is_duplicate
