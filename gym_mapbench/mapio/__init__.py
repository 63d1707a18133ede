"""Maps in and out: one file per format, one way in (:func:`load_scenarios`), one way out (:func:`write_maps`)."""

from gym_mapbench.mapio.conversion import write_map_file, write_maps
from gym_mapbench.mapio.loading import PoseLike, load_map_set, load_maps, load_scenarios
from gym_mapbench.mapio.map_server import Occupancy, files_beside, occupancy_files, read_occupancy
from gym_mapbench.mapio.map_set_file import check_map_set_size, save_map_set
from gym_mapbench.mapio.tasked_map import Task, TaskedMap, group_scenarios

__all__ = [
    "Occupancy",
    "PoseLike",
    "Task",
    "TaskedMap",
    "check_map_set_size",
    "files_beside",
    "group_scenarios",
    "load_map_set",
    "load_maps",
    "load_scenarios",
    "occupancy_files",
    "read_occupancy",
    "save_map_set",
    "write_map_file",
    "write_maps",
]
