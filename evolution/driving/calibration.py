"""A plain loop that times are divided by, so that times of different machines can be compared."""

from __future__ import annotations

import time


def calibration_loop(n: int = 20_000) -> float:
    """Return the seconds of one iteration of a plain Python loop."""
    began = time.perf_counter()
    total = 0
    for i in range(n):
        total += i & 3
    return (time.perf_counter() - began) / n
