"""Parameters of the whole navigation: read from a real ``nav2_params.yaml`` or a preset, written back for ROS 2.

Files of all releases are understood: those for Humble and Jazzy drive as they would there, names of other releases are
translated, and keys that the robot's own Nav2 would ignore are listed, not refused. A file is read into a document that
knows its lines; its nodes are found and its release is recognised (``file``); then each section is read key by key
(``sections``). ``migration`` converts the text of a file, and ``values`` changes single values in it.
"""

from __future__ import annotations

from controllers.nav2_params.filters_writing import mask_files
from controllers.nav2_params.navigation import NavigationParams
from controllers.nav2_params.parsing import Nav2Params, parse_nav2_params
from controllers.nav2_params.plugin_settings import ControllerPlugin, PlannerPlugin
from controllers.nav2_params.presets import PRESETS, counterpart, load_preset
from controllers.nav2_params.reading import read_nav2_params
from controllers.nav2_params.robot import robot_of
from controllers.nav2_params.summary import advise, summarise
from controllers.nav2_params.writing import parameters_of_ours, write_nav2_params

__all__ = [
    "PRESETS",
    "ControllerPlugin",
    "Nav2Params",
    "NavigationParams",
    "PlannerPlugin",
    "advise",
    "counterpart",
    "load_preset",
    "mask_files",
    "parameters_of_ours",
    "parse_nav2_params",
    "read_nav2_params",
    "robot_of",
    "summarise",
    "write_nav2_params",
]
