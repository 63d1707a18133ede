"""Locks on files: one process at a time writes to a directory; the error for a second process names the first.

Only Linux names the holder of a lock. A lock ends with its process, however the process ends.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from gym_mapbench.errors import RunError
from gym_mapbench.files.locks import lock

LOCKS = Path("/proc/locks")
COMMAND_LENGTH = 80
PAUSE = 0.1


@contextlib.contextmanager
def locked(file: Path, wait_s: float) -> Iterator[None]:
    """Hold a lock on a file while the ``with`` block lasts; nothing is written.

    Args:
        file: The file; it must exist, and must not be replaced by those who look at its lock.
        wait_s: How long to wait for another process that holds it, s; 0 where the user cannot choose.

    Raises:
        RunError: If it stays locked, or cannot be opened.
    """
    try:
        opened = os.open(file, os.O_RDONLY)
    except OSError as error:
        raise RunError(f"{file}: cannot be read ({error.strerror})") from None
    try:
        until = time.monotonic() + wait_s
        while not lock(opened):
            if time.monotonic() >= until:
                raise RunError(f"{file.parent}: is being filled by {locked_by([file], wait_s)}")
            time.sleep(PAUSE)
        yield
    finally:
        os.close(opened)


def locked_by(files: Iterable[Path], wait_s: float) -> str:
    """Return in words which process has locked some files, and what to do."""
    holders = ", ".join(holders_of(files)) or "another process"
    return f"{holders}; try again when it has ended" + (
        f", or wait longer than {wait_s:g} s with --wait" * (wait_s > 0)
    )


def holders_of(files: Iterable[Path]) -> list[str]:
    """Return the processes that hold locks on some files, by number and command line, each once.

    The files are not opened: closing a file gives up the locks that this process itself may hold on it.
    """
    wanted = set()
    for file in files:
        with contextlib.suppress(OSError):
            wanted.add(str(file.stat().st_ino))
    try:
        lines = LOCKS.read_text(encoding="ascii").splitlines()
    except OSError:
        return []
    locks = [line.split() for line in lines]
    found = [one[4] for one in locks if len(one) > 5 and one[3] == "WRITE" and one[5].split(":")[-1] in wanted]
    return [_named(pid) for pid in dict.fromkeys(found)]


def _named(pid: str) -> str:
    """Return the number of a process with its command line."""
    try:
        command = Path("/proc", pid, "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return f"process {pid}"
    return f"process {pid} ({' '.join(command.split())[:COMMAND_LENGTH]})"
