"""Map formats by name: how their files are recognised, how they are read, and how they are written.

A third party's is a :class:`MapFormat` in :data:`FORMATS`, which is asked after the project's own, or a function of a
path, named ``module:attribute``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio.barn import read_barn, world_files
from gym_mapbench.mapio.image import IMAGE_SUFFIXES, image_files, read_image
from gym_mapbench.mapio.map_server import SUFFIXES as YAML_SUFFIXES
from gym_mapbench.mapio.map_server import find_map_files, map_server_files, read_map_server
from gym_mapbench.mapio.map_set_file import BEST_MAP_SET, MAP_SET_FILE, map_set_text, read_map_set
from gym_mapbench.mapio.movingai import movingai_files, read_movingai
from gym_mapbench.mapio.mrpb import MAP as MRPB_MAP
from gym_mapbench.mapio.mrpb import TASKS as MRPB_TASKS
from gym_mapbench.mapio.mrpb import find_tests, read_mrpb, read_mrpb_folder
from gym_mapbench.mapio.output import Files
from gym_mapbench.mapio.poses import find_poses
from gym_mapbench.mapio.source import files_ending
from gym_mapbench.mapio.tasked_map import TaskedMap
from gym_mapbench.registry import Registry


def _none_in(folder: Path) -> list[Path]:
    """Find no files in any folder."""
    return []


@dataclass(frozen=True)
class MapFormat:
    """One format of map files.

    Args:
        read: Returns the maps in a file; takes ``resolution=`` and ``threshold=`` by keyword where they mean something.
        suffixes: How its files' names end, lower case; files that are written end in the first.
        names: Whole names of its files, where the end of the name does not tell.
        files_in: Returns the files to read in a folder; none if the folder is not of this format.
        write: Returns the contents of the files for some maps, by name; None for a format that is only read.
    """

    read: Callable[..., list[TaskedMap]]
    suffixes: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    files_in: Callable[[Path], list[Path]] = _none_in
    write: Callable[[Sequence[TaskedMap]], Files] | None = None


def _map_set_in(folder: Path) -> list[Path]:
    """The map set of a run directory, or else of an exported folder."""
    return [folder / name for name in (BEST_MAP_SET, MAP_SET_FILE) if (folder / name).exists()][:1]


def _mrpb_tasks_in(folder: Path) -> list[Path]:
    """The tasks of MRPB's maps, one folder each; a single map's folder may have a file of this name as well."""
    return [folder / MRPB_TASKS] if (folder / MRPB_TASKS).exists() and not (folder / MRPB_MAP).exists() else []


def _read_yaml(path: Path) -> list[TaskedMap]:
    """Read a map_server map; one of MRPB's has tests beside it instead of poses."""
    tests = None if find_poses(path) else find_tests(path)
    return read_mrpb(path, tests) if tests else read_map_server(path)


def _octile_maps_in(folder: Path) -> list[Path]:
    return files_ending(folder, (".map",))


def _format(entry: Any) -> MapFormat:
    """Accept a format, or a function that reads the files it is given."""
    if isinstance(entry, MapFormat):
        return entry
    if not callable(entry):
        raise ConfigError(f"expected a MapFormat or a function of a path, got {type(entry).__name__}")
    return MapFormat(entry)


_PICTURES = (".png", *sorted(IMAGE_SUFFIXES - {".png"}))

FORMATS: Registry[MapFormat] = Registry(
    "map format",
    "map_formats",
    {
        "mapset": MapFormat(
            read_map_set, (".json",), files_in=_map_set_in, write=lambda maps: {MAP_SET_FILE: map_set_text(maps)}
        ),
        "mrpb": MapFormat(read_mrpb_folder, names=(MRPB_TASKS,), files_in=_mrpb_tasks_in),
        "map_server": MapFormat(_read_yaml, YAML_SUFFIXES, files_in=find_map_files, write=map_server_files),
        "barn": MapFormat(read_barn, (".world",), files_in=world_files),
        "movingai": MapFormat(read_movingai, (".map", ".scen"), files_in=_octile_maps_in, write=movingai_files),
        "image": MapFormat(read_image, _PICTURES, write=image_files),
    },
    check=_format,
)
"""The formats by name, in the order in which a folder is offered to them. ``gazebo`` needs more than maps, and is
written by :mod:`gym_mapbench.mapio.gazebo`."""

WRITTEN = tuple(name for name in FORMATS.built_in if FORMATS.get(name).write is not None)
"""Names of the project's formats that can be written."""
