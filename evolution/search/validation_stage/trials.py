"""Trials of a set: one repeat of each of its maps."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TypeVar

import numpy as np

from evolution.driving import SetResults
from evolution.search.judging import Fitness, Judgement, singles_of

MAX_COMBINATIONS = 1024

T = TypeVar("T")


def trials_of(results: SetResults) -> list[SetResults]:
    """Return every combination of one repeat of each map, see :func:`combinations_of`."""
    return combinations_of([singles_of(of_map) for of_map in results])


def judged_trials(results: SetResults, fitness: Fitness) -> list[Judgement]:
    """Return the judgement of each of :func:`trials_of`; every repeat is judged once."""
    singles = [[fitness.judge_map(one) for one in singles_of(of_map)] for of_map in results]
    return list(map(fitness.judge, combinations_of(singles)))


def combinations_of(singles: Sequence[Sequence[T]]) -> list[tuple[T, ...]]:
    """Return every combination of one repeat of each map.

    Of more than 1,024 combinations, those are taken in which the repeats of neighbouring maps are equally far apart.

    Args:
        singles: The repeats of each map.
    """
    counts = [len(of_map) for of_map in singles]
    if np.prod(counts, dtype=float) <= MAX_COMBINATIONS:
        return list(product(*singles))
    most = max(counts)
    return [
        tuple(of_map[(first + place * step) % len(of_map)] for place, of_map in enumerate(singles))
        for first in range(most)
        for step in range(most)
    ]
