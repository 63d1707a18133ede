"""Motions: the pose of a body as a function of time.

A new kind of motion is one class and one line in :data:`MOTIONS`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, JsonValue, model_validator

from gym_mapbench.errors import ConfigError
from gym_mapbench.registry import Registry, must_be_callable
from gym_mapbench.settings import Settings
from gym_mapbench.world.pedestrians import Coordinate, Course, Scripted, SocialForce, Wander

Floats = NDArray[np.float64]


class Motion(Protocol):
    """The pose of a body as a function of time: the same times give the same poses."""

    def at(self, times: Floats) -> Floats:
        """Return the poses ``(n, 3)`` x, y (m), yaw (rad) on the map at ``(n,)`` simulated seconds since the start."""
        ...


class Line(Settings):
    """A body moves from ``start`` to ``end`` at a constant speed, turns on the spot, moves back, and so on.

    Args:
        start: ``(x, y)`` at time 0, m.
        end: ``(x, y)`` where the body turns round, m; the body stands still if this is ``start``.
        speed: Speed, m/s; the fastest body moves by 0.05 m in a physics step of 0.01 s.
    """

    start: tuple[Coordinate, Coordinate]
    end: tuple[Coordinate, Coordinate]
    speed: Annotated[float, Field(ge=0, le=5)]

    def at(self, times: Floats) -> Floats:
        """As :meth:`Motion.at`."""
        dx, dy = self.end[0] - self.start[0], self.end[1] - self.start[1]
        length, heading = math.hypot(dx, dy), math.atan2(dy, dx)
        if not length:
            return np.tile([*self.start, 0.0], (len(times), 1))
        driven = np.fmod(self.speed * times, 2 * length)
        share = 1.0 - np.abs(driven / length - 1.0)
        back = heading - math.pi if heading > 0 else heading + math.pi
        yaw = np.where(driven < length, heading, back)
        return np.stack([self.start[0] + share * dx, self.start[1] + share * dy, yaw], axis=1)


MOTIONS: Registry[Callable[..., Motion | SocialForce]] = Registry(
    "motion",
    "motions",
    {"line": Line, "scripted": Scripted, "wander": Wander, "social_force": SocialForce},
    check=must_be_callable,
)
"""Motions of bodies by name; each is made of its options by keyword.

All but ``social_force`` are functions of time; those people react, and :mod:`gym_mapbench.world.crowd` moves them.
"""


class MotionSpec(Settings):
    """A motion as data, JSON-able.

    Args:
        name: One of :data:`MOTIONS`.
        options: Options of the motion.

    Raises:
        ConfigError: If there is no such motion, or an option is unknown, missing or bad.
    """

    name: Annotated[str, Field(min_length=1)]
    options: dict[str, JsonValue] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _exists(self) -> MotionSpec:
        _ = self.motion
        return self

    def __getstate__(self) -> dict[Any, Any]:
        """Return what is pickled: the data alone; whoever reads it makes the motion by its name."""
        state = super().__getstate__()
        return {**state, "__dict__": {name: getattr(self, name) for name in type(self).model_fields}}

    @cached_property
    def motion(self) -> Motion | SocialForce:
        """The motion itself."""
        make = MOTIONS.get(self.name)
        try:
            with MOTIONS.blamed(self.name):
                return make(**self.options)
        except ConfigError as error:
            raise ConfigError(f"{self.name}: {error}") from None

    @cached_property
    def keeps_to_course(self) -> bool:
        """Whether the motion has a course, which has to stay clear of walls."""
        return isinstance(self.motion, Course)

    @cached_property
    def text(self) -> str:
        """The motion as JSON, which says all there is to know of it."""
        return self.model_dump_json()

    def __hash__(self) -> int:
        return hash(self.text)
