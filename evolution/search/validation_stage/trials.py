"""Trials of a set: one repeat of each of its maps."""

from __future__ import annotations

from itertools import product

import numpy as np

from evolution.driving import SetResults
from evolution.search.judging import singles_of

MAX_COMBINATIONS = 1024


def trials_of(results: SetResults) -> list[SetResults]:
    """Return every combination of one repeat of each map.

    Of more than 1,024 combinations, those are taken in which the repeats of neighbouring maps are equally far apart.
    """
    singles = [singles_of(of_map) for of_map in results]
    counts = [len(of_map) for of_map in singles]
    if np.prod(counts, dtype=float) <= MAX_COMBINATIONS:
        return [tuple(chosen) for chosen in product(*singles)]
    most = max(counts)
    return [
        tuple(of_map[(first + place * step) % len(of_map)] for place, of_map in enumerate(singles))
        for first in range(most)
        for step in range(most)
    ]
