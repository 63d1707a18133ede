"""Requests: what the page asks for. An unknown key, another type or a number out of range is refused in one line."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, JsonValue

from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.files.documents import parse_json
from gym_mapbench.quantities import Natural, NonNegative
from gym_mapbench.settings import Settings

MAX_SIDE = 5_000
"""Most rows, and most columns, of a map."""
MAX_TEXT = 10_000_000
"""Most characters of a message: the cells of a map of 5,000 x 5,000 take 4.2 million, and the unknown ones as many."""
MAX_FILE = 6_000_000
"""Most bytes of a dropped file."""
MAX_NAME = 60
"""Most characters of the name of a map."""
MAX_VARIANTS = 12
MAX_REPEATS = 50
MAX_RUNS = 600
"""Most runs of a background search."""
MAX_VALUES = 200
"""Most changed parameters of a variant."""

PageName = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[\w .,=+-]+$")]
"""A name that the page gives: letters, digits and ``_ .,=+-``; never a module or a file."""
Key = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[\w.]+$")]
"""Nav2's dotted name of a parameter below its controller, or ``local_costmap.…`` and ``global_costmap.…``."""
Point = tuple[float, float]
"""x, y in m."""
PoseTuple = tuple[float, float, float]
"""x, y in m, and the heading in rad."""
PageSeed = Annotated[int, Field(ge=0, lt=2**53)]
"""A seed; JavaScript would round larger whole numbers."""
Values = Annotated[dict[Key, JsonValue], Field(max_length=MAX_VALUES)]


