"""One way in for every map format: by the name of the file."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gym_mapbench.errors import ConfigError, MapFormatError, PluginError
from gym_mapbench.generator import ShapeSettings, default_task, task_cells
from gym_mapbench.mapio.formats import FORMATS, MapFormat
from gym_mapbench.mapio.image import DEFAULT_THRESHOLD
from gym_mapbench.mapio.poses import check_yaw
from gym_mapbench.mapio.tasked_map import Task, TaskedMap
from gym_mapbench.registry import accepted_keywords
from gym_mapbench.trust import MODULE_ATTRIBUTE
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Pose, Scenario

LOG = logging.getLogger(__name__)

PoseLike = Pose | Sequence[float]

PREFIXED = re.compile(rf"({MODULE_ATTRIBUTE.pattern}|[A-Za-z_]\w+):(.+)")
"""A path with the format that reads it in front; a single letter in front would be a drive of Windows."""


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
        MapFormatError: If the content does not fit the format of the file.
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
    ``FORMAT:PATH``                         what that format reads there, e.g. ``barn:FOLDER``
    ``module:attribute:PATH``               what that function of a path reads there
    ======================================  =======================================================

    Third parties' formats (:mod:`gym_mapbench.mapio.formats`) come after these.

    Args:
        path: The file or folder.
        resolution: Side of a cell in m, for formats that do not say: pictures (0.05) and MovingAI (1).
        threshold: Brightness (0..1) below which a pixel of a plain picture is occupied.

    Raises:
        MapFormatError: If there is no such file, or it is in none of these formats.
        ConfigError: If the file says its own resolution and another is given.
        PluginError: If a third party's reader fails.
    """
    name, place = _format_and_path(str(path))
    form = FORMATS.get(name)
    accepted = accepted_keywords(form.read)
    if resolution is not None and "resolution" not in accepted:
        raise ConfigError(f"resolution: {path} says its own; it can be given for pictures and MovingAI maps only")
    options = {"resolution": resolution, "threshold": threshold}
    maps = _read(name, place, {key: value for key, value in options.items() if key in accepted and value is not None})
    LOG.info("%s: read as %s; maps: %d, tasks: %d", path, name, len(maps), sum(len(one.tasks) for one in maps))
    return maps


def _read(name: str, path: Path, options: dict[str, float]) -> list[TaskedMap]:
    """Read a file, or those of a folder, in a format."""
    form = FORMATS.get(name)
    with FORMATS.blamed(name):
        files = form.files_in(path) if os.path.isdir(path) else [path]
        read = [form.read(file, **options) for file in files]
    if not files:
        raise MapFormatError(f"{path}: no {name} maps found in this folder")
    for maps in read:
        if not isinstance(maps, list) or not all(isinstance(tasked, TaskedMap) for tasked in maps):
            raise PluginError(f"map format {name!r}: expected a list of TaskedMap, got {maps!r:.80}")
    if not any(read):
        raise MapFormatError(f"{path}: expected at least one map in format {name!r}, got none")
    return [tasked for maps in read for tasked in maps]


def _format_and_path(text: str) -> tuple[str, Path]:
    """Tell which format a path is in: the one named before it, or else the one that recognises its name."""
    if not text:
        raise MapFormatError("expected the name of a map, got ''")
    prefixed = PREFIXED.fullmatch(text)
    if prefixed and not os.path.exists(text) and (":" in prefixed[1] or prefixed[1] in FORMATS):
        if not os.path.exists(prefixed[2]):
            raise MapFormatError(f"{prefixed[2]}: no such file or folder")
        return prefixed[1], Path(prefixed[2])
    path = Path(text)
    for names in (FORMATS.built_in, FORMATS.added()):
        for knows in (_holds, _is_called, _ends):
            for name in names:
                if knows(FORMATS.get(name), path):
                    return name, path
    raise MapFormatError(_nobody_knows(path))


def _holds(form: MapFormat, path: Path) -> bool:
    """Whether a folder holds maps of a format."""
    return os.path.isdir(path) and bool(form.files_in(path))


def _is_called(form: MapFormat, path: Path) -> bool:
    """Whether a file is in a format by its whole name."""
    return path.name in form.names and not os.path.isdir(path)


def _ends(form: MapFormat, path: Path) -> bool:
    """Whether a file is in a format by the end of its name."""
    return path.suffix.lower() in form.suffixes and not os.path.isdir(path)


def _nobody_knows(path: Path) -> str:
    """Say why a path is in no format."""
    if os.path.isdir(path):
        return f"{path}: no maps found in this folder"
    if not os.path.exists(path):
        return f"{path}: no such file or folder"
    known = ", ".join(suffix for name in FORMATS for suffix in FORMATS.get(name).suffixes)
    return f"{path}: no map format known by this name (expected {known} or a folder)"


def _with_task(path: str | Path, item: TaskedMap, start: PoseLike | None, goal: PoseLike | None) -> TaskedMap:
    """Give a map its task: the file's, the caller's, or the thesis'."""
    if start is None and goal is None and item.tasks:
        return item
    task = item.tasks[0] if item.tasks else _thesis_task(item)
    first: PoseLike | None = start if start is not None else task and task.start
    last: PoseLike | None = goal if goal is not None else task and task.goal
    if first is None or last is None:
        missing = " and ".join(what for what, pose in (("start", first), ("goal", last)) if pose is None)
        raise ConfigError(f"{path}: no task is known for this map, give {missing} as x,y,yaw{_or_poses(path)}")
    bodies = task.bodies if task else ()
    given = Task(as_pose("start", first), as_pose("goal", last), item.name, bodies)
    return replace(item, tasks=(given,))


def _or_poses(path: str | Path) -> str:
    """Say what file would give a map_server map its task."""
    if Path(path).suffix.lower() not in (".yaml", ".yml"):
        return ""
    return f", or write {Path(path).stem}_poses.yaml beside it: a line '- [x, y, yaw]' for the start, one for the goal"


def as_pose(what: str, pose: PoseLike) -> Pose:
    """Make a pose of ``(x, y, yaw)``.

    Raises:
        ConfigError: If it is not three numbers, or the yaw is in degrees.
    """
    try:
        x, y, yaw = (float(value) for value in pose)
    except (TypeError, ValueError):
        raise ConfigError(f"{what}: expected x, y, yaw in m and rad, got {pose!r}") from None
    return check_yaw(what, Pose(x, y, yaw), ConfigError)


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
