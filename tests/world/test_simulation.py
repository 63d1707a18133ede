from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gym_mapbench.generator import ShapeSettings, default_task, sample_map
from gym_mapbench.kernels.motion import SCALE, is_clear
from gym_mapbench.world.clearance import measure_clearance
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import ROBOTS, RobotSpec
from gym_mapbench.world.scenario import Pose
from gym_mapbench.world.simulation import Simulation
from gym_mapbench.world.state import Worlds, ground_of
from gym_mapbench.world.world import World
from tests.oracle_data import ORACLE, needs_oracle

WAFFLE, JACKAL = ROBOTS["turtlebot3_waffle"], ROBOTS["jackal"]
OPEN = GridMap(np.zeros((400, 400), bool), origin=(-10.0, -10.0))
MILLIMETRE = 1e-3


def integrate(pose, commands, robot, dt, ticks):
    """The plain twin: limits, accelerations and the midpoint step, one line each."""
    x, y, yaw, v, w = *pose, 0.0, 0.0
    states = []
    for command in commands:
        for _ in range(ticks):
            target_v = min(max(command[0], -robot.max_reverse_velocity), robot.max_linear_velocity)
            target_w = min(max(command[1], -robot.max_angular_velocity), robot.max_angular_velocity)
            v += min(max(target_v - v, -robot.max_linear_acceleration * dt), robot.max_linear_acceleration * dt)
            w += min(max(target_w - w, -robot.max_angular_acceleration * dt), robot.max_angular_acceleration * dt)
            x += v * math.cos(yaw + w * dt / 2) * dt
            y += v * math.sin(yaw + w * dt / 2) * dt
            yaw += w * dt
        states.append((x, y, yaw, v, w))
    return np.array(states)


def drive(simulation, commands, ticks=5):
    """States after every command, and whether anything was touched."""
    states, contacts = [], []
    for v, w in commands:
        contacts.append(simulation.advance(v, w, ticks))
        states.append((*simulation.pose, *simulation.velocity))
    return np.array(states), np.array(contacts)


def wall_at(x, resolution=0.05, size=160):
    cells = np.zeros((size, size), bool)
    cells[:, round(x / resolution) :] = True
    return GridMap(cells, resolution)


@pytest.mark.parametrize("robot", [WAFFLE, JACKAL])
@pytest.mark.parametrize("hz", [100.0, 50.0])
def test_free_motion_is_the_float64_midpoint_step(robot, hz):
    rng = np.random.default_rng(0)
    commands = np.repeat(rng.uniform([-0.5, -5.0], [0.6, 5.0], (100, 2)), 10, axis=0)
    states, contacts = drive(Simulation(World(OPEN, physics_hz=hz), robot, Pose(0.0, 0.0, 0.3)), commands)
    assert not contacts.any()
    twin = integrate((0.0, 0.0, 0.3), commands, robot, 1 / hz, 5)
    difference = states - twin
    difference[:, 2] = np.remainder(difference[:, 2] + np.pi, 2 * np.pi) - np.pi
    assert np.abs(difference).max() < 1e-10
    assert (np.abs(states[:, 2]) <= np.pi).all()


def test_the_body_follows_the_float64_pose():
    simulated = Simulation(World(wall_at(4.0)), WAFFLE, Pose(3.775, 1.0, math.pi / 2))
    _, contacts = drive(simulated, np.tile([0.5, 0.0], (200, 1)))
    assert not contacts.any()
    position = simulated._engine._body.position
    offset = position.x / SCALE - simulated.pose.x, position.y / SCALE - simulated.pose.y
    assert np.hypot(*offset) < 1e-5


