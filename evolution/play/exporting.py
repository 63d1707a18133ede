"""Export: a session as one HTML file that opens from the disk, with map, ways, answer and overlays."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable, Sequence
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from evolution.driving import Job
from evolution.files import json_in_script
from evolution.play.drives import Driven, drive, prepared
from evolution.play.instants import look
from evolution.play.messages.replies import Data, Instant
from evolution.play.messages.requests import Drive
from evolution.play.messages.start import State
from evolution.play.track import Track
from evolution.play.worlds import Given
from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio.output import write_new_folder

INSTANTS = 16
"""Instants of each variant's first run, evenly spaced, for which overlays are recorded."""
PAGE = Path(str(files("evolution.play") / "page"))
RECORDED_SERVER = Path(str(files("evolution.play") / "recorded_server.js"))
IMPORT = re.compile(r"""(from\s+)"\./(\w+)\.js\"""")
INDEX = "index.html"


def export(given: Given, state: State, tracks: Sequence[Track], folder: Path) -> Path:
    """Run the session that a page would start with, and write it into a new folder.

    Args:
        given: What the command line gives.
        state: What the page would start with.
        tracks: Runs the variants, and shows the instants.
        folder: New or empty.

    Returns:
        The file.

    Raises:
        ConfigError: If the folder holds something, or a variant cannot run.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ConfigError(f"{folder}: expected a new or empty folder")
    request = Drive(id=1, scene=state.scene, settings=state.settings, variants=tuple(state.variants))
    driven, replies = prepared(request, given), list[Data]()
    drive(driven, tracks[0].run, replies.append)
    recorded = {
        "state": state.model_dump(mode="json"),
        "replies": [reply.model_dump(mode="json") for reply in replies],
        "instants": [one.model_dump(mode="json") for one in _instants(driven, tracks[1])],
    }
    return write_new_folder({INDEX: page_with(recorded)}, folder)[0]


def page_with(recorded: dict[str, Any]) -> str:
    """Return the page with its style, its modules and recorded data in one text.

    Args:
        recorded: ``state``, ``replies`` and ``instants``, JSON-able.
    """
    modules = {path.stem: path for path in sorted(PAGE.glob("*.js"))} | {"server": RECORDED_SERVER}
    imports = {name: _as_url("text/javascript", _by_name(_text_of(path))) for name, path in modules.items()}
    scripts = [
        f'<script type="application/json" id="recorded">{json_in_script(recorded)}</script>',
        f'<script type="importmap">{json_in_script({"imports": imports})}</script>',
        '<script type="module">import "main";</script>',
    ]
    text = _text_of(PAGE / INDEX)
    icon = _as_url("image/svg+xml", _text_of(PAGE / "icon.svg"))
    for old, new in {
        'href="static/icon.svg"': f'href="{icon}"',
        '<link rel="stylesheet" href="static/style.css">': f"<style>{_text_of(PAGE / 'style.css')}</style>",
        '<script type="module" src="static/main.js"></script>': "\n".join(scripts),
    }.items():
        text = text.replace(old, new)
    return text


def _text_of(path: Path) -> str:
    """Return the text of a file of the page."""
    return path.read_text(encoding="utf-8")


def _instants(driven: Driven, track: Track) -> list[Data]:
    """Return what the robots believed at some moments of their first runs."""
    found: list[Data] = []
    for name in (one.variant.name for one in driven.variants):
        job = driven.job(name, 0)
        times = np.linspace(0.0, driven.results[job.key].time_s, INSTANTS).tolist()
        answer = partial(Instant, id=driven.request.id, variant=name, repeat=0)
        track.run(partial(look, times), [job], partial(_append, found, answer))
    return found


def _append(found: list[Data], answer: Callable[..., Data], _job: Job, fields: dict[str, Any]) -> None:
    """Append the message about what a run has sent."""
    found.append(answer(**fields))


def _by_name(module: str) -> str:
    """Return a module that imports others by their names, which an import map gives; a file cannot import files."""
    return IMPORT.sub(r'\1"\2"', module)


def _as_url(kind: str, text: str) -> str:
    return f"data:{kind};base64,{base64.b64encode(text.encode()).decode()}"
