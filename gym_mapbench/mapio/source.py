"""Reading files that may be anything: bounded sizes, one clear line for every failure."""

from __future__ import annotations

import math
import os
import reprlib
from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import Any

import yaml

from gym_mapbench.errors import ConfigError, MapFormatError
from gym_mapbench.files import bounded
from gym_mapbench.files.documents import parse_json, parse_yaml

MAX_MAP_CELLS = 25_000_000
"""Largest map read from a file (5000 x 5000); the size in a header is checked before any memory is allocated."""

MAX_MAP_SIDE = 50_000

MAX_FILE_BYTES = 120_000_000
MAX_JSON_BYTES = 20_000_000
"""Low, because many small JSON objects take twenty times the memory of their text."""

MAX_NAME_LENGTH = 1000
MAX_YAML_BYTES = 100_000
"""Largest YAML file of one map; a real one has 200 bytes."""


def read_bytes(path: Path, limit: int = MAX_FILE_BYTES) -> bytes:
    """Read a whole file; raises ``MapFormatError`` if it cannot be read or is larger than ``limit`` bytes."""
    return bounded.read_bytes(path, limit, MapFormatError)


def read_text(path: Path, limit: int = MAX_FILE_BYTES) -> str:
    """Read a whole UTF-8 text file, errors as in :func:`read_bytes`."""
    return bounded.read_text(path, limit, MapFormatError)


def read_yaml_file(path: Path, *, each_key_once: bool = False) -> Any:
    """Read one YAML document.

    Args:
        path: The file.
        each_key_once: Whether to refuse a document that gives a key twice. Nav2's map server takes the first value,
            and PyYAML the last.

    Raises:
        MapFormatError: If the file cannot be read, is not YAML, or gives a key twice where it must not.
    """
    try:
        document, node = parse_yaml(read_text(path, MAX_YAML_BYTES), path)
    except ConfigError as error:
        raise MapFormatError(str(error)) from None
    if each_key_once and isinstance(node, yaml.MappingNode) and node.value:
        key, times = Counter(name.value for name, _ in node.value).most_common(1)[0]
        if times > 1:
            raise MapFormatError(f"{path}: {short(key)}: expected the key once, got it {times} times")
    return document


def read_json(path: Path, limit: int = MAX_JSON_BYTES) -> Any:
    """Read one JSON document.

    Raises:
        MapFormatError: If the file cannot be read or is not JSON.
    """
    return parse_json(read_text(path, limit), path, MapFormatError)


def files_ending(folder: Path, suffixes: Collection[str]) -> list[Path]:
    """Return the files of a folder whose names end in one of ``suffixes`` (lower case) in any case, by name."""
    return sorted(file for file in folder.glob("*") if file.suffix.lower() in suffixes)


def check_size(where: object, rows: int, cols: int) -> None:
    """Refuse an empty or absurdly large map before it is allocated.

    Raises:
        MapFormatError: Outside 1 to :data:`MAX_MAP_CELLS` cells, or with more than :data:`MAX_MAP_SIDE` in a line.
    """
    if rows < 1 or cols < 1 or rows * cols > MAX_MAP_CELLS:
        raise MapFormatError(f"{where}: expected a map of 1 to {MAX_MAP_CELLS} cells, got {cols} x {rows}")
    if max(rows, cols) > MAX_MAP_SIDE:
        raise MapFormatError(f"{where}: expected at most {MAX_MAP_SIDE} cells a side, got {cols} x {rows}")


def as_number(where: str, value: object) -> float:
    """Return a finite float; text such as ``5e-2``, which YAML 1.1 does not take for a number, is read as well.

    Raises:
        MapFormatError: If it is none.
    """
    try:
        number = math.nan if isinstance(value, bool) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise MapFormatError(f"{where}: expected a number, got {short(value)}")
    return number


def as_numbers(where: str, value: object, count: int) -> list[float]:
    """Return ``count`` finite floats of a list.

    Raises:
        MapFormatError: If it is something else.
    """
    if not isinstance(value, (list, tuple)) or len(value) != count:
        raise MapFormatError(f"{where}: expected a list of {count} numbers, got {short(value)}")
    return [as_number(where, item) for item in value]


def short(value: object) -> str:
    """Show a value in one short line, however deep or long it is."""
    text = " ".join(reprlib.repr(value).split())
    return text if len(text) <= 80 else text[:77] + "..."


def file_named(folder: Path, name: object, where: str) -> Path:
    """Resolve a file name found in a file, relative to ``folder`` unless it is absolute; links are the user's own.

    Raises:
        MapFormatError: If it is not a name.
    """
    if not isinstance(name, str) or not name.strip() or not name.isprintable() or len(name) > MAX_NAME_LENGTH:
        raise MapFormatError(f"{where}: expected a file name, got {short(name)}")
    return Path(os.path.normpath(os.path.join(os.path.abspath(folder), name)))


def file_inside(folder: Path, name: object, where: str) -> Path:
    """Resolve a file name found in a file, errors as in :func:`file_named`: it must stay inside ``folder``, as written.

    Raises:
        MapFormatError: If it leads out of the folder.
    """
    path = file_named(folder, name, where)
    base = os.path.abspath(folder)
    if os.path.commonpath([base, path]) != base:
        raise MapFormatError(f"{where}: expected a file inside {folder}, got {short(name)}")
    return path
