"""Locks of files, which end with the process that holds them: they tell what a killed process has left."""

from __future__ import annotations

import importlib
import importlib.util
import os
import time
from pathlib import Path

NEW_SECONDS = 60.0
"""What is younger may not be locked yet."""


def lock(file: int) -> bool:
    """Take the lock of an open file; returns whether it was free, which it always is where there are no such locks."""
    try:
        fcntl = importlib.import_module("fcntl")
    except ModuleNotFoundError:
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True


def take(path: Path) -> bool:
    """Hold a lock on a file or directory as long as this process lives; returns whether it was free."""
    return lock(os.open(path, os.O_RDONLY))


def is_abandoned(path: Path) -> bool:
    """Whether a file or directory that its writer keeps locked is this user's, and its writer is gone.

    Raises:
        OSError: If it cannot be read.
    """
    status = path.lstat()
    mine = not hasattr(os, "getuid") or status.st_uid == os.getuid()
    old = time.time() - status.st_mtime > NEW_SECONDS
    return mine and old and not path.is_symlink() and _is_free(path)


def _is_free(path: Path) -> bool:
    """Whether no process holds a lock on a file or directory; False where there are no such locks."""
    if importlib.util.find_spec("fcntl") is None:
        return False
    opened = os.open(path, os.O_RDONLY)
    try:
        return lock(opened)
    finally:
        os.close(opened)
