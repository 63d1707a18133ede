"""BARN worlds (``world_N.world``), their paths, their task and the published reference runs.

Source: Perille et al., "Benchmarking Metric Ground Navigation", 2020, and the BARN Challenge. A
world is Gazebo SDF whose obstacles are cylinders on an exact 0.15 m lattice: a corridor of 34 rows
and a random field of 30 rows, open beyond. A cylinder fills its cell here. The map goes on, free,
to y = 14.4 m, past the goal.
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, ParseError

import numpy as np
from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring
from numpy.typing import NDArray

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio.source import as_number, read_bytes, read_text, short
from gym_mapbench.mapio.tasked_map import TaskedMap, name_tasks
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose

RESOLUTION = 0.15
COLS = 30
CORRIDOR_ROWS = 34
LATTICE_ROWS = 64
ROWS = 96
ORIGIN = (-COLS * RESOLUTION, 0.0)
START = Pose(-2.0, 3.0, 1.57)
GOAL = Pose(-2.0, 13.0, 1.57)
GOAL_RADIUS = 1.0
TIME_LIMIT = 100.0

MAX_WORLD_BYTES = 8_000_000
_OFF_LATTICE = 1e-4
# Magic, version and length of the header; the header itself, as NumPy writes it.
_NPY_HEADER = re.compile(
    rb"\x93NUMPY(?:\x01\x00..|[\x02\x03]\x00....)"
    rb"\{'descr': '([<>|][iu][1248])', 'fortran_order': (True|False), 'shape': \((\d{1,6}), 2\), *\} *\n",
    re.DOTALL,
)
_COUNTS = ("world", "runs", "success", "collision", "timeout")
_TIMES = ("mean_time_success", "std_time_success")
_WORLD_NAME = re.compile(r"world_(\d+)\.world")


class BarnPath(NamedTuple):
    """A published path.

    ``points`` is ``(n, 2)`` x, y in m, start to goal, in the middle of cells; ``official_length`` is the
    length L from start over path to goal by which BARN scores, m.
    """

    points: NDArray[np.float64]
    official_length: float


class DwaReference(NamedTuple):
    """Published runs of DWA on one world; times of the successful runs in s (nan if none was), path length in m."""

    runs: int
    success: int
    collision: int
    timeout: int
    mean_time: float
    std_time: float
    path_length: float


def read_barn(path: Path) -> list[TaskedMap]:
    """Read one world with BARN's task on it.

    Raises:
        MapFormatError: If it is not a BARN world.
    """
    occupancy = np.zeros((ROWS, COLS), dtype=np.bool_)
    for model in _obstacles(path):
        occupancy[_cell(model, path)] = True
    grid = GridMap(occupancy, RESOLUTION, ORIGIN)
    return [TaskedMap(path.stem, grid, name_tasks(path.stem, [(START, GOAL)]))]


def world_files(folder: Path) -> list[Path]:
    """Return the worlds of a BARN folder, by number; empty if there are none."""
    for place in (folder, folder / "world_files"):
        numbered = {int(m[1]): file for file in place.glob("world_*.world") if (m := _WORLD_NAME.fullmatch(file.name))}
        if numbered:
            return [numbered[number] for number in sorted(numbered)]
    return []


def read_barn_path(world: Path) -> BarnPath | None:
    """Read the path published for a world.

    Looked for as ``path_N.npy`` beside the world, in ``path_files/`` beside it and in ``../path_files/``.

    Args:
        world: ``world_N.world``.

    Returns:
        The path; None if there is no file.

    Raises:
        MapFormatError: If the file holds anything but cells of the field.
    """
    match = _WORLD_NAME.fullmatch(world.name)
    places = (world.parent, world.parent / "path_files", world.parent.parent / "path_files")
    file = next((p for place in places if match and os.path.isfile(p := place / f"path_{match[1]}.npy")), None)
    if file is None:
        return None
    cells = _load_cells(file)
    points = np.array(ORIGIN) + RESOLUTION * (cells + np.array([0.5, CORRIDOR_ROWS + 0.5]))
    return BarnPath(points, _official_length(cells))


def read_dwa_reference(path: Path) -> dict[str, DwaReference]:
    """Read ``dwa_reference.csv``, by name of the world (``world_0``).

    Raises:
        MapFormatError: If a column or a number is missing.
    """
    reference = {}
    for number, row in enumerate(_csv_rows(path), start=2):
        where = f"{path}: line {number}"
        ran = (row.get("success") or "").strip() != "0"
        counts = [int(as_number(f"{where}: {name}", row.get(name))) for name in _COUNTS]
        times = [as_number(f"{where}: {name}", row.get(name)) if ran else math.nan for name in _TIMES]
        length = as_number(f"{where}: official_path_m", row.get("official_path_m"))
        reference[f"world_{counts[0]}"] = DwaReference._make([*counts[1:], *times, length])
    return reference


def _csv_rows(path: Path) -> list[dict[str, str]]:
    try:
        return list(csv.DictReader(io.StringIO(read_text(path, 1_000_000)), restval=""))
    except csv.Error as error:
        raise MapFormatError(f"{path}: not a CSV file ({error})") from None


def _official_length(cells: NDArray[np.int64]) -> float:
    """Return the length that the challenge's score uses, m: start, path, goal.

    The challenge's own conversion puts the path a cell off in x and 0.1 m in y; the published lengths include this.
    """
    path = cells * RESOLUTION + np.array([-4.575, 5.075])
    points = np.vstack([START[:2], path, GOAL[:2]])
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


def _obstacles(path: Path) -> list[Element]:
    """Return the models of the world itself: those inside ``<state>`` repeat them."""
    try:
        root = fromstring(read_bytes(path, MAX_WORLD_BYTES), forbid_dtd=True)
    except DefusedXmlException as error:
        raise MapFormatError(f"{path}: expected plain XML without entities ({type(error).__name__})") from None
    except (ParseError, ValueError, LookupError) as error:
        if isinstance(error, MapFormatError):
            raise
        raise MapFormatError(f"{path}: not an XML file ({short(str(error))})") from None
    models = root.findall("world/model") if root.tag == "sdf" else []
    obstacles = [model for model in models if model.get("name") != "ground_plane"]
    if not obstacles:
        raise MapFormatError(f"{path}: expected an SDF world with BARN's cylinders, found none")
    return obstacles


def _cell(model: Element, path: Path) -> tuple[int, int]:
    """Return ``(row, col)`` of the lattice cell that a cylinder stands in."""
    where = f"{path}: model {short(model.get('name'))}"
    radius = as_number(f"{where}: radius", model.findtext("link/collision/geometry/cylinder/radius"))
    pose = (model.findtext("pose") or "").split()
    if len(pose) != 6:
        raise MapFormatError(f"{where}: expected a pose of 6 numbers, got {short(pose)}")
    x, y = (as_number(f"{where}: pose", value) for value in pose[:2])
    col, row = (x - ORIGIN[0]) / RESOLUTION - 0.5, y / RESOLUTION - 0.5
    nearest = round(row), round(col)
    on_lattice = max(abs(row - nearest[0]), abs(col - nearest[1]), abs(radius - RESOLUTION / 2)) < _OFF_LATTICE
    if not on_lattice or not (0 <= nearest[0] < LATTICE_ROWS and 0 <= nearest[1] < COLS):
        raise MapFormatError(f"{where}: expected a cylinder of 0.075 m on BARN's 0.15 m lattice, got {x:g}, {y:g} m")
    return nearest


def _load_cells(file: Path) -> NDArray[np.int64]:
    """Read the field cells of a path, ``(n, 2)`` column and row; NumPy's own reader trusts the header too much."""
    data = read_bytes(file, 1_000_000)
    header = _NPY_HEADER.match(data)
    if header is None:
        raise MapFormatError(f"{file}: expected a NumPy file with an (n, 2) array of whole numbers")
    dtype, fortran, length = np.dtype(header[1].decode()), header[2] == b"True", int(header[3])
    body = data[header.end() :]
    if length < 1 or len(body) != 2 * length * dtype.itemsize:
        raise MapFormatError(f"{file}: its header announces {length} cells, got {len(body)} bytes of data")
    cells = np.frombuffer(body, dtype).reshape((length, 2), order="F" if fortran else "C").astype(np.int64)
    size = LATTICE_ROWS - CORRIDOR_ROWS
    if cells.min() < 0 or cells.max() >= size:
        raise MapFormatError(f"{file}: expected cells of the {size} x {size} field, got {cells.min()} to {cells.max()}")
    return cells
