"""Bounded reading of untrusted files: kind and size of a file are checked before it is read."""

from __future__ import annotations

import contextlib
import os
import select
import stat
import time
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.errors import MapBenchError

MAX_ZIP_MEMBERS = 10_000
NOBODY_SECONDS, SILENT_SECONDS, POLL_SECONDS = 0.5, 60.0, 0.01
COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""What numpy and PyTorch write."""


def read_bytes(path: str | Path, limit: int, raises: type[MapBenchError]) -> bytes:
    """Read a whole file.

    Args:
        path: A file, or a pipe; a device such as ``/dev/zero`` may have no end.
        limit: Most bytes that are read.
        raises: The error of this kind of file.

    Raises:
        raises: If ``path`` is no file name, there is no such file, it is something else, or it is larger.
    """
    if not isinstance(path, str | os.PathLike):  # a number would be an open file, which is not ours to read and close
        raise raises(f"expected a file name, got {path!r:.80}")
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            status = os.fstat(file.fileno())
            content, size = _content(file.fileno(), status, limit), status.st_size
    except OSError as error:
        raise raises(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError:
        raise raises(f"{str(path)!r}: not a file name") from None
    if content is None:
        raise raises(f"{path}: expected a file, got a device, or a pipe that nobody writes to")
    if (size := max(size, len(content))) > limit:
        raise raises(f"{path}: expected at most {limit} bytes, got {size} or more")
    return content


def _without_waiting(path: str, flags: int) -> int:
    """Open a file; a pipe that nobody writes to would else be waited for."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _content(file: int, status: os.stat_result, limit: int) -> bytes | None:
    """Read at most one byte more than ``limit``, nothing if a file is larger; None if it is neither file nor pipe."""
    if stat.S_ISREG(status.st_mode):
        with open(file, "rb", closefd=False) as whole:
            return whole.read(limit + 1) if status.st_size <= limit else b""
    return _from_pipe(file, limit) if stat.S_ISFIFO(status.st_mode) else None


def _from_pipe(pipe: int, limit: int) -> bytes | None:
    """Read a pipe to its end; None if nobody writes to it, or nothing comes for too long."""
    found, somebody, since = b"", False, time.monotonic()
    while len(found) <= limit:
        try:
            part = os.read(pipe, limit + 1 - len(found))
        except BlockingIOError:  # somebody has opened it, and has not written yet
            somebody = True
        else:
            found, somebody = found + part, somebody or bool(part)
            if somebody and not part:
                return found
            since = time.monotonic() if part else since
        if time.monotonic() - since > (SILENT_SECONDS if somebody else NOBODY_SECONDS):
            return None
        select.select([pipe], [], [], POLL_SECONDS)
    return found


def read_text(path: str | Path, limit: int, raises: type[MapBenchError]) -> str:
    """Read a whole UTF-8 text file, without the mark that Windows programs put first; else as :func:`read_bytes`."""
    try:
        return read_bytes(path, limit, raises).decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        byte = error.object[error.start]
        raise raises(f"{path}: line {line}: expected text in UTF-8, got the byte 0x{byte:02x}") from None


@contextlib.contextmanager
def open_zip(path: str | Path, limit: int, raises: type[MapBenchError]) -> Iterator[zipfile.ZipFile]:
    """Open an archive whose members can be unpacked without surprise.

    Args:
        path: The archive.
        limit: Most bytes of all members together, unpacked.
        raises: The error of this kind of file.

    Raises:
        raises: If it is no archive, has too many members or too large ones, or one that is encrypted or compressed in
            a way that neither numpy nor PyTorch uses; or if what is done inside the ``with`` block finds it damaged.
    """
    if not os.path.isfile(path):
        what = "is not a file" if os.path.exists(path) else "does not exist"
        raise raises(f"{path} {what}")
    try:
        with zipfile.ZipFile(path) as archive:
            _check_members(path, archive.infolist(), limit, raises)
            yield archive
    except MapBenchError:
        raise
    except Exception as error:  # zipfile and the decoders below it raise nearly anything on damaged bytes
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:120]
        raise raises(f"{path}: cannot be read as an archive ({reason})") from None


def read_arrays(path: str | Path, limit: int, raises: type[MapBenchError]) -> dict[str, NDArray[Any]]:
    """Read the arrays of an ``.npz`` file; nothing in it is unpickled.

    Args:
        path: The file.
        limit: Most bytes of all arrays together.
        raises: The error of this kind of file.

    Raises:
        raises: If it is missing, larger, or holds something else, whatever the headers of its arrays state.
    """
    with open_zip(path, limit, raises), np.load(path, allow_pickle=False) as arrays:
        return {name: _array(path, name, arrays, raises) for name in arrays.files}


def _array(path: str | Path, name: str, arrays: Mapping[str, Any], raises: type[MapBenchError]) -> NDArray[Any]:
    """Read one array; a member that is no array comes as bytes, and the header of empty items may state any length."""
    array = arrays[name]
    if not isinstance(array, np.ndarray) or (array.size and not array.dtype.itemsize):
        raise raises(f"{path}: {name!r:.80}: expected an array")
    return array


def _check_members(path: str | Path, members: list[zipfile.ZipInfo], limit: int, raises: type[MapBenchError]) -> None:
    """Refuse an archive by what its directory says."""
    if len(members) > MAX_ZIP_MEMBERS:
        raise raises(f"{path}: expected at most {MAX_ZIP_MEMBERS} files in the archive, got {len(members)}")
    if (size := sum(member.file_size for member in members)) > limit:
        raise raises(f"{path}: expected at most {limit} bytes in the archive, got {size}")
    for member in members:
        if member.flag_bits & 1:
            raise raises(f"{path}: expected an archive that is not encrypted, got {member.filename!r:.80}, which is")
        if member.compress_type not in COMPRESSIONS:
            raise raises(f"{path}: {member.filename!r:.80} is compressed in a way that is not supported")
