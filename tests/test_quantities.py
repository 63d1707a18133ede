"""Constrained numbers: their bounds, their messages, and one meaning for each name in the whole project."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

import pytest

import gym_mapbench
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator.ranges import Length
from gym_mapbench.quantities import (
    Count,
    Fraction,
    Natural,
    NonNegative,
    NonPositive,
    Positive,
    SignedFraction,
)
from gym_mapbench.settings import Settings

ROOT = Path(gym_mapbench.__file__).parents[1]


class Options(Settings):
    positive: Positive = 1.0
    non_negative: NonNegative = 0.0
    non_positive: NonPositive = 0.0
    fraction: Fraction = 1.0
    signed: SignedFraction = -1.0
    count: Count = 1
    natural: Natural = 0
    length: Length = 1000.0


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("positive", 0.0, "greater than 0"),
        ("non_negative", -0.1, "greater than or equal to 0"),
        ("non_positive", 0.1, "less than or equal to 0"),
        ("fraction", 1.1, "less than or equal to 1"),
        ("signed", -1.1, "greater than or equal to -1"),
        ("count", 0, "greater than or equal to 1"),
        ("natural", -1, "greater than or equal to 0"),
        ("length", 1001.0, "less than or equal to 1000"),
        ("length", 0.0, "greater than 0"),
        ("positive", float("inf"), "a finite number"),
    ],
)
def test_values_out_of_bounds_are_refused_in_one_line(name, value, expected):
    with pytest.raises(ConfigError, match=f"^{name}: expected {expected}, got {value}$"):
        Options(**{name: value})


def test_a_name_of_a_constrained_number_is_defined_once():
    homes = defaultdict(list)
    for package in ("gym_mapbench", "controllers", "evolution"):
        for path in (ROOT / package).rglob("*.py"):
            for name in re.findall(r"^(\w+) = Annotated\[", path.read_text(), re.M):
                homes[name].append(path.name)
    assert homes["Positive"] == ["quantities.py"]
    assert {name: where for name, where in homes.items() if len(where) > 1} == {}
