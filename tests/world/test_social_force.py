from __future__ import annotations

import cmath
import logging
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.social_force import PERSON, STEP, desired_force, force_on, obstacle_force, social_force
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.clearance import check_clearance
from gym_mapbench.world.crowd import CHUNK, Track, place_crowd, wall_points
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import ROBOTS
from gym_mapbench.world.scenario import Pose, Scenario
from tests.world import plain_social_force as plain
from tests.worlds import among, line, social

HALL = GridMap.from_rows(("#" * 100, *["#" + "." * 98 + "#"] * 58, "#" * 100), 0.1)
"""An empty hall of 10 m x 6 m."""
WAFFLE = ROBOTS["turtlebot3_waffle"]
SPEED = st.floats(-1.5, 1.5)


CROWD = (
    social((2.0, 2.0), (8.0, 2.2), speed=1.0, sees_robot=False),
    social((8.0, 2.0), (2.0, 2.0), (2.0, 4.0), speed=0.7, loop=True),
    social((5.0, 5.0), (5.0, 1.0), speed=1.3),
)
TIMES = np.arange(0.0, 30.0, STEP)


def standing(x, y, seconds=30.0):
    return Track(STEP, np.tile([x, y, 0.0, 0.0, 0.0], (round(seconds / STEP) + 1, 1)))


@given(st.floats(-3, 3), st.floats(-3, 3), SPEED, SPEED, SPEED, SPEED)
def test_forces_are_those_of_the_plain_twin(dx, dy, vx, vy, other_x, other_y):
    away, approach = complex(dx, dy), complex(vx - other_x, vy - other_y)
    assume(abs(away) > 1e-3)
    angle = cmath.phase((2.0 * approach + away / abs(away)) * away.conjugate())
    assume(1e-9 < abs(angle) < math.pi - 1e-9)  # The force that turns changes sides at 0 and at half a turn.
    force = social_force(dx, dy, vx - other_x, vy - other_y)
    wanted = plain.social(complex(dx, dy), complex(vx, vy), complex(other_x, other_y))
    assert complex(*force) == pytest.approx(wanted, abs=1e-9)
    me = np.zeros(1, PERSON)
    me["vx"], me["vy"], me["speed"] = vx, vy, 1.1
    assert complex(*desired_force(me[0], dx, dy)) == pytest.approx(
        plain.desired(complex(vx, vy), complex(dx, dy), 1.1), abs=1e-9
    )


def test_walls_push_as_the_plain_twin_says():
    walls = wall_points(HALL)
    for x, y, radius in ((5.0, 0.4, 0.25), (0.6, 5.5, 0.35), (5.0, 3.0, 0.25)):
        assert complex(*obstacle_force(x, y, radius, walls)) == pytest.approx(
            plain.obstacle(complex(x, y), radius, walls.tolist()), rel=1e-9, abs=1e-12
        )


def test_points_of_walls_lie_on_the_sides_that_free_cells_touch():
    walls = wall_points(GridMap.from_rows(("...", ".#.", "..."), 0.1, origin=(1.0, 2.0)))
    assert len(walls) == 12 + 4
    assert {tuple(point) for point in walls[:, :2].round(6).tolist()} >= {(1.15, 2.1), (1.15, 2.2), (1.1, 2.15)}
    for resolution in (0.05, 0.1, 0.25, 1.0):
        weights = wall_points(GridMap(np.zeros((20, 20), bool), resolution))[:, 2]
        assert weights.sum() == pytest.approx(80 * resolution * 10)


def test_a_crowd_walks_as_the_plain_twin_says():
    robot = standing(5.0, 2.5)
    people = [
        {
            "place": complex(*one.waypoints[0]),
            "velocity": one.speed * (target := complex(*one.goals[0]) - complex(*one.waypoints[0])) / abs(target),
            "speed": one.speed,
            "radius": 0.2,
            "goals": [complex(*goal) for goal in one.goals],
            "goal": 0,
            "sees_robot": one.sees_robot,
        }
        for one in (body.motion.motion for body in CROWD)
    ]
    walked = place_crowd(HALL, CROWD, TIMES, robot)
    points = wall_points(HALL).tolist()
    for row in walked[:60]:
        assert [complex(*place[:2]) for place in row] == pytest.approx([one["place"] for one in people], abs=1e-7)
        plain.step(people, points, (5.0 + 2.5j, 0j))


