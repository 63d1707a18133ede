from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymoo.core.population import Population

from evolution.search.operators.changes import move, scale, scale_shape
from evolution.search.operators.crossover import CROSSOVERS, MapCrossover, pool_crossover, position_crossover
from evolution.search.operators.duplicates import MapSetDuplicates
from evolution.search.operators.edits import Edit
from evolution.search.operators.mutation import MapMutation, Mutator, draw_changes, label_obstacles
from evolution.search.operators.repair import MapRepair, repair_scenario
from evolution.search.operators.sampling import MapSampling, as_column, scenario_on
from evolution.search.operators.settings import MutationSettings
from gym_mapbench.errors import ConfigError, PluginError
from gym_mapbench.generator import FamilySpec, ShapeSettings, clear_and_border, sample_map
from gym_mapbench.world.scenario import MapSet, Scenario
from tests.evolution.fake_runs import SMALL, WAFFLE

seeds = st.integers(0, 2**32 - 1)
THESIS = ShapeSettings()
ONLY = {
    name: MutationSettings(
        shapes_per_map=(1, 1),
        **{f"{other}_probability": float(other == name) for other in ("move", "scale", "remove", "add")},
    )
    for name in ("move", "scale", "remove", "add")
}


def in_order(cells, shapes):
    return np.array_equal(cells, clear_and_border(cells, shapes))


def inner(cells):
    return cells[1:-1, 1:-1]


def edit_of(cells, labels, **options):
    """An edit of obstacle 1."""
    return Edit(cells, labels, 1, THESIS, MutationSettings(**options), WAFFLE)


def mutate_map(cells, shapes, options, rng, families=()):
    return Mutator(shapes, options, WAFFLE, families).vary(scenario_on(cells, shapes), rng)[0].map.occupancy


@given(seeds, seeds, st.sampled_from([SMALL, THESIS.replace(n_obstacles=(15, 20))]))
@settings(max_examples=60)
def test_mutation_keeps_border_and_cleared_areas_and_its_input(seed, map_seed, shapes):
    cells = sample_map(np.random.default_rng(map_seed), shapes)
    before = cells.copy()
    mutated = mutate_map(cells, shapes, MutationSettings(), np.random.default_rng(seed))
    assert np.array_equal(cells, before)
    assert in_order(mutated, shapes)
    assert np.array_equal(mutated, mutate_map(cells, shapes, MutationSettings(), np.random.default_rng(seed)))


@given(seeds, seeds)
@settings(max_examples=60)
def test_each_operation_does_what_its_name_says(seed, map_seed):
    cells = sample_map(np.random.default_rng(map_seed), THESIS.replace(n_obstacles=(3, 12)))
    labels, count = label_obstacles(inner(cells))
    removed, added = (mutate_map(cells, THESIS, ONLY[name], np.random.default_rng(seed)) for name in ("remove", "add"))
    assert not (removed & ~cells).any()
    assert label_obstacles(inner(removed))[1] == count - 1
    gone = inner(cells) & ~inner(removed)
    assert np.array_equal(gone, labels == labels[gone][0])
    assert not (cells & ~added).any()


@given(seeds, st.integers(1, 6), st.integers(1, 6), st.integers(0, 14), st.integers(0, 14))
def test_a_moved_obstacle_keeps_its_shape_and_stays_inside(seed, height, width, row, col):
    labels = np.zeros((20, 20), dtype=np.int32)
    labels[row : row + height, col : col + width] = 1
    moved = np.zeros((20, 20), dtype=np.bool_)
    move(edit_of(moved, labels, move_distance=5), np.random.default_rng(seed))
    [shape, new_row, new_col] = edit_of(moved, moved.astype(np.int32)).cut_out()
    assert shape.shape == (height, width)
    assert shape.all()
    assert max(abs(new_row - row), abs(new_col - col)) <= 5


def test_what_is_added_is_a_piece_of_a_family():
    families = [FamilySpec(name="doors", options={"thickness": [0.1, 0.1]})]
    empty = clear_and_border(np.zeros((150, 150), dtype=np.bool_), THESIS)
    for seed in range(10):
        rng = np.random.default_rng(seed)
        added = inner(mutate_map(empty, THESIS, ONLY["add"].replace(shapes_per_map=(1, 1)), rng, families))
        rows, cols = np.nonzero(added)
        sides = sorted((np.ptp(rows) + 1, np.ptp(cols) + 1))
        assert sides[0] == 2
        assert 2 < sides[1] <= 30
    column = as_column([MapSampling(2, THESIS).draw_set(rng)])
    settings = ONLY["add"].replace(probability=1.0)
    pairs = [
        MapMutation(Mutator(THESIS, settings, WAFFLE, families))._do(None, column, random_state=rng)[0, 0]
        for _ in range(2)
    ]
    assert pairs[0].digest != pairs[1].digest