def wander(seed, robot, **options):
    """Drive at random on a drawn map: always with all of Box2D, and with the given options."""
    rng = np.random.default_rng(seed)
    grid = GridMap(sample_map(rng, ShapeSettings(size=80)))
    start = default_task(grid)[0]
    commands = np.repeat(rng.uniform([-0.5, -2.0], [2.0, 2.0], (40, 2)), 10, axis=0)
    driven = [drive(Simulation(World(grid), robot, start, **chosen), commands) for chosen in ({}, options)]
    return driven[0], driven[1]


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.sampled_from([WAFFLE, JACKAL, ROBOTS["turtlebot3_burger"]]))
@example(2710, JACKAL)
def test_nothing_changes_up_to_the_first_touch_where_box2d_rests_among_walls_nearby(seed, robot):
    (expected, touched), (states, contacts) = wander(seed, robot, rests=True, nearby=True)
    touch = int(np.argmax(touched)) if touched.any() else len(touched)
    assert (contacts[: touch + 1] == touched[: touch + 1]).all()
    assert (states[:touch] == expected[:touch]).all()
    np.testing.assert_allclose(states[touch : touch + 1], expected[touch : touch + 1], rtol=0.0, atol=1e-5)


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.sampled_from([WAFFLE, ROBOTS["turtlebot3_burger"]]))
def test_nothing_ever_changes_where_box2d_rests_with_a_disc(seed, robot):
    (expected, touched), (states, contacts) = wander(seed, robot, rests=True)
    assert (contacts == touched).all()
    assert (states == expected).all()


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1))
def test_the_box_is_kept_while_box2d_rests(seed):
    rng = np.random.default_rng(seed)
    commands = np.repeat(rng.uniform([-0.5, -2.0], [0.5, 2.0], (20, 2)), 10, axis=0)
    resting, always = (Simulation(World(OPEN), WAFFLE, Pose(0.0, 0.0, 0.3), rests=rests) for rests in (True, False))
    for v, w in commands:
        resting.advance(v, w, 5)
        always.advance(v, w, 5)
        assert resting._worlds.boxes.item(0)[:4] == always._engine.box()[:4]


@settings(max_examples=200)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 2.0))
def test_walls_are_near_where_geometry_says(seed, reach):
    rng = np.random.default_rng(seed)
    grid = GridMap(rng.random((30, 40)) < 0.02, 0.1, (-1.0, 2.0))
    pose = Pose(*rng.uniform(grid.bounds[:2], grid.bounds[2:]))
    worlds = Worlds()
    worlds.grounds[0] = ground_of(grid)
    square = RobotSpec(footprint=[(reach, reach), (-reach, reach), (-reach, -reach), (reach, -reach)])
    clearance = measure_clearance(grid, square, [Pose(*pose[:2], 0.0)])[0]
    assert is_clear(grid.framed.reshape(-1), worlds.grounds, 0, pose.x, pose.y, reach) == (clearance > 0)


@needs_oracle
def test_recorded_plants_are_repeated():
    config = json.loads((ORACLE / "config.json").read_text())
    runs, data = json.loads((ORACLE / "runs_A.json").read_text()), np.load(ORACLE / "runs_A.npz")
    maps = np.load(ORACLE / "maps.npz")["occupied"]
    robot = RobotSpec(radius=0.22, max_linear_velocity=10, max_reverse_velocity=10, max_angular_velocity=20)
    assert config
    free = [run for run in runs if run["min_clearance"] and run["min_clearance"] > 0.01 and run["n_samples"] > 50][::25]
    assert len(free) > 5
    for run in free:
        first, end = data["offset"][run["index"] : run["index"] + 2]
        trajectory = data["traj"][first:end].astype(float)
        simulated = Simulation(World(GridMap.from_image_array(maps[run["map"]])), robot, Pose(*trajectory[0, :3]))
        states, contacts = drive(simulated, data["cmd"][first : end - 1].astype(float))
        assert not contacts.any()
        # Commands are recorded to 1e-5, which adds up.
        assert np.abs(states[:, :2] - trajectory[1:, :2]).max() < 2e-3


@settings(max_examples=40)
@given(st.floats(0.02, 0.5), st.floats(-1.3, 1.3), st.floats(0.0, 0.04))
def test_a_disc_touches_a_flat_wall_where_geometry_says(speed, angle, offset):
    grid = wall_at(4.0)
    simulated = Simulation(World(grid), WAFFLE, Pose(3.7 - offset, 4.0, angle))
    for _ in range(600):
        touched = simulated.advance(speed, 0.0, 1)
        clearance = 4.0 - simulated.pose.x - WAFFLE.radius
        assert clearance > -MILLIMETRE
        if touched:
            assert clearance < 0.05 * MILLIMETRE
            break
        if simulated.pose.y > 7 or simulated.pose.y < 1:
            break


