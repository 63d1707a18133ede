"""Processes that tests start: whether one has ended."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path

PATIENCE = 300.0
"""Seconds for which a test waits for what must come; how long it takes depends on what else the machine does."""


def is_gone(pid):
    """Whether a process ends in time; one that only waits for its parent to notice has ended."""
    until = time.monotonic() + PATIENCE
    while _is_there(pid):
        if time.monotonic() > until:
            return False
        time.sleep(0.05)
    return True


def _is_there(pid):
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True
