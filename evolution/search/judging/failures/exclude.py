"""Exclude: a map with a failed run has no value."""

from __future__ import annotations

from evolution.search.judging.failures.base import FailurePolicy


class Exclude(FailurePolicy):
    """A map with a failed run has no value (thesis, section 4.1.11)."""

    excludes = True
