"""Files that are complete at any moment: they are written under another name, and renamed.

Their content is on the disk before they are renamed: after a power cut, file systems such as ext4 and XFS otherwise
have the new name with an empty file.
"""

from __future__ import annotations

import errno
import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from gym_mapbench.files.locks import is_abandoned, lock

WITHOUT_LINKS = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP)
"""Errors of file systems that have no hard links."""


PARTIAL = re.compile(r"\..+\.[0-9a-f]{8}\.part")
"""Names of files that are being written; their writers keep them locked."""


def _partial(path: Path) -> Path:
    """Return another name beside a file, which no other writer has."""
    return path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")


def remove_abandoned(folder: Path) -> None:
    """Remove what killed processes have left of files that they were writing in a folder and in those below."""
    for entry in folder.rglob(".*.part"):
        with suppress(OSError):
            if PARTIAL.fullmatch(entry.name) and is_abandoned(entry):
                entry.unlink()


@contextmanager
def replaced_at_once(path: Path) -> Iterator[BinaryIO]:
    """Write a file in one step: after the ``with`` block it is complete, before and on an error as it was.

    Several processes may write the same file; the last one to end wins. A link at ``path`` is replaced, not followed.

    Raises:
        OSError: If it cannot be written.
    """
    partial = _partial(path)
    try:
        with open(partial, "xb") as file:
            lock(file.fileno())
            yield file
            _store(file)
        os.replace(partial, path)
    finally:
        with suppress(OSError):
            partial.unlink()


def create_at_once(path: Path, content: bytes) -> None:
    """Write a new file in one step, of several processes only one.

    Raises:
        FileExistsError: If it is there already.
        OSError: If it cannot be written.
    """
    partial = _partial(path)
    try:
        _write_new(partial, content)
        os.link(partial, path)
    except OSError as error:
        if error.errno not in WITHOUT_LINKS:
            raise
        _write_new(path, content)
    finally:
        with suppress(OSError):
            partial.unlink()


def _write_new(path: Path, content: bytes) -> None:
    """Write a new file to the disk."""
    with open(path, "xb") as file:
        lock(file.fileno())
        file.write(content)
        _store(file)


def _store(file: BinaryIO) -> None:
    """Wait until the content of a file is on the disk."""
    file.flush()
    os.fsync(file.fileno())
