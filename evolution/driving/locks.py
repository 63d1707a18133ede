"""Who has locked a file: told by Linux; elsewhere nobody is named."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from pathlib import Path

LOCKS = Path("/proc/locks")
COMMAND_LENGTH = 80


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
