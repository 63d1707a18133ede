"""One way out for every map format."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.mapio.bundle import MAP_SET_FILE, bundle_text
from gym_mapbench.mapio.image import image_files
from gym_mapbench.mapio.map_server import map_server_files
from gym_mapbench.mapio.movingai import movingai_files
from gym_mapbench.mapio.output import Files, write_files, write_new_folder
from gym_mapbench.mapio.tasked_map import TaskedMap

FORMATS: dict[str, Callable[[Sequence[TaskedMap]], Files]] = {
    "map_server": map_server_files,
    "image": image_files,
    "movingai": movingai_files,
    "mapset": lambda maps: {MAP_SET_FILE: bundle_text(maps)},
}
"""What each format makes of maps; ``gazebo`` needs more and is written by :func:`~gym_mapbench.mapio.gazebo`."""

_BY_SUFFIX = {".yaml": "map_server", ".png": "image", ".map": "movingai", ".json": "mapset"}


def write_maps(maps: Sequence[TaskedMap], out_dir: str | Path, format: str) -> list[Path]:
    """Write maps and their tasks into a new or empty folder.

    Args:
        maps: What :func:`~gym_mapbench.mapio.load_maps` returns.
        out_dir: The folder.
        format: One of :data:`FORMATS`.

    Returns:
        The files written.

    Raises:
        ConfigError: If the format is unknown, the folder holds something, a name cannot be a file name,
            or the format cannot hold a map.
    """
    if format not in FORMATS:
        raise unknown_name("map format", format, FORMATS)
    return write_new_folder(FORMATS[format](maps), Path(out_dir))


def write_map_file(maps: Sequence[TaskedMap], target: str | Path) -> list[Path]:
    """Write one map (or, as ``.json``, any number) under a name of the caller's, with the files that belong to it.

    Args:
        maps: What :func:`~gym_mapbench.mapio.load_maps` returns.
        target: ``NAME.yaml`` (map_server), ``NAME.png``, ``NAME.map`` (MovingAI) or ``NAME.json`` (map set).

    Returns:
        The files written.

    Raises:
        ConfigError: If a file is there already, the name says no format, or a format for one map gets several.
    """
    target = Path(target)
    if target.suffix not in _BY_SUFFIX:
        raise ConfigError(f"{target}: expected a name that ends in one of {', '.join(_BY_SUFFIX)}")
    form = _BY_SUFFIX[target.suffix]
    if form == "mapset":
        return write_files({target.name: bundle_text(maps)}, target.parent)
    if len(maps) != 1 or (form == "map_server" and len(maps[0].tasks) > 1):
        tasks = sum(len(tasked.tasks) for tasked in maps)
        raise ConfigError(f"{target}: holds one map, got {len(maps)} with {tasks} tasks; name a folder or a .json file")
    return write_files(FORMATS[form]([maps[0].renamed(target.stem)]), target.parent)