@settings(max_examples=40)
@given(st.floats(0.02, 2.0), st.floats(-1.2, 1.2), st.floats(0.0, 0.04))
def test_a_polygon_touches_a_flat_wall_where_geometry_says(speed, angle, offset):
    simulated = Simulation(World(wall_at(4.0)), JACKAL, Pose(3.7 - offset, 4.0, angle))
    corners = np.array(JACKAL.footprint)
    touched = False
    for _ in range(600):
        touched |= simulated.advance(speed, 0.0, 1)
        along = corners[:, 0] * math.cos(simulated.pose.yaw) - corners[:, 1] * math.sin(simulated.pose.yaw)
        clearance = 4.0 - simulated.pose.x - along.max()
        assert clearance > -MILLIMETRE
        if clearance < -0.7 * MILLIMETRE:
            assert touched
        if touched or not 1 < simulated.pose.y < 7:
            break


@settings(max_examples=40)
@given(st.sampled_from([WAFFLE, JACKAL]), st.floats(0, 2 * math.pi), st.floats(-0.15, 0.15), st.floats(0.05, 0.5))
def test_corners_are_touched_where_geometry_says(robot, direction, aside, speed):
    cells = np.zeros((120, 120), bool)
    cells[60, 60] = True
    grid = GridMap(cells)
    x, y = 3.025 - 0.6 * math.cos(direction), 3.025 - 0.6 * math.sin(direction)
    start = Pose(x - aside * math.sin(direction), y + aside * math.cos(direction), direction)
    simulated = Simulation(World(grid), robot, start)
    for _ in range(1000):
        before = measure_clearance(grid, robot, [simulated.pose])[0]
        if simulated.advance(speed, 0.0, 1):
            clearance = measure_clearance(grid, robot, [simulated.pose])[0]
            assert -MILLIMETRE < clearance < MILLIMETRE
            break
        assert before > -MILLIMETRE
    else:
        pytest.fail("the robot missed the wall")


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_no_wall_is_ever_entered(seed):
    rng = np.random.default_rng(seed)
    grid = GridMap(sample_map(rng, ShapeSettings()))
    simulated = Simulation(World(grid), WAFFLE, default_task(grid)[0])
    commands = np.repeat(rng.uniform([0.1, -1.0], [0.5, 1.0], (15, 2)), 20, axis=0)
    states, contacts = drive(simulated, commands)
    clearances = measure_clearance(grid, WAFFLE, states)
    assert clearances.min() > -MILLIMETRE
    assert (contacts[np.flatnonzero(clearances < -0.5 * MILLIMETRE)]).all()


@pytest.mark.parametrize("angle", [0.3, 0.8, 1.2])
def test_a_disc_slides_along_a_wall(angle):
    simulated = Simulation(World(wall_at(4.0)), WAFFLE, Pose(3.6, 2.0, math.pi / 2 - angle))
    states, contacts = drive(simulated, np.tile([0.3, 0.0], (120, 1)))
    assert contacts[-40:].all()
    assert states[-1, 1] - states[-41, 1] == pytest.approx(0.3 * math.cos(angle) * 2.0, rel=1e-3)
    assert states[-1, 3] == pytest.approx(0.3 * math.cos(angle) ** 2, rel=1e-3)


@pytest.mark.parametrize(("angle", "heading", "speed"), [(0.3, math.pi / 2, 0.3), (1.2, 0.0, 0.0)])
def test_a_polygon_comes_to_lie_along_a_wall(angle, heading, speed):
    simulated = Simulation(World(wall_at(4.0)), JACKAL, Pose(3.6, 2.0, math.pi / 2 - angle))
    states, contacts = drive(simulated, np.tile([0.3, 0.0], (120, 1)))
    assert contacts[-40:].all()
    assert states[-1, 2] == pytest.approx(heading, abs=0.02)
    assert states[-1, 3] == pytest.approx(speed, abs=1e-3)


