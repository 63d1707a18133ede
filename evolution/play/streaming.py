"""Streaming: runs in worker processes that send their poses while they drive, and that end when they are not wanted.

A worker connects to the server for each run, and begins once the server says so. The server sends a message, or closes
the connection, to end the run. No worker process is killed for that, so the next run begins at once.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from multiprocessing.connection import Client, Connection
from typing import Any

from evolution.driving import Job, RunResult, run_job

BEGIN, END = "begin", "end"
"""What the server sends to begin and to end a run; it sends nothing else."""
BATCH_SECONDS = 0.02
"""Wall-clock time between two messages of a run."""
Waypoint = tuple[float, float, float, float]


class CancelledError(Exception):
    """The run is not wanted any more."""

    def __str__(self) -> str:
        return "the run was cancelled"


@dataclass(frozen=True)
class Address:
    """Where the server listens.

    Args:
        place: Address of the listener.
        key: Secret that both sides know.
        number: Number of the batch of runs; the server refuses those of former batches.
    """

    place: str
    key: bytes
    number: int

    def connect(self, job: Job) -> Connection:
        """Connect to the server for a run.

        Raises:
            CancelledError: If the server does not listen any more, or refuses the run.
        """
        try:
            channel = Client(self.place, authkey=self.key)
            channel.send((self.number, job.key))
            channel.recv()
        except (OSError, EOFError):
            raise CancelledError from None
        return channel


@dataclass(frozen=True)
class Part:
    """A further part of the way of a run.

    Args:
        first: Number of poses that were sent before.
        poses: ``(t, x, y, yaw)`` after each step, s, m, rad.
    """

    first: int
    poses: list[Waypoint]


@dataclass
class Poses:
    """Collects the poses of a run and sends them in batches.

    Args:
        channel: The connection to the server.
    """

    channel: Connection
    waiting: list[Waypoint] = field(default_factory=list)
    sent: int = 0
    next_time: float = -math.inf

    def add(self, _observation: dict[str, Any], info: dict[str, Any]) -> None:
        """Add the pose of a step.

        Raises:
            CancelledError: If the run is not wanted any more.
        """
        x, y, yaw = info["pose"].tolist()
        self.waiting.append((float(info["time"]), x, y, yaw))
        if time.perf_counter() >= self.next_time:
            self.send()

    def send(self) -> None:
        """Send what was collected; errors as for :meth:`add`."""
        send(self.channel, Part(self.sent, self.waiting))
        self.sent += len(self.waiting)
        self.waiting = []
        self.next_time = time.perf_counter() + BATCH_SECONDS


def run_streamed(address: Address, job: Job) -> RunResult:
    """Run a job as ``mapbench bench`` does, and send its poses while it runs."""
    with address.connect(job) as channel:
        poses = Poses(channel)
        result = run_job(job, poses.add)
        poses.send()
    return result


def run_silently(address: Address, job: Job) -> RunResult:
    """Run a job that can be cancelled, without sending its poses."""
    next_time = time.perf_counter()

    def look(_observation: dict[str, Any], _info: dict[str, Any]) -> None:
        nonlocal next_time
        if time.perf_counter() >= next_time:
            refuse_if_cancelled(channel)
            next_time = time.perf_counter() + BATCH_SECONDS

    with address.connect(job) as channel:
        return run_job(job, look)


def send(channel: Connection, message: object) -> None:
    """Send a message to the server.

    Raises:
        CancelledError: If the run is not wanted any more.
    """
    refuse_if_cancelled(channel)
    try:
        channel.send(message)
    except OSError:
        raise CancelledError from None


def refuse_if_cancelled(channel: Connection) -> None:
    """Raise ``CancelledError`` if the server has sent something, or has closed the connection."""
    if channel.poll():
        raise CancelledError
