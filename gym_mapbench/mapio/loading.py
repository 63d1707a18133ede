"""One way in for every map format: by the name of the file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gym_mapbench.errors import ConfigError, MapFormatError
from gym_mapbench.generator import ShapeSettings, default_task, task_cells
from gym_mapbench.gridmap import GridMap
from gym_mapbench.mapio.barn import read_barn, read_barn_folder, world_files
from gym_mapbench.mapio.bundle import BEST_MAP_SET, MAP_SET_FILE, read_bundle
from gym_mapbench.mapio.image import DEFAULT_RESOLUTION as IMAGE_RESOLUTION
from gym_mapbench.mapio.image import DEFAULT_THRESHOLD, IMAGE_SUFFIXES, read_image
from gym_mapbench.mapio.map_server import find_map_files, read_map_server
from gym_mapbench.mapio.movingai import DEFAULT_RESOLUTION as MOVINGAI_RESOLUTION
from gym_mapbench.mapio.movingai import read_movingai
from gym_mapbench.mapio.mrpb import MAP as MRPB_MAP
from gym_mapbench.mapio.mrpb import TASKS as MRPB_TASKS
from gym_mapbench.mapio.mrpb import find_tests, read_mrpb, read_mrpb_folder
from gym_mapbench.mapio.poses import find_poses
from gym_mapbench.mapio.tasked_map import Task, TaskedMap
from gym_mapbench.scenario import MapSet, Pose, Scenario

PoseLike = Pose | Sequence[float]
BARN_PREFIX = "barn:"


def load_scenarios(
    path: str | Path,
    *,
    start: PoseLike | None = None,
    goal: PoseLike | None = None,
    resolution: float | None = None,
    threshold: float = DEFAULT_THRESHOLD,
) -> list[Scenario]:
    """Load every task of a map file, map-set file, run directory or benchmark folder.

    A map with many tasks is shared by their scenarios. A map without any gets the default task of
    the thesis where it has the thesis' layout.

    Args:
        path: What :func:`load_maps` reads.
        start: ``(x, y, yaw)`` in m and rad, to use instead of the file's; every map is then driven once.
        goal: The same for the goal.
        resolution: As for :func:`load_maps`.
        threshold: As for :func:`load_maps`.

    Raises:
        MapFormatError: If the file is not what it claims to be.
        ConfigError: If a map has no task and none is given, or a pose is off the map or occupied.
    """
    maps = load_maps(path, resolution=resolution, threshold=threshold)
    tasked = [_with_task(path, item, start, goal) for item in maps]
    try:
        return [scenario for item in tasked for scenario in item.scenarios()]
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None


def load_map_set(path: str | Path, *, start: PoseLike | None = None, goal: PoseLike | None = None) -> MapSet:
    """Load what :func:`load_scenarios` loads, as one map set; the same errors."""
    return MapSet(tuple(load_scenarios(path, start=start, goal=goal)))


def load_maps(
    path: str | Path, *, resolution: float | None = None, threshold: float = DEFAULT_THRESHOLD
) -> list[TaskedMap]:
    """Load the maps of a file or folder, with the tasks known for them, which may be none.

    ======================================  =======================================================
    ``NAME.yaml``                           map_server, with ``NAME_poses.yaml``; MRPB with its tests
    ``NAME.png``, ``.pgm .bmp .jpg .jpeg``  plain picture
    ``NAME.map``, ``NAME.scen``             MovingAI map with its tasks
    ``world_N.world``                       BARN world with its task
    ``NAME.json``                           the project's map-set file; ``tasks.json``: MRPB
    a folder                                run directory, exported maps, MRPB, BARN or MovingAI
    ``barn:FOLDER``                         every world of a BARN folder, by number
    ======================================  =======================================================

    Args:
        path: The file or folder.
        resolution: Side of a cell in m, for formats that do not say: pictures (0.05) and MovingAI (1).
        threshold: Brightness (0..1) below which a pixel of a plain picture is occupied.

    Raises:
        MapFormatError: If there is no such file, or it is in none of these formats.
        ConfigError: If the file says its own resolution and another is given.
    """
    barn = str(path).startswith(BARN_PREFIX)
    path = Path(str(path).removeprefix(BARN_PREFIX))
    suffix = "" if barn else path.suffix.lower()
    if suffix in IMAGE_SUFFIXES:
        return read_image(path, IMAGE_RESOLUTION if resolution is None else resolution, threshold)
    if suffix in (".map", ".scen"):
        return read_movingai(path, MOVINGAI_RESOLUTION if resolution is None else resolution)
    if resolution is not None:
        raise ConfigError(f"resolution: {path} says its own; it can be given for pictures and MovingAI maps only")
    if barn:
        return read_barn_folder(path)
    return _load_folder(path) if path.is_dir() else _load_file(path, suffix)


def _load_file(path: Path, suffix: str) -> list[TaskedMap]:
    """Load a file that says its own resolution."""
    if suffix in (".yaml", ".yml"):
        return _load_yaml(path)
    if suffix == ".world":
        return read_barn(path)
    if path.name == MRPB_TASKS:
        return read_mrpb_folder(path)
    if suffix == ".json":
        return read_bundle(path)
    if not path.exists():
        raise MapFormatError(f"{path}: no such file or folder")
    known = ", ".join((".yaml", ".json", ".map", ".scen", ".world", *sorted(IMAGE_SUFFIXES)))
    raise MapFormatError(f"{path}: no map format known by this name (expected {known} or a folder)")


def _load_yaml(path: Path) -> list[TaskedMap]:
    tests = None if find_poses(path) else find_tests(path)
    return read_mrpb(path, tests) if tests else read_map_server(path)


def _load_folder(path: Path) -> list[TaskedMap]:
    """Load the maps of a folder, whichever kind it is."""
    for name in (BEST_MAP_SET, MAP_SET_FILE):
        if (path / name).exists():
            return read_bundle(path / name)
    if (path / MRPB_TASKS).exists() and not (path / MRPB_MAP).exists():
        return read_mrpb_folder(path / MRPB_TASKS)
    maps = find_map_files(path)
    if maps:
        return [tasked for file in maps for tasked in _load_yaml(file)]
    if world_files(path):
        return read_barn_folder(path)
    octile = sorted(path.glob("*.map"))
    if octile:
        return [tasked for file in octile for tasked in read_movingai(file)]
    raise MapFormatError(f"{path}: no maps found in this folder")


def _with_task(path: str | Path, item: TaskedMap, start: PoseLike | None, goal: PoseLike | None) -> TaskedMap:
    """Give a map its task: the file's, the caller's, or the thesis'."""
    if start is None and goal is None and item.tasks:
        return item
    task = item.tasks[0] if item.tasks else _thesis_task(item)
    first: PoseLike | None = start if start is not None else task and task.start
    last: PoseLike | None = goal if goal is not None else task and task.goal
    if first is None or last is None:
        missing = " and ".join(f"--{what}" for what, pose in (("start", first), ("goal", last)) if pose is None)
        raise ConfigError(f"{path}: no task is known for this map, give {missing} as x,y,yaw{_or_poses(path)}")
    return TaskedMap(item.name, item.grid, (Task(as_pose("start", first), as_pose("goal", last), item.name),))