@pytest.fixture
def simulator(monkeypatch, tmp_path):
    """PySocialForce's simulator; its import writes a log here and changes the root logger, which is restored."""
    monkeypatch.chdir(tmp_path)
    root = logging.getLogger()
    level, handlers = root.level, list(root.handlers)
    yield pytest.importorskip("pysocialforce").Simulator
    root.setLevel(level)
    for handler in set(root.handlers) - set(handlers):
        root.removeHandler(handler)
        handler.close()


def test_forces_are_those_of_pysocialforce(simulator):
    rng = np.random.default_rng(3)
    compared = 0
    for _ in range(40):
        states = np.column_stack([rng.uniform(1, 4, (4, 2)), rng.uniform(-1, 1, (4, 2)), rng.uniform(0, 5, (4, 2))])
        one = simulator(states.copy(), obstacles=[[0, 5, 0, 0], [0, 0, 0, 5]])
        people = np.zeros(4, PERSON)
        for name, column in zip(("x", "y", "vx", "vy"), states.T, strict=False):
            people[name] = column
        people["speed"], people["radius"], people["wall_factor"] = one.peds.max_speeds, 0.35, 1.0
        people["first"], people["count"], people["walks"] = np.arange(4), 1, True
        walls = np.vstack(one.get_obstacles())
        walls = np.hstack([walls, np.ones((len(walls), 1))])
        desired, social, obstacle = (one.forces[number].get_force() for number in range(3))
        for i in np.flatnonzero(~_unwrapped(states)):
            ours = force_on(people, i, np.ascontiguousarray(states[:, 4:]), walls, np.full(5, np.nan))
            assert ours == pytest.approx((desired + social + obstacle)[i], rel=1e-9, abs=1e-12)
            compared += 1
    assert compared > 30


def _unwrapped(states):
    """Which people have an angle beyond half a turn to somebody, which PySocialForce does not wrap."""
    places, velocities = states[:, 0:2] @ [1, 1j], states[:, 2:4] @ [1, 1j]
    away = places[:, None] - places
    lengths = np.where(away == 0, 1, np.abs(away))
    interactions = -2.0 * (velocities[:, None] - velocities) + away / lengths
    return (np.abs(np.angle(interactions) - np.angle(away)) > np.pi).any(axis=1)


def test_people_reach_their_goals_and_keep_apart_and_off_the_walls():
    walked = place_crowd(HALL, CROWD, TIMES)[:, :, :2]
    for number, body in enumerate(CROWD):
        for goal in body.motion.motion.goals:
            assert np.hypot(*(walked[:, number] - goal).T).min() < 0.5
    assert np.hypot(*(np.diff(walked, axis=0) / STEP).T).max() <= 1.3 + 1e-9
    assert (walked > 0.35).all()
    assert (walked < [9.65, 5.65]).all()
    apart = [np.hypot(*(walked[:, i] - walked[:, j]).T).min() for i, j in ((0, 1), (0, 2), (1, 2))]
    assert min(apart) > 0.3  # The model knows no radii: people brush past each other.


@pytest.mark.parametrize(("factor", "narrow", "wide"), [(1.0, 1.5, 1.6), (0.1, 0.6, 0.7)])
def test_the_factor_of_walls_says_through_which_openings_a_person_walks(factor, narrow, wide):
    for width, passes in ((narrow, False), (wide, True)):
        cells, half = np.zeros((80, 120), bool), round(width / 0.05) // 2
        cells[:, 60:62] = True
        cells[40 - half : 40 + half, 60:62] = False
        person = social((1.0, 2.1), (5.0, 1.9), speed=1.0, radius=0.25, wall_factor=factor)
        walked = place_crowd(GridMap(cells, 0.05), [person], TIMES)
        assert (walked[:, 0, 0].max() > 4.0) == passes


