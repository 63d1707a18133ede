"""Nav2's map_server format: ``NAME.yaml`` and its picture.

Source: nav2_map_server/src/map_io.cpp (Humble) for the values of the cells, and
nav2_costmap_2d/plugins/static_layer.cpp with its default parameters (``trinary_costmap``,
``lethal_cost_threshold`` 100) for what counts as a wall: only cells of value 100; graded values
below it are free.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from numpy.typing import NDArray

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio.image import Picture, grey_levels, look_up, read_picture
from gym_mapbench.mapio.netpbm import encode_pgm
from gym_mapbench.mapio.output import Files, check_names
from gym_mapbench.mapio.people import find_people, people_yaml, read_people
from gym_mapbench.mapio.poses import find_poses, poses_yaml, read_poses, yaml_float
from gym_mapbench.mapio.source import as_number, as_numbers, file_named, files_ending, read_yaml_file, short
from gym_mapbench.mapio.tasked_map import TaskedMap, name_tasks
from gym_mapbench.world.gridmap import GridMap

LOG = logging.getLogger(__name__)

SUFFIXES = (".yaml", ".yml")

OCCUPIED_THRESH = 0.65
FREE_THRESH = 0.25
FREE_THRESH_BELOW_UNKNOWN = 0.196
"""The grey value 205 of unknown cells is an occupancy of 0.19608: with 0.25 they would be read back as free."""

UNKNOWN = -1
LETHAL = 100

Values = NDArray[np.int8]


class _Thresholds(NamedTuple):
    """How to read a brightness: the keys of the same names in the YAML file."""

    negate: bool
    occupied_thresh: float
    free_thresh: float


def files_beside(path: Path) -> list[Path]:
    """Return the files with the task and the people of ``NAME.yaml``, where there are any."""
    return [file for file in (find_poses(path), find_people(path)) if file is not None]


def read_map_server(path: Path) -> list[TaskedMap]:
    """Read ``NAME.yaml``, its picture, and its ``NAME_poses.yaml`` and ``NAME_people.yaml``, where there are any.

    As in Nav2, the name of the picture is relative to the folder of the YAML file, or absolute.

    Raises:
        MapFormatError: If one of the files is damaged, or there are people and no poses.
    """
    grid = read_map_server_grid(path)
    poses, people = find_poses(path), find_people(path)
    tasks = name_tasks(path.stem, [read_poses(poses)] if poses else [])
    if people and not tasks:
        raise MapFormatError(f"{people}: expected start and goal beside it, in {path.stem}_poses.yaml")
    if people:
        tasks = (tasks[0]._replace(bodies=read_people(people)),)
    return [TaskedMap(path.stem, grid, tasks)]


def find_map_files(folder: Path) -> list[Path]:
    """Return the map files of a folder, or of ``maps/`` in it, by name; other YAML files are passed over."""
    for place in (folder, folder / "maps"):
        files = [file for file in files_ending(place, SUFFIXES) if _names_image(file)]
        if files:
            return files
    return []


class Occupancy(NamedTuple):
    """An occupancy grid, as Nav2's map server publishes it.

    Args:
        values: ``(rows, cols)`` int8, row 0 at the bottom: 0 to 100, -1 unknown.
        resolution: Side of a cell, m.
        origin: x and y of the lower-left corner, m.
    """

    values: Values
    resolution: float
    origin: tuple[float, float]


def read_map_server_grid(path: Path) -> GridMap:
    """Read the map alone; see :func:`read_map_server`. A warning names values between free and occupied."""
    values, resolution, origin = read_occupancy(path)
    graded = int(((values > 0) & (values < LETHAL)).sum())
    if graded:
        said = "%s: %d cells have values of 1 to 99 and are free here; Nav2 differs with %s"
        LOG.warning(said, path, graded, "lethal_cost_threshold below 100 or trinary_costmap false")
    image = values[::-1]
    return GridMap.from_image_array(image == LETHAL, resolution, origin=origin, unknown=image == UNKNOWN)


def read_occupancy(path: Path) -> Occupancy:
    """Read the values of ``NAME.yaml`` and its picture, those between free and occupied included.

    Nav2's costmaps and filters ignore the yaw of the origin; so does this function, and a warning says so.

    Raises:
        MapFormatError: If one of the files is damaged or missing.
    """
    info = _required(path, read_yaml_file(path, each_key_once=True))
    mode = info.get("mode", "trinary")
    read = _MODES.get(mode.lower()) if isinstance(mode, str) else None
    if read is None:
        raise MapFormatError(f"{path}: mode: expected one of {', '.join(_MODES)}, got {short(mode)}")
    resolution = as_number(f"{path}: resolution", info["resolution"])
    x, y, yaw = as_numbers(f"{path}: origin", info["origin"], 3)
    if resolution <= 0:
        raise MapFormatError(f"{path}: resolution: expected metres per cell > 0, got {resolution:g}")
    if yaw != 0:
        LOG.warning("%s: origin: the yaw %g is ignored, as in Nav2's costmaps", path, yaw)
    picture = read_picture(file_named(path.parent, info["image"], f"{path}: image"))
    values = read(picture, _thresholds(path, info, apart=read is _scale))
    return Occupancy(values[::-1], resolution, (x, y))


def occupancy_files(name: str, grid: Occupancy) -> Files:
    """Return ``NAME.yaml`` and ``NAME.pgm``, from which :func:`read_occupancy` returns equal values (``raw``)."""
    info = {"image": f"{name}.pgm", "mode": "raw", "resolution": grid.resolution, "origin": [*grid.origin, 0.0]}
    thresholds = {"negate": 0, "occupied_thresh": OCCUPIED_THRESH, "free_thresh": FREE_THRESH}
    text = yaml.safe_dump(info | thresholds, sort_keys=False)
    return {f"{name}.yaml": text, f"{name}.pgm": encode_pgm(grid.values[::-1].astype(np.uint8))}


def map_server_yaml(grid: GridMap, image: str) -> str:
    """Return the text of ``NAME.yaml`` for a picture written with :func:`map_server_pgm`."""
    x, y = (yaml_float(value) for value in grid.origin)
    free_thresh = FREE_THRESH if grid.unknown is None else FREE_THRESH_BELOW_UNKNOWN
    return (
        f"image: {image}\nmode: trinary\nresolution: {yaml_float(grid.resolution)}\norigin: [{x}, {y}, 0.0]\n"
        f"negate: 0\noccupied_thresh: {OCCUPIED_THRESH}\nfree_thresh: {free_thresh}\n"
    )


def map_server_pgm(grid: GridMap) -> bytes:
    """Return the P5 picture: 0 occupied, 254 free, 205 unknown."""
    return encode_pgm(grey_levels(grid))


def map_server_files(maps: Sequence[TaskedMap]) -> Files:
    """Return ``NAME.pgm``, ``NAME.yaml`` and, where a task is known, ``NAME_poses.yaml`` of every map.

    A task among moving bodies has a ``NAME_people.yaml``, too. A map with several tasks is written once for each task,
    since a poses file holds only one.

    Raises:
        ConfigError: If a name cannot be a file name or comes twice.
    """
    named = [(name, tasked.grid) for tasked in maps for name in tasked.names]
    tasks = [task for tasked in maps for task in tasked.tasks]
    check_names(
        "map", [name for name, _ in named], [f"{task.name}_{what}" for task in tasks for what in ("poses", "people")]
    )
    files: Files = {}
    for name, grid in named:
        files[f"{name}.pgm"] = map_server_pgm(grid)
        files[f"{name}.yaml"] = map_server_yaml(grid, f"{name}.pgm")
    for task in tasks:
        files[f"{task.name}_poses.yaml"] = poses_yaml([task.start, task.goal])
        if task.bodies:
            files[f"{task.name}_people.yaml"] = people_yaml(task.bodies)
    return files


def _names_image(path: Path) -> bool:
    document = read_yaml_file(path)
    return isinstance(document, Mapping) and "image" in document


def _required(path: Path, document: object) -> Mapping[Any, Any]:
    """Check that the keys Nav2 demands are there."""
    if not isinstance(document, Mapping):
        raise MapFormatError(f"{path}: expected the keys of a map_server file, got {short(document)}")
    for key in ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"):
        if key not in document:
            raise MapFormatError(f"{path}: not a map_server file: the key {key!r} is missing")
    return document


def _thresholds(path: Path, info: Mapping[Any, Any], *, apart: bool) -> _Thresholds:
    """Read the keys about brightness; values between the thresholds need these ``apart``."""
    negate = info["negate"]
    if not isinstance(negate, (bool, int)) or negate not in (0, 1):
        raise MapFormatError(f"{path}: negate: expected 0 or 1, got {short(negate)}")
    occupied, free = (_fraction(f"{path}: {key}", info[key]) for key in ("occupied_thresh", "free_thresh"))
    if free > occupied or (apart and free == occupied):
        expected = f"{'less than' if apart else 'at most'} occupied_thresh {occupied:g}"
        raise MapFormatError(f"{path}: free_thresh: expected {expected}, got {free:g}")
    return _Thresholds(bool(negate), occupied, free)


def _fraction(where: str, value: object) -> float:
    fraction = as_number(where, value)
    if not 0 <= fraction <= 1:
        raise MapFormatError(f"{where}: expected 0..1, got {fraction:g}")
    return fraction


def _occupancy(
    picture: Picture, thresholds: _Thresholds, with_alpha: bool
) -> tuple[NDArray[np.unsignedinteger], NDArray[np.float64]]:
    """Return every pixel's level and each level's occupancy in 0..1, before thresholding."""
    total, brightness = picture.levels(with_alpha)
    return total, brightness if thresholds.negate else 1.0 - brightness


def _trinary(picture: Picture, thresholds: _Thresholds) -> Values:
    total, occupancy = _occupancy(picture, thresholds, with_alpha=True)
    values = np.full(len(occupancy), UNKNOWN, np.int8)
    values[occupancy < thresholds.free_thresh] = 0
    values[occupancy > thresholds.occupied_thresh] = LETHAL
    return look_up(values, total)


def _scale(picture: Picture, thresholds: _Thresholds) -> Values:
    """Like :func:`_trinary`, with values in between; a pixel that is not opaque is unknown."""
    total, occupancy = _occupancy(picture, thresholds, with_alpha=False)
    span = thresholds.occupied_thresh - thresholds.free_thresh
    graded = np.rint((occupancy - thresholds.free_thresh) / span * 100.0)
    graded[occupancy < thresholds.free_thresh] = 0
    graded[occupancy > thresholds.occupied_thresh] = LETHAL
    values = look_up(np.clip(graded, 0, LETHAL).astype(np.int8), total)
    if picture.alpha is not None:
        values[picture.alpha < picture.white] = UNKNOWN
    return values


def _raw(picture: Picture, _: _Thresholds) -> Values:
    """Grey values 0..100 are the values themselves, whatever ``negate`` says; all others are unknown."""
    total, brightness = picture.levels(with_alpha=False)
    percent = np.floor(brightness * 255 + 0.5)
    return look_up(np.where(percent <= LETHAL, percent, UNKNOWN).astype(np.int8), total)


_MODES: dict[str, Callable[[Picture, _Thresholds], Values]] = {"trinary": _trinary, "scale": _scale, "raw": _raw}
