"""Where maps come from: the thesis' random shapes, families of maps with genes, and motifs along a route."""

from __future__ import annotations

from gym_mapbench.generator.base import Family
from gym_mapbench.generator.cellular import Cellular
from gym_mapbench.generator.families import FAMILIES, WITHOUT_ROUTE, FamilySpec, FamilySpecs, make_family
from gym_mapbench.generator.genomes import build_genome, elements_line, genome_of, read_genome
from gym_mapbench.generator.motifs import (
    MOTIFS,
    AlongRoute,
    Around,
    Motif,
    MotifGenes,
    Route,
    Section,
    legs_of,
    places,
)
from gym_mapbench.generator.people import PeopleSettings, draw_person, fits, with_people
from gym_mapbench.generator.sampling import (
    DrawnMap,
    draw_from,
    draw_map,
    draw_obstacle,
    find_way,
    is_drivable,
    plan_way,
)
from gym_mapbench.generator.shapes import (
    TASK_YAW,
    Cells,
    ShapeSettings,
    checked_cells,
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
    "MOTIFS",
    "TASK_YAW",
    "WITHOUT_ROUTE",
    "AlongRoute",
    "Around",
    "Cells",
    "Cellular",
    "DrawnMap",
    "Family",
    "FamilySpec",
    "FamilySpecs",
    "Motif",
    "MotifGenes",
    "PeopleSettings",
    "Route",
    "Section",
    "ShapeSettings",
    "build_genome",
    "checked_cells",
    "clear_and_border",
    "default_task",
    "disc",
    "draw_from",
    "draw_map",
    "draw_obstacle",
    "draw_person",
    "draw_position",
    "draw_shape",
    "elements_line",
    "find_way",
    "fits",
    "genome_of",
    "interior",
    "is_drivable",
    "legs_of",
    "make_family",
    "places",
    "plan_way",
    "read_genome",
    "sample_map",
    "stamp",
    "task_cells",
    "with_people",
]
