"""Motifs along a route: what their genes mean, and that genomes are the maps they describe."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import (
    MOTIFS,
    FamilySpec,
    MotifGenes,
    Route,
    Section,
    ShapeSettings,
    build_genome,
    clear_and_border,
    default_task,
    draw_from,
    elements_line,
    find_way,
    genome_of,
    legs_of,
    make_family,
    places,
    read_genome,
    task_cells,
)
from gym_mapbench.generator.motifs.around import Around
from gym_mapbench.generator.motifs.pillar_rows import PillarRows
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import make_robot

THESIS = ShapeSettings()
WAFFLE = make_robot("turtlebot3_waffle")
START, GOAL = (((col + 0.5) * 0.05, (row + 0.5) * 0.05) for row, col in task_cells((150, 150), 11))
EVEN = {"phase": 0.0, "shift": 0.0, "slope": 0.0, "swing": 0.0}
seeds = st.integers(0, 2**32 - 1)


def gates(count, route="diagonal", elements=None, **shared):
    """Genes of equal gates."""
    values = {"pitch": 1.5, "gap": 0.8, "thickness": 0.2, **EVEN, **shared}
    section = Section(shared=values, elements=elements or ({},) * count)
    return MotifGenes(route=Route(name=route), sections=(section,))


def built(genes, name="gates"):
    return make_family(name).build(genes, THESIS)


def test_oblique_gates_by_hand():
    """Three walls of 0.2 m, 1.5 m apart, their gaps of 0.8 m where the diagonal crosses them."""
    expected = np.zeros((150, 150), dtype=bool)
    for middle in (75 - 30, 75, 75 + 30):
        rows = slice(middle - 2, middle + 2)
        expected[rows] = True
        expected[rows, 150 - middle - 8 : 150 - middle + 8] = False
    assert np.array_equal(built(gates(3)), clear_and_border(expected, THESIS))


def test_a_mirrored_diagonal_route_is_the_mirror_image():
    genes = gates(3, shift=0.3)
    mirrored = built(genes.replace(route=Route(name="diagonal", mirrored=True)))
    shifted = built(gates(3, shift=-0.3))
    assert np.array_equal(mirrored, shifted[::-1, ::-1].T)


@pytest.mark.parametrize(
    ("shared", "moved"),
    [
        ({"shift": 0.3}, [(-0.3, 0.0)] * 2),
        ({"phase": 0.2}, [(-0.3, 0.3)] * 2),
        ({"swing": 0.4}, [(-0.2, 0.0), (0.2, 0.0)]),
        ({"slope": 0.2}, [(0.15, 0.0), (-0.15, 0.0)]),
    ],
)
def test_what_the_shared_genes_move(shared, moved):
    family = make_family("gates")
    before, after = (
        [place.centre for place in places(family, genes, START, GOAL)] for genes in (gates(2), gates(2, **shared))
    )
    assert np.allclose(np.subtract(after, before), moved)


def test_an_element_deviates_alone():
    family = make_family("gates")
    genes = gates(2, elements=({}, {"gap": 0.1, "shift": 0.25}))
    first, second = places(family, genes, START, GOAL)
    plain = list(places(family, gates(2), START, GOAL))
    assert np.allclose(first.centre, plain[0].centre)
    assert np.allclose(second.centre - plain[1].centre, (-0.25 * 0.8, 0.0))
    section = genes.sections[0]
    assert family.values(section, 0)["gap"] == 0.8
    assert math.isclose(family.values(section, 1)["gap"], 0.8 + 0.1 * 0.4)


@given(st.floats(-1, 1))
def test_a_bent_route_leads_from_start_to_goal_and_turns_by_a_right_angle_at_most(bend):
    first, second = legs_of(Route(name="bent", bend=bend), START, GOAL)
    assert np.allclose(first.start, START)
    assert np.allclose(first.end, second.start)
    assert np.allclose(second.end, GOAL)
    assert first.along @ second.along > -1e-9
    corner = np.array([START[0], GOAL[1]]) if bend > 0 else np.array([GOAL[0], START[1]])
    middle = np.add(START, GOAL) / 2
    assert np.allclose(first.end, middle + abs(bend) * (corner - middle))


@pytest.mark.parametrize("name", [*MOTIFS.built_in, "sequences"])
@given(seed=seeds)
@settings(max_examples=20, deadline=None)
def test_a_genome_is_the_map_and_its_values_lie_in_their_ranges(name, seed):
    spec = FamilySpec(name=name)
    family = spec.make()
    genes = family.draw_genes(np.random.default_rng(seed))
    genome = genome_of(spec, genes)
    assert read_genome(genome)[1] == genes
    assert np.array_equal(build_genome(genome, THESIS), family.build(genes, THESIS))
    for section in genes.sections:
        motif = family.motif(section.motif)
        assert motif.count[0] <= len(section.elements) <= motif.count[1]
        for number in range(len(section.elements)):
            for gene, value in motif.values(section, number).items():
                low, high = motif.ranges[gene]
                assert low <= value <= high


def test_the_line_of_elements_begins_at_the_start_and_ends_at_the_goal():
    genome = genome_of(FamilySpec(name="gates"), gates(3))
    line = elements_line(genome, START, GOAL)
    assert len(line) == 5
    assert np.allclose(line[[0, 2, -1]], [START, (3.75, 3.75), GOAL])


def test_only_maps_of_motifs_have_a_genome():
    rng = np.random.default_rng(0)
    assert draw_from(rng, [FamilySpec(name="doors")], THESIS, WAFFLE).genome is None
    one = draw_from(rng, [FamilySpec(name="baffles", options={"count": [2, 2]})], THESIS, WAFFLE)
    assert np.array_equal(build_genome(one.genome, THESIS), one.cells)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"family": "doors"}, "expected a family of motifs along a route, got 'doors'"),
        ({"family": "gatez"}, "did you mean 'gates'"),
        ({"options": {"gap": [0.9, 0.7]}}, "gap"),
        ({"genes": {"route": {"name": "round"}, "sections": []}}, "route.name"),
        ({"genes": gates(1, width=1.0).model_dump(mode="json")}, "expected the genes of the motif, 'width' differs"),
    ],
)
def test_a_genome_that_is_none_of_its_family_is_refused(change, problem):
    genome = genome_of(FamilySpec(name="gates"), gates(2)).replace(**change)
    with pytest.raises(ConfigError, match=problem):
        read_genome(genome)


@pytest.mark.parametrize("route", ["diagonal", "straight", "bent"])
def test_a_map_without_room_is_refused(route):
    with pytest.raises(ConfigError, match=r"size: expected a map with room for motifs .*, got 40 cells"):
        make_family("gates").build(gates(1, route), THESIS.replace(size=40))
    assert make_family("gates").build(gates(1, route), THESIS.replace(size=70))[1:-1, 1:-1].any()


def test_a_sequence_names_its_motifs():
    with pytest.raises(ConfigError, match="did you mean 'gates'"):
        make_family("sequences", motifs={"gate": {}})
    family = make_family("sequences", motifs={"gates": {"count": [1, 1]}, "dead_ends": {}}, sections=(3, 3))
    genes = family.draw_genes(np.random.default_rng(0))
    assert len(genes.sections) == 3
    assert {section.motif for section in genes.sections} <= {"gates", "dead_ends"}


def test_gaps_leave_every_robot_the_same_room():
    burger, gate = make_robot("turtlebot3_burger"), FamilySpec(name="gates")  # 0.21 m wide, 0.23 m less than usual
    assert gate.for_robot(WAFFLE) is gate
    assert gate.for_robot(burger).options == {"gap": [0.47, 0.87]}
    given = FamilySpec(name="gates", options={"gap": [0.6, 0.7], "count": [1, 2]})
    assert given.for_robot(burger) == given
    of_sequence = FamilySpec(name="sequences", options={"motifs": {"bends": {}, "gates": {"gap": [0.5, 0.6]}}})
    assert of_sequence.for_robot(burger).options["motifs"] == {
        "bends": {"width": [0.42, 0.87]},
        "gates": {"gap": [0.5, 0.6]},
    }
    assert FamilySpec(name="doors").for_robot(burger).options == {}


@pytest.mark.parametrize("name", [*MOTIFS.built_in, "sequences"])
def test_a_map_for_a_narrow_robot_is_built_again_from_its_genome(name):
    drawn = draw_from(np.random.default_rng(3), [FamilySpec(name=name)], THESIS, make_robot("turtlebot3_burger"))
    assert (build_genome(drawn.genome, THESIS) == drawn.cells).all()


def seen_from(seed):
    """Cells around an element, and plain NumPy's distances of their centres, along the route and to the left of it."""
    rng = np.random.default_rng(seed)
    east, north = (rng.uniform(-4.0, 4.0, size) for size in (40, 30))
    x, y = forward = rng.choice([[0.0, 1.0], [-1.0, 0.0], [-0.6, 0.8], [-math.sqrt(0.5), math.sqrt(0.5)]])
    distances = (east * a + north[:, None] * b for a, b in (forward, (-y, x)))
    return Around(east, north, forward, 0, 0.05), *distances


