"""Small worlds for tests."""

from __future__ import annotations

import math

ROOM = ("#" * 30, *["#" + "." * 28 + "#"] * 28, "#" * 30)
"""An empty room of 3 m x 3 m at 0.1 m a cell."""
ROOM_START = (0.8, 0.8, 0.0)
ROOM_GOAL = (2.2, 2.2, math.pi / 2)
ROOM_OPTIONS = {"maps": ROOM, "resolution": 0.1, "start": ROOM_START, "goal": ROOM_GOAL}
