"""Temporary files: all of a process in one directory, which a later process removes if this one was killed."""

from __future__ import annotations

import atexit
import contextlib
import os
import shutil
import tempfile
import time
from functools import cache
from pathlib import Path

from evolution.files.locks import is_free, take

PREFIX, SUFFIX = "mapbench-", ".tmp"
NEW_SECONDS = 60.0
"""A directory that is younger may not be locked yet."""


@cache
def temporary_directory() -> Path:
    """Return this process's directory for temporary files; it is removed when the process ends.

    Directories of killed processes are removed now: no process holds their locks.
    """
    for old in Path(tempfile.gettempdir()).glob(f"{PREFIX}*{SUFFIX}"):
        with contextlib.suppress(OSError):
            if _is_abandoned(old):
                shutil.rmtree(old, ignore_errors=True)
    path = Path(tempfile.mkdtemp(prefix=PREFIX, suffix=SUFFIX))
    take(path)
    atexit.register(_remove, path, os.getpid())
    return path


def _remove(path: Path, owner: int) -> None:
    """Remove a directory, unless this process is only a copy of the one that made it."""
    if os.getpid() == owner:
        shutil.rmtree(path, ignore_errors=True)


def _is_abandoned(path: Path) -> bool:
    """Whether a directory is this user's, and the process that made it is gone."""
    status = path.lstat()
    mine = not hasattr(os, "getuid") or status.st_uid == os.getuid()
    old = time.time() - status.st_mtime > NEW_SECONDS
    return mine and old and path.is_dir() and not path.is_symlink() and is_free(path)