def within(distances, width):
    return (distances >= -width / 2) & (distances < width / 2)


@settings(max_examples=50, deadline=None)
@given(seed=seeds, width=st.floats(0.0, 9.0), moved=st.tuples(*[st.floats(-3.0, 3.0)] * 2))
def test_cells_around_an_element_are_those_of_plain_numpy(seed, width, moved):
    around, along, across = seen_from(seed)
    beside = around.moved(*moved)
    for seen, offsets in ((around, (0.0, 0.0)), (beside, moved)):
        assert np.array_equal(seen.along, along - offsets[0])
        assert np.array_equal(seen.across, across - offsets[1])
        assert np.array_equal(seen.within_along(width), within(along - offsets[0], max(width, 0.05)))
        assert np.array_equal(seen.within_across(width), within(across - offsets[1], max(width, 0.05)))


def test_the_lower_edge_alone_belongs_to_a_strip():
    edges = np.array([-1.0, 0.0, 1.0])
    around = Around(edges, edges, np.array([0.0, 1.0]), 0, 0.05)
    assert around.within_along(2.0)[:, 0].tolist() == [True, True, False]
    assert around.within_across(2.0)[0].tolist() == [False, True, True]


@settings(max_examples=30, deadline=None)
@given(seed=seeds, gap=st.floats(0.01, 1.5), side=st.floats(0.01, 1.5))
def test_pillars_are_those_of_the_formula_on_all_cells(seed, gap, side):
    around, along, across = seen_from(seed)
    walls = PillarRows().walls(around, {"gap": gap, "side": side})
    gap, side = max(gap, 0.05), max(side, 0.05)
    assert np.array_equal(walls, within(along, side) & ((across + gap / 2) % (gap + side) >= gap))


def test_the_way_of_equal_maps_is_planned_once_and_cannot_be_changed():
    task = default_task(GridMap(built(gates(3))))
    way = find_way(GridMap(built(gates(3))), *task, WAFFLE)
    assert find_way(GridMap(built(gates(3))), *task, WAFFLE) is way
    with pytest.raises(ValueError, match="read-only"):
        way[0] = 0.0


def test_the_way_is_that_of_map_task_and_robot():
    grid = GridMap(built(gates(3)))
    narrow = GridMap(make_family("gates", gap=(0.4, 0.4)).build(gates(3), THESIS))
    start, goal = default_task(grid)
    for asked in range(2):
        assert find_way(grid, start, goal, WAFFLE) is not None, asked
        assert find_way(narrow, start, goal, WAFFLE) is None, asked
        assert find_way(narrow, start, goal, make_robot("turtlebot3_burger")) is not None, asked
        assert find_way(grid, goal, start, WAFFLE)[-1].tolist() == list(start[:2]), asked
