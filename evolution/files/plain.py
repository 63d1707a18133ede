"""Plain files that are complete at any moment: text, JSON, CSV and arrays, written under another name and renamed."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.errors import RunError
from gym_mapbench.files import bounded
from gym_mapbench.files.documents import parse_json
from gym_mapbench.files.replacing import create_at_once, replaced_at_once
from gym_mapbench.world.gridmap import GridMap

Row = dict[str, Any]
"""A line of a table, by column."""


MAX_BYTES = 2_000_000_000
"""Largest file of results that is read; a million runs take half of it."""


class WriteError(RunError):
    """A file or directory cannot be written, for example because the disk is full or read-only."""


@contextmanager
def written_at_once(path: Path) -> Iterator[BinaryIO]:
    """Write a file in one step: after the ``with`` block it is complete, before and on an error as it was.

    Raises:
        WriteError: If it cannot be written.
    """
    try:
        with replaced_at_once(path) as file:
            yield file
    except OSError as error:
        raise WriteError(f"{path}: cannot be written ({error.strerror})") from None


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file in one step, as :func:`written_at_once` does."""
    with written_at_once(path) as file:
        file.write(content)


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays as an ``.npz`` file in one step."""
    with written_at_once(path) as file:
        np.savez(file, allow_pickle=False, **arrays)


def append_line(path: Path, text: str) -> None:
    """Append a line to a text file; an incomplete last line stays a line of its own.

    Raises:
        WriteError: If it cannot be written.
    """
    try:
        with open(path, "a+b", opener=_no_link) as file:
            if file.tell():
                file.seek(-1, os.SEEK_END)
                text = text if file.read(1) == b"\n" else f"\n{text}"
            file.write(f"{text}\n".encode())
    except OSError as error:
        raise WriteError(f"{path}: cannot be written ({error.strerror})") from None


def _no_link(path: str, flags: int) -> int:
    """Open a file; a link, which may lead out of the directory that is written, is an error."""
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0), 0o666)


def write_text(path: Path, text: str) -> None:
    """Write a text file in one step; letters that are none, as of a file name that is not UTF-8, are escaped."""
    write_bytes(path, text.encode(errors="backslashreplace"))


def write_json(path: Path, document: Mapping[str, Any]) -> None:
    """Write a JSON file in one step."""
    write_text(path, _json_of(document))


def _json_of(document: Mapping[str, Any]) -> str:
    return json.dumps(document, indent=1) + "\n"


def json_in_script(document: object) -> str:
    """Return JSON for a script element of a page, which nothing in it can close or leave open."""
    return json.dumps(document, separators=(",", ":")).replace("<", "\\u003c")


def write_new_json(path: Path, document: Mapping[str, Any]) -> None:
    """Write a JSON file in one step, unless it is there.

    Raises:
        FileExistsError: If it is, also if another process has just written it.
        WriteError: If it cannot be written.
    """
    try:
        create_at_once(path, _json_of(document).encode())
    except FileExistsError:
        raise
    except OSError as error:
        raise WriteError(f"{path}: cannot be written ({error.strerror})") from None


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises:
        RunError: If it is missing or something else.
    """
    document = parse_json(_read_text(path), path, RunError)
    if not isinstance(document, dict):
        raise RunError(f"{path}: expected a JSON object, got {type(document).__name__}")
    return document


def csv_of(rows: Sequence[Row]) -> str:
    """Return a table as CSV text; columns are in order of their first use, and empty where a row has no value.

    A text that a spreadsheet would take for a formula begins with an apostrophe, which :func:`read_csv` takes off.
    """
    return GrowingCsv().text(rows)