def _or_poses(path: str | Path) -> str:
    """Say what file would give a map_server map its task."""
    if Path(path).suffix.lower() not in (".yaml", ".yml"):
        return ""
    return f", or write {Path(path).stem}_poses.yaml beside it: a line '- [x, y, yaw]' for the start, one for the goal"


def as_pose(what: str, pose: PoseLike) -> Pose:
    """Make a pose of ``(x, y, yaw)``.

    Raises:
        ConfigError: If it is not three numbers.
    """
    try:
        x, y, yaw = (float(value) for value in pose)
    except (TypeError, ValueError):
        raise ConfigError(f"{what}: expected x, y, yaw in m and rad, got {pose!r}") from None
    return Pose(x, y, yaw)


def _thesis_task(item: TaskedMap) -> Task | None:
    """Return the thesis' task if the map is laid out for it: square, walled in, both corners cleared."""
    if not has_thesis_layout(item.grid):
        return None
    return Task(*default_task(item.grid), item.name)


def has_thesis_layout(grid: GridMap) -> bool:
    """Whether the map is square, has a filled border, and is clear around the thesis' start and goal."""
    layout = ShapeSettings()
    margin, reach = layout.border + layout.task_distance, layout.cleared_distance
    cells = grid.occupancy
    if cells.shape[0] != cells.shape[1] or cells.shape[0] <= 2 * margin or grid.unknown is not None:
        return False
    walled = np.concatenate([cells[0], cells[-1], cells[:, 0], cells[:, -1]]).all()
    clear = not any(
        cells[row - reach : row + reach + 1, col - reach : col + reach + 1].any()
        for row, col in task_cells(grid.shape, margin)
    )
    return bool(walled and clear)
