"""The collision monitor: worked examples of each action and release, a slow plain twin, and drives."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.base import STOP, Twist
from controllers.collision_monitor import CollisionMonitor as Params
from controllers.collision_monitor import MonitorPolygon, MonitorSource
from controllers.nav2_params.navigation import VelocitySmoother
from controllers.navigator.collision_monitor import CollisionMonitor, is_in_range
from controllers.navigator.navigator import Navigator
from gym_mapbench.kernels.collision_points import collision_time, count_inside
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.lidar import Lidar, LidarSettings
from gym_mapbench.world.scenario import Pose
from gym_mapbench.world.world import World
from tests.controllers.plain_follower import OPEN, START, Drive, PlainFollower, context, plain_navigation

LIDAR = LidarSettings(beams=360, range_max=3.5)
SQUARE = ((0.5, 0.5), (0.5, -0.5), (-0.5, -0.5), (-0.5, 0.5))
FOOTPRINT = Footprint.from_corners(np.array([(0.2, 0.2), (0.2, -0.2), (-0.2, -0.2), (-0.2, 0.2)]), padding=0.0)
SCAN = {"scan": MonitorSource()}
HOME = Pose(0.0, 0.0, 0.0)
AHEAD = Twist(0.4, 0.2)


def polygon(action, **changes):
    return MonitorPolygon(**{"type": "polygon", "action_type": action, "points": SQUARE, "min_points": 4} | changes)


def scan_with(hits: int, distance: float = 0.4):
    """A scan in which the first beams, which look ahead, hit something."""
    ranges = np.full(LIDAR.beams, LIDAR.range_max, dtype=np.float32)
    ranges[:hits] = distance
    return ranges


def monitor_of(*polygons, release="jazzy", hits=0, distance=0.4, lidar=LIDAR, **changes):
    named = {f"p{number}": one for number, one in enumerate(polygons)}
    params = Params(**{"polygons": named, "observation_sources": SCAN} | changes)
    monitor = CollisionMonitor(params, release, FOOTPRINT, lidar)
    monitor.observe(HOME, scan_with(hits, distance))
    return monitor


class TestActions:
    @pytest.mark.parametrize("release", RELEASES)
    @pytest.mark.parametrize(("hits", "stops"), [(3, False), (4, True), (5, True)])
    def test_stop_acts_from_min_points_on(self, release, hits, stops):
        monitor = monitor_of(polygon("stop"), release=release, hits=hits)
        assert monitor.process(AHEAD) == (STOP if stops else AHEAD)
        assert monitor.actions == {"stop" if stops else "none": 1}

    def test_slowdown_multiplies_both_velocities(self):
        monitor = monitor_of(polygon("slowdown", slowdown_ratio=0.3), hits=4)
        assert monitor.process(AHEAD) == pytest.approx((0.12, 0.06))

    def test_a_ratio_above_one_changes_nothing(self):
        assert monitor_of(polygon("slowdown", slowdown_ratio=1.5), hits=4).process(AHEAD) == AHEAD

    @pytest.mark.parametrize(("release", "expected"), [("jazzy", (0.2, 0.3)), ("lyrical", (0.12, 0.3))])
    def test_jazzy_caps_both_velocities_apart_and_lyrical_keeps_the_curvature(self, release, expected):
        monitor = monitor_of(polygon("limit", linear_limit=0.2, angular_limit=0.3), release=release, hits=4)
        assert monitor.process(Twist(0.4, 1.0)) == pytest.approx(expected)
        assert monitor.process(Twist(-0.4, -1.0)) == pytest.approx([-value for value in expected])
        assert monitor.process(Twist(0.1, 0.2)) == (0.1, 0.2)

    def test_approach_scales_by_the_time_before_the_step_that_collides(self):
        # The points are 0.05 m in front of the footprint at 0.5 m/s: the second step of 0.1 s brings them inside.
        approach = polygon("approach", points=None, time_before_collision=2.0, simulation_time_step=0.1)
        monitor = monitor_of(approach, hits=4, distance=0.26)
        assert monitor.process(Twist(0.5, 0.0)) == pytest.approx((0.5 * 0.1 / 2.0, 0.0))
        assert monitor.process(Twist(-0.5, 0.0)) == (-0.5, 0.0)

    def test_approach_stops_when_the_first_step_collides(self):
        monitor = monitor_of(polygon("approach", points=None), hits=4, distance=0.22)
        assert monitor.process(Twist(0.5, 0.0)) == STOP

    @pytest.mark.parametrize(("release", "stops"), [("humble", True), ("jazzy", False), ("lyrical", False)])
    def test_humbles_approach_needs_one_point_less_for_a_collision_of_now(self, release, stops):
        monitor = monitor_of(polygon("approach"), release=release, hits=3)
        assert monitor.process(AHEAD) == (STOP if stops else AHEAD)

    def test_none_and_disabled_polygons_change_nothing(self):
        monitor = monitor_of(polygon("none"), polygon("stop", enabled=False), hits=9)
        assert monitor.process(AHEAD) == AHEAD
        assert monitor_of(polygon("stop"), hits=9, enabled=False).process(AHEAD) == AHEAD

    def test_the_least_velocity_counts_and_a_stop_ends_the_search(self):
        fast, slow = polygon("slowdown", slowdown_ratio=0.8), polygon("slowdown", slowdown_ratio=0.4)
        assert monitor_of(fast, slow, hits=4).act_on(AHEAD).polygon == "p1"
        assert monitor_of(slow, fast, hits=4).act_on(AHEAD).polygon == "p0"
        assert monitor_of(slow, polygon("stop"), fast, hits=4).act_on(AHEAD) == ("stop", STOP, "p1")

    def test_a_circle_counts_points_nearer_than_its_radius(self):
        circle = MonitorPolygon(type="circle", action_type="stop", radius=0.4)
        assert monitor_of(circle, hits=4, distance=0.39).process(AHEAD) == STOP
        assert monitor_of(circle, hits=4, distance=0.41).process(AHEAD) == AHEAD

    def test_lyrical_waits_for_consecutive_commands(self):
        patient = polygon("stop", trigger_consecutive_points=2, release_consecutive_points=3)
        monitor = monitor_of(patient, release="lyrical", hits=4)
        assert [monitor.process(AHEAD) for _ in range(2)] == [AHEAD, STOP]
        monitor.observe(HOME, scan_with(0))
        assert [monitor.process(AHEAD) for _ in range(3)] == [STOP, STOP, AHEAD]


FORWARD = {"points": SQUARE, "linear_min": 0.1, "linear_max": 1.0, "theta_min": -1.0, "theta_max": 1.0}
BACKWARD = {**FORWARD, "points": [[3, 3], [3, 2], [2, 2]], "linear_min": -1.0, "linear_max": -0.1}


class TestVelocityPolygons:
    def polygon(self, **changes):
        shapes = {"forward": FORWARD, "backward": BACKWARD}
        return MonitorPolygon(type="velocity_polygon", action_type="stop", velocity_polygons=shapes, **changes)

    def test_the_command_selects_the_shape_and_the_last_one_stays(self):
        monitor = monitor_of(self.polygon(), hits=4)
        assert monitor.process(Twist(0.0, 0.5)) == (0.0, 0.5), "no shape yet"
        assert monitor.process(AHEAD) == STOP
        assert monitor.process(Twist(0.0, 0.5)) == STOP, "the shape for driving forward stays"
        assert monitor.process(Twist(-0.4, 0.0)) == (-0.4, 0.0)

    @pytest.mark.parametrize(
        ("release", "command", "expected"),
        [("jazzy", 0.4, True), ("jazzy", -0.4, False), ("lyrical", 0.4, False), ("lyrical", -0.4, True)],
    )
    def test_a_holonomic_shape_asks_for_a_direction(self, release, command, expected):
        start, end = (math.pi / 2, -math.pi / 2) if release == "lyrical" else (-1.0, 1.0)
        shape = (
            self.polygon().velocity_polygons["forward"].replace(direction_start_angle=start, direction_end_angle=end)
        )
        assert is_in_range(shape, Twist(command, 0.0), True, release) is expected


class TestPoints:
    def test_shortest_and_longest_ranges_are_no_points(self):
        lidar = LIDAR.replace(range_min=0.12)
        assert monitor_of(polygon("stop"), hits=9, distance=0.1, lidar=lidar).process(AHEAD) == AHEAD
        wide = polygon("stop", points=((9, 9), (9, -9), (-9, -9), (-9, 9)))
        assert monitor_of(wide, hits=0).process(AHEAD) == AHEAD

    def test_points_stand_where_the_lidar_stands(self):
        lidar = LIDAR.replace(x=0.3, yaw=math.pi)
        assert monitor_of(polygon("stop"), hits=4, distance=0.7, lidar=lidar).process(AHEAD) == STOP
        assert monitor_of(polygon("stop"), hits=4, distance=0.7).process(AHEAD) == AHEAD

    @pytest.mark.parametrize("shifts", [True, False])
    def test_an_old_scan_is_moved_by_what_the_robot_has_moved(self, shifts):
        monitor = monitor_of(polygon("stop"), hits=4, distance=0.7, base_shift_correction=shifts)
        monitor.observe(Pose(0.3, 0.0, 0.0), scan_with(4, 0.7))
        assert monitor.process(AHEAD) == (STOP if shifts else AHEAD)

    def test_turning_turns_the_points(self):
        ahead = polygon("stop", points=((0.5, 0.1), (0.5, -0.1), (0.0, -0.1), (0.0, 0.1)))
        monitor = monitor_of(ahead, hits=4)
        assert monitor.process(AHEAD) == STOP
        monitor.observe(Pose(0.0, 0.0, math.pi / 2), scan_with(4))
        assert monitor.process(AHEAD) == AHEAD

    def test_a_polygon_counts_its_own_sources(self):
        sources = {"scan": MonitorSource(), "depth": MonitorSource(type="pointcloud")}
        blind = polygon("stop", sources_names=("depth",))
        assert monitor_of(blind, hits=9, observation_sources=sources).process(AHEAD) == AHEAD
        assert monitor_of(polygon("stop"), hits=9, observation_sources=sources).process(AHEAD) == STOP

    def test_the_lidar_stands_for_a_point_cloud_if_there_is_no_laser(self):
        cloud = {"depth": MonitorSource(type="pointcloud")}
        assert monitor_of(polygon("stop"), hits=9, observation_sources=cloud).process(AHEAD) == STOP
        off = {"scan": MonitorSource(enabled=False)}
        assert monitor_of(polygon("stop"), hits=9, observation_sources=off).process(AHEAD) == AHEAD


# --- A plain twin -----------------------------------------------------------------------------------------------------

coordinates = st.floats(-1.5, 1.5)
points = st.lists(st.tuples(coordinates, coordinates), max_size=12).map(lambda rows: np.array(rows).reshape(-1, 2))
speeds = st.floats(-1.0, 1.0)
commands = st.builds(Twist, speeds, speeds)


def plain_count(cloud, half):
    """Number of points in an axis-parallel square around the origin."""
    return sum(abs(x) < half and abs(y) < half for x, y in cloud)


def plain_time(cloud, half, v, w, horizon, step, least):
    """Seconds until enough points are inside, by complex numbers: the pose first, then the test."""
    place, heading, time = 0j, 0.0, 0.0
    if plain_count(cloud, half) >= least:
        return 0.0
    while time <= horizon:
        place += v * step * complex(math.cos(heading), math.sin(heading))
        heading += w * step
        seen = [(complex(x, y) - place) * complex(math.cos(heading), -math.sin(heading)) for x, y in cloud]
        if plain_count([(z.real, z.imag) for z in seen], half) >= least:
            return time
        time += step
    return -1.0


@settings(max_examples=150, deadline=None)
@given(points, commands, st.integers(1, 4))
def test_the_kernel_equals_a_plain_simulation(cloud, command, least):
    corners = np.array([(0.3, 0.3), (0.3, -0.3), (-0.3, -0.3), (-0.3, 0.3)])
    found = collision_time(cloud, corners, 0.5, *command, 1.0, 0.1, least, least)
    # A point on the border may fall to either side: such samples are compared with both a larger and a smaller square.
    nearly = {plain_time(cloud, half, *command, 1.0, 0.1, least) for half in (0.3 - 1e-9, 0.3, 0.3 + 1e-9)}
    assert found in nearly


@settings(max_examples=150, deadline=None)
@given(points, st.floats(0.1, 1.0), coordinates, coordinates, st.floats(-3, 3))
def test_circles_and_polygons_with_many_corners_hold_the_same_points(cloud, radius, x, y, yaw):
    angles = np.linspace(0.0, 2 * np.pi, 2000, endpoint=False)
    corners = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    in_polygon = count_inside(cloud, corners, 2.0 * radius, x, y, yaw)
    smaller, larger = (count_inside(cloud, np.empty((0, 2)), radius * f, x, y, yaw) for f in (0.99999, 1.00001))
    assert smaller <= in_polygon <= larger


# --- Properties -------------------------------------------------------------------------------------------------------

ratios = st.floats(0.0, 1.5)
polygons = st.one_of(
    st.builds(polygon, st.just("stop")),
    st.builds(polygon, st.just("slowdown"), slowdown_ratio=ratios),
    st.builds(polygon, st.just("limit"), linear_limit=ratios, angular_limit=ratios),
    st.builds(polygon, st.just("approach"), time_before_collision=st.floats(0.2, 3.0)),
)


@settings(max_examples=150, deadline=None)
@given(st.lists(polygons, max_size=4), commands, st.integers(0, 12), st.floats(0.2, 3.0), st.sampled_from(RELEASES))
def test_a_monitored_command_is_never_faster_and_turns_no_other_way(chosen, command, hits, distance, release):
    action = monitor_of(*chosen, release=release, hits=hits, distance=distance).act_on(command)
    v, w = action.velocity
    assert abs(v) <= abs(command.v)
    assert abs(w) <= abs(command.w)
    assert v * command.v >= 0.0
    assert w * command.w >= 0.0
    if action.kind in ("slowdown", "approach") or release == "lyrical":
        assert v * command.w == pytest.approx(w * command.v, abs=1e-12), "the curvature stays"


# --- Drives -----------------------------------------------------------------------------------------------------------


class ScanningDrive(Drive):
    """A drive whose navigator also gets the scan of the map."""

    def __init__(self, navigator, grid, **options):
        super().__init__(navigator, **options)
        self.lidar = Lidar(LidarSettings(), World(grid))

    def step(self):
        act = self.navigator.act
        scan = self.lidar.scan(self.pose)
        self.navigator.act = lambda observation: act({**observation, "scan": scan})
        try:
            return super().step()
        finally:
            self.navigator.act = act


def drive(monitor, steps, answer=lambda now: Twist(0.37, 0.0), **changes):
    follower = PlainFollower(answer)
    navigator = Navigator(follower, plain_navigation(collision_monitor=monitor, **changes), "plain")
    navigator.reset(context())
    return navigator, ScanningDrive(navigator, OPEN).run(steps)


STOP_AHEAD = Params(
    polygons={"stop": polygon("stop", points=((0.5, 0.2), (0.5, -0.2), (0.0, -0.2), (0.0, 0.2)))},
    observation_sources=SCAN,
)


@pytest.mark.parametrize("smoother", [None, VelocitySmoother()])
def test_the_robot_stands_before_the_wall(smoother):
    """The follower drives straight on for ever, past the goal; the wall is at x = 4.95 m."""
    navigator, run = drive(STOP_AHEAD, 400, velocity_smoother=smoother, **never_there())
    assert navigator.status == "running"
    assert run.commands[-1] == STOP
    assert 4.95 - 0.5 - 0.37 * 0.05 <= run.pose.x <= 4.95 - 0.5 + 0.37 * 0.05
    assert navigator.explain() == "polygon stop of the collision monitor stops it"
    assert navigator.monitor_actions["stop"] > 100
    assert navigator.monitor_actions["none"] > 100


def never_there():
    server = plain_navigation().controller_server
    progress = server.progress_checker.replace(plugin="none")
    goal = server.goal_checker.replace(xy_goal_tolerance=1e-6)
    return {"controller_server": server.replace(progress_checker=progress, goal_checker=goal)}


def test_without_the_monitor_it_drives_into_the_wall():
    navigator, run = drive(None, 400, **never_there())
    assert run.pose.x > 4.95
    assert navigator.monitor_actions == {}


def test_a_monitor_without_points_changes_no_command():
    _, plain = drive(None, 4000, answer=lambda now: None)
    navigator, watched = drive(STOP_AHEAD, 4000, answer=lambda now: None)
    assert watched.commands == plain.commands
    assert navigator.status == "succeeded"


def test_the_navigator_asks_for_scans_at_the_rate_of_its_commands():
    plain = Navigator(PlainFollower(), plain_navigation(), "plain")
    watched = Navigator(PlainFollower(), plain_navigation(collision_monitor=STOP_AHEAD), "plain")
    assert "scan" not in plain.observation_keys
    assert "scan" in watched.observation_keys
    assert watched.scan_rate == max(20.0, plain.scan_rate)


@pytest.mark.parametrize(("release", "passes"), [("humble", True), ("jazzy", False)])
def test_recoveries_of_humble_go_past_the_monitor(release, passes):
    navigator = Navigator(PlainFollower(), plain_navigation(collision_monitor=STOP_AHEAD, release=release), "plain")
    navigator.reset(context())
    navigator._monitor.observe(START, scan_with(9))
    navigator._take_recovery_command(AHEAD)
    assert navigator.cmd_vel == (AHEAD if passes else STOP)