class Scene(Settings):
    """A map with its task.

    Args:
        height: Number of rows.
        width: Number of columns.
        resolution: Side of a cell, m.
        origin: Lower-left corner of cell (0, 0), m.
        cells: Base64 of the occupancy, one bit a cell, row-major from row 0, the first cell in the highest bit; rows
            are not padded.
        unknown: The same for the cells about which nothing is known; empty if all is known.
        start: Where the robot starts.
        goal: Where the robot shall go.
        name: Name of the map in tables and files.
    """

    height: Annotated[int, Field(ge=2, le=MAX_SIDE)]
    width: Annotated[int, Field(ge=2, le=MAX_SIDE)]
    resolution: Annotated[float, Field(ge=0.001, le=10.0)]
    origin: Point
    cells: Annotated[str, Field(max_length=MAX_TEXT)]
    unknown: Annotated[str, Field(max_length=MAX_TEXT)] = ""
    start: PoseTuple
    goal: PoseTuple
    name: Annotated[str, Field(min_length=1, max_length=MAX_NAME, pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")] = "map"


class WorldSettings(Settings):
    """The world of all variants.

    Args:
        preset: Name of one of the state's presets; ``file`` is the parameter file of the command line.
        robot: Name of one of the state's robots; empty for the robot of the preset or of the file.
        robot_radius: Radius of the robot, here a disc, m; None for the shape of the robot.
        noise: Name of one of the state's noise levels.
        seed: Root of all randomness.
        repeats: Runs of each variant.
        shared: Parameters of the costmaps for all variants, by key.
    """

    preset: PageName
    robot: Annotated[str, Field(max_length=80, pattern=r"^[\w .+-]*$")] = ""
    robot_radius: Annotated[float, Field(gt=0, le=5)] | None = None
    noise: PageName = "none"
    seed: PageSeed = 0
    repeats: Annotated[int, Field(ge=1, le=MAX_REPEATS)] = 1
    shared: Values = Field(default_factory=dict)


class Variant(Settings):
    """A controller with some of its parameters changed.

    Args:
        name: PageName in the table; unique.
        controller: Name of one of the state's controllers.
        parameters: The changed parameters, by key.
    """

    name: PageName
    controller: PageName
    parameters: Values = Field(default_factory=dict)


class Session(Settings):
    """All that the page shows: a map, a world and the variants. Saving, exporting and driving start from it."""

    scene: Scene
    settings: WorldSettings
    variants: Annotated[tuple[Variant, ...], Field(min_length=1, max_length=MAX_VARIANTS)]


class Drive(Session):
    """Run every variant; ends whatever is under way. Answers: ``way`` and ``run`` for each run, then ``answer``."""

    type: Literal["drive"] = "drive"
    id: Natural


class AskInstant(Settings):
    """Show what the robot of one run of the last ``drive`` believes at an instant. Answer: ``instant``.

    Args:
        id: The ``drive``.
        variant: Name of the variant.
        repeat: Number of the run, from 0.
        time: Simulated time since the start, s; the last control cycle that is not later is shown.
    """

    type: Literal["instant"] = "instant"
    id: Natural
    variant: PageName
    repeat: Natural = 0
    time: NonNegative


class AskSearch(Settings):
    """Search for changes of the map of the last ``drive``, with its variants. Answers: ``offers``.

    Args:
        id: The ``drive``.
        goal: ``harder``: the best variant needs more time or fails. ``apart``: the times differ more (Gini).
        runs: Most runs on changed maps; every variant drives at least one.
    """

    type: Literal["search"] = "search"
    id: Natural
    goal: Literal["harder", "apart"]
    runs: Annotated[int, Field(ge=1, le=MAX_RUNS)] = 60


class AskWhy(Settings):
    """Remove the obstacles that a verdict of the last ``drive`` does not need. Answers: ``offers`` with one offer.

    Args:
        id: The ``drive``.
        verdict: As for ``mapbench minimize --keep``, e.g. ``dwb fails``; the names are those of the variants.
        runs: Most runs.
    """

    type: Literal["why"] = "why"
    id: Natural
    verdict: Annotated[str, Field(min_length=1, max_length=200)]
    runs: Annotated[int, Field(ge=1, le=MAX_RUNS)] = 200


class Cancel(Settings):
    """End whatever is under way."""

    type: Literal["cancel"] = "cancel"


class AskRandom(Settings):
    """Sample a random map (``POST random``); answers with a scene.

    Args:
        family: Name of one of the state's families.
        seed: Seed of the generator.
        genes: Genes with the values to use; the generator samples the others. Only for families with genes.
    """

    family: PageName
    seed: PageSeed = 0
    genes: Annotated[dict[PageName, float], Field(max_length=40)] = Field(default_factory=dict)


class DroppedFile(Settings):
    """A file that was dropped on the page: its name, and its content in base64."""

    name: Annotated[str, Field(min_length=1, max_length=120, pattern=r"^\w[\w .,()+=-]*$")]
    content: Annotated[str, Field(max_length=MAX_FILE * 4 // 3 + 4)]


class AskOpen(Settings):
    """Read dropped files (``POST open``): a map with the files that belong to it. Answers with a list of scenes."""

    files: Annotated[tuple[DroppedFile, ...], Field(min_length=1, max_length=8)]


class AskParameters(Session):
    """Save the parameters of a variant (``POST save/params``); answers with a ``nav2_params.yaml``."""

    variant: PageName


Request = Drive | AskInstant | AskSearch | AskWhy | Cancel
REQUESTS: dict[str, type[Request]] = {
    "drive": Drive,
    "instant": AskInstant,
    "search": AskSearch,
    "why": AskWhy,
    "cancel": Cancel,
}
"""The messages of the page by their ``type``."""


def read_request(text: str) -> Request:
    """Read a message of the page.

    Raises:
        ConfigError: If it is not JSON, of no known type, or one of its values cannot be used.
    """
    if len(text) > MAX_TEXT:
        raise ConfigError(f"message: expected at most {MAX_TEXT} characters, got {len(text)}")
    document = parse_json(text, "message", ConfigError)
    name = document.get("type") if isinstance(document, dict) else None
    if not isinstance(name, str) or name not in REQUESTS:
        raise unknown_name("type of message", name, REQUESTS)
    return REQUESTS[name].from_mapping(document, name)
