"""What a directory of results says about itself: its format, and the versions it was made with."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from evolution.files import read_json
from evolution.jobs import PACKAGE_VERSION
from gym_mapbench.errors import RunError

LIBRARIES = ("numpy", "scipy", "numba", "Box2D", "gymnasium", "pymoo")


def header(kind: str, kind_version: int) -> dict[str, Any]:
    """Begin the document of a new directory."""
    return {"format": kind, "format_version": kind_version, **versions()}


def versions() -> dict[str, Any]:
    """Return the versions of this package and of the libraries that results depend on."""
    return {"version": PACKAGE_VERSION, "libraries": {name: version(name) for name in LIBRARIES}}


def read_header(path: Path, kind: str, kind_version: int) -> dict[str, Any]:
    """Read the document of a directory.

    Raises:
        RunError: If it cannot be read, or is of another format.
    """
    config = read_json(path)
    if config.get("format") != kind or config.get("format_version") != kind_version:
        found = f"{config.get('format')} {config.get('format_version')}"
        raise RunError(f"{path}: expected {kind} {kind_version}, got {found}")
    return config


def refuse_version(config: Mapping[str, Any], path: Path) -> None:
    """Refuse to go on with what another version of this package began.

    Raises:
        RunError: If one did.
    """
    came = config.get("version")
    if came != PACKAGE_VERSION:
        raise RunError(f"{path}: written by version {came}; version {PACKAGE_VERSION} cannot continue it")
