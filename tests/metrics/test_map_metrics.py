from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gym_mapbench.kernels.pathmeasures import characteristic_dimension, dispersion, visibility
from gym_mapbench.metrics.map_metrics import (
    MEASURES,
    configuration_space,
    find_path,
    footprint_cells,
    measure_map,
    narrowest_passage,
)
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import RobotSpec, make_robot
from gym_mapbench.world.scenario import Pose, Scenario
from tests.oracle_data import DATA, needs_data

CELLS = st.tuples(st.integers(1, 9), st.integers(1, 9)).flatmap(lambda shape: arrays(np.bool_, shape))
POINT = RobotSpec(radius=1e-6)


def corridor(width, length=20):
    """A corridor between two walls; the task leads along its middle row."""
    rows = ["#" * length, *["." * length] * width, "#" * length]
    grid = GridMap.from_rows(rows, 0.1)
    y = 0.1 * (width // 2 + 1.5)
    return Scenario(grid, Pose(0.05, y), Pose(0.1 * length - 0.05, y))


def reaches(free, start, goal):
    return len(find_path(free, start, goal)[0]) > 0


def framed(rows):
    return np.pad(np.array([list(row) for row in rows])[::-1] == "#", 1, constant_values=True)


def test_a_straight_corridor():
    measures = measure_map(corridor(5), POINT)
    assert measures["occupied_share"] == pytest.approx(2 / 7)
    assert measures["solvable"] == 1.0
    assert measures["path_length"] == pytest.approx(1.9)
    assert measures["tortuosity"] == 1.0
    assert measures["closest_obstacle"] == pytest.approx((2 * (0.1 + 0.2) + 16 * 0.3) / 20)
    assert tuple(measures) == MEASURES


@pytest.mark.parametrize(("cells", "width"), [(1, 1.0), (2, 2.0), (3, 3.0), (4, 4.0)])
def test_narrowest_passage_is_exact_for_odd_and_even_widths(cells, width):
    door = ["#" if not 3 <= row < 3 + cells else "." for row in range(10)]
    columns = ["##########", *[".........."] * 6, door, *[".........."] * 6, "##########"]
    rows = ["".join(column[row] for column in columns) for row in range(10)]
    # The rows at the rim are open: the map's edge is the wall there.
    grid = GridMap.from_rows(rows, 1.0)
    assert narrowest_passage(grid, (5, 4), (5, 10)) == pytest.approx(width)


def test_start_and_goal_are_places_and_no_way_is_zero():
    grid = GridMap.from_rows([".....#....."] * 5, 1.0)
    assert narrowest_passage(grid, (2, 2), (2, 8)) == 0.0
    assert narrowest_passage(grid, (2, 2), (2, 1)) == pytest.approx(3.0)
    assert narrowest_passage(grid, (2, 2), (2, 2)) == pytest.approx(5.0)
    assert narrowest_passage(GridMap.from_rows(["#"]), (0, 0), (0, 0)) == 0.0


def test_barns_measures_by_hand():
    blocked = framed([".....", "..#..", ".....", ".....", "#...."])
    # In the frame, the middle of the field is row 3, column 3; a wall stands one above it.
    root = math.sqrt(2)
    # left 3, below 3, right 3, above 1; lower left 2 diagonals, lower right 3, upper right 3, upper left 3.
    assert visibility(blocked, 3, 3) == pytest.approx((3 + 3 + 3 + 1 + (2 + 3 + 3 + 3) * root) / 8)
    assert characteristic_dimension(blocked, 3, 3) == pytest.approx(2.0)
    # Within one cell only the wall above is seen: open, closed, open.
    assert dispersion(blocked, 3, 3, 1) == 2
    # Within two, the corner at the lower left too.
    assert dispersion(blocked, 3, 3, 2) == 4


def slow_fan(blocked, row, col, radius):
    """Which of 16 directions meet a wall within the radius, by name of the angle."""
    seen = []
    for k in range(16):
        angle = k * math.pi / 8
        length = 1 if k % 2 == 0 else 2
        step = (round(length * math.sin(angle)), round(length * math.cos(angle)))
        if k % 2 == 0:
            step = (round(math.sin(angle) * 1.2), round(math.cos(angle) * 1.2))
        hit = False
        for n in range(1, -(-radius // length) + 1):
            r, c = row + n * step[0], col + n * step[1]
            if not (0 <= r < blocked.shape[0] and 0 <= c < blocked.shape[1]):
                break
            if blocked[r, c]:
                hit = True
                break
        seen.append(hit)
    return sum(a != b for a, b in zip(seen, seen[1:] + seen[:1], strict=True))


@given(cells=CELLS, radius=st.integers(1, 5), data=st.data())
@settings(max_examples=80, deadline=None)
def test_dispersion_is_that_of_a_plain_fan(cells, radius, data):
    blocked = np.pad(cells, 1, constant_values=True)
    row = data.draw(st.integers(1, cells.shape[0]))
    col = data.draw(st.integers(1, cells.shape[1]))
    assert dispersion(blocked, row, col, radius) == slow_fan(blocked, row, col, radius)


@pytest.mark.parametrize(("radius", "fits"), [(0.149, True), (0.15, True), (0.151, False)])
def test_a_disc_fits_between_walls_it_only_touches(radius, fits):
    measures = measure_map(corridor(3), RobotSpec(radius=radius))
    assert measures["narrowest_passage"] == pytest.approx(0.1)  # the task begins at the map's edge
    inside = configuration_space(corridor(3).map, RobotSpec(radius=radius))[0]
    assert inside[2, 10] == fits
    assert measures["solvable"] == 0.0
    assert all(math.isnan(measures[name]) for name in MEASURES[4:])


def test_footprint_cells_of_a_box():
    box = np.array([[0.21, 0.165], [-0.21, 0.165], [-0.21, -0.165], [0.21, -0.165]])
    straight = {tuple(cell) for cell in footprint_cells(box, 0.0, 0.1)}
    assert straight == {(row, col) for row in range(-2, 3) for col in range(-2, 3)}
    upright = {tuple(cell) for cell in footprint_cells(box, math.pi / 2, 0.05)}
    assert upright == {(row, col) for row in range(-4, 5) for col in range(-3, 4)}
    bar = np.array([[1.5, 0.5], [-1.5, 0.5], [-1.5, -0.5], [1.5, -0.5]])
    assert {tuple(cell) for cell in footprint_cells(bar, 0.0, 1.0)} == {(0, -1), (0, 0), (0, 1)}


BAR = RobotSpec(footprint=((0.24, 0.04), (-0.24, 0.04), (-0.24, -0.04), (0.24, -0.04)))


def test_a_polygon_passes_where_it_need_not_turn():
    cells = np.ones((13, 28), bool)
    cells[1:-1, 1:11] = cells[1:-1, 17:-1] = False  # two rooms
    cells[6, 11:17] = False  # and a slit between them, one cell wide
    grid = GridMap(cells, 0.1)
    start, goal = (6, 5), (6, 22)
    free = configuration_space(grid, BAR)
    assert reaches(free, start, goal)
    assert not free[4, 6, 14]  # upright it does not fit into the slit
    assert not reaches(configuration_space(grid, RobotSpec(radius=0.24)), start, goal)


def test_a_polygon_cannot_turn_in_a_bend_that_is_too_narrow():
    grid = GridMap.from_rows(["#######", "######.", "######.", "######.", "######.", ".......", "#######"], 0.1)
    start, goal = (1, 3), (3, 6)
    free = configuration_space(grid, BAR)
    assert free[0, *start]
    assert free[4, *goal]
    assert not reaches(free, start, goal)
    assert reaches(configuration_space(grid, RobotSpec(radius=0.04)), start, goal)


@given(cells=CELLS, radius=st.floats(0.01, 0.3))
@settings(max_examples=40, deadline=None)
def test_a_polygon_like_a_disc_fits_where_the_disc_does(cells, radius):
    grid = GridMap(cells, 0.1)
    angles = np.arange(8) * math.pi / 4
    outline = tuple((radius * math.cos(a), radius * math.sin(a)) for a in angles)
    disc = configuration_space(grid, RobotSpec(radius=radius))[0]
    polygon = configuration_space(grid, RobotSpec(footprint=outline))
    assert polygon[:, disc].all()
    inner = configuration_space(grid, RobotSpec(radius=radius * math.cos(math.pi / 8)))[0]
    assert not polygon[:, ~inner].any()


@given(cells=CELLS, data=st.data())
@settings(max_examples=60, deadline=None)
def test_every_map_is_measured(cells, data):
    cells[0, 0] = cells[-1, -1] = False
    grid = GridMap(cells, 0.1)
    scenario = Scenario(grid, Pose(*grid.cell_to_world(0, 0)), Pose(*grid.cell_to_world(*np.array(cells.shape) - 1)))
    robot = data.draw(st.sampled_from([POINT, BAR, RobotSpec(radius=0.1)]))
    measures = measure_map(scenario, robot)
    finite = [name for name in MEASURES if math.isfinite(measures[name])]
    assert len(finite) == (len(MEASURES) if measures["solvable"] else 3)
    if measures["solvable"]:
        assert measures["tortuosity"] >= 1.0 - 1e-12
        assert measures["narrowest_passage"] > 0.0


@needs_data
def test_published_maps_are_solvable_for_their_robots():
    from gym_mapbench.mapio import load_scenarios

    for scenario in load_scenarios(f"barn:{DATA / 'barn'}"):
        measures = measure_map(scenario, make_robot("jackal"))
        assert measures["solvable"] == 1.0
        assert measures["narrowest_passage"] > 0.33
    for scenario in load_scenarios(DATA / "mrpb"):
        assert measure_map(scenario, RobotSpec(radius=0.25))["solvable"] == 1.0
