"""Processes that tests start: which they are, and whether they have ended."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

PATIENCE = 300.0
"""Seconds for which a test waits for what must come; how long that takes depends on what else the machine does."""


def holds_soon(condition: Callable[[], bool]) -> bool:
    """Whether a condition holds before the patience ends."""
    until = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > until:
            return False
        time.sleep(0.05)
    return True


def is_gone(pid: int) -> bool:
    """Whether a process ends; one that only waits for its parent to notice has ended."""
    return holds_soon(lambda: not _is_there(pid))


def children_of(pid: int | None) -> list[int]:
    """Return the numbers of the processes that a process has started."""
    running = [int(one.name) for one in Path("/proc").glob("[0-9]*")]
    return [one for one in running if _state(one)[1:2] == [str(pid)]]


def _is_there(pid: int) -> bool:
    if _state(pid)[:1] in (["Z"], ["X"]):
        return False
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def _state(pid: int) -> list[str]:
    """Return the state of a process and the number of its parent; nothing where the system does not say."""
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()[:2]
    return []
