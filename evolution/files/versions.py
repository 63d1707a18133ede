"""The versions of the software that results depend on: those in use, and those recorded in a file."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from gym_mapbench.errors import RunError

PACKAGE_VERSION = version("gym-mapbench")
LIBRARIES = ("numpy", "scipy", "numba", "Box2D", "gymnasium", "pymoo")


def versions() -> dict[str, Any]:
    """Return the versions of this package and of the libraries that results depend on."""
    return {"version": PACKAGE_VERSION, "libraries": dict(_library_versions())}


@cache
def _library_versions() -> tuple[tuple[str, str], ...]:
    return tuple((name, version(name)) for name in LIBRARIES)


def software() -> dict[str, str]:
    """Return the same versions by name, this package's among them."""
    return {"mapbench": PACKAGE_VERSION, **versions()["libraries"]}


def version_lines() -> list[str]:
    """Return name and version of this package, of Python, and of the libraries that results depend on, one a line."""
    mapbench, *libraries = (f"{name} {one}" for name, one in software().items())
    return [mapbench, f"python {platform.python_version()}", *libraries]


def refuse_version(config: Mapping[str, Any], path: Path) -> None:
    """Refuse to continue a directory that another version of this package began.

    Raises:
        RunError: If the versions differ.
    """
    came = config.get("version")
    if came != PACKAGE_VERSION:
        raise RunError(f"{path}: written by version {came}; version {PACKAGE_VERSION} cannot continue it")


def written_elsewhere(config: Mapping[str, Any]) -> list[str]:
    """Return a line about the versions that differ between writing and reading a file; no line if none differs.

    Args:
        config: Content of ``config.json`` or ``study.json``.
    """
    theirs, here = {"mapbench": config["version"], **config["libraries"]}, software()
    other = [name for name in here if theirs.get(name) != here[name]]
    if not other:
        return []
    was = ", ".join(f"{name} {theirs.get(name, 'unknown')}" for name in other)
    return [f"written by {was}; read and replayed by {', '.join(f'{name} {here[name]}' for name in other)}"]
