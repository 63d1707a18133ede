"""Delta debugging: removes items in chunks, large ones first, while a condition holds (Zeller, Hildebrandt 2002)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

Item = TypeVar("Item")
FirstOf = Callable[[list[list[Item]]], int | None]
"""Returns the position of the first candidate for which the condition holds; None if there is none."""

BATCH = 4
"""Candidates that are tested at a time; fixed, so that the result does not depend on the number of workers."""


def minimal(items: Sequence[Item], first_of: FirstOf[Item]) -> list[Item]:
    """Return a part of the items from which no single item can be removed.

    Args:
        items: All items, in the order in which they are tried.
        first_of: Tests some candidates.
    """
    kept, size = list(items), max(1, len(items) // 2)
    while kept:
        kept, removed = _pass(kept, size, first_of)
        if size == 1 and not removed:
            break
        size = max(1, min(size // 2, len(kept) // 2))
    return kept


def _pass(kept: list[Item], size: int, first_of: FirstOf[Item]) -> tuple[list[Item], bool]:
    """Try to remove each chunk of ``size`` items once; return the rest, and whether anything was removed."""
    start, removed = 0, False
    while start < len(kept):
        starts = range(start, len(kept), size)[:BATCH]
        found = first_of([kept[:one] + kept[one + size :] for one in starts])
        if found is None:
            start = starts[-1] + size
        else:
            start, removed = starts[found], True
            kept = kept[:start] + kept[start + size :]
    return kept, removed
