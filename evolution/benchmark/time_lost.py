"""Time lost: how much longer runs take among people than on the same maps without people.

Francis et al., Principles and Guidelines for Evaluating Social Robot Navigation Algorithms (2025), measure the time to
the goal; the comparison with the map without people is that of this project.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

from evolution.files import Row
from gym_mapbench.world.scenario import Scenario


class TimeLost(NamedTuple):
    """A run among people and the run of the same controller and repeat without people; both reach the goal.

    Args:
        map: Name of the map.
        controller: Name of the controller.
        repeat: Number of the run on the map.
        among: Time among people, s.
        alone: Time without people, s.
    """

    map: str
    controller: str
    repeat: int
    among: float
    alone: float

    @property
    def seconds(self) -> float:
        """Time lost, s; negative if the run among people is faster."""
        return self.among - self.alone

    @property
    def ratio(self) -> float:
        """Time among people over time without people."""
        return self.among / self.alone


def without_people(scenarios: Iterable[Scenario]) -> list[Scenario]:
    """Return the same tasks without bodies."""
    return [replace(scenario, bodies=()) for scenario in scenarios]


def time_lost(among: Sequence[Row], alone: Sequence[Row]) -> list[TimeLost]:
    """Return the time lost in every pair of runs that reach the goal, in the order of the first runs.

    Seeds depend on map and people, so the noise of both runs differs even if the benchmarks have the same seed.

    Args:
        among: Rows of a benchmark on maps with people.
        alone: Rows of a benchmark with the same names of maps and controllers, without people.
    """
    times = {_key(row): float(row["time_s"]) for row in alone if row["outcome"] == "goal"}
    paired = [row for row in among if row["outcome"] == "goal" and _key(row) in times]
    return [TimeLost(*_key(row), float(row["time_s"]), times[_key(row)]) for row in paired]


def _key(row: Row) -> tuple[str, str, int]:
    return str(row["map"]), str(row["controller"]), int(row["repeat"])
