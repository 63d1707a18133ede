"""Instants: what a robot believes and considers at one moment of a run, by running it again up to that moment."""

from __future__ import annotations

import base64
import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.base import Controller
from controllers.navigator.navigator import Navigator
from evolution.driving import Job, RunResult, record
from evolution.play.messages.replies import CostGrid
from evolution.play.streaming import Address, send
from evolution.play.thoughts import thoughts_of
from gym_mapbench.costmap import Costmap
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.world.frames import IDENTITY, compose
from gym_mapbench.world.scenario import Pose

MAX_CELLS = 2_000_000
"""Most cells of a costmap that is sent."""
MAX_POINTS = 2_000
"""Most points of a global plan that are sent."""


class SeenError(Exception):
    """All moments have been seen, so the run ends."""


@dataclass
class Look:
    """Watches a run at some moments.

    Args:
        environment: The env of the run.
        times: The moments, s, ascending.
        show: Takes the fields of :class:`~evolution.play.messages.replies.Instant` at each moment.
    """

    environment: EnvConfig
    times: list[float]
    show: Callable[[dict[str, Any]], object]
    controller: Controller | None = None
    observation: dict[str, Any] = field(default_factory=dict)
    info: dict[str, Any] = field(default_factory=dict)
    calls: int = 0

    def step(self, observation: dict[str, Any], info: dict[str, Any]) -> None:
        """Remember what the env gives, before the controller sees it."""
        self.observation, self.info, self.calls = observation, info, _calls(self.controller)

    def watch(self, controller: Controller) -> None:
        """Show the moments before the next cycle; the controller has just decided. After the last, the run ends."""
        self.controller = controller
        next_time = self.info["time"] + 1.0 / self.environment.control_hz
        while self.times and next_time > self.times[0] + 1e-9:
            self.times.pop(0)
            self.show(self.fields())
        if not self.times:
            raise SeenError

    def fields(self) -> dict[str, Any]:
        """Return the fields of :class:`~evolution.play.messages.replies.Instant` but those that say which run it is."""
        x, y, yaw = self.info["pose"].tolist()
        seen = {
            "time": float(self.info["time"]),
            "pose": (x, y, yaw),
            "velocity": tuple(self.info["velocity"].tolist()),
        }
        if isinstance(self.controller, Navigator):
            return seen | self._of(self.controller)
        unknown = dict.fromkeys(("command", "local", "global_costmap", "thoughts"))
        return seen | unknown | {"believed": (x, y, yaw), "plan": [], "lidar": self._lidar(Pose(x, y, yaw))}

    def _of(self, navigator: Navigator) -> dict[str, Any]:
        """Return what one of Nav2's controllers believes."""
        local = navigator.seen_costmap
        decided = navigator.controller_calls > self.calls
        path = navigator.path[:: 1 + len(navigator.path) // MAX_POINTS]
        return {
            "believed": tuple(local.estimate),
            "command": tuple(navigator.cmd_vel),
            "plan": points(path),
            "local": grid_of(local.costmap, local.frame),
            "global_costmap": grid_of(navigator.global_costmap, IDENTITY),
            "lidar": self._lidar(local.estimate),
            "thoughts": thoughts_of(navigator, local.frame) if decided else None,
        }

    def _lidar(self, robot: Pose) -> list[tuple[float, float]]:
        """Return where the beams that hit something ended, for a robot at a pose."""
        scan = self.observation.get("scan")
        if scan is None:
            return []
        lidar = self.environment.mounted_lidar
        sensor, hits = lidar.sensor_pose(robot), (scan > 0.0) & (scan < lidar.range_max)
        angles, ranges = (sensor.yaw + lidar.angles)[hits], scan[hits].astype(np.float64)
        return points(np.column_stack([sensor.x + ranges * np.cos(angles), sensor.y + ranges * np.sin(angles)]))


def look(times: Sequence[float], address: Address, job: Job) -> RunResult:
    """Run a job up to some moments, in a worker, and send what :meth:`Look.fields` returns at each.

    Of the moments after the end, the last cycle is sent once.

    Args:
        times: The moments, s, ascending.
        address: Where to send them.
        job: The run.
    """
    with address.connect(job) as channel:
        seen = Look(job.settings.environment, list(times), partial(send, channel))
        with contextlib.suppress(SeenError):
            record(job, seen.watch, seen.step)
        if seen.times:
            seen.show(seen.fields())
    return RunResult("timeout", time_s=times[-1], path_length_m=0.0)


def grid_of(costmap: Costmap, frame: Pose) -> CostGrid | None:
    """Return a costmap in the map; None if it is too large to be sent.

    Args:
        costmap: The costmap, in a frame of its own.
        frame: Pose of that frame in the map.
    """
    rows, cols = costmap.costs.shape
    if rows * cols > MAX_CELLS:
        return None
    corner = compose(frame, Pose(costmap.origin_x, costmap.origin_y))
    return CostGrid(
        origin=(corner.x, corner.y),
        yaw=frame.yaw,
        resolution=costmap.resolution,
        height=rows,
        width=cols,
        costs=base64.b64encode(costmap.costs.tobytes()).decode(),
    )


def points(places: NDArray[np.floating]) -> list[tuple[float, float]]:
    """Return x and y of places, m, to the millimetre."""
    return [(x, y) for x, y in np.round(places[:, :2].astype(np.float64), 3).tolist()]


def _calls(controller: Controller | None) -> int:
    return controller.controller_calls if isinstance(controller, Navigator) else 0
