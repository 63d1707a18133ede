"""Parameters of the whole navigation: read from a real ``nav2_params.yaml`` or a preset, written back for ROS 2.

Humble's behaviour is built. Newer names of parameters that Humble has are understood; parameters that
exist only in newer releases are refused with the reason.
"""

from __future__ import annotations

from controllers.nav2_params.navigation import ControllerPlugin, NavigationParams, PlannerPlugin
from controllers.nav2_params.parsing import Nav2Params, parse_nav2_params
from controllers.nav2_params.presets import PRESETS, load_preset
from controllers.nav2_params.reading import read_nav2_params
from controllers.nav2_params.writing import write_nav2_params

__all__ = [
    "PRESETS",
    "ControllerPlugin",
    "Nav2Params",
    "NavigationParams",
    "PlannerPlugin",
    "load_preset",
    "parse_nav2_params",
    "read_nav2_params",
    "write_nav2_params",
]
