"""The project's own map-set file: one JSON document that can be read, and edited, without this package.

::

    {"format": "mapbench-mapset", "version": 1,
     "maps": [{"name": "map_0", "resolution": 0.05, "origin": [0.0, 0.0],
               "tasks": [{"name": "map_0", "start": [x, y, yaw], "goal": [x, y, yaw]}],
               "rows": ["#####", "#...#", "#####"]}]}

Lengths are m, angles rad; ``origin`` is the lower-left corner. The first row is the top one, ``#``
occupied, ``.`` free, ``?`` unknown. A task among moving bodies lists them (:class:`~gym_mapbench.world.bodies.Body`)::

    "bodies": [{"shape": {"radius": 0.3},
                "motion": {"name": "line", "options": {"start": [1, 1], "end": [3, 1], "speed": 0.5}}}]

A map of motifs has its genes (:class:`~gym_mapbench.world.genome.Genome`); the rows alone are the map::

    "genome": {"family": "gates", "options": {}, "genes": {...}}
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gym_mapbench.errors import ConfigError, MapFormatError
from gym_mapbench.files.replacing import replaced_at_once
from gym_mapbench.generator import read_genome
from gym_mapbench.mapio.source import MAX_JSON_BYTES, as_number, as_numbers, check_size, read_json, short
from gym_mapbench.mapio.tasked_map import Task, TaskedMap, group_scenarios
from gym_mapbench.trust import refuse_code
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.genome import Genome
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Pose

FORMAT = "mapbench-mapset"
VERSION = 1
BEST_MAP_SET = "best_map_set.json"
"""Name of the map-set file in a run directory."""

MAP_SET_FILE = "maps.mapset.json"
"""Name of the map-set file in any other folder."""


def read_map_set(path: Path) -> list[TaskedMap]:
    """Read a map-set file.

    Raises:
        MapFormatError: If it is anything else.
    """
    return parse_map_set(read_json(path), str(path))


def parse_map_set(document: object, where: str) -> list[TaskedMap]:
    """Read the document of a map-set file; ``where`` opens every error message.

    Raises:
        MapFormatError: If it is anything else.
    """
    fields = _fields(document, where, {"format", "version", "maps"})
    if fields["format"] != FORMAT or fields["version"] != VERSION:
        came = f"{short(fields['format'])} {short(fields['version'])}"
        raise MapFormatError(f"{where}: expected format {FORMAT!r} of version {VERSION}, got {came}")
    maps = _list(fields["maps"], f"{where}: maps")
    if not maps:
        raise MapFormatError(f"{where}: expected at least one map, got none")
    return [_parse_map(entry, f"{where}: maps[{index}]") for index, entry in enumerate(maps)]


def map_set_document(maps: Sequence[TaskedMap]) -> dict[str, Any]:
    """Return the JSON-able document of a map-set file."""
    return {"format": FORMAT, "version": VERSION, "maps": [_map_entry(tasked) for tasked in maps]}


def map_set_text(maps: Sequence[TaskedMap]) -> str:
    """Return the text of a map-set file.

    Raises:
        ConfigError: If the file would be larger than a file that can be read.
    """
    text = json.dumps(map_set_document(maps), indent=1, allow_nan=False) + "\n"
    if len(text) > MAX_JSON_BYTES:
        raise ConfigError(
            f"expected fewer cells: the map-set file would have {len(text)} bytes, {MAX_JSON_BYTES} are read"
        )
    return text


def check_map_set_size(maps: Sequence[TaskedMap]) -> None:
    """Refuse maps that no map-set file can hold, before long work on them; errors as in :func:`map_set_text`."""
    map_set_text(maps)


def write_map_set(maps: Sequence[TaskedMap], path: Path) -> None:
    """Write a map-set file; a file that is there is replaced in one step, so that it is never half written."""
    with replaced_at_once(path) as file:
        file.write(map_set_text(maps).encode())


def save_map_set(map_set: MapSet, path: str | Path) -> None:
    """Write a map set as a map-set file; :func:`read_map_set` gives it back bit by bit."""
    write_map_set(group_scenarios(map_set), Path(path))


def _map_entry(tasked: TaskedMap) -> dict[str, Any]:
    entry = {
        "name": tasked.name,
        "resolution": tasked.grid.resolution,
        "origin": list(tasked.grid.origin),
        "tasks": [_task_entry(task) for task in tasked.tasks],
        "rows": list(tasked.grid.to_rows()),
    }
    return entry | ({"genome": tasked.genome.model_dump(mode="json")} if tasked.genome else {})


def _task_entry(task: Task) -> dict[str, Any]:
    entry = {"name": task.name, "start": list(task.start), "goal": list(task.goal)}
    return entry | ({"bodies": [body.model_dump(mode="json") for body in task.bodies]} if task.bodies else {})


def _parse_map(entry: object, where: str) -> TaskedMap:
    fields = _fields(entry, where, {"name", "resolution", "origin", "tasks", "rows"}, "genome")
    rows = _list(fields["rows"], f"{where}: rows")
    if not all(isinstance(row, str) for row in rows):
        raise MapFormatError(f"{where}: rows: expected lines of text, got {short(rows)}")
    check_size(f"{where}: rows", len(rows), len(rows[0]) if rows else 0)
    x, y = as_numbers(f"{where}: origin", fields["origin"], 2)
    resolution = as_number(f"{where}: resolution", fields["resolution"])
    try:
        grid = GridMap.from_rows(rows, resolution, origin=(x, y))
    except ConfigError as error:
        raise MapFormatError(f"{where}: {error}") from None
    tasks = _list(fields["tasks"], f"{where}: tasks")
    return TaskedMap(
        _name(fields["name"], f"{where}: name"),
        grid,
        tuple(_parse_task(task, f"{where}: tasks[{index}]") for index, task in enumerate(tasks)),
        _parse_genome(fields["genome"], where) if "genome" in fields else None,
    )


def _parse_genome(value: object, where: str) -> Genome:
    """Read a genome, and refuse one that is none of its family."""
    refuse_code(value, f"{where}: genome")
    try:
        genome = Genome.from_mapping(value, "options")
        read_genome(genome)
    except ConfigError as error:
        raise MapFormatError(f"{where}: genome: {error}") from None
    return genome


def _parse_task(entry: object, where: str) -> Task:
    fields = _fields(entry, where, {"name", "start", "goal"}, "bodies")
    start, goal = (Pose(*as_numbers(f"{where}: {what}", fields[what], 3)) for what in ("start", "goal"))
    return Task(start, goal, _name(fields["name"], f"{where}: name"), _parse_bodies(fields.get("bodies", []), where))


def _parse_bodies(value: object, where: str) -> tuple[Body, ...]:
    refuse_code(value, f"{where}: bodies")
    bodies = _list(value, f"{where}: bodies")
    try:
        return tuple(Body.from_mapping(body, f"{where}: bodies[{index}]") for index, body in enumerate(bodies))
    except ConfigError as error:
        raise MapFormatError(str(error)) from None


def _fields(value: object, where: str, expected: set[str], *optional: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping) or set(value) - set(optional) != expected:
        names = short(sorted(value)) if isinstance(value, Mapping) else short(value)
        raise MapFormatError(f"{where}: expected the keys {', '.join(sorted(expected))}, got {names}")
    return value


def _list(value: object, where: str) -> list[Any]:
    if not isinstance(value, list):
        raise MapFormatError(f"{where}: expected a list, got {short(value)}")
    return value


def _name(value: object, where: str) -> str:
    if not isinstance(value, str) or not value:
        raise MapFormatError(f"{where}: expected a name, got {short(value)}")
    return value