def test_the_default_factor_of_walls_is_1():
    explicit = (*CROWD[:2], social((5.0, 5.0), (5.0, 1.0), speed=1.3, wall_factor=1.0))
    assert place_crowd(HALL, explicit, TIMES).tobytes() == place_crowd(HALL, CROWD, TIMES).tobytes()


def test_only_people_who_see_the_robot_react_to_it():
    alone, among_robot = (place_crowd(HALL, CROWD, TIMES, track) for track in (None, standing(5.0, 2.1)))
    assert (alone[:, 0] == among_robot[:, 0]).all()
    assert np.abs(alone[:, 1] - among_robot[:, 1]).max() > 0.1


def test_positions_do_not_depend_on_the_times_asked_for():
    whole = place_crowd(HALL, CROWD, np.arange(CHUNK + 100) * STEP)
    assert (place_crowd(HALL, CROWD, np.array([(CHUNK + 50) * STEP, 1.0])) == whole[[CHUNK + 50, 20]]).all()
    halfway = place_crowd(HALL, CROWD, np.array([1.025]))[0, :, :2]
    assert halfway == pytest.approx(whole[20:22, :, :2].mean(axis=0))


def test_scripted_bodies_are_met_but_do_not_react():
    crowd = (line((5.0, 2.0), (5.0, 2.0), 0.0), social((2.0, 2.1), (8.0, 2.1)))
    walked = place_crowd(HALL, crowd, TIMES)
    assert (walked[:, 0, :2] == [5.0, 2.0]).all()
    assert np.abs(walked[:, 1, 1] - 2.1).max() > 0.1


@pytest.mark.parametrize("hz", [20, 10, 30, 50])
def test_a_recorded_run_says_where_the_people_were(hz):
    scenario = Scenario(HALL, Pose(4.0, 1.0, math.pi / 2), Pose(9.0, 5.0), bodies=CROWD)
    env = MapBenchEnv(scenarios=[scenario], control_hz=hz, physics_hz=300, time_limit=8.0, collision_ends_episode=False)
    infos, places, over = [env.reset(seed=1)[1]], [env.simulation.world.poses], False
    while not over:
        *_, over, info = env.step((0.3, 0.1))
        infos.append(info)
        places.append(env.simulation.world.poses)
    states = np.array([[*info["pose"], *info["velocity"]] for info in infos])
    times = np.arange(len(states)) / hz
    recorded = place_crowd(HALL, CROWD, times, Track(1.0 / hz, states))
    assert (recorded == np.array(places)).all() if hz == 20 else recorded == pytest.approx(np.array(places), abs=1e-9)
    alone = place_crowd(HALL, CROWD, times)
    assert np.abs(recorded[:, 1:] - alone[:, 1:]).max() > 0.05


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (social((1.0, 1.0), (2.0, 20.0)), "off the map"),
        (social((0.8, 0.8), (2.0, 2.0)), "start: expected room for the robot"),
        (social((1.5, 1.5), (1.5, 2.95)), "expected a course clear of walls"),
    ],
)
def test_people_through_walls_or_on_the_start_are_refused(body, message):
    with pytest.raises(ConfigError, match=message):
        check_clearance(among(body), WAFFLE)


@pytest.mark.parametrize(
    "options",
    [
        {"speed": math.nan},
        {"speed": 9.0},
        {"waypoints": [[1, 1]]},
        {"sees_robot": "perhaps"},
        {"phase": 0.5},
        {"wall_factor": 0},
    ],
)
def test_bad_options_are_one_clear_line(options):
    with pytest.raises(ConfigError, match=r"speed|waypoints|sees_robot|phase|wall_factor") as caught:
        Body(motion={"name": "social_force", "options": {"waypoints": [[1, 1], [2, 2]], "speed": 1.0, **options}})
    assert "\n" not in str(caught.value)
