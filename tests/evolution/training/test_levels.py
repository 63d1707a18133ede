from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from evolution.training.levels import GivenLevels, RandomLevels, ReplayedLevels, is_split, split
from evolution.training.settings import ReplaySettings, Stage, TrainSettings
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenario
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

WORLD = EnvConfig()


def level(number):
    """A room of its own size."""
    side = 12 + number
    rows = ["#" * side, *["#" + "." * (side - 2) + "#"] * 10, "#" * side]
    return Scenario(GridMap.from_rows(rows, 0.25), Pose(1.0, 1.0), Pose(2.0, 1.0), str(number))


def rng(seed=0):
    return np.random.default_rng(seed)


def replayed(count=3, fresh=(), **settings):
    options = ReplaySettings(**{"probability": 1.0, "staleness": 0.0, **settings})
    return ReplayedLevels(options, GivenLevels(fresh or [level(50)], rng()), [level(i) for i in range(count)], rng(1))


def random_levels(*stages, seed=0, **settings):
    options = {"anywhere": 0.0, "reuse": 1.0, **settings}
    return RandomLevels(TrainSettings(algorithm="ppo", steps=1, world=WORLD, obstacles=stages, **options), rng(seed))


def test_the_number_of_obstacles_follows_the_stages():
    stages = (Stage(after=0.0, fewest=0, most=10), Stage(after=0.5, fewest=10, most=20))
    levels = random_levels(*stages)
    assert [levels.obstacles(share) for share in (0.0, 0.25, 0.5, 1.0)] == [(0, 10), (5, 15), (10, 20), (10, 20)]


def test_random_maps_are_new_at_first_and_then_used_again():
    levels = random_levels(Stage(after=0.0, fewest=2, most=4), reuse=5.0)
    digests = [levels.next(0.0).digest for _ in range(600)]
    assert len(set(digests[:200])) == 200
    assert len(set(digests)) == pytest.approx(280, abs=40)


def test_tasks_are_anywhere_as_often_as_told():
    stages = (Stage(after=0.0, fewest=2, most=4),)
    starts = [random_levels(*stages, seed=seed, anywhere=0.5).next(0.0).start for seed in range(60)]
    usual = sum(start == starts[0] for start in starts) or sum(start == starts[1] for start in starts)
    assert 15 < max(usual, len(starts) - len(set(starts))) < 45


def test_a_map_that_is_given_twice_is_not_on_both_sides():
    maps = [level(number) for number in (0, 1, 2, 3, 4, 0, 1, 2, 3, 4)]
    kept, held_out = split(maps)
    assert [one.name for one in kept] == ["0", "1", "2", "3"]
    assert [one.name for one in held_out] == ["4"]
    assert not is_split([level(0)] * 5)


def test_people_are_on_random_maps_up_to_their_number():
    levels = random_levels(Stage(after=0.0, fewest=0, most=2), people={"count": 3})
    assert {len(levels.next(0.0).bodies) for _ in range(30)} == {0, 1, 2, 3}


def test_without_people_no_randomness_is_used_for_them():
    levels = random_levels(Stage(after=0.0, fewest=2, most=4))
    world = WORLD.replace(shapes=WORLD.shapes.replace(n_obstacles=(2, 4)))
    source = rng()
    for _ in range(3):
        assert levels.next(0.0).digest == draw_scenario(world, source).digest
        source.random()  # whether start and goal are anywhere


def test_a_task_without_the_path_that_is_observed_is_not_taken(monkeypatch):
    stages = (Stage(after=0.0, fewest=2, most=4),)
    monkeypatch.setattr("evolution.training.levels.is_planned", lambda world, scenario: False)
    starts = {random_levels(*stages, seed=seed, anywhere=1.0).next(0.0).start for seed in range(5)}
    assert len(starts) == 1


def test_given_levels_are_all_used():
    levels = GivenLevels([level(i) for i in range(4)], rng())
    assert {levels.next(0.0).name for _ in range(60)} == {"0", "1", "2", "3"}


def test_what_is_to_be_learned_is_the_variance_of_success():
    levels = replayed()
    for success in (True, False):
        levels.ended(level(0), success)
    for _ in range(2):
        levels.ended(level(1), True)
        levels.ended(level(2), False)
    assert levels.scores() == pytest.approx([1 / 4, 3 / 16, 3 / 16])


def test_levels_are_replayed_by_rank_and_age():
    levels = replayed(temperature=1.0)
    levels.ended(level(1), True)
    levels.ended(level(2), True)
    levels.ended(level(2), True)
    weights = np.array([1, 1 / 2, 1 / 3])
    assert levels.probabilities() == pytest.approx(weights / weights.sum())
    old = replayed(staleness=1.0)
    seen = [old.next(0.0).name for _ in range(12)]
    # By age alone, a level that was just played cannot come again at once.
    assert all(one != two for one, two in pairwise(seen))


def test_random_maps_are_mixed_in_and_kept_where_there_is_room():
    levels = replayed(2, fresh=[level(30), level(31)], probability=0.5, capacity=3)
    names = [levels.next(0.0).name for _ in range(100)]
    assert 25 < sum(name in ("30", "31") for name in names) < 75
    levels.ended(level(30), True)
    assert len(levels.scores()) == 3
    levels.ended(level(31), False)
    assert len(levels.scores()) == 3
    replayed_names = {name for name in (levels.next(0.0).name for _ in range(300)) if name in ("0", "1", "30")}
    assert {"0", "1"} <= replayed_names


def test_the_same_seed_gives_the_same_levels():
    stages = (Stage(after=0.0, fewest=5, most=9),)
    one, two = (random_levels(*stages, seed=7, anywhere=0.5, reuse=2.0) for _ in range(2))
    assert [one.next(0.1).digest for _ in range(20)] == [two.next(0.1).digest for _ in range(20)]
