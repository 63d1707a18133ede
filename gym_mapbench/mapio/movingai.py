"""Moving AI Lab's grid maps (``.map``) and their tasks (``.scen``).

Source: Sturtevant, "Benchmarks for Grid-Based Pathfinding", 2012. Their y runs down from the top
left corner. They have no unit of length: a cell is 1 m here unless told otherwise, so that
lengths in cells are lengths in m.
"""

from __future__ import annotations

import math
import os
import re
from collections import defaultdict
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.errors import ConfigError, MapFormatError
from gym_mapbench.kernels.distance import geodesic_distance
from gym_mapbench.mapio.output import Files, check_names
from gym_mapbench.mapio.source import as_number, check_size, file_inside, read_bytes, read_text, short
from gym_mapbench.mapio.tasked_map import TaskedMap, name_tasks
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose

DEFAULT_RESOLUTION = 1.0
PASSABLE = b".GS"
BLOCKED = b"@OTW"
MAX_SCEN_TASKS = 500_000
DECIMALS = 8
"""Digits after the point of the lengths that are written."""

Cell = tuple[int, int]

_HEADER = re.compile(rb"type[ \t]+octile\s+height[ \t]+(\d{1,9})\s+width[ \t]+(\d{1,9})\s+map[ \t]*\r?\n")
_CORNERS = re.compile(rb"type[ \t]+octile-corner\s")
_LINE_LIMIT = 2000


class ScenTask(NamedTuple):
    """One line of a ``.scen`` file.

    ``start`` and ``goal`` are ``(row, col)`` with row 0 at the bottom; ``optimal`` is in cells, and the file prints it
    with ``decimals`` digits after the point (negative: the last digit stands for tens, hundreds...).
    """

    start: Cell
    goal: Cell
    optimal: float
    decimals: int = DECIMALS


def read_movingai(path: Path, resolution: float = DEFAULT_RESOLUTION) -> list[TaskedMap]:
    """Read a ``.map`` with the ``.scen`` beside it, if there is one, or a ``.scen`` with its map.

    Start and goal of a task face along the straight line between them.

    Args:
        path: The ``.map`` or ``.scen`` file.
        resolution: Side of a cell, m.

    Raises:
        MapFormatError: If a file is missing or damaged.
    """
    map_path, scen_path = _pair(path)
    grid = read_map_file(map_path, resolution)
    tasks = read_scen_file(scen_path, grid.shape) if scen_path else []
    poses = [_poses(grid, task) for task in tasks]
    return [TaskedMap(map_path.stem, grid, name_tasks(map_path.stem, poses) if poses else ())]


def read_map_file(path: Path, resolution: float = DEFAULT_RESOLUTION) -> GridMap:
    """Read the grid of a ``.map`` file.

    Raises:
        MapFormatError: If the header or a row is not as it should be.
    """
    data = read_bytes(path)
    rows, cols, begin = _read_header(path, data)
    check_size(path, rows, cols)
    body = data[begin:]
    lines = body.split() if len(body) <= 2 * rows * (cols + 2) + _LINE_LIMIT else []
    if len(lines) != rows or any(len(line) != cols for line in lines):
        raise MapFormatError(f"{path}: expected {rows} rows of {cols} cells as its header says")
    cells = np.frombuffer(b"".join(lines), np.uint8).reshape(rows, cols)
    blocked = np.isin(cells, np.frombuffer(BLOCKED, np.uint8))
    strange = cells[~blocked & ~np.isin(cells, np.frombuffer(PASSABLE, np.uint8))]
    if len(strange):
        raise MapFormatError(f"{path}: expected cells of {(PASSABLE + BLOCKED).decode()}, got {chr(strange[0])!r}")
    return GridMap.from_image_array(blocked, resolution)


def _read_header(path: Path, data: bytes) -> tuple[int, int, int]:
    """Return rows, columns, and where the cells begin."""
    header = _HEADER.match(data)
    if header is not None:
        return int(header[1]), int(header[2]), header.end()
    if _CORNERS.match(data):
        raise MapFormatError(
            f"{path}: an octile-corner map, in which different heights of the corners close cells to their neighbours, "
            "which a grid of free and occupied cells cannot represent; expected type octile"
        )
    raise MapFormatError(f"{path}: expected the header of an octile map (type, height, width, map)")


