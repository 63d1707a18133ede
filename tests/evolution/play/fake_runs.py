"""Runs for a track that drive nothing: importable by worker processes."""

from __future__ import annotations

import os
import time

from evolution.driving import RunResult
from evolution.play.streaming import Part, send


def count(address, job):
    """Send three messages, then say in which process."""
    with address.connect(job) as channel:
        for number in range(3):
            send(channel, Part(number, [(float(number), 0.0, 0.0, 0.0)]))
    return RunResult("goal", time_s=1.0, path_length_m=0.0, reason=str(os.getpid()))


def go_on(address, job):
    """Send messages until the run is cancelled."""
    with address.connect(job) as channel:
        while True:
            send(channel, Part(0, []))
            time.sleep(0.001)


def hang(address, job):
    """Send a message, and never look whether the run is cancelled."""
    with address.connect(job) as channel:
        send(channel, Part(0, []))
        time.sleep(600.0)
