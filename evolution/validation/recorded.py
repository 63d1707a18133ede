"""Reads and checks files of recorded results; an error is one line that names the file."""

from __future__ import annotations

import gzip
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from gym_mapbench.errors import MapFormatError
from gym_mapbench.files import bounded

Arrays = dict[str, NDArray[Any]]

MAX_BYTES = 2_000_000_000
"""Largest file of recorded results that is read, unpacked."""


def read_config(directory: str | Path) -> dict[str, Any]:
    """Read the ``config.json`` of a directory of recorded results.

    Raises:
        MapFormatError: If there is no such directory or file, or it holds no mapping.
    """
    directory = Path(directory)
    if not directory.is_dir():
        raise MapFormatError(f"{directory}: expected a directory of recorded results, found none")
    config: dict[str, Any] = read_json(directory / "config.json", dict)
    return config


def read_json(path: Path, kind: type) -> Any:
    """Read a JSON file that holds a ``kind``; a name that ends in ``.gz`` is that of a packed file.

    Raises:
        MapFormatError: If it is missing, unreadable, or holds something else.
    """
    try:
        loaded = json.loads(_unpacked(path) if path.suffix == ".gz" else _text(path))
    except (ValueError, RecursionError, OSError, EOFError) as error:
        raise MapFormatError(f"{path}: not readable as JSON ({error})") from None
    if not isinstance(loaded, kind):
        raise MapFormatError(f"{path}: expected a JSON {kind.__name__}, got {type(loaded).__name__}")
    return loaded


def _text(path: Path) -> str:
    return bounded.read_text(_there(path), MAX_BYTES, MapFormatError)


def _unpacked(path: Path) -> bytes:
    packed = bounded.read_bytes(_there(path), MAX_BYTES, MapFormatError)
    with gzip.open(io.BytesIO(packed)) as file:
        unpacked = file.read(MAX_BYTES + 1)
    if len(unpacked) > MAX_BYTES:
        raise MapFormatError(f"{path}: expected at most {MAX_BYTES} bytes unpacked, got more")
    return unpacked


def read_arrays(path: Path, required: Sequence[str]) -> Arrays:
    """Read all arrays of an ``.npz`` file.

    Raises:
        MapFormatError: If it is missing, unreadable, or lacks one of the ``required`` fields.
    """
    loaded = bounded.read_arrays(_there(path), MAX_BYTES, MapFormatError)
    missing = [key for key in required if key not in loaded]
    if missing:
        raise MapFormatError(f"{path}: expected the field {missing[0]!r}, found {sorted(loaded)}")
    return loaded


def _there(path: Path) -> Path:
    """Return a path at which there is something."""
    if not path.exists():
        raise MapFormatError(f"{path}: expected recorded results, found no such file")
    return path