class GrowingCsv:
    """The CSV text of a table that grows: a row is made text once, unless a later one brings a new column."""

    def __init__(self) -> None:
        self._columns: dict[str, None] = {}
        self._text = ""
        self._count = 0

    def text(self, rows: Sequence[Row]) -> str:
        """Return a table as :func:`csv_of` does.

        Args:
            rows: All rows, also those of the last call; these must not have changed.
        """
        new = rows[self._count :]
        columns = dict.fromkeys(name for row in new for name in row)
        if not (self._count and columns.keys() <= self._columns.keys()):
            new, self._columns = rows, dict.fromkeys(name for row in rows for name in row)
            self._text = _lines([[_harmless(name) for name in self._columns]])
        self._text += _lines([_harmless(row.get(name, "")) for name in self._columns] for row in new)
        self._count = len(rows)
        return self._text


def _lines(table: Iterable[Iterable[Any]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(table)
    return text.getvalue()


FORMULA = ("=", "+", "-", "@", "\t", "\r", "'")
"""How texts begin that spreadsheets do not show as they are."""


def _harmless(value: Any) -> Any:
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else value


def _as_written(text: str) -> str:
    return text[1:] if text.startswith("'") else text


TEXT_COLUMN = re.compile(r"map(_\d+|_set)?|best_map_set|world|walls|controller|outcome|reason")


def read_csv(path: Path) -> list[Row]:
    """Read what :func:`csv_of` wrote: numbers as numbers, None where empty.

    Raises:
        RunError: If the file is missing or holds something else.
    """
    try:
        table = csv.DictReader(io.StringIO(_read_text(path), newline=""))
        return [{_as_written(name): _parse(name, text) for name, text in row.items()} for row in table]
    except (ValueError, TypeError, AttributeError, csv.Error) as error:
        raise _unreadable(path, error) from None


def npz_of(maps: Mapping[str, GridMap]) -> bytes:
    """Return maps as the bytes of a compressed ``.npz`` file; equal maps give equal bytes."""
    content = io.BytesIO()
    np.savez_compressed(content, allow_pickle=False, **{digest: grid.occupancy for digest, grid in maps.items()})
    return content.getvalue()


def zip_of(files: Mapping[str, bytes]) -> bytes:
    """Return an archive of some files by name; equal files give equal bytes."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for name, part in files.items():
            archive.writestr(zipfile.ZipInfo(name), part, zipfile.ZIP_DEFLATED)
    return content.getvalue()


def read_npz(path: Path, resolution: float, limit: int = MAX_BYTES) -> dict[str, GridMap]:
    """Read what :func:`npz_of` returned.

    Args:
        path: The file.
        resolution: Side of a cell, m.
        limit: Most bytes of all maps together.

    Raises:
        RunError: If it is missing or holds something else.
    """
    try:
        return {digest: GridMap(array, resolution) for digest, array in read_arrays(path, limit).items()}
    except ValueError as error:
        raise _unreadable(path, error) from None


def read_arrays(path: Path, limit: int) -> dict[str, NDArray[Any]]:
    """Read the arrays of an ``.npz`` file as :func:`gym_mapbench.files.bounded.read_arrays`; raises ``RunError``."""
    return bounded.read_arrays(path, limit, RunError)


def _parse(column: str, text: str) -> Any:
    if TEXT_COLUMN.fullmatch(column):
        return _as_written(text)
    if text == "":
        return None
    return int(text) if re.fullmatch(r"-?\d+", text) else float(text)


def read_json_lines(path: Path) -> list[Row]:
    """Read a JSON lines file without lines that were not written to their end; nothing if there is no file.

    Raises:
        RunError: If it is not a text file.
    """
    rows: list[Row] = []
    for line in _read_text(path).splitlines() if path.is_file() else []:
        with suppress(ValueError, RecursionError):
            rows.append(json.loads(line))
    return rows


def _read_text(path: Path) -> str:
    return bounded.read_text(path, MAX_BYTES, RunError)


def _unreadable(path: Path, error: Exception) -> RunError:
    return RunError(f"{path}: cannot be read ({' '.join(str(error).split())[:120]})")


def make_directory(path: Path) -> None:
    """Make a directory and those above it.

    Raises:
        WriteError: If it cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise WriteError(f"{path}: cannot be made ({error.strerror})") from None
