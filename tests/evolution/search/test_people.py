from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evolution.search import EvolveSettings
from evolution.search.operators.mutation import Mutator
from evolution.search.operators.people_changes import PEOPLE_OPERATORS, change_people
from evolution.search.operators.repair import repair_scenario
from evolution.search.operators.sampling import MapSampling, scenario_on
from evolution.search.operators.settings import MutationSettings
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import PeopleSettings, ShapeSettings, clear_and_border, with_people
from gym_mapbench.world.clearance import check_clearance
from gym_mapbench.world.robot import ROBOTS

SMALL = ShapeSettings(size=100)
FOUR = PeopleSettings(count=4)
WAFFLE = ROBOTS["turtlebot3_waffle"]
SEEDS = st.integers(0, 2**32 - 1)


def sampled(seed, people=FOUR):
    return MapSampling(1, SMALL, people=people).draw_set(np.random.default_rng(seed))[0]


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_sampled_people_can_be_driven_among(seed):
    scenario = sampled(seed)
    assert 1 <= len(scenario.bodies) <= 4
    check_clearance(scenario, WAFFLE)
    assert sampled(seed) == scenario
    assert {body.motion.name for body in scenario.bodies} <= {"scripted", "wander"}
    assert all(0.3 <= body.motion.options["speed"] <= 1.3 for body in scenario.bodies)


def test_without_people_the_same_maps_are_sampled_as_ever():
    alone = MapSampling(2, SMALL, people=PeopleSettings()).draw_set(np.random.default_rng(3))
    assert alone == MapSampling(2, SMALL).draw_set(np.random.default_rng(3))
    assert not any(scenario.bodies for scenario in alone)


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_mutated_people_can_be_driven_among_and_the_walls_stay(seed):
    scenario, rng = sampled(seed), np.random.default_rng(seed)
    for _ in range(10):
        changed, names = change_people(scenario, FOUR, rng)
        assert changed.map == scenario.map
        assert (changed == scenario) == (not names)
        assert 1 <= len(changed.bodies) <= 8
        check_clearance(changed, WAFFLE)
        scenario = changed


@pytest.mark.parametrize("name", PEOPLE_OPERATORS)
def test_every_operator_changes_what_it_is_named_after(name):
    rng, scenario = np.random.default_rng(0), sampled(0)
    found = [made for made in (PEOPLE_OPERATORS[name](scenario, FOUR, rng) for _ in range(60)) if made is not None]
    assert found or len(scenario.bodies) >= 8
    more = {"add_person": 1, "remove_person": -1}.get(name, 0)
    key = {"change_speed": {"speed"}, "change_phase": {"phase"}, "move_waypoint": {"waypoints", "centre"}}
    for people in found:
        assert len(people) == len(scenario.bodies) + more
        if not more:
            pairs = [(a, b) for a, b in zip(scenario.bodies, people, strict=True) if a != b]
            ((before, after),) = pairs
            differing = {k for k, v in after.motion.options.items() if before.motion.options[k] != v}
            assert differing <= key[name]


@settings(max_examples=10, deadline=None)
@given(SEEDS)
def test_people_who_no_longer_fit_between_changed_walls_are_sampled_again(seed):
    none = PeopleSettings(count=4, mutation=0.0)
    scenario, rng = sampled(seed), np.random.default_rng(seed)
    varied, _ = Mutator(SMALL, MutationSettings(probability=1.0), WAFFLE, people=none).vary(scenario, rng)
    assert varied.map != scenario.map or varied.bodies == scenario.bodies
    assert 1 <= len(varied.bodies) <= 4
    check_clearance(varied, WAFFLE)


def test_repair_keeps_the_people_who_fit():
    scenario = sampled(1)
    broken = with_people(scenario, FOUR, np.random.default_rng(0), scenario.bodies)
    assert repair_scenario(broken, SMALL) is broken


def test_maps_without_room_are_refused_and_walls_that_leave_no_room_stay():
    def full(rng, shapes):
        return clear_and_border(np.ones((shapes.size, shapes.size), dtype=bool), shapes)

    with pytest.raises(ConfigError, match="expected maps with room for a person, got none in 20"):
        MapSampling(1, SMALL, full, PeopleSettings(count=1)).draw_set(np.random.default_rng(0))
    scenario = sampled(0)
    fat = PeopleSettings(count=4, radius=1.0, mutation=0.0)
    narrow = with_people(scenario_on(full(None, SMALL), SMALL), fat, np.random.default_rng(0), scenario.bodies)
    assert narrow.bodies == ()


def test_people_are_recorded_only_where_they_are_asked_for():
    assert "people" not in EvolveSettings().model_dump(mode="json")
    chosen = EvolveSettings(people={"count": 3})
    assert EvolveSettings.from_mapping(chosen.model_dump(mode="json"), "search") == chosen


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"count": 51}, "count: expected"),
        ({"speed": [1.0, 0.5]}, r"speed: expected \(slowest, fastest\)"),
        ({"speed": [0.1, float("nan")]}, "speed"),
        ({"radius": 0}, "radius: expected"),
    ],
)
def test_bad_options_are_one_clear_line(options, message):
    with pytest.raises(ConfigError, match=message) as caught:
        PeopleSettings(**options)
    assert "\n" not in str(caught.value)
