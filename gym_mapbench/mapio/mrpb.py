"""Mobile Robot Planning Benchmark (MRPB) 1.0: a map_server map in a folder of its own, and the tests on it.

The tests are in ``config.txt`` beside ``map.yaml``, as published (arguments of a launch file), or in
one ``tasks.json`` for many folders: ``{"maze": {"tests": [{"start": [x, y, yaw], "goal": ...}]}}``.
Source: Wen et al., "MRPB 1.0: A Unified Benchmark for the Evaluation of Mobile Robot Local Planning
Approaches", 2021.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio.map_server import read_map_server_grid
from gym_mapbench.mapio.source import as_number, as_numbers, file_inside, read_json, read_text, short
from gym_mapbench.mapio.tasked_map import TaskedMap, name_tasks
from gym_mapbench.world.scenario import Pose

CONFIG = "config.txt"
TASKS = "tasks.json"
MAP = "map.yaml"
MAX_TASKS_BYTES = 4_000_000

_ARGUMENT = re.compile(r'<arg\s+name="(initial|goal)_pose_([xya])"\s+default="([^"]*)"\s*/>')
_ORDER = [(which, axis) for which in ("initial", "goal") for axis in "xya"]

PosePair = tuple[Pose, Pose]


def find_tests(map_path: Path) -> Path | None:
    """Return the file with the tests of ``FOLDER/map.yaml``; None if the map is not MRPB's."""
    folder = Path(map_path).absolute().parent
    if map_path.name != MAP:
        return None
    for file in (folder / CONFIG, folder / TASKS, folder.parent / TASKS):
        if os.path.isfile(file) and (file.name == CONFIG or folder.name in _read_tests(file)):
            return file
    return None


def read_mrpb(map_path: Path, tests: Path) -> list[TaskedMap]:
    """Read one map with its tests; it is named after its folder.

    Args:
        map_path: ``FOLDER/map.yaml``.
        tests: What :func:`find_tests` found.

    Raises:
        MapFormatError: If one of the files is damaged.
    """
    name = Path(map_path).absolute().parent.name
    poses = _parse_config(tests) if tests.name == CONFIG else _parse_tests(_read_tests(tests)[name], f"{tests}: {name}")
    return [TaskedMap(name, read_map_server_grid(map_path), name_tasks(name, poses))]


def read_mrpb_folder(tests: Path) -> list[TaskedMap]:
    """Read the maps that a ``tasks.json`` names, in its order; those whose folder is missing are left out.

    Raises:
        MapFormatError: If one of the files is damaged.
    """
    maps = [file_inside(tests.parent, name, f"{tests}: map") / MAP for name in _read_tests(tests)]
    present = [path for path in maps if os.path.isfile(path)]
    if not present:
        raise MapFormatError(f"{tests}: expected the folder of at least one of its {len(maps)} maps beside it")
    return [tasked for path in present for tasked in read_mrpb(path, tests)]


def _parse_config(path: Path) -> list[PosePair]:
    """Read the published form: six arguments a test, in a fixed order."""
    found = _ARGUMENT.findall(read_text(path, MAX_TASKS_BYTES))
    if not found or [(which, axis) for which, axis, _ in found] != _ORDER * (len(found) // 6):
        raise MapFormatError(f"{path}: expected initial_pose_x, _y, _a and goal_pose_x, _y, _a of every test")
    values = [as_number(f"{path}: {which}_pose_{axis}", value) for which, axis, value in found]
    return [(Pose(*values[at : at + 3]), Pose(*values[at + 3 : at + 6])) for at in range(0, len(values), 6)]


def _parse_tests(entry: object, where: str) -> list[PosePair]:
    tests = entry.get("tests") if isinstance(entry, Mapping) else None
    if not isinstance(tests, list) or not tests or not all(isinstance(test, Mapping) for test in tests):
        raise MapFormatError(f"{where}: expected a list of tests with start and goal, got {short(entry)}")
    return [(_pose(test, "start", where), _pose(test, "goal", where)) for test in tests]


def _pose(test: Mapping[str, Any], what: str, where: str) -> Pose:
    return Pose(*as_numbers(f"{where}: {what}", test.get(what), 3))


def _read_tests(path: Path) -> Mapping[str, Any]:
    document = read_json(path, MAX_TASKS_BYTES)
    if not isinstance(document, Mapping):
        raise MapFormatError(f"{path}: expected one entry per map, got {short(document)}")
    return document
