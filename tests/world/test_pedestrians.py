from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gym_mapbench.errors import ConfigError
from gym_mapbench.world.bodies import Body, place_bodies
from gym_mapbench.world.clearance import check_clearance
from gym_mapbench.world.pedestrians import Course, Scripted, Wander
from gym_mapbench.world.robot import ROBOTS
from tests.worlds import among, line

WAFFLE = ROBOTS["turtlebot3_waffle"]


def walker(*waypoints, radius=0.2, **options):
    return Body(
        shape={"radius": radius},
        motion={
            "name": "scripted",
            "options": {"waypoints": [list(one) for one in waypoints], "speed": 0.5, **options},
        },
    )


def wanderer(centre, reach, **options):
    motion = {"name": "wander", "options": {"centre": list(centre), "reach": reach, "speed": 0.4, **options}}
    return Body(shape={"radius": 0.2}, motion=motion)


def test_a_scripted_body_walks_to_the_last_waypoint_and_back():
    walk = Scripted(waypoints=((1.0, 1.0), (3.0, 1.0), (3.0, 2.0)), speed=0.5)
    places = walk.at(np.array([0.0, 2.0, 4.0, 5.0, 6.0, 7.0, 8.0, 12.0]))
    assert places[:, :2].tolist() == [[1, 1], [2, 1], [3, 1], [3, 1.5], [3, 2], [3, 1.5], [3, 1], [1, 1]]
    assert places[:, 2] == pytest.approx([0, 0, math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2, math.pi, 0])


def test_a_loop_leads_from_the_last_waypoint_to_the_first_and_a_phase_begins_further_on():
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    walk = Scripted(waypoints=square, speed=1.0, loop=True)
    assert walk.at(np.array([3.5, 4.5]))[:, :2].tolist() == [[0, 0.5], [0.5, 0]]
    ahead = walk.replace(phase=0.25)
    times = np.linspace(0.0, 9.0, 50)
    assert ahead.at(times) == pytest.approx(walk.at(times + 1.0))


def plain_walk(walk, times):
    """The plain twin: interpolation along the round."""
    corners = np.array([*walk.waypoints, *(walk.waypoints[:1] if walk.loop else walk.waypoints[-2::-1])])
    corners = corners[np.concatenate([[True], np.hypot(*np.diff(corners, axis=0).T) > 0])]
    dx, dy = np.diff(corners, axis=0).T
    marks, headings = np.concatenate([[0.0], np.cumsum(np.hypot(dx, dy))]), np.arctan2(dy, dx)
    along = np.fmod(walk.phase * marks[-1] + walk.speed * times, marks[-1])
    x, y = (np.interp(along, marks, corners[:, axis]) for axis in (0, 1))
    return np.stack([x, y, headings[np.searchsorted(marks, along, side="right") - 1]], axis=1)


coordinates = st.floats(-20.0, 20.0).map(lambda value: round(value, 3) + 0.0)


@given(
    st.lists(st.tuples(coordinates, coordinates), min_size=2, max_size=6).filter(lambda points: len(set(points)) > 1),
    st.floats(0.05, 3.0),
    st.floats(0.0, 1.0, exclude_max=True),
    st.booleans(),
    st.integers(0, 10**5),
)
def test_a_walk_is_its_plain_twin_to_the_bit(waypoints, speed, phase, loop, first):
    walk = Scripted(waypoints=tuple(waypoints), speed=speed, phase=phase, loop=loop)
    for times in (0.05 * np.arange(first, first + 600), np.sort(walk.corner_times)):
        assert (walk.at(times) == plain_walk(walk, times)).all()


def test_a_zero_with_a_sign_is_a_zero():
    """Else a walk would depend on which of two equal walks was asked for first."""
    walk = Scripted(waypoints=((1.0625, 0.0), (0.0, -0.0)), speed=1.0)
    assert walk.at(np.array([0.5]))[0, 2] == math.pi


def test_equal_waypoints_are_a_body_that_stands():
    assert Scripted(waypoints=((1.0, 2.0),) * 3, speed=1.0).at(np.arange(5.0))[:, :2] == pytest.approx(
        np.tile([1.0, 2.0], (5, 1)), abs=1e-8
    )


@given(st.integers(0, 2**63 - 1), st.floats(0.1, 5.0), st.floats(0.1, 2.0), st.floats(0.0, 0.99))
def test_a_wander_stays_within_reach_keeps_its_mean_speed_and_is_smooth(seed, reach, speed, phase):
    walk = Wander(centre=(2.0, -1.0), reach=reach, speed=speed, seed=seed, phase=phase)
    times = np.linspace(0.0, 2 * math.pi / walk._rate, 4001)
    places = walk.at(times)
    velocities = np.diff(places[:, :2], axis=0) / np.diff(times)[:, None]
    assert np.hypot(*(places[:, :2] - [2.0, -1.0]).T).max() <= reach * (1 + 1e-9)
    assert math.sqrt((velocities**2).sum(axis=1).mean()) == pytest.approx(speed, rel=1e-3)
    assert np.abs(np.diff(velocities, axis=0)).max() < 0.05 * speed
    assert places[0] == pytest.approx(places[-1], abs=1e-6), "the curve is closed"
    heading = np.arctan2(velocities[:, 1], velocities[:, 0])
    fast = np.hypot(*velocities.T) > 0.3 * speed
    turned = np.abs(np.angle(np.exp(1j * (heading - places[:-1, 2]))))
    assert turned[fast].max() < 0.05


def test_one_seed_is_one_curve():
    first, same, other = (Wander(centre=(0.0, 0.0), reach=1.0, speed=0.5, seed=seed) for seed in (1, 1, 2))
    times = np.linspace(0.0, 20.0, 100)
    assert (first.at(times) == same.at(times)).all()
    assert (first.at(times) == pickle.loads(pickle.dumps(first)).at(times)).all()
    assert np.abs(first.at(times) - other.at(times)).max() > 0.1


