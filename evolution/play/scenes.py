"""Scenes: maps with their tasks, to and from the page, from dropped files, and sampled from families."""

from __future__ import annotations

import base64
import binascii
import re
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import scipy
import yaml
from numpy.typing import NDArray

from evolution.files import temporary_directory
from evolution.play.messages.requests import MAX_NAME, MAX_SIDE, AskOpen, AskRandom, DroppedFile, Scene
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError, MapBenchError, refuse_unknown
from gym_mapbench.generator import FAMILIES, FamilySpec, draw_from
from gym_mapbench.mapio import TaskedMap, group_scenarios, load_maps
from gym_mapbench.mapio.map_server import SUFFIXES, map_server_files
from gym_mapbench.mapio.source import file_inside, file_named, read_yaml_file
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

Cells = NDArray[np.bool_]

READ_FIRST = (".json", ".scen", ".world", ".yaml", ".yml", ".map")
"""Ends of names of dropped files, in the order in which one of several files is taken for the map."""
POSES = "_poses"
ROOM = 0.4
"""Distance that start and goal of a map without a task keep from obstacles where the map has room, m."""


def scenario_of(scene: Scene) -> Scenario:
    """Return the scenario of a scene.

    Raises:
        ConfigError: If the cells are not those of the map's size, or start or goal is not on a free cell.
    """
    shape = scene.height, scene.width
    occupancy = _unpacked("cells", scene.cells, shape)
    unknown = _unpacked("unknown", scene.unknown, shape) if scene.unknown else None
    grid = GridMap(occupancy, scene.resolution, scene.origin, unknown)
    return Scenario(grid, Pose(*scene.start), Pose(*scene.goal), scene.name)


def scene_of(scenario: Scenario) -> Scene:
    """Return the scene of a scenario.

    Raises:
        ConfigError: If the map is too large for the page, or bodies move on it.
    """
    grid = scenario.map
    if max(grid.shape) > MAX_SIDE:
        raise ConfigError(f"{scenario.name}: expected at most {MAX_SIDE} rows and columns, got {grid.shape}")
    if scenario.bodies:
        raise ConfigError(f"{scenario.name}: expected a map without moving bodies, which the playground cannot hold")
    return Scene(
        height=grid.shape[0],
        width=grid.shape[1],
        resolution=grid.resolution,
        origin=grid.origin,
        cells=_packed(grid.occupancy),
        unknown="" if grid.unknown is None else _packed(grid.unknown),
        start=tuple(scenario.start),
        goal=tuple(scenario.goal),
        name=_file_name(scenario.name),
    )


def changed_name(name: str, end: str) -> str:
    """Return the name of a changed map, with this end; it is no longer than a scene's may be.

    No command takes a changed map for the file of the first, as their names differ.
    """
    return name.removesuffix(end)[: MAX_NAME - len(end)] + end


def opened(dropped: AskOpen) -> list[Scene]:
    """Return the maps of dropped files; a map without a task gets one.

    Raises:
        ConfigError: If a map cannot be shown.
        MapFormatError: If the files are no map.
    """
    with TemporaryDirectory(dir=temporary_directory()) as folder:
        for file in dropped.files:
            (Path(folder) / file.name).write_bytes(_decoded(file.name, file.content))
        paths = [Path(folder) / file.name for file in sorted(dropped.files, key=_place)]
        try:
            for path in paths:
                _take_dropped_picture(path)
            maps = load_maps(paths[0])
        except MapBenchError as error:
            raise type(error)(str(error).replace(f"{folder}/", "")) from None
    return [scene_of(scenario) for tasked in maps for scenario in _with_task(tasked)]


def _take_dropped_picture(path: Path) -> None:
    """Let a map_server file name the picture beside it if the file names a picture of the same name elsewhere.

    Raises:
        MapFormatError: If it names another picture elsewhere, since the page reads no file that was not dropped; or if
            it is damaged.
    """
    document = read_yaml_file(path) if path.suffix.lower() in SUFFIXES else None
    if not isinstance(document, Mapping) or "image" not in document:
        return
    named = file_named(path.parent, document["image"], f"{path}: image")
    beside = path.parent / named.name
    if not beside.is_file():
        file_inside(path.parent, document["image"], f"{path}: image")
    elif named != beside:
        document = read_yaml_file(path, each_key_once=True)
        path.write_text(yaml.safe_dump({**document, "image": beside.name}), encoding="utf-8")


