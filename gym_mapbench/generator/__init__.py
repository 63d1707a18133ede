"""Where maps come from: the thesis' random shapes, and families of maps whose parameters are genes."""

from __future__ import annotations

from gym_mapbench.generator.base import Family
from gym_mapbench.generator.cellular import Cellular
from gym_mapbench.generator.families import FAMILIES, FamilySpec, FamilySpecs, make_family
from gym_mapbench.generator.sampling import DrawnMap, draw_from, draw_map, draw_obstacle, is_drivable, plan_way
from gym_mapbench.generator.shapes import (
    TASK_YAW,
    Cells,
    ShapeSettings,
    clear_and_border,
    default_task,
    disc,
    draw_position,
    draw_shape,
    interior,
    sample_map,
    stamp,
    task_cells,
)

__all__ = [
    "FAMILIES",
    "TASK_YAW",
    "Cells",
    "Cellular",
    "DrawnMap",
    "Family",
    "FamilySpec",
    "FamilySpecs",
    "ShapeSettings",
    "clear_and_border",
    "default_task",
    "disc",
    "draw_from",
    "draw_map",
    "draw_obstacle",
    "draw_position",
    "draw_shape",
    "interior",
    "is_drivable",
    "make_family",
    "plan_way",
    "sample_map",
    "stamp",
    "task_cells",
]
