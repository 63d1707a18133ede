"""The command ``mapbench``, also as ``python -m evolution``."""

from __future__ import annotations

import sys

INTERRUPTED = 130


def run() -> int:
    """Run the command and return its exit code; Ctrl-C before the command itself takes it is one line, too."""
    try:
        from evolution.cli import start

        return start()
    except KeyboardInterrupt:
        print("mapbench: interrupted", file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    raise SystemExit(run())