@given(st.integers(1, 30), st.integers(1, 30), st.floats(0.3, 3.0))
def test_a_scaled_shape_has_the_scaled_size(height, width, factor):
    scaled = scale_shape(np.ones((height, width), dtype=np.bool_), factor)
    assert scaled.shape == (max(1, round(height * factor)), max(1, round(width * factor)))
    assert scaled.all()


def test_scaling_by_one_changes_nothing_and_keeps_the_middle():
    cells = np.zeros((40, 40), dtype=np.bool_)
    cells[10:16, 20:30] = True
    cells[12, 22] = False
    labels, _ = label_obstacles(cells)
    for factor, size in ((1.0, (6, 10)), (2.0, (12, 20)), (0.5, (3, 5))):
        scaled = np.zeros_like(cells)
        scale(edit_of(scaled, labels, scale_factor=(factor, factor)), np.random.default_rng(0))
        rows, cols = np.nonzero(scaled)
        assert (np.ptp(rows) + 1, np.ptp(cols) + 1) == size
        assert abs(rows.min() + rows.max() - 25) <= 1
        assert abs(cols.min() + cols.max() - 49) <= 1
        if factor == 1.0:
            assert np.array_equal(scaled, cells)


def test_an_empty_map_gets_obstacles():
    empty = clear_and_border(np.zeros((150, 150), dtype=np.bool_), THESIS)
    mutated = [mutate_map(empty, THESIS, ONLY["remove"], np.random.default_rng(seed)) for seed in range(5)]
    assert any((cells & ~empty).any() for cells in mutated)


def test_connectivity_says_what_one_obstacle_is():
    diagonal = np.eye(4, dtype=np.bool_)
    assert label_obstacles(diagonal, 4)[1] == 4
    assert label_obstacles(diagonal, 8)[1] == 1


def test_changes_follow_their_probabilities():
    rng = np.random.default_rng(0)
    changes = [change for _ in range(4000) for change in draw_changes(20, MutationSettings(), rng)]
    assert len(changes) / 4000 == pytest.approx(2.0, abs=0.05)
    shares = Counter(operation for _, operation in changes)
    assert {name: share / len(changes) for name, share in shares.items()} == pytest.approx(
        dict.fromkeys(("move", "scale", "remove", "add"), 0.25), abs=0.02
    )
    assert {obstacle for obstacle, _ in changes} == set(range(1, 21))
    for _ in range(100):
        chosen = [obstacle for obstacle, _ in draw_changes(3, MutationSettings(shapes_per_map=(3, 3)), rng)]
        assert sorted(chosen) == [1, 2, 3]


@given(seeds, st.lists(st.integers(0, 5), min_size=1, max_size=5), st.data())
def test_crossover_conserves_the_maps(seed, first, data):
    second = data.draw(st.lists(st.integers(0, 5), min_size=len(first), max_size=len(first)))
    for cross in CROSSOVERS.values():
        one, other = cross(first, second, np.random.default_rng(seed))
        assert len(one) == len(other) == len(first)
        assert Counter([*one, *other]) == Counter([*first, *second])


@given(seeds)
def test_position_crossover_keeps_positions(seed):
    one, other = position_crossover("abcde", "ABCDE", np.random.default_rng(seed))
    assert "".join(one).lower() == "".join(other).lower() == "abcde"


def test_pool_crossover_reaches_every_split():
    rng = np.random.default_rng(0)
    splits = {frozenset(pool_crossover("abc", "def", rng)[0]) for _ in range(400)}
    assert len(splits) == 20


def test_settings_are_checked():
    with pytest.raises(ConfigError, match="expected probabilities with a sum of 1"):
        MutationSettings(move_probability=0.5)
    with pytest.raises(ConfigError, match="shapes_per_map"):
        MutationSettings(shapes_per_map=(3, 1))


def small_sets(count, seed=0):
    rng = np.random.default_rng(seed)
    return [MapSampling(3, SMALL).draw_set(rng) for _ in range(count)]


class OneVariable:
    n_var = 1


def test_pymoo_operators_work_on_object_columns():
    rng = np.random.default_rng(1)
    population = MapSampling(3, SMALL).do(OneVariable(), 8, random_state=rng)
    assert [len(individual.X[0]) for individual in population] == [3] * 8
    mated = MapCrossover("pool", 1.0).do(
        OneVariable(), population, parents=np.array([[0, 1], [2, 3]]), random_state=rng
    )
    maps = Counter(scenario.digest for individual in population[:4] for scenario in individual.X[0])
    assert Counter(scenario.digest for individual in mated for scenario in individual.X[0]) == maps
    untouched = MapCrossover("pool", 0.0).do(OneVariable(), population, parents=np.array([[0, 1]]), random_state=rng)
    assert [individual.X[0] for individual in untouched] == [individual.X[0] for individual in population[:2]]


@pytest.mark.parametrize("probability", [0.0, 0.5, 1.0])
def test_individuals_are_mutated_with_p_m(probability):
    sets = small_sets(60)
    population = Population.new("X", as_column(sets))
    mutation = MapMutation(Mutator(SMALL, MutationSettings(probability=probability), WAFFLE))
    mutated = mutation.do(OneVariable(), population, random_state=np.random.default_rng(0))
    changed = [after.X[0] is not before for after, before in zip(mutated, sets, strict=True)]
    assert np.mean(changed) == pytest.approx(probability, abs=0.15)


