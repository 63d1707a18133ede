"""What every family of maps keeps: the same seed, the same map; genes that are plain data; a way for the robot."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy import ndimage

from gym_mapbench.costmap import CostmapParams, build_static_costmap
from gym_mapbench.env.task import DistanceToGoal
from gym_mapbench.generator import (
    FAMILIES,
    FamilySpec,
    ShapeSettings,
    clear_and_border,
    default_task,
    draw_from,
    make_family,
)
from gym_mapbench.planners import make_planner
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import Scenario

THESIS = ShapeSettings()
DRAWS = 50
CROSS = ndimage.generate_binary_structure(2, 1)
INFLATIONS = (CostmapParams.example_global(), CostmapParams())


def drawn(name, robot, seed, shapes=THESIS):
    return draw_from(np.random.default_rng(seed), [FamilySpec(name=name)], shapes, make_robot(robot))


def rebuilt(name, genes, shapes=THESIS):
    """A map of the genes as they come back from a file."""
    family = make_family(name)
    text = json.dumps(genes.model_dump(mode="json"))
    read = family.genes.from_mapping(json.loads(text), name)
    assert read == genes
    return family.build(read, shapes)


def planned_points(grid, params, robot):
    """Points of NavFn's own plan; raises where there is none."""
    costmap = build_static_costmap(grid, params, params.make_footprint(robot))
    return len(make_planner("navfn", tolerance=0.0).plan(costmap, *default_task(grid)))


@pytest.mark.parametrize("name", tuple(FAMILIES))
def test_the_same_seed_is_the_same_map_and_others_differ(name):
    maps = [drawn(name, "turtlebot3_waffle", seed) for seed in (0, 0, *range(1, 10))]
    assert maps[0].genes == maps[1].genes
    assert maps[0].cells.tobytes() == maps[1].cells.tobytes()
    assert len({one.cells.tobytes() for one in maps}) == 10


@pytest.mark.parametrize("name", tuple(FAMILIES))
@pytest.mark.parametrize("robot", ["turtlebot3_waffle", "turtlebot3_burger"])
def test_the_robot_gets_through_even_between_thicker_walls(name, robot):
    rng, spec = np.random.default_rng(1), make_robot(robot)
    for number in range(DRAWS):
        one = draw_from(rng, [FamilySpec(name=name)], THESIS, spec)
        assert np.array_equal(one.cells, clear_and_border(one.cells, THESIS))
        for cells in (one.cells, ndimage.binary_dilation(one.cells, CROSS)):
            grid = GridMap(cells, THESIS.resolution)
            assert planned_points(grid, INFLATIONS[number % 2], spec) <= 4 * THESIS.size
            assert DistanceToGoal(Scenario(grid, *default_task(grid)), spec).solvable


@pytest.mark.parametrize("name", tuple(FAMILIES))
def test_genes_come_back_from_json_and_make_the_same_map(name):
    rng = np.random.default_rng(2)
    for _ in range(10):
        one = draw_from(rng, [FamilySpec(name=name)], THESIS, make_robot("turtlebot3_waffle"))
        assert np.array_equal(rebuilt(name, one.genes), one.cells)


@pytest.mark.parametrize("name", tuple(FAMILIES))
def test_the_same_genes_make_a_map_of_any_size_and_resolution(name):
    for size, resolution in ((100, 0.1), (300, 0.025)):
        shapes = THESIS.replace(size=size, resolution=resolution)
        one = drawn(name, "turtlebot3_waffle", 3, shapes)
        assert one.cells.shape == (size, size)
        assert np.array_equal(one.cells, clear_and_border(one.cells, shapes))
        assert rebuilt(name, one.genes).shape == (150, 150)


@pytest.mark.parametrize("name", tuple(FAMILIES))
def test_a_family_says_what_its_maps_look_like(name):
    picture = FAMILIES[name].__doc__
    rows = [row.strip() for row in picture.splitlines() if row.strip().startswith("#")]
    assert len(rows) >= 8
    assert len({len(row) for row in rows}) == 1
    assert sum("G" in row for row in rows) == sum("S" in row for row in rows) == 1