def sampled(asked: AskRandom, config: EnvConfig) -> Scene:
    """Return a random map of a family on which the robot can get from start to goal.

    Args:
        asked: The family, the seed, and the genes that are not sampled.
        config: Gives size and resolution, and the robot.

    Raises:
        ConfigError: If there is no such family or gene, or the family has no such map.
    """
    refuse_unknown("family", asked.family, FAMILIES.names())
    options = FamilySpec(name=asked.family).make()
    ranges = {name: _fixed(getattr(options, name, None), value) for name, value in asked.genes.items()}
    spec = FamilySpec(name=asked.family, options=ranges)
    drawn = draw_from(np.random.default_rng(asked.seed), (spec,), config.shapes, config.robot)
    return scene_of(config.make_scenario(GridMap(drawn.cells, config.shapes.resolution), asked.family))


def map_files(scenario: Scenario) -> dict[str, bytes]:
    """Return the files of a map for Nav2's map_server, its picture, and its start and goal."""
    files = map_server_files(group_scenarios([scenario]))
    return {name: text if isinstance(text, bytes) else text.encode() for name, text in files.items()}


def _fixed(own: object, value: float) -> list[float] | float:
    """Return the option of a family that fixes a gene: a range without width, or a number."""
    numbers = own if isinstance(own, tuple) else (own,)
    fixed = round(value) if all(isinstance(number, int) for number in numbers) else value
    return [fixed, fixed] if isinstance(own, tuple) else fixed


def _unpacked(what: str, text: str, shape: tuple[int, int]) -> Cells:
    rows, cols = shape
    packed = np.frombuffer(_decoded(what, text), dtype=np.uint8)
    if len(packed) != (rows * cols + 7) // 8:
        raise ConfigError(f"{what}: expected {rows * cols} cells, a bit each, got {len(packed)} bytes")
    return np.unpackbits(packed, count=rows * cols).reshape(shape).astype(np.bool_)


def _packed(cells: Cells) -> str:
    return base64.b64encode(np.packbits(cells).tobytes()).decode()


def _decoded(what: str, text: str) -> bytes:
    try:
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        raise ConfigError(f"{what}: expected base64, got something else") from None


def _place(file: DroppedFile) -> tuple[int, bool]:
    """Return the rank of a dropped file: the lowest is taken for the map."""
    path = Path(file.name)
    suffix = path.suffix.lower()
    return READ_FIRST.index(suffix) if suffix in READ_FIRST else len(READ_FIRST), path.stem.endswith(POSES)


def _with_task(tasked: TaskedMap) -> list[Scenario]:
    if tasked.tasks:
        return tasked.scenarios()
    return [Scenario(tasked.grid, *_far_apart(tasked.grid), tasked.name)]


def _far_apart(grid: GridMap) -> tuple[Pose, Pose]:
    """Return a start near the lower left and a goal near the upper right, away from obstacles where there is room.

    Raises:
        ConfigError: If no cell is free.
    """
    blocked = grid.occupancy if grid.unknown is None else grid.occupancy | grid.unknown
    distance = scipy.ndimage.distance_transform_edt(np.pad(~blocked, 1))[1:-1, 1:-1] * grid.resolution
    cells = np.argwhere(~blocked & (distance >= min(ROOM, distance.max())))
    if not len(cells) or not distance.max():
        raise ConfigError("map: expected a free cell, got none")
    order = cells.sum(axis=1)
    (start, goal) = (grid.cell_to_world(*cells[int(at)].tolist()) for at in (order.argmin(), order.argmax()))
    return Pose(*start), Pose(*goal)


def _file_name(name: str) -> str:
    """Return a name that can be a file name everywhere."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name).lstrip("_.-")[:MAX_NAME] or "map"