def read_scen_file(path: Path, shape: tuple[int, int]) -> list[ScenTask]:
    """Read the tasks of a ``.scen`` file for a map of ``(rows, cols)``.

    Raises:
        MapFormatError: If a line is not as it should be, a cell lies off the map, or the tasks are on several maps.
    """
    lines = _scen_lines(path)
    if not lines or lines[0].split() not in (["version", "1"], ["version", "1.0"]):
        raise MapFormatError(f"{path}: expected 'version 1' in its first line, got {short(lines[0] if lines else '')}")
    tasks = [(f"{path}: line {number}", line) for number, line in enumerate(lines[1:], start=2) if line.strip()]
    parsed = [_parse_task(line, shape, where) for where, line in tasks]
    names = [_map_name(line) for _, line in tasks]
    for (where, _), name in zip(tasks, names, strict=True):
        if name != names[0]:
            raise MapFormatError(f"{where}: expected tasks on one map, {short(names[0])}, got {short(name)}")
    return parsed


def map_of_scen(path: Path) -> Path:
    """Return the ``.map`` file of a ``.scen`` file: the one its first task names, beside it.

    Raises:
        MapFormatError: If it is no ``.scen`` file, names no map, or the map is missing.
    """
    if path.suffix.lower() != ".scen":
        raise MapFormatError(f"{path}: expected a .scen file, got {path.suffix or path.name}")
    first = next((line for line in _scen_lines(path)[1:] if line.strip()), "")
    if len(first.split()) < 2:
        raise MapFormatError(f"{path}: expected a task with the name of its map")
    map_path = file_inside(path.parent, _map_name(first), f"{path}: map")
    if not os.path.isfile(map_path):
        raise MapFormatError(f"{path}: expected its map {map_path.name} beside it")
    return map_path


def map_text(grid: GridMap) -> str:
    """Return the ``.map`` text: ``.`` free, ``@`` occupied, ``O`` (out of bounds, blocked) unknown."""
    cells = np.where(grid.occupancy, "@", ".")
    if grid.unknown is not None:
        cells = np.where(grid.unknown, "O", cells)
    rows, cols = grid.shape
    body = "\n".join("".join(row) for row in cells[::-1])
    return f"type octile\nheight {rows}\nwidth {cols}\nmap\n{body}\n"


def scen_text(map_name: str, shape: tuple[int, int], tasks: Sequence[ScenTask]) -> str:
    """Return the ``.scen`` text of tasks with their optimal lengths (cells); buckets are 4 cells wide."""
    rows, cols = shape
    lines = ["version 1"]
    for (start_row, start_col), (goal_row, goal_col), optimal, _ in tasks:
        ends = f"{start_col}\t{rows - 1 - start_row}\t{goal_col}\t{rows - 1 - goal_row}"
        lines.append(f"{int(optimal) // 4}\t{map_name}\t{cols}\t{rows}\t{ends}\t{optimal:.{DECIMALS}f}")
    return "\n".join(lines) + "\n"


def movingai_files(maps: Sequence[TaskedMap]) -> Files:
    """Return ``NAME.map`` and, where tasks are known, ``NAME.map.scen`` of every map; resolution and origin are lost.

    Raises:
        ConfigError: If a name cannot be a file name or comes twice, or a task has no path.
    """
    check_names("map", [tasked.name for tasked in maps])
    files: Files = {}
    for tasked in maps:
        files[f"{tasked.name}.map"] = map_text(tasked.grid)
        if tasked.tasks:
            tasks = _scen_tasks(tasked)
            files[f"{tasked.name}.map.scen"] = scen_text(f"{tasked.name}.map", tasked.grid.shape, tasks)
    return files


