"""State: all that the page starts with."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, JsonValue

from evolution.play.messages.replies import Data
from evolution.play.messages.requests import (
    MAX_NAME,
    MAX_REPEATS,
    MAX_RUNS,
    MAX_SIDE,
    MAX_VARIANTS,
    Point,
    Scene,
    Variant,
    WorldSettings,
)


class Parameter(Data):
    """A parameter of a controller, or of a costmap.

    Args:
        key: Nav2's dotted name below the controller, or ``local_costmap.…`` and ``global_costmap.…``.
        default: Value of the preset or of the file.
        kind: What the value is.
        unit: Its unit; empty if it has none.
        low: Lower end of the sensible range; None if there is none, as for ``high``.
        high: Upper end.
        choices: The values that are possible; empty if any are.
        text: One sentence on what the parameter does; empty if nothing is known.
    """

    key: str
    default: JsonValue
    kind: Literal["float", "int", "bool", "str", "list"]
    unit: str = ""
    low: float | None = None
    high: float | None = None
    choices: list[str] = Field(default_factory=list)
    text: str = ""


class ControllerState(Data):
    """A controller with its parameters, by preset: the defaults of the presets differ.

    Args:
        name: Name for ``Variant.controller``.
        kind: Its plugin: ``dwb``, ``mppi``, ``rpp``, ``graceful``, ``rotation_shim``; empty for others.
        label: Name for a reader.
        parameters: Its parameters by the names of the presets; none for a controller without Nav2's parameters.
    """

    name: str
    kind: str
    label: str
    parameters: dict[str, list[Parameter]]


class RobotState(Data):
    """A robot: its shape is a polygon, or a disc if ``footprint`` is None."""

    name: str
    radius: float
    footprint: list[Point] | None
    max_linear_velocity: float
    max_angular_velocity: float


class PresetState(Data):
    """A set of parameters.

    Args:
        name: Name for ``WorldSettings.preset``; ``file`` for the parameter file of the command line.
        release: ``humble`` or ``jazzy``.
        label: Name for a reader.
        shared: Parameters of the costmaps.
        robot: The robot where the settings name none.
    """

    name: str
    release: str
    label: str
    shared: list[Parameter]
    robot: RobotState


class Gene(Data):
    """A number that a family of maps is made from; ``whole`` if it has no decimals."""

    name: str
    low: float
    high: float
    default: float
    whole: bool


class FamilyState(Data):
    """A family of random maps; it may have no genes."""

    name: str
    genes: list[Gene]


class MapEntry(Data):
    """A map of the command line, or of the run directory that was named there."""

    name: str
    scene: Scene


class Limits(Data):
    """The largest numbers that the server accepts."""

    side: int = MAX_SIDE
    name: int = MAX_NAME
    repeats: int = MAX_REPEATS
    variants: int = MAX_VARIANTS
    runs: int = MAX_RUNS
    file_bytes: int


class State(Data):
    """All that the page starts with (``GET state``).

    Args:
        version: Of this package.
        scene: The map to begin with.
        settings: The world to begin with.
        variants: The variants to begin with.
        controllers: The controllers that can be chosen.
        presets: The sets of parameters.
        robots: The robots.
        noise_levels: Names of the noise levels.
        families: The families of random maps.
        maps: The maps of the command line.
        limits: The largest numbers.
    """

    version: str
    scene: Scene
    settings: WorldSettings
    variants: list[Variant]
    controllers: list[ControllerState]
    presets: list[PresetState]
    robots: list[RobotState]
    noise_levels: list[str]
    families: list[FamilyState]
    maps: list[MapEntry]
    limits: Limits