def test_repair_restores_what_is_broken_and_nothing_else():
    cells = sample_map(np.random.default_rng(0), SMALL)
    fine = scenario_on(cells, SMALL)
    assert repair_scenario(fine, SMALL) is fine
    cells[0, :] = False
    cells[1, 1] = True
    broken = Scenario(type(fine.map)(cells, fine.map.resolution), fine.start, fine.goal)
    population = Population.new("X", as_column([MapSet((fine, broken))]))
    MapRepair(SMALL).do(OneVariable(), population, random_state=np.random.default_rng(0))
    repaired = population[0].X[0]
    assert repaired[0] is fine
    assert in_order(repaired[1].map.occupancy, SMALL)
    assert repaired[1].map.occupancy[1, 1]


def test_duplicates_are_found_by_content_in_any_order():
    one, other, third = small_sets(3)
    copy = MapSet(tuple(scenario_on(s.map.occupancy.copy(), SMALL) for s in reversed(one.scenarios)))
    fresh = Population.new("X", as_column([one, copy, other, third]))
    parents = Population.new("X", as_column([third]))
    kept = MapSetDuplicates().do(fresh, parents)
    assert [individual.X[0] for individual in kept] == [one, other]


def fill(edit, rng):
    edit.cells[:] = True


def stumble(edit, rng):
    raise LookupError("no obstacle is good enough")


HERE = "tests.evolution.search.test_operators"
NONE = {f"{name}_probability": 0.0 for name in ("move", "scale", "remove", "add")}


def test_operators_of_others_are_used_as_often_as_asked_for():
    options = MutationSettings(operators={f"{HERE}:fill": 0.5}, **NONE | {"add_probability": 0.5})
    rng = np.random.default_rng(0)
    names = [name for _ in range(2000) for _, name in draw_changes(20, options, rng)]
    assert names.count(f"{HERE}:fill") / len(names) == pytest.approx(0.5, abs=0.03)
    full = MutationSettings(operators={f"{HERE}:fill": 1.0}, **NONE)
    mutated = mutate_map(sample_map(rng, SMALL), SMALL, full, rng)
    assert np.array_equal(mutated, clear_and_border(np.ones_like(mutated), SMALL))


def test_operators_are_left_out_of_a_file_if_there_are_none():
    assert "operators" not in MutationSettings().model_dump(mode="json")
    options = MutationSettings(operators={f"{HERE}:fill": 0.5}, move_probability=0.0, scale_probability=0.0)
    assert MutationSettings(**options.model_dump(mode="json")) == options
    assert options.replace(connectivity=8).operators == options.operators


@pytest.mark.parametrize(
    ("operators", "message"),
    [
        ({"dor": 0.5}, "operators: unknown mutation operator 'dor'"),
        ({"add": 0.5}, "operators: expected other operators, got 'add', which has a probability of its own"),
        ({f"{HERE}:fill": 0.5}, "probabilities with a sum of 1, got move_probability 0.25, .*fill 0.5"),
        ({f"{HERE}:HERE": 0.5}, "expected a function"),
    ],
)
def test_wrong_operators(operators, message):
    with pytest.raises(ConfigError, match=message):
        MutationSettings(operators=operators)


def test_an_operator_that_fails_says_so():
    options = MutationSettings(operators={f"{HERE}:stumble": 1.0}, **NONE)
    with pytest.raises(PluginError, match=r"stumble': LookupError: no obstacle is good enough, test_operators.py line"):
        mutate_map(sample_map(np.random.default_rng(0), SMALL), SMALL, options, np.random.default_rng(0))


def fill_anew(edit, rng):
    """As ``fill``, in an array of its own."""
    edit.cells = np.ones_like(edit.cells)


def return_cells(edit, rng):
    return np.ones_like(edit.cells)


def shrink(edit, rng):
    edit.cells = edit.cells[1:]


def test_an_operator_may_replace_the_cells():
    cells = sample_map(np.random.default_rng(0), SMALL)
    options = MutationSettings(operators={f"{HERE}:fill_anew": 1.0}, shapes_per_map=(2, 2), **NONE)
    mutated = mutate_map(cells, SMALL, options, np.random.default_rng(0))
    assert np.array_equal(mutated, clear_and_border(np.ones_like(cells), SMALL))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("return_cells", "return_cells': expected a change of edit.cells and no result, got ndarray"),
        ("shrink", r"shrink': expected edit.cells as bool \(\d+, \d+\), got bool \(\d+, \d+\)"),
    ],
)
def test_an_operator_whose_change_would_be_lost_says_so(name, message):
    options = MutationSettings(operators={f"{HERE}:{name}": 1.0}, **NONE)
    with pytest.raises(PluginError, match=message):
        mutate_map(sample_map(np.random.default_rng(0), SMALL), SMALL, options, np.random.default_rng(0))
