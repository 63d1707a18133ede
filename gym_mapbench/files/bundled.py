"""YAML files that come with a package."""

from __future__ import annotations

from importlib.resources import as_file, files
from typing import Any

from gym_mapbench.files.documents import read_yaml


def bundled_names(package: str, folder: str) -> tuple[str, ...]:
    """Return the names of the YAML files in a folder of a package, without their ending and in order."""
    names = (entry.name for entry in files(package).joinpath(folder).iterdir())
    return tuple(sorted(name.removesuffix(".yaml") for name in names if name.endswith(".yaml")))


def read_bundled(package: str, *parts: str) -> Any:
    """Read a YAML file of a package.

    Args:
        package: The package, by its name in Python.
        parts: Folders in it, and the name of the file.
    """
    with as_file(files(package).joinpath(*parts)) as path:
        return read_yaml(path)