def optimal_lengths(grid: GridMap, tasks: Sequence[tuple[Cell, Cell]]) -> NDArray[np.float64]:
    """Return the exact length of every task's shortest path, cells; inf where there is none.

    Steps go to the 8 neighbours, diagonally only between two free cells; unknown cells are blocked.
    Tasks with the same start share one search.

    Args:
        grid: The map.
        tasks: Start and goal cells ``(row, col)``.
    """
    blocked = grid.occupancy if grid.unknown is None else grid.occupancy | grid.unknown
    by_start: dict[Cell, list[int]] = defaultdict(list)
    for index, (start, _) in enumerate(tasks):
        by_start[start].append(index)
    lengths = np.empty(len(tasks))
    for start, indices in by_start.items():
        distance = geodesic_distance(blocked, *start)
        for index in indices:
            lengths[index] = distance[tasks[index][1]]
    return lengths


def _scen_tasks(tasked: TaskedMap) -> list[ScenTask]:
    """Turn poses into cells, with the optimal lengths."""
    scenarios = tasked.scenarios()
    ends = [scenario.end_cells for scenario in scenarios]
    lengths = optimal_lengths(tasked.grid, ends)
    for scenario, length in zip(scenarios, lengths, strict=True):
        if not np.isfinite(length):
            raise ConfigError(f"task {scenario.name!r}: has no path, which a .scen file cannot express")
    return [ScenTask(start, goal, float(length)) for (start, goal), length in zip(ends, lengths, strict=True)]


def _scen_lines(path: Path) -> list[str]:
    text = read_text(path)
    if text.count("\n") > MAX_SCEN_TASKS:
        raise MapFormatError(f"{path}: expected at most {MAX_SCEN_TASKS} tasks, got more")
    return text.split("\n")


def _pair(path: Path) -> tuple[Path, Path | None]:
    """Find the map and the tasks that belong together."""
    if path.suffix.lower() == ".scen":
        return map_of_scen(path), path
    beside = (path.with_name(path.name + ".scen"), path.with_suffix(".scen"))
    return path, next((scen for scen in beside if os.path.isfile(scen)), None)


def _poses(grid: GridMap, task: ScenTask) -> tuple[Pose, Pose]:
    (x0, y0), (x1, y1) = grid.cell_to_world(*task.start), grid.cell_to_world(*task.goal)
    yaw = math.atan2(y1 - y0, x1 - x0)
    return Pose(x0, y0, yaw), Pose(x1, y1, yaw)


def _parse_task(line: str, shape: tuple[int, int], where: str) -> ScenTask:
    """Read ``bucket map width height start_x start_y goal_x goal_y optimal``; a map's name may hold spaces."""
    fields = line.split()
    if len(fields) < 9 or len(line) > _LINE_LIMIT:
        raise MapFormatError(f"{where}: expected 9 fields (bucket, map, size, start, goal, optimum), got {short(line)}")
    width, height, *ends = (_integer(field, where) for field in fields[-7:-1])
    rows, cols = shape
    if (height, width) != shape:
        raise MapFormatError(f"{where}: expected a task on a map of {cols} x {rows} cells, got {width} x {height}")
    x0, y0, x1, y1 = ends
    if not all(0 <= x < cols and 0 <= y < rows for x, y in ((x0, y0), (x1, y1))):
        raise MapFormatError(f"{where}: expected cells on the map, got {ends}")
    optimal = as_number(f"{where}: optimum", fields[-1])
    return ScenTask((rows - 1 - y0, x0), (rows - 1 - y1, x1), optimal, _decimals(fields[-1]))


def _map_name(line: str) -> str:
    """Return the name of a task's map, without folders: all between the bucket and the last seven fields."""
    return re.split(r"[/\\]", line.split(maxsplit=1)[1].rsplit(maxsplit=7)[0])[-1]


def _decimals(number: str) -> int:
    """Count the digits after the point of a printed number."""
    exponent = Decimal(number).as_tuple().exponent
    return -exponent if isinstance(exponent, int) else 0


def _integer(field: str, where: str) -> int:
    if not re.fullmatch(r"-?\d{1,9}", field):
        raise MapFormatError(f"{where}: expected a whole number, got {short(field)}")
    return int(field)
