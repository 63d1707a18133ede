"""Reading files that may be anything: what they are and how large they are is looked at before they are read."""

from __future__ import annotations

import contextlib
import os
import stat
import zipfile
from collections.abc import Iterator
from pathlib import Path

from gym_mapbench.errors import MapBenchError

MAX_ZIP_MEMBERS = 10_000
COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""What numpy and PyTorch write."""


def read_bytes(path: str | Path, limit: int, raises: type[MapBenchError]) -> bytes:
    """Read a whole file.

    Args:
        path: A file, or a pipe; a device such as ``/dev/zero`` may have no end.
        limit: Most bytes that are read.
        raises: The error of this kind of file.

    Raises:
        raises: If there is no such file, it is something else, or it is larger.
    """
    try:
        with Path(path).open("rb") as file:
            status = os.fstat(file.fileno())
            if not (stat.S_ISREG(status.st_mode) or stat.S_ISFIFO(status.st_mode)):
                raise raises(f"{path}: expected a file, got a device")
            content = file.read(limit + 1) if status.st_size <= limit else b""
    except OSError as error:
        raise raises(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError:
        raise raises(f"{str(path)!r}: not a file name") from None
    if (size := max(status.st_size, len(content))) > limit:
        raise raises(f"{path}: expected at most {limit} bytes, got {size} or more")
    return content


def read_text(path: str | Path, limit: int, raises: type[MapBenchError]) -> str:
    """Read a whole UTF-8 text file; arguments and errors as in :func:`read_bytes`."""
    try:
        return read_bytes(path, limit, raises).decode("utf-8").replace("\r\n", "\n")
    except UnicodeDecodeError:
        raise raises(f"{path}: expected a text file, got other bytes") from None


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
    if not Path(path).is_file():
        what = "is not a file" if Path(path).exists() else "does not exist"
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
