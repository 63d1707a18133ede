"""Mutation of one map at a time: informed operators, ways that stay open, and adaptive operator selection."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from evolution.search.operators.adaptive import Credit, Trial
from evolution.search.operators.mutation import MapMutation, Mutator, draw_changes, label_obstacles, obstacles_near
from evolution.search.operators.sampling import MapSampling, as_column, scenario_on
from evolution.search.operators.settings import MutationSettings
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import ShapeSettings, interior, is_drivable, plan_way, sample_map
from tests.evolution.fake_runs import WAFFLE

THESIS = ShapeSettings()
NONE = {f"{name}_probability": 0.0 for name in ("move", "scale", "remove", "add")}


def mutator(name, **options):
    """A mutator that does one thing to one obstacle."""
    settings = MutationSettings(**NONE, operators={name: 1.0}, shapes_per_map=(1, 1), maps="one", **options)
    return Mutator(THESIS, settings, WAFFLE)


def vary(mutates, cells, rng):
    varied, names = mutates.vary(scenario_on(cells, THESIS), rng)
    return varied.map.occupancy, names


def drivable_maps(count=4):
    rng = np.random.default_rng(3)
    maps = (sample_map(rng, THESIS) for _ in range(50))
    return [cells for cells in maps if is_drivable(cells, THESIS, WAFFLE)][:count]


@pytest.mark.parametrize("cells", drivable_maps())
def test_a_nudge_moves_an_obstacle_near_the_way_by_one_to_three_cells(cells):
    mutated, names = vary(mutator("nudge"), cells, np.random.default_rng(0))
    assert names == ("nudge",)
    changed = np.argwhere(mutated != cells)
    way = plan_way(cells, THESIS, WAFFLE)[:, ::-1] / THESIS.resolution - 0.5
    labels, count = label_obstacles(interior(cells, THESIS.border))
    assert len(changed) > 0
    nearest = obstacles_near(way[:, ::-1] - THESIS.border, labels)[:3]
    allowed = ndimage.binary_dilation(np.isin(labels, nearest), iterations=6)
    assert allowed[tuple((changed - THESIS.border).T)].all()
    assert count - 1 <= label_obstacles(interior(mutated, THESIS.border))[1] + 3


@pytest.mark.parametrize("cells", drivable_maps())
def test_a_new_obstacle_is_put_beside_the_way(cells):
    way = plan_way(cells, THESIS, WAFFLE)
    for seed in range(5):
        mutated, _ = vary(mutator("near_way"), cells, np.random.default_rng(seed))
        added = np.argwhere(mutated & ~cells)
        if len(added) == 0:  # it fell on other obstacles
            continue
        places = (added[:, ::-1] + 0.5) * THESIS.resolution
        assert np.linalg.norm(places[:, None] - way[None], axis=2).min() < 0.8 + 0.1


def test_a_door_leaves_a_gap_in_a_wall_across_the_way():
    cells = nearly_free()
    way, widest = plan_way(cells, THESIS, WAFFLE), []
    for seed in range(10):
        mutated, _ = vary(mutator("door"), cells, np.random.default_rng(seed))
        if not (mutated & ~cells).any():  # in the cleared areas of start and goal
            continue
        added = (np.argwhere(mutated & ~cells)[:, ::-1] + 0.5) * THESIS.resolution
        assert np.linalg.norm(added[:, None] - way[None], axis=2).min() < 0.3 + 0.45 + 0.1
        _, _, axes = np.linalg.svd(added - added.mean(axis=0))
        along, across = np.sort((added - added.mean(axis=0)) @ axes.T, axis=0).T
        assert np.ptp(across) < 0.2 + 0.1
        assert np.diff(along).max() < 0.9 + 0.1
        widest.append(np.diff(along).max())
    assert np.median(widest) > 0.45


def nearly_free():
    """A map with one obstacle in a corner; on a map without any, mutation only adds."""
    cells = np.ones((THESIS.size, THESIS.size), dtype=bool)
    interior(cells, THESIS.border)[:] = False
    cells[140:145, 140:145] = True
    return cells


def test_redrawing_replaces_every_other_change():
    settings = MutationSettings(
        **{**NONE, "move_probability": 0.5}, operators={"redraw": 0.5}, shapes_per_map=(3, 3), maps="one"
    )
    rng = np.random.default_rng(0)
    drawn = [draw_changes(9, settings, rng) for _ in range(200)]
    assert {len(changes) for changes in drawn if ("redraw" in [name for _, name in changes])} == {1}
    assert {len(changes) for changes in drawn if all(name == "move" for _, name in changes)} == {3}
    (cells, *_) = drivable_maps(1)
    mutated, names = vary(mutator("redraw"), cells, np.random.default_rng(1))
    assert names == ("redraw",)
    assert (mutated != cells).mean() > 0.02


def test_a_mutation_that_must_leave_a_way_does():
    (cells, *_) = drivable_maps(1)
    blocked = 0
    for seed in range(12):
        closed, _ = vary(mutator("door"), cells, np.random.default_rng(seed))
        left, _ = vary(mutator("door", drivable=True), cells, np.random.default_rng(seed))
        blocked += not is_drivable(closed, THESIS, WAFFLE)
        assert is_drivable(left, THESIS, WAFFLE)
    assert blocked > 0


def test_one_map_of_a_set_is_mutated_and_the_trial_is_noted():
    rng = np.random.default_rng(0)
    before = MapSampling(3, THESIS).draw_set(rng)
    settings = MutationSettings(probability=1.0, maps="one", adaptive=True)
    mutation = MapMutation(Mutator(THESIS, settings, WAFFLE), role_of=lambda map_set, place: 2 - place)
    (after,) = mutation._do(None, as_column([before]), random_state=rng)[0]
    changed = [place for place in range(3) if before[place].map.digest != after[place].map.digest]
    assert len(changed) == 1
    (trial,) = mutation.trials
    assert (trial.before.digest, trial.after.digest, trial.role) == (before.digest, after.digest, 2 - changed[0])
    mutation.credit_trials(lambda trial: 3.0)
    assert mutation.trials == []
    assert mutation.credit.of(trial.role) == pytest.approx((3.0 + 3.0) / 2)


def test_operators_with_a_gain_are_selected_more_often_and_none_is_dropped():
    credit = Credit()
    configured = {"move": 0.5, "door": 0.25, "nudge": 0.25}
    assert credit.chances(configured, 0) == pytest.approx(configured)
    rng = np.random.default_rng(0)
    before = MapSampling(1, THESIS).draw_set(rng)
    for _ in range(50):
        credit.add(Trial(before, before, 0, ("move",)), -1.0)
        credit.add(Trial(before, before, 0, ("door",)), 2.0)
    chances = credit.chances(configured, 0)
    assert sum(chances.values()) == pytest.approx(1)
    assert chances["door"] > chances["nudge"] > chances["move"] > 0
    assert credit.chances(configured, 1) == pytest.approx(configured)
    assert credit.of(1) == pytest.approx(1.0)
    assert credit.of(0) == pytest.approx((1.0 + 100.0) / 101)


def test_adaptive_operator_selection_needs_a_gain_with_one_cause():
    with pytest.raises(ConfigError, match="adaptive: expected maps 'one' beside it, got 'all'"):
        MutationSettings(adaptive=True)
