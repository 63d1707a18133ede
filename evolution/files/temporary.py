"""Temporary files: all of a process in one directory, which a later process removes if this one was killed."""

from __future__ import annotations

import atexit
import contextlib
import os
import shutil
import tempfile
from functools import cache
from pathlib import Path

from gym_mapbench.files.locks import is_abandoned, take

PREFIX, SUFFIX = "mapbench-", ".tmp"


@cache
def temporary_directory() -> Path:
    """Return this process's directory for temporary files; it is removed when the process ends.

    Directories of killed processes are removed now: no process holds their locks.
    """
    for old in Path(tempfile.gettempdir()).glob(f"{PREFIX}*{SUFFIX}"):
        with contextlib.suppress(OSError):
            if old.is_dir() and is_abandoned(old):
                shutil.rmtree(old, ignore_errors=True)
    path = Path(tempfile.mkdtemp(prefix=PREFIX, suffix=SUFFIX))
    take(path)
    atexit.register(_remove, path, os.getpid())
    return path


def _remove(path: Path, owner: int) -> None:
    """Remove a directory, unless this process is only a copy of the one that made it."""
    if os.getpid() == owner:
        shutil.rmtree(path, ignore_errors=True)
