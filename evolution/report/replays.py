"""The data of the page's replays: maps as rectangles, runs as thinned trajectories with marks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evolution.pictures import PEOPLE_COLOUR, colour_of
from gym_mapbench.kernels.rectangles import merge_rectangles
from gym_mapbench.metrics.episode import RECOVERY_KINDS, Episode, Event
from gym_mapbench.world.crowd import Track, place_crowd

REPLAY_PERIOD = 0.1
MARKED_KINDS = RECOVERY_KINDS | {"contact"}
STUCK_SECONDS = 3.0
STUCK_RADIUS = 0.1
"""A robot that stays within this distance, m, for :data:`STUCK_SECONDS` is stuck."""


@dataclass(frozen=True)
class ReplayedMap:
    """One map with the recorded runs on it.

    Args:
        title: Shown above the map.
        episodes: Runs on this map, all of one scenario.
        group: Maps of one group are shown together; the reader selects the group.
        sample: Which of all runs title and replay show, in words; shown below the title.
    """

    title: str
    episodes: Sequence[Episode]
    group: str = ""
    sample: str = ""


def replays_of(maps: Sequence[ReplayedMap]) -> dict[str, Any]:
    """Return the JSON-able document that the page's script plays."""
    names = list(dict.fromkeys(episode.controller for shown in maps for episode in shown.episodes))
    return {
        "controllers": names,
        "colours": {name: colour_of(names, name) for name in names},
        "people": PEOPLE_COLOUR,
        "groups": list(dict.fromkeys(shown.group for shown in maps)),
        "maps": [_replayed_map(shown) for shown in maps],
    }


def stuck_spots(states: NDArray[np.float64], period: float) -> list[tuple[float, float, float, float]]:
    """Return where a robot was stuck: ``(x, y, from, until)`` in m and s, in order of time.

    Args:
        states: ``(n, >= 2)`` x, y, ... at equal intervals.
        period: Seconds between two states.
    """
    spots = []
    start = 0
    while start < len(states):
        away = np.hypot(*(states[start:, :2] - states[start, :2]).T) > STUCK_RADIUS
        stays = int(np.argmax(away)) if away.any() else len(away)
        if (stays - 1) * period >= STUCK_SECONDS:
            x, y = states[start : start + stays, :2].mean(axis=0)
            spots.append((float(x), float(y), start * period, (start + stays - 1) * period))
            start += stays
        else:
            start += 1
    return spots


def _replayed_map(shown: ReplayedMap) -> dict[str, Any]:
    scenario = shown.episodes[0].scenario
    x0, y0, x1, y1 = scenario.map.bounds
    rectangles = merge_rectangles(scenario.map.occupancy)
    return {
        "title": shown.title,
        "sample": shown.sample,
        "group": shown.group,
        "x": x0,
        "y": y0,
        "width": x1 - x0,
        "height": y1 - y0,
        "resolution": scenario.map.resolution,
        "walls": [[int(col), int(row), int(cols), int(rows)] for row, col, rows, cols in rectangles],
        "start": list(scenario.start),
        "goal": list(scenario.goal),
        "runs": [_run(episode) for episode in shown.episodes],
        **_bodies(shown.episodes),
    }


def _bodies(episodes: Sequence[Episode]) -> dict[str, Any]:
    """Return where the bodies of a scenario are until the end of its longest run; nothing where there are none.

    People who see the robot are where they were in the first run.
    """
    first, bodies = episodes[0], episodes[0].scenario.bodies
    if not bodies:
        return {}
    times = np.arange(0.0, max(episode.time for episode in episodes) + REPLAY_PERIOD, REPLAY_PERIOD)
    x, y, _ = np.round(
        place_crowd(first.scenario.map, bodies, times, Track(first.control_period, first.trajectory)), 3
    ).T.tolist()
    courses = zip(bodies, x, y, strict=True)
    return {"period": REPLAY_PERIOD, "bodies": [{"radius": one.shape.radius, "x": x, "y": y} for one, x, y in courses]}


def _run(episode: Episode) -> dict[str, Any]:
    every = max(1, round(REPLAY_PERIOD / episode.control_period))
    states, period = _thinned(episode.trajectory, every), every * episode.control_period
    return {
        "controller": episode.controller,
        "robot": episode.robot.outline,
        "outcome": episode.outcome,
        "time": round(episode.time, 3),
        "period": period,
        "x": np.round(states[:, 0], 3).tolist(),
        "y": np.round(states[:, 1], 3).tolist(),
        "yaw": np.round(states[:, 2], 2).tolist(),
        "recoveries": sum(event.kind in RECOVERY_KINDS for event in episode.events),
        "marks": [_mark(episode, event) for event in episode.events if event.kind in MARKED_KINDS],
        "stuck": [[round(value, 3) for value in spot] for spot in stuck_spots(states, period)],
    }


def _thinned(trajectory: NDArray[np.float64], every: int) -> NDArray[np.float64]:
    """Return every n-th state and the last one."""
    kept = list(range(0, len(trajectory), every))
    if kept[-1] != len(trajectory) - 1:
        kept.append(len(trajectory) - 1)
    return trajectory[kept]


def _mark(episode: Episode, event: Event) -> dict[str, Any]:
    row = min(round(event.time / episode.control_period), len(episode.trajectory) - 1)
    x, y = episode.trajectory[row, :2]
    return {"time": round(event.time, 3), "kind": event.kind, "x": round(float(x), 3), "y": round(float(y), 3)}
