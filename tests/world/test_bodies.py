from __future__ import annotations

import math
import pickle
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.bodies import see_bodies
from gym_mapbench.world.bodies import Body, Disc, place_bodies
from gym_mapbench.world.clearance import check_clearance
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import Lidar, LidarSettings
from gym_mapbench.world.motions import MOTIONS, Line
from gym_mapbench.world.robot import ROBOTS
from gym_mapbench.world.scenario import Pose, Scenario
from gym_mapbench.world.simulation import Simulation
from gym_mapbench.world.world import BODY, LOOK_AHEAD, WALL, World
from tests.worlds import among, line

WAFFLE, JACKAL = ROBOTS["turtlebot3_waffle"], ROBOTS["jackal"]
OPEN = GridMap(np.zeros((200, 200), bool))
MILLIMETRE = 1e-3


def test_a_line_leads_to_its_end_and_back():
    moves = Line(start=(1.0, 2.0), end=(1.0, 4.0), speed=0.5)
    places = moves.at(np.array([0.0, 1.0, 4.0, 5.0, 8.0, 17.0]))
    assert places[:, :2].tolist() == [[1, 2], [1, 2.5], [1, 4], [1, 3.5], [1, 2], [1, 2.5]]
    assert places[:, 2] == pytest.approx(np.array([1, 1, -1, -1, 1, 1]) * math.pi / 2)
    assert Line(start=(1.0, 2.0), end=(1.0, 2.0), speed=0.5).at(np.array([0.0, 9.0])).tolist() == [[1, 2, 0]] * 2
    assert Line(start=(1.0, 2.0), end=(3.0, 2.0), speed=0.0).at(np.array([9.0])).tolist() == [[1, 2, 0]]


def distance_to_discs(x, y, angle, poses, radii, range_max):
    """The plain twin: the ray against every circle, by the roots of its quadratic equation."""
    nearest = range_max
    for (centre_x, centre_y, _), radius in zip(poses, radii, strict=True):
        dx, dy = centre_x - x, centre_y - y
        if math.hypot(dx, dy) <= radius:
            return 0.0
        roots = np.roots([1.0, -2 * (dx * math.cos(angle) + dy * math.sin(angle)), dx**2 + dy**2 - radius**2])
        nearest = min([nearest, *(root.real for root in roots if abs(root.imag) == 0 and root.real > 0)])
    return nearest


@settings(max_examples=200)
@given(st.integers(0, 2**32 - 1), st.integers(0, 4))
def test_the_scan_of_bodies_is_that_of_exact_geometry(seed, count):
    rng = np.random.default_rng(seed)
    poses, radii = rng.uniform(-3, 3, (count, 3)), rng.uniform(0.05, 1.5, count)
    x, y, yaw = rng.uniform(-2, 2, 3)
    angles = rng.uniform(-4, 4, 17)
    ranges = np.full(17, 2.5, np.float32)
    see_bodies(poses, radii, x, y, yaw, np.stack([np.cos(angles), np.sin(angles)], axis=1), 2.5, ranges)
    expected = [distance_to_discs(x, y, yaw + angle, poses, radii, 2.5) for angle in angles]
    # A ray that grazes a circle may go either way.
    grazing = [graze(x, y, yaw + angle, poses, radii) < 1e-6 for angle in angles]
    assert np.where(grazing, 0.0, ranges) == pytest.approx(np.where(grazing, 0.0, expected), abs=1e-5)


def graze(x, y, angle, poses, radii):
    """How far a ray's line is from touching a circle without entering it, m."""
    aside = np.abs((poses[:, 1] - y) * math.cos(angle) - (poses[:, 0] - x) * math.sin(angle))
    return float(np.abs(aside - radii).min(initial=1.0))


