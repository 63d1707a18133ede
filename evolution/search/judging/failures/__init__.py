"""Failure policies: what a failed run counts; each policy has a file of its own."""

from __future__ import annotations

from evolution.search.judging.failures.base import FailurePolicy
from evolution.search.judging.failures.censor import Censor
from evolution.search.judging.failures.exclude import Exclude
from evolution.search.judging.failures.par2 import Par2
from gym_mapbench.registry import Registry, must_be_subclass

__all__ = ["FAILURES", "FailurePolicy"]

FAILURES: Registry[type[FailurePolicy]] = Registry(
    "failure policy",
    "failure_policies",
    {"exclude": Exclude, "censor": Censor, "par2": Par2},
    check=must_be_subclass(FailurePolicy),
)
"""The failure policies by name."""