def test_it_is_stopped_head_on_while_its_wheels_turn():
    simulated = Simulation(World(wall_at(4.0)), WAFFLE, Pose(3.5, 4.0, 0.0))
    states, _ = drive(simulated, np.tile([0.5, 0.0], (40, 1)))
    assert np.abs(np.diff(states[-10:], axis=0)).max() < 1e-6
    assert simulated.velocity == pytest.approx((0.0, 0.0), abs=1e-6)
    simulated.advance(-0.2, 0.0, 5)
    # The wheels still turn at 0.5 m/s and must slow down first: 5 ticks of 0.025 m/s.
    assert simulated.velocity[0] == pytest.approx(0.0, abs=1e-6)
    drive(simulated, np.tile([-0.2, 0.0], (20, 1)))
    assert simulated.velocity == (-0.2, 0.0)


@pytest.mark.parametrize("robot", [WAFFLE, JACKAL])
@pytest.mark.parametrize(("angle", "turn"), [(-0.02, 0.0), (-0.3, 0.0), (0.0, -0.2)])
def test_seams_between_wall_rectangles_are_not_felt(robot, angle, turn):
    cells = np.zeros((40, 200), bool)
    cells[:10] = True
    half = robot.radius if robot.footprint is None else 0.21
    ends = []
    row, col = np.nonzero(cells)
    one_a_cell = np.stack([row, col, np.ones_like(row), np.ones_like(col)], axis=1)
    for rectangles in (GridMap(cells).rectangles, one_a_cell):
        grid = GridMap(cells)
        grid.__dict__["rectangles"] = rectangles
        simulated = Simulation(World(grid), robot, Pose(1.0, 0.5 + half + 0.01, angle))
        states, contacts = drive(simulated, np.tile([0.5, turn], (120, 1)))
        assert contacts.sum() > 10
        ends.append(states[-1])
    assert np.abs(ends[0][:2] - ends[1][:2]).max() < 0.03 * np.abs(ends[0][0] - 1.0)


def test_the_edge_of_the_map_is_a_wall():
    simulated = Simulation(World(GridMap(np.zeros((40, 40), bool))), WAFFLE, Pose(1.0, 1.0, 0.0))
    states, contacts = drive(simulated, np.tile([0.5, 0.0], (60, 1)))
    assert contacts[-1]
    assert states[-1, 0] == pytest.approx(2.0 - WAFFLE.radius, abs=MILLIMETRE)


def test_a_polygon_turns_about_its_own_origin():
    ahead = RobotSpec(footprint=((0.4, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.4, -0.1)))
    simulated = Simulation(World(OPEN), ahead, Pose(0.0, 0.0, 0.0))
    drive(simulated, np.tile([0.0, 1.0], (20, 1)))
    position = simulated._engine._body.position
    assert (position.x / SCALE - 10.0, position.y / SCALE - 10.0) == pytest.approx((0, 0), abs=1e-6)


def test_maps_of_four_million_cells_are_driven_on():
    rng = np.random.default_rng(0)
    cells = rng.random((2000, 2000)) < 0.001
    cells[990:1030, 990:1200] = False
    cells[990:1030, 1100] = True
    grid = GridMap(cells, origin=(-50.0, -50.0))
    states, contacts = drive(Simulation(World(grid), WAFFLE, Pose(0.5, 0.5, 0.0)), np.tile([0.5, 0.0], (250, 1)))
    assert contacts[-1]
    assert states[-1, 0] == pytest.approx(5.0 - WAFFLE.radius, abs=MILLIMETRE)


