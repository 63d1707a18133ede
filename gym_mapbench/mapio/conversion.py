"""One way out for every map format."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio.formats import FORMATS, WRITTEN
from gym_mapbench.mapio.map_set_file import map_set_text
from gym_mapbench.mapio.output import write_files, write_new_folder
from gym_mapbench.mapio.tasked_map import TaskedMap, genome_files, refuse_bodies

MAP_SET = "mapset"
"""The format that holds genomes."""
MAP_SERVER = "map_server"
WITH_BODIES = (MAP_SET, MAP_SERVER)
"""The formats that hold moving bodies."""


def write_maps(maps: Sequence[TaskedMap], out_dir: str | Path, format: str) -> list[Path]:
    """Write maps and their tasks into a new or empty folder.

    Args:
        maps: What :func:`~gym_mapbench.mapio.load_maps` returns.
        out_dir: The folder.
        format: Name of one of :data:`~gym_mapbench.mapio.formats.FORMATS` that is written.

    Returns:
        The files written.

    Raises:
        ConfigError: If the format is unknown, the folder holds something, a name cannot be a file name,
            or the format cannot hold a map.
    """
    write = FORMATS.get(format).write
    if write is None:
        raise ConfigError(f"map format {format!r}: is only read (expected one of: {', '.join(WRITTEN)})")
    if format not in WITH_BODIES:
        refuse_bodies(f"map format {format!r}", (task for tasked in maps for task in tasked.tasks))
    with FORMATS.blamed(format):
        files = dict(write(maps))
    if format != MAP_SET:
        files |= genome_files((tasked.name, tasked.genome) for tasked in maps)
    return write_new_folder(files, Path(out_dir))


def write_map_file(maps: Sequence[TaskedMap], target: str | Path) -> list[Path]:
    """Write one map (or, as ``.json``, any number) under the given name, with the files that belong to it.

    Args:
        maps: What :func:`~gym_mapbench.mapio.load_maps` returns.
        target: ``NAME.yaml`` (map_server), ``NAME.png``, ``NAME.map`` (MovingAI) or ``NAME.json`` (map set).

    Returns:
        The files written.

    Raises:
        ConfigError: If a file is there already, the name says no format, or a format for one map gets several.
    """
    target = Path(target)
    forms = {FORMATS.get(name).suffixes[0]: name for name in WRITTEN}
    if target.suffix not in forms:
        raise ConfigError(f"{target}: expected a name that ends in one of {', '.join(forms)}")
    form = forms[target.suffix]
    if form == MAP_SET:
        return write_files({target.name: map_set_text(maps)}, target.parent)
    if len(maps) != 1 or (form == MAP_SERVER and len(maps[0].tasks) > 1):
        tasks = sum(len(tasked.tasks) for tasked in maps)
        raise ConfigError(f"{target}: holds one map, got {len(maps)} with {tasks} tasks; name a folder or a .json file")
    if form not in WITH_BODIES:
        refuse_bodies(str(target), maps[0].tasks)
    write = FORMATS.get(form).write
    assert write is not None
    return write_files(write([maps[0].renamed(target.stem)]), target.parent)
