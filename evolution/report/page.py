"""From the content of a report to one HTML file that needs no network."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import metadata, resources
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from evolution.plots import colour_of
from gym_mapbench.episode import RECOVERY_KINDS, Episode, Event
from gym_mapbench.kernels.rectangles import merge_rectangles
from gym_mapbench.scenario import Scenario

REPLAY_PERIOD = 0.1
_SCRIPTS = ("vendor/sortable.min.js", "vendor/sortable.a11y.min.js", "vendor/medium-zoom.min.js", "replay.js")


@dataclass(frozen=True)
class Table:
    """A sortable table; numbers are shown with three significant decimals."""

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str | float | int]]


@dataclass(frozen=True)
class Attachment:
    """A file inside the page: a picture to show or a download; ``name`` is its caption or file name."""

    name: str
    media_type: str
    content: bytes

    @property
    def caption(self) -> str:
        """The name, under a picture."""
        return self.name

    @property
    def uri(self) -> str:
        """The content as a data URI."""
        return f"data:{self.media_type};base64,{base64.b64encode(self.content).decode()}"


@dataclass(frozen=True)
class ReplayedMap:
    """One map with the recorded runs on it.

    Args:
        title: Shown above the map.
        episodes: Runs on this map, all of one scenario.
        robot_radius: Drawn size of the robot, m.
    """

    title: str
    episodes: Sequence[Episode]
    robot_radius: float


@dataclass(frozen=True)
class Report:
    """Everything one page says.

    Args:
        title: Heading.
        subtitle: One line below it.
        verdict: The answer first, a paragraph each.
        command: The command that repeats it.
        configuration: The options as used, as text.
        missing: What a partial report lacks, a line each.
    """

    title: str
    subtitle: str
    verdict: Sequence[str]
    command: str
    configuration: str
    maps: Sequence[ReplayedMap] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[Attachment] = ()
    downloads: Sequence[Attachment] = ()
    missing: Sequence[str] = field(default=())


def render_page(report: Report) -> str:
    """Return the page as HTML text."""
    folder = resources.files("evolution.report")
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    environment.filters["figure"] = _figure
    template = environment.from_string(folder.joinpath("page.html.j2").read_text(encoding="utf-8"))
    scripts = [folder.joinpath(name).read_text(encoding="utf-8") for name in _SCRIPTS]
    return template.render(
        report=report,
        css=Markup(folder.joinpath("page.css").read_text(encoding="utf-8")),
        scripts=Markup("\n;\n".join(scripts)),
        replays=Markup(_script_json(_replays(report.maps))),
        version=metadata.version("gym-mapbench"),
    )


def _figure(value: float) -> str:
    """A number as a reader wants it: integers whole, others with three decimals at most."""
    if not np.isfinite(value):
        return "–"
    return str(value) if isinstance(value, int) else f"{value:.3f}".rstrip("0").rstrip(".")


def _script_json(value: Any) -> str:
    """JSON that may stand inside a script element: no sequence in it can close the element."""
    return json.dumps(value, separators=(",", ":")).replace("</", "<\\/").replace("<!--", "<\\!--")


def _replays(maps: Sequence[ReplayedMap]) -> dict[str, Any]:
    names = list(dict.fromkeys(episode.controller for shown in maps for episode in shown.episodes))
    return {
        "controllers": names,
        "colours": {name: colour_of(names, name) for name in names},
        "maps": [_replayed_map(shown) for shown in maps],
    }


def _replayed_map(shown: ReplayedMap) -> dict[str, Any]:
    scenario: Scenario = shown.episodes[0].scenario
    x0, y0, x1, y1 = scenario.map.bounds
    rectangles = merge_rectangles(scenario.map.occupancy)
    return {
        "title": shown.title,
        "x": x0,
        "y": y0,
        "width": x1 - x0,
        "height": y1 - y0,
        "resolution": scenario.map.resolution,
        "walls": [[int(c0), int(r0), int(c1 - c0), int(r1 - r0)] for r0, c0, r1, c1 in rectangles],
        "start": list(scenario.start),
        "goal": list(scenario.goal),
        "robot": shown.robot_radius,
        "runs": [_run(episode) for episode in shown.episodes],
    }


def _run(episode: Episode) -> dict[str, Any]:
    every = max(1, round(REPLAY_PERIOD / episode.control_period))
    states = _thinned(episode.trajectory, every)
    return {
        "controller": episode.controller,
        "outcome": episode.outcome,
        "time": round(episode.time, 3),
        "period": every * episode.control_period,
        "x": np.round(states[:, 0], 3).tolist(),
        "y": np.round(states[:, 1], 3).tolist(),
        "yaw": np.round(states[:, 2], 2).tolist(),
        "recoveries": sum(event.kind in RECOVERY_KINDS for event in episode.events),
        "marks": [_mark(episode, event) for event in episode.events if event.kind in RECOVERY_KINDS | {"contact"}],
    }


def _thinned(trajectory: NDArray[np.float64], every: int) -> NDArray[np.float64]:
    """Every n-th state and the last one."""
    kept = list(range(0, len(trajectory), every))
    if kept[-1] != len(trajectory) - 1:
        kept.append(len(trajectory) - 1)
    return trajectory[kept]


def _mark(episode: Episode, event: Event) -> dict[str, Any]:
    row = min(round(event.time / episode.control_period), len(episode.trajectory) - 1)
    x, y = episode.trajectory[row, :2]
    return {"time": round(event.time, 3), "kind": event.kind, "x": round(float(x), 3), "y": round(float(y), 3)}