def test_the_scanner_sees_a_body_where_it_is_now():
    world = World(OPEN, [line((6.0, 5.0), (8.0, 5.0), 0.5)])
    lidar = Lidar(LidarSettings(beams=4), world)
    for second in range(5):
        away = 6.0 + 0.5 * second - 0.2 - 4.0 if second < 4 else 3.5
        assert lidar.scan(Pose(4.0, 5.0)).tolist() == pytest.approx([away, 3.5, 3.5, 3.5])
        world.advance(100)
    ahead = Lidar(LidarSettings(beams=4, x=0.5), World(OPEN, [line((4.0, 7.0), (4.0, 7.0), 0.0)]))
    assert ahead.scan(Pose(4.0, 5.0, math.pi / 2)).tolist() == pytest.approx([1.3, 3.5, 3.5, 3.5])


def test_the_nearer_of_wall_and_body_is_seen():
    cells = np.zeros((100, 100), bool)
    cells[:, 60] = True
    for x, expected in ((2.5, 0.3), (4.0, 1.0)):
        lidar = Lidar(LidarSettings(beams=1), World(GridMap(cells), [line((x, 2.0), (x, 2.0), 0.0)]))
        assert lidar.scan(Pose(2.0, 2.0)) == pytest.approx([expected])
    blind = Lidar(LidarSettings(beams=8), World(GridMap(cells), [line((2.0, 2.0), (2.0, 2.0), 0.0)]))
    assert (blind.scan(Pose(2.1, 2.0)) == 0.0).all()