def integrate_fortress(pose, commands, robot, ticks):
    """The plain twin of the plant ``fortress``: steps of 1 ms, and a command takes effect one step after it arrives."""
    x, y, yaw, v, w, target = *pose, 0.0, 0.0, (0.0, 0.0)
    states = []
    for command in commands:
        for step in range(10 * ticks):
            if step:
                target = command
            target_v = min(max(target[0], -robot.max_reverse_velocity), robot.max_linear_velocity)
            target_w = min(max(target[1], -robot.max_angular_velocity), robot.max_angular_velocity)
            v += min(max(target_v - v, -1e-3 * robot.max_linear_acceleration), 1e-3 * robot.max_linear_acceleration)
            w += min(max(target_w - w, -1e-3 * robot.max_angular_acceleration), 1e-3 * robot.max_angular_acceleration)
            x += 1e-3 * v * math.cos(yaw + 5e-4 * w)
            y += 1e-3 * v * math.sin(yaw + 5e-4 * w)
            yaw += 1e-3 * w
        states.append((x, y, yaw, v, w))
    return np.array(states)


@pytest.mark.parametrize("rests", [True, False])
def test_the_fortress_plant_is_integrated_in_steps_of_a_millisecond(rests):
    commands = np.repeat(np.random.default_rng(1).uniform([-0.5, -2.5], [0.6, 2.5], (40, 2)), 4, axis=0)
    world = World(GridMap(np.zeros((1, 1), bool), 40.0, (-20.0, -20.0)))
    states, _ = drive(Simulation(world, WAFFLE, Pose(0.0, 0.0, 0.3), plant="fortress", rests=rests), commands)
    difference = states - integrate_fortress((0.0, 0.0, 0.3), commands, WAFFLE, 5)
    difference[:, 2] = np.remainder(difference[:, 2] + np.pi, 2 * np.pi) - np.pi
    assert np.abs(difference).max() < 1e-9


@pytest.mark.parametrize("plant", ["ideal", "fortress"])
def test_a_robot_stopped_by_a_wall_turns_away_from_it(plant):
    """The wheels' speeds and headings after a touch are those of the ticks that follow it."""
    simulated = Simulation(World(wall_at(2.0)), WAFFLE, Pose(1.7, 2.0, 0.0), plant=plant)
    states, contacts = drive(simulated, [(0.3, 0.0)] * 20 + [(0.0, 1.0)] * 40 + [(0.3, 0.0)] * 20)
    assert contacts[15:20].all()
    assert states[19, 0] == pytest.approx(2.0 - WAFFLE.radius, abs=1e-3)
    assert states[-1, 0] < 2.0 - WAFFLE.radius - 0.05


@pytest.mark.parametrize(("plant", "heading"), [("ideal", 1.0), ("fortress", 0.0)])
def test_a_robot_that_pushes_against_a_wall_turns_only_if_its_wheels_hold(plant, heading):
    """Both wheels drive forwards at 0.26 +- 0.165 m/s, so under ``fortress`` both slip the same way."""
    simulated = Simulation(World(wall_at(2.0)), WAFFLE, Pose(1.7, 2.0, 0.0), plant=plant)
    drive(simulated, [(0.26, 0.0)] * 20)
    drive(simulated, [(0.26, 1.0)] * 26)
    assert simulated.pose.yaw == pytest.approx(heading, abs=0.15)


@pytest.mark.parametrize("robot", [WAFFLE, JACKAL])
def test_wheels_that_hold_turn_a_robot_at_a_wall(robot):
    """Backing off and turning at once, and turning on the spot, are as without the wall."""
    reach = robot.footprint[0][0] if robot.footprint else robot.radius
    for command in [(-0.2, 0.5), (0.0, 1.0) if robot is WAFFLE else (-0.2, -0.5)]:
        headings = []
        for x in (2.0 - reach - 0.02, 1.0):
            simulated = Simulation(World(wall_at(2.0)), robot, Pose(x, 2.0, 0.0), plant="fortress")
            _, contacts = drive(simulated, [(0.02 if x > 1.2 else 0.0, 0.0)] * 40)
            assert contacts[-1] == (x > 1.2)
            drive(simulated, [(0.0, 0.0)] * 4 + [command] * 20)
            headings.append(simulated.pose.yaw)
        assert headings[0] == pytest.approx(headings[1], abs=0.01)
