"""Bodies: what moves through a world besides the robot, as frozen data of a scenario.

A body has a shape and a motion (:mod:`gym_mapbench.world.motions`). Nothing stops a body: neither walls nor the robot.
A body with a course (:class:`~gym_mapbench.world.pedestrians.Course`) is refused if its course meets a wall.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from pydantic import Field

from gym_mapbench.errors import ConfigError
from gym_mapbench.settings import Settings
from gym_mapbench.world.motions import MOTIONS, Floats, MotionSpec
from gym_mapbench.world.pedestrians import SocialForce


class Disc(Settings):
    """The shape of a body.

    Args:
        radius: Radius, m; a person's by default.
    """

    radius: Annotated[float, Field(gt=0, le=100)] = 0.25


class Body(Settings):
    """A moving obstacle.

    Args:
        shape: Its shape, around its pose.
        motion: Name and options of its motion: ``{name: line, options: {start: [1, 1], end: [3, 1], speed: 0.5}}``.
    """

    shape: Disc = Disc()
    motion: MotionSpec


def place_bodies(bodies: Sequence[Body], times: Floats) -> Floats:
    """Return where bodies are whose motion is a function of time: ``(times, bodies, 3)`` x, y (m), yaw (rad).

    :func:`gym_mapbench.world.crowd.place_crowd` does so for all bodies.

    Args:
        bodies: Bodies that do not move by social forces.
        times: ``(n,)`` simulated seconds since the start.

    Raises:
        ConfigError: If a motion returns anything but a finite pose for every time.
        PluginError: If a third party's motion fails.
    """
    sent = np.ascontiguousarray(times, dtype=np.float64).tobytes()
    poses: Floats = np.empty((len(times), len(bodies), 3))
    for number, body in enumerate(bodies):
        poses[:, number] = _poses(number, body.motion, sent)
    return poses


@functools.lru_cache(maxsize=512)
def _poses(number: int, spec: MotionSpec, sent: bytes) -> Floats:
    """Return the poses ``(times, 3)`` of one body; kept, because every reset asks for the same ones.

    Args:
        number: Number of the body, for messages.
        spec: Its motion.
        sent: The times as bytes.
    """
    times, poses = np.frombuffer(sent), _ask(spec, sent)
    if poses.shape != (len(times), 3):
        raise ConfigError(f"body {number} ({spec.name}): expected poses {(len(times), 3)}, got {poses.shape}")
    if not np.isfinite(poses).all():
        bad = times[~np.isfinite(poses).all(axis=1)][0]
        raise ConfigError(f"body {number} ({spec.name}): expected a finite pose at all times, got none at {bad:g} s")
    if spec.name not in MOTIONS.built_in and not np.array_equal(poses, _ask(spec, sent)):
        raise ConfigError(f"body {number} ({spec.name}): expected the same poses at the same times, got others")
    return poses


def _ask(spec: MotionSpec, sent: bytes) -> Floats:
    """Ask a motion for its poses, in an array of its own."""
    assert not isinstance(spec.motion, SocialForce)
    with MOTIONS.blamed(spec.name):
        return np.array(spec.motion.at(np.frombuffer(sent).copy()), dtype=np.float64)
