"""``python -m evolution`` is the command ``mapbench``."""

from __future__ import annotations

from evolution.cli import start

if __name__ == "__main__":
    raise SystemExit(start())