@given(st.lists(st.integers(1, 2000), min_size=1, max_size=12), st.sampled_from([1, 5]))
def test_bodies_are_where_their_motion_says_at_every_control_step_and_move_evenly_in_between(steps, ticks):
    bodies = [line((1.0, 1.0), (4.0, 5.0), 0.7), line((8.0, 1.0), (2.0, 1.0), 1.1)]
    world = World(OPEN, bodies, 100.0, ticks)
    for now, passed in zip(np.cumsum(steps), steps, strict=True):
        after = world.after(passed)
        world.advance(passed)
        first, then = place_bodies(bodies, np.array([now // ticks, now // ticks + 1]) * ticks / 100.0)[:, :, :2]
        assert (world.poses == after).all()
        assert after[:, :2] == pytest.approx(first + (now % ticks) / ticks * (then - first), abs=1e-12)


def test_a_long_step_is_one_step():
    world = World(OPEN, [line((1.0, 1.0), (9.0, 1.0), 0.5)], 1000.0)
    world.advance(3 * LOOK_AHEAD)
    assert world.poses[0, 0] == pytest.approx(1.0 + 0.5 * 3 * LOOK_AHEAD / 1000)


@pytest.mark.parametrize(("robot", "length"), [(WAFFLE, 0.22), (JACKAL, 0.21)])
@pytest.mark.parametrize("options", [{}, {"rests": True, "nearby": True}])
@pytest.mark.parametrize("speed", [0.0, 0.3])
def test_the_robot_touches_a_body_where_geometry_says(robot, length, options, speed):
    world = World(OPEN, [line((2.0, 5.0), (8.0, 5.0), 0.8)])
    simulated = Simulation(world, robot, Pose(5.0, 5.0, math.pi), **options)
    for _ in range(400):
        before = simulated.pose.x - world.poses[0, 0]
        touched = simulated.advance(speed, 0.0, 1)
        if touched:
            break
        assert simulated.pose.x - world.poses[0, 0] - length - 0.2 > -MILLIMETRE
    assert touched == BODY
    assert abs(before - length - 0.2) < 0.8 / 100 + speed / 100 + 15 * MILLIMETRE
    overlap = 0.8 / 100 if speed == 0.0 else 0.0  # a body moves on into a robot that stands still
    assert abs(simulated.pose.x - world.poses[0, 0] - length - 0.2) < overlap + MILLIMETRE


@pytest.mark.parametrize("robot", [WAFFLE, JACKAL])
@pytest.mark.parametrize("plant", ["ideal", "fortress"])
def test_a_body_passes_a_robot_that_stands_still(robot, plant):
    world = World(OPEN, [line((2.0, 5.05), (8.0, 5.05), 0.8)])
    simulated = Simulation(world, robot, Pose(5.0, 5.0, 1.0), plant=plant)
    touched = [simulated.advance(0.0, 0.0, 5) for _ in range(130)]
    assert world.poses[0, 0] > 5.0 + robot.radius + 0.2
    assert simulated.pose == pytest.approx((5.0, 5.0, 1.0), abs=1e-5)
    assert set(touched) == {0, BODY}
    assert not touched[-1]
    for _ in range(40):
        simulated.advance(0.3, 0.0, 5)
    assert np.hypot(simulated.pose.x - 5.0, simulated.pose.y - 5.0) > 0.5, "it can drive on"


def test_a_body_pushes_a_moving_robot_and_both_touch_a_wall():
    cells = np.zeros((200, 200), bool)
    cells[:, 120:] = True
    world = World(GridMap(cells), [line((2.0, 5.0), (9.0, 5.0), 0.5)])
    simulated = Simulation(world, WAFFLE, Pose(5.0, 5.0, math.pi))
    touched = [simulated.advance(0.0, 0.1, 5) for _ in range(150)]
    codes = list(dict.fromkeys(touched))
    assert codes[:3] == [0, BODY, BODY | WALL]


def meet(seed, robot, **options):
    """Drive at random among bodies and walls: always with all of Box2D, and with the given options."""
    rng = np.random.default_rng(seed)
    grid = GridMap(rng.random((60, 60)) < 0.004, 0.1)
    ends = rng.uniform(0.0, 6.0, (6, 2, 2))
    ends = ends[np.hypot(*(ends[:, 0] - 3.0).T) > 0.8]
    bodies = [line(start, end, rng.uniform(0.0, 2.0)) for start, end in ends.tolist()]
    commands = np.repeat(rng.uniform([-0.5, -2.0], [2.0, 2.0], (25, 2)), 8, axis=0)
    driven = []
    for chosen in ({}, options):
        simulated = Simulation(World(grid, bodies), robot, Pose(3.0, 3.0), **chosen)
        steps = [(simulated.advance(v, w, 5), *simulated.pose, *simulated.velocity) for v, w in commands]
        driven.append(np.array(steps))
    return driven


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.sampled_from([WAFFLE, JACKAL]))
def test_nothing_changes_up_to_the_first_touch_where_box2d_rests_among_bodies(seed, robot):
    expected, driven = meet(seed, robot, rests=True, nearby=True)
    touched = np.flatnonzero(expected[:, 0])
    until = touched[0] + 1 if len(touched) else len(expected)
    assert (driven[:until] == expected[:until]).all()


def test_an_empty_world_asks_for_no_bodies():
    world = World(OPEN)
    assert (world.bodies, world.poses.shape, world.radii.shape) == ((), (0, 3), (0,))


def test_bodies_are_part_of_what_a_scenario_is():
    plain, moving = among(), among(line((0.5, 1.5), (2.5, 1.5), 0.3))
    faster = among(line((0.5, 1.5), (2.5, 1.5), 0.4))
    assert plain.world_digest == plain.map.digest
    assert len({one.digest for one in (plain, moving, faster)}) == 3
    assert len({one.world_digest for one in (plain, moving, faster)}) == 3
    again = pickle.loads(pickle.dumps(moving))
    assert (again, hash(again), again.digest) == (moving, hash(moving), moving.digest)
    assert Body.from_mapping(moving.bodies[0].model_dump(mode="json"), "body") == moving.bodies[0]


@pytest.mark.parametrize(
    ("shape", "motion", "message"),
    [
        ({"radius": 0.0}, {}, r"shape\.radius: expected"),
        ({"radius": -1.0}, {}, r"shape\.radius: expected"),
        ({"radius": math.nan}, {}, r"shape\.radius: expected"),
        ({"radius": "wide"}, {}, r"shape\.radius: expected"),
        ({"radius": 0.2}, {"speed": -1.0}, "line: speed: expected"),
        ({"radius": 0.2}, {"speed": math.nan}, "speed.*: expected"),
        ({"radius": 0.2}, {"speed": 5.1}, "line: speed: expected .* 5, got 5.1"),
        ({"radius": 0.2}, {"end": [1e9, 0.0]}, r"line: end\.0: expected less than or equal to 100000000"),
        ({"radius": 0.2}, {"start": [0.0]}, "start"),
        ({"radius": 0.2}, {"sped": 1.0}, "did you mean 'speed'"),
    ],
)
def test_bad_bodies_are_one_clear_line(shape, motion, message):
    options = {"start": [1.0, 1.0], "end": [2.0, 1.0], "speed": 0.5, **motion}
    with pytest.raises(ConfigError, match=message) as caught:
        Body(shape=shape, motion={"name": "line", "options": options})
    assert "\n" not in str(caught.value)


def test_unknown_motions_and_things_that_are_no_bodies_are_refused():
    with pytest.raises(ConfigError, match="'line'"):
        Body(shape=Disc(radius=0.2), motion={"name": "lin"})
    with pytest.raises(ConfigError, match="bodies: expected Body values, got 3"):
        Scenario(OPEN, Pose(1, 1), Pose(2, 2), bodies=(3,))


def test_what_moves_too_fast_for_box2d_is_refused():
    World(OPEN, [line((1, 1), (9, 1), 5.0)])
    with pytest.raises(ConfigError, match=r"body 1 \(line\): expected at most 4 m/s at 80 physics steps .* got 5 m/s"):
        World(OPEN, [line((1, 1), (9, 1), 4.0), line((1, 1), (9, 1), 5.0)], physics_hz=80.0)


def test_a_line_that_is_back_at_every_step_is_not_too_fast_to_be_seen():
    """Its places at the control steps are all the same: 50 m/s look like none."""
    with pytest.raises(ConfigError, match="speed: expected"):
        World(OPEN, [line((1, 1), (2, 1), 50.0)], ticks=4)


@pytest.mark.parametrize(
    ("poses", "message"),
    [
        (lambda times: np.full((len(times), 3), np.nan), "expected a finite pose at all times, got none at 0 s"),
        (lambda times: np.zeros((len(times), 2)), r"expected poses \(513, 3\), got \(513, 2\)"),
    ],
)
def test_a_motion_that_is_none_is_refused(poses, message, monkeypatch):
    class Broken:
        at = staticmethod(poses)

    monkeypatch.setitem(MOTIONS._entries, "broken", Broken)
    with pytest.raises(ConfigError, match=rf"body 0 \(broken\): {message}"):
        World(OPEN, [Body(shape=Disc(radius=0.2), motion={"name": "broken"})])


class Loose:
    """A motion that cannot be pickled."""

    def __init__(self):
        self.at = lambda times: np.zeros((len(times), 3))


def test_a_body_is_pickled_as_data_whatever_its_motion_is():
    body = Body(motion={"name": f"{__name__}:Loose"})
    copied = pickle.loads(pickle.dumps(body))
    assert copied == body
    assert not copied.motion.motion.at(np.zeros(2)).any()


def test_a_motion_that_gives_other_poses_at_the_same_times_is_refused(monkeypatch):
    rng = np.random.default_rng(1)
    monkeypatch.setitem(MOTIONS._entries, "restless", lambda: SimpleNamespace(at=lambda t: rng.random((len(t), 3))))
    with pytest.raises(ConfigError, match=r"body 0 \(restless\): expected the same poses at the same times, got"):
        World(OPEN, [Body(motion={"name": "restless"})])


@pytest.mark.parametrize("robot", [WAFFLE, JACKAL])
@pytest.mark.parametrize(("what", "at"), [("start", (0.8, 1.15)), ("goal", (2.2, 1.85))])
def test_a_body_on_start_or_goal_is_refused(robot, what, at):
    with pytest.raises(ConfigError, match=rf"{what}: expected room .* got body 1 \(line\) that touches it"):
        check_clearance(among(line((1.5, 1.5), (1.5, 1.5), 0.1, 0.1), line(at, (1.5, 1.5), 0.1)), robot)


def test_room_for_a_polygon_is_measured_from_its_outline():
    # The Jackal is 0.165 m wide to both sides; its corners are 0.267 m away.
    beside = among(line((0.8, 0.8 + 0.165 + 0.21), (1.5, 1.5), 0.1))
    check_clearance(beside, JACKAL)
    with pytest.raises(ConfigError, match="start: expected room"):
        check_clearance(beside, WAFFLE)
