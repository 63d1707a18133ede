"""Summarises the times of all recorded runs on one map, so that a page says the same of a map everywhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

SIMILAR: Final = 1.1
"""Controllers are alike on a map if the largest median time is at most this times the smallest."""
OUTLIER: Final = 1.5
"""A run that takes longer than this times the median of its controller is an outlier."""


@dataclass(frozen=True)
class ControllerTimes:
    """Times of the runs of one controller on one map.

    Args:
        controller: Name of the controller.
        times: Times of the runs that reached the goal, s, in the order of the repeats.
        runs: Number of all runs.
    """

    controller: str
    times: tuple[float, ...]
    runs: int

    @property
    def failed(self) -> int:
        """Number of runs that did not reach the goal."""
        return self.runs - len(self.times)

    @property
    def median(self) -> float:
        """Median time, s; nan if no run reached the goal."""
        return float(np.median(self.times)) if self.times else float("nan")

    @property
    def outliers(self) -> tuple[float, ...]:
        """Times longer than :data:`OUTLIER` times the median, s, ascending."""
        return tuple(sorted(time for time in self.times if time > OUTLIER * self.median))

    @property
    def in_words(self) -> str:
        """The controller with its median time, its failed runs and its outliers."""
        remarks = [f"{self.failed} of {self.runs} failed"] if self.failed else []
        if len(self.outliers) == 1:
            remarks.append(f"1 outlier: {self.outliers[0]:.1f} s")
        elif self.outliers:
            remarks.append(f"{len(self.outliers)} outliers up to {self.outliers[-1]:.1f} s")
        time = f"{self.median:.1f} s" if self.times else "no time"
        return f"{self.controller} {time}" + (f" ({', '.join(remarks)})" if remarks else "")


@dataclass(frozen=True)
class MapSummary:
    """Times of all controllers on one map.

    Args:
        name: Name of the map.
        controllers: The times of each controller.
    """

    name: str
    controllers: tuple[ControllerTimes, ...]

    @property
    def ordered(self) -> list[ControllerTimes]:
        """The controllers by their median times, the fastest first."""
        return sorted(self.controllers, key=lambda one: one.median)

    @property
    def lost(self) -> list[str]:
        """Names of the controllers that never reach the goal."""
        return [one.controller for one in self.controllers if not one.times]

    @property
    def failed(self) -> bool:
        """Whether a run of a controller failed."""
        return any(one.failed for one in self.controllers)

    @property
    def alike(self) -> bool:
        """Whether the medians of all controllers are alike; False if a controller never reaches the goal."""
        return not self.lost and self.ordered[-1].median <= SIMILAR * self.ordered[0].median

    @property
    def ratio(self) -> float:
        """Largest median time divided by the smallest."""
        return self.ordered[-1].median / self.ordered[0].median

    @property
    def difference(self) -> str:
        """Which controller is slowest, and by how much; or that all are alike; or which never reaches the goal.

        Of a single controller its median time.
        """
        if self.lost:
            return f"{', '.join(self.lost)} {'never reaches' if len(self.lost) == 1 else 'never reach'} the goal"
        if len(self.controllers) == 1:
            return f"{self.ordered[0].controller} {self.ordered[0].median:.1f} s"
        if self.alike:
            return f"all alike (within {100 * (SIMILAR - 1):.0f} %)"
        fast, slow = self.ordered[0], self.ordered[-1]
        return f"{slow.controller} takes {self.ratio:.1f} times as long as {fast.controller}"

    @property
    def runs(self) -> str:
        """The number of runs of a controller, or its range."""
        counts = [one.runs for one in self.controllers]
        least, most = min(counts), max(counts)
        return str(most) if least == most else f"{least} to {most}"

    @property
    def sample(self) -> str:
        """Which runs of each controller the times are the medians of."""
        return "1 run" if self.runs == "1" else f"medians of {self.runs} runs"

    @property
    def sample_at_goal(self) -> str:
        """The sample, and the number of runs at the goal of each controller of which only some reach it."""
        some = [f"{len(one.times)} of {one.controller}" for one in self.controllers if one.failed and one.times]
        return self.sample + (f" (at the goal: {', '.join(some)})" if some else "")

    @property
    def in_words(self) -> str:
        """The difference, the sample, and the time of every controller."""
        times = ", ".join(one.in_words for one in self.controllers)
        if len(self.controllers) == 1:
            return f"{self.name}, {self.sample}: {times}."
        return f"{self.name}: {self.difference}. {self.sample.capitalize()}: {times}."


def summary_of_map(name: str, runs: Mapping[str, Sequence[Mapping[str, Any]]]) -> MapSummary:
    """Return the summary of a map.

    Args:
        name: Name of the map.
        runs: By controller, its runs with ``outcome`` and ``time_s``, as in ``best_results.json``.
    """
    return MapSummary(
        name,
        tuple(
            ControllerTimes(name, tuple(one["time_s"] for one in some if one["outcome"] == "goal"), len(some))
            for name, some in runs.items()
        ),
    )
