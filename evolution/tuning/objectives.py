"""Objectives and requirements: what the runs of a trial cost, and which conditions they must meet.

Every cost is finite, so that a trial with failures can be compared with any other.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from evolution.benchmark import MEASURES
from evolution.driving import DriveSettings, RunResult
from evolution.files import Row
from gym_mapbench.env.task import distance_to_goal
from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.metrics.map_metrics import measure_map
from gym_mapbench.world.scenario import Scenario

FAILURE = 2.0
"""A failure costs as much as this many time limits."""
REQUIREMENT = re.compile(r"\s*(?P<measure>\w+)\s*(?P<sign><=|>=)\s*(?P<limit>-?\d+(\.\d*)?|-?\.\d+)\s*")


@dataclass(frozen=True)
class Scale:
    """What the costs of a map are measured by.

    Args:
        length: Length of the shortest path, m.
        time: The same at the robot's maximum speed, s.
        limit: Time limit of a run, s.
    """

    length: float
    time: float
    limit: float

    @property
    def failure(self) -> float:
        """Cost of a run that fails, in units of ``time``."""
        return FAILURE * self.limit / self.time


def scale_of(scenario: Scenario, settings: DriveSettings) -> Scale:
    """Return the scale of a map.

    Raises:
        ConfigError: If walls separate start and goal, or both are the same.
    """
    length = distance_to_goal(scenario, settings.robot).at(scenario.start.x, scenario.start.y)
    if length <= 0 or measure_map(scenario, settings.robot)["narrowest_passage"] <= 0:
        raise ConfigError(f"{scenario.name}: expected a map with a way to the goal, got none")
    return Scale(length, length / settings.robot.max_linear_velocity, settings.time_limit)


def time_cost(result: RunResult, scale: Scale) -> float:
    """Time over the time of the shortest path at maximum speed; a failure costs twice the time limit."""
    return result.time_s / scale.time if result.success else scale.failure


def length_cost(result: RunResult, scale: Scale) -> float:
    """Driven length over the length of the shortest path; a failure costs what it costs in time."""
    return result.path_length_m / scale.length if result.success else scale.failure


def clearance_cost(result: RunResult, scale: Scale) -> float:
    """Negative smallest distance to a wall, m; a failure counts as no distance."""
    return -max(0.0, result.value("min_clearance")) if result.success else 0.0


OBJECTIVES: dict[str, Callable[[RunResult, Scale], float]] = {
    "time": time_cost,
    "length": length_cost,
    "clearance": clearance_cost,
}
"""Objectives by name: functions of a run, all minimised."""


@dataclass(frozen=True)
class Requirement:
    """A condition that the runs of a trial must meet.

    Args:
        text: As the user wrote it.
        measure: Key of :data:`~evolution.benchmark.MEASURES`.
        sign: 1 for at most, -1 for at least.
        limit: The limit.
    """

    text: str
    measure: str
    sign: int
    limit: float

    def violation(self, rows: Sequence[Row]) -> float:
        """Return by how much rows of runs miss the limit, at most 0 if they meet it; 1 without a value."""
        value = MEASURES[self.measure](rows)
        return 1.0 if value is None else self.sign * (value - self.limit)


def read_requirement(text: str) -> Requirement:
    """Read a condition such as ``clearance>=0.1``.

    Raises:
        ConfigError: If it is none, or there is no such measure.
    """
    found = REQUIREMENT.fullmatch(text)
    if found is None:
        raise ConfigError(f"requirement: expected a condition like clearance>=0.1, got {text!r}")
    if found["measure"] not in MEASURES:
        raise ConfigError(f"requirement: {unknown_name('measure', found['measure'], MEASURES)}")
    return Requirement(text.strip(), found["measure"], 1 if found["sign"] == "<=" else -1, float(found["limit"]))