@given(st.integers(0, 1000), st.floats(0.05, 0.5))
def test_a_course_holds_every_place_of_its_body(seed, spacing):
    rng = np.random.default_rng(seed)
    walks = [
        Scripted(waypoints=tuple(map(tuple, rng.uniform(0, 5, (4, 2)).tolist())), speed=0.7, loop=bool(seed % 2)),
        Wander(centre=(1.0, 1.0), reach=2.0, speed=0.7, seed=seed),
    ]
    for walk in walks:
        assert isinstance(walk, Course)
        course = walk.course(spacing)
        assert np.hypot(*np.diff(course, axis=0).T).max() <= spacing * (1 + 1e-9)
        assert len(walk.course(math.inf)) <= 9
        places = walk.at(rng.uniform(0.0, 200.0, 20))[:, None, :2]
        assert np.hypot(*np.moveaxis(places - course, 2, 0)).min(axis=1).max() <= spacing


@pytest.mark.parametrize("reach", [1e-300, 1e300])
def test_a_reach_that_no_float_can_square_is_refused(reach):
    with pytest.raises(ConfigError, match=r"reach: expected (less|greater) than or equal to"):
        wanderer((1.5, 1.5), reach)


def test_a_waypoint_whose_distance_no_float_can_hold_is_refused():
    with pytest.raises(ConfigError, match=r"waypoints\.1\.0: expected less than or equal to 100000000, got 1e\+308"):
        walker((1.5, 1.5), (1e308, 1.5))


@pytest.mark.parametrize(
    ("bodies", "message"),
    [
        (
            [walker((1.5, 0.05), (1.5, 2.0))],
            r"body 0 \(scripted\): expected a course clear of walls, got a wall .*1\.5",
        ),
        ([walker((1.5, 1.5), (1.5, 2.8))], "body 0 .* a wall"),
        ([walker((1.5, 1.5), (3.5, 1.5))], r"body 0 .* got \(3\.5, 1\.5\) off the map"),
        ([walker((1.5, 1.5), (1e8, 1.5))], r"body 0 .* got \(1e\+08, 1\.5\) off the map"),
        ([wanderer((1.5, 1.5), 0.2), wanderer((1.5, 1.5), 3.0)], r"body 1 \(wander\)"),
        ([walker((2.3, 0.6), (2.4, 0.6)), walker((2.3, 0.7), (2.4, 0.7))], "expected room at its start .* body 1"),
        ([line((1.5, 1.5), (1.5, 1.5), 0.1), walker((1.6, 1.5), (2.0, 1.5))], r"body 1 .* got body 0 \(line\) there"),
        ([walker((0.8, 1.8), (0.8, 0.5))], r"start: expected room .* got body 0 \(scripted\) that touches it"),
        ([walker((2.2, 1.2), (2.2, 2.2))], r"goal: expected room .* got body 0 \(scripted\)"),
        ([walker((2.3, 0.6), (2.4, 0.6))] * 101, "bodies: expected at most 100, got 101"),
    ],
)
def test_bodies_that_walk_through_walls_or_start_inside_something_are_refused(bodies, message):
    with pytest.raises(ConfigError, match=message) as caught:
        check_clearance(among(*bodies), WAFFLE)
    assert "\n" not in str(caught.value)


def test_a_body_that_comes_later_than_the_first_seconds_is_not_refused():
    check_clearance(among(walker((0.8, 2.6), (0.8, 0.8), speed=0.3)), WAFFLE)
    check_clearance(among(line((1.5, 1.5), (5.0, 1.5), 0.5)), WAFFLE)  # a line may lead through walls


@pytest.mark.parametrize(
    ("motion", "message"),
    [
        ({"name": "scripted", "options": {"waypoints": [[1, 1], [2, 2]], "speed": math.nan}}, "speed.*expected"),
        ({"name": "scripted", "options": {"waypoints": [[1, 1], [2, 2]], "speed": 0}}, "scripted: speed: expected"),
        ({"name": "scripted", "options": {"waypoints": [[1, 1], [2, 2]], "speed": 9}}, "scripted: speed: expected"),
        ({"name": "scripted", "options": {"waypoints": [[1, 1]], "speed": 1}}, "scripted: waypoints: expected"),
        ({"name": "scripted", "options": {"waypoints": [[1, 1], [2, 2]], "speed": 1, "phase": 1}}, "phase"),
        ({"name": "wander", "options": {"centre": [1, 1], "reach": 0, "speed": 1}}, "wander: reach: expected"),
        ({"name": "wander", "options": {"centre": [1, 1], "reach": 1, "speed": 1, "seed": -1}}, "wander: seed"),
    ],
)
def test_bad_options_are_one_clear_line(motion, message):
    with pytest.raises(ConfigError, match=message) as caught:
        Body(motion=motion)
    assert "\n" not in str(caught.value)


def test_a_person_has_a_radius_of_a_quarter_of_a_metre_and_returns_from_json():
    for body in (
        walker((1.0, 1.0), (2.0, 1.0)),
        wanderer((1.5, 1.5), 0.4, seed=3),
        Body(motion=walker((1, 1), (2, 2)).motion),
    ):
        again = Body.from_mapping(body.model_dump(mode="json"), "body")
        assert again == body
        assert (place_bodies([again], np.arange(3.0)) == place_bodies([body], np.arange(3.0))).all()
        assert again == body, "equal by value after use, too"
        times = np.linspace(0, 30, 99)
        assert (place_bodies([again], times) == place_bodies([body], times)).all()
    assert body.shape.radius == 0.25
