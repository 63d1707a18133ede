"""Runs with costmap filters: paths and robots stay out of keepout zones, and keep the limits of speed zones."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.nav2_params import load_preset
from controllers.navigator.navigator import Navigator
from controllers.registry import make_controller
from evolution.driving.one_run import environment_for, run_episode
from gym_mapbench.costmap import FilterMask, KeepoutFilter, LayeredCostmap, SpeedFilter
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError, PlanningError
from gym_mapbench.planners import make_planner
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose, Scenario
from tests.controllers.plain_follower import OPEN, Drive, PlainFollower, context, plain_navigation

PRESETS = {"humble": "thesis", "jazzy": "jazzy", "lyrical": "lyrical"}
ACROSS = Scenario(OPEN, Pose(0.7, 1.5, 0.0), Pose(4.3, 1.5, 0.0), "across")
CONTROLLERS = {"dwb": "max_vel_x", "mppi": "vx_max", "rpp": "desired_linear_vel", "graceful": "v_linear_max"}
"""Controllers, and the parameter that holds the top speed of each."""


def zone(x0, x1, y0, y1, border=0.0):
    """A mask of the open map with a zone between some coordinates, m, and values that fall off around it."""
    rows, cols = OPEN.shape
    x, y = (np.arange(cols) + 0.5) * 0.05, (np.arange(rows)[:, None] + 0.5) * 0.05
    away = np.hypot(np.maximum(np.maximum(x0 - x, x - x1), 0.0), np.maximum(np.maximum(y0 - y, y - y1), 0.0))
    values = np.where(away == 0.0, 100, np.where(away < border, 90 * (1.0 - away / max(border, 0.05)), 0))
    return FilterMask.from_values(values.astype(np.int8), 0.05)


def navigation(release, keepout=None, speed=None, **options):
    """The preset of a release with filters in both costmaps, the speed filter in the global costmap alone."""
    preset = load_preset(PRESETS[release])
    keepouts = {"keepout": KeepoutFilter(mask=keepout)} if keepout else {}
    speeds = {"speed": SpeedFilter(mask=speed, **options)} if speed else {}
    return preset.replace(
        local_costmap=preset.local_costmap.replace(keepout_filters=keepouts),
        global_costmap=preset.global_costmap.replace(keepout_filters=keepouts, speed_filters=speeds),
    )


def drive(name, release, scenario=ACROSS, **filters):
    return drive_through(navigation(release, **filters), name, scenario)


def drive_through(params, name="rpp", scenario=ACROSS):
    controller = make_controller(name, navigation=params)
    env = environment_for(EnvConfig(time_limit=60.0), controller)
    return run_episode(env, controller, scenario, name=name, seed=3)


def inside(mask, poses):
    """Whether each pose is in the zone of a mask."""
    cells = [mask.cell_at(Pose(x, y)) for x, y in np.asarray(poses)[:, :2]]
    return np.array([cell is not None and mask.values[cell] == 100 for cell in cells])


class TestKeepout:
    ZONE = zone(2.0, 3.0, 0.0, 2.0, border=0.5)

    @settings(max_examples=25, deadline=None)
    @given(
        st.sampled_from(["navfn", "smac_2d", "theta_star"]), st.sampled_from(RELEASES),
        st.floats(1.0, 2.4), st.floats(0.2, 1.4), st.floats(0.0, 1.4), st.floats(0.2, 1.4),
    )  # fmt: skip
    def test_no_path_crosses_a_zone(self, planner, release, x, width, y, height):
        """NavFn's paths are half a cell off, so the outermost cells of the zone do not count."""
        mask, core = zone(x, x + width, y, y + height), zone(x + 0.05, x + width - 0.05, y + 0.05, y + height - 0.05)
        costmap = LayeredCostmap(navigation(release, mask).global_costmap, OPEN, Footprint.from_radius(0.22))
        try:
            path = make_planner(planner, release=release).plan(costmap.update(ACROSS.start), ACROSS.start, ACROSS.goal)
        except PlanningError:
            return
        assert not inside(core, path).any()

    @pytest.mark.parametrize("release", RELEASES)
    @pytest.mark.parametrize("name", CONTROLLERS)
    def test_robots_go_around(self, name, release):
        straight, around = drive(name, release), drive(name, release, keepout=self.ZONE)
        assert inside(self.ZONE, straight.trajectory).any()
        assert around.outcome == "goal"
        assert not inside(self.ZONE, around.trajectory).any()

    def test_an_inflation_layer_behind_the_filter_keeps_paths_off_a_zone_without_a_border(self):
        plain = navigation("jazzy", keepout=zone(2.0, 3.0, 0.0, 2.0))
        costmaps = {
            name: each.replace(inflation_filters={"inflation_layer": each.inflation_layer})
            for name, each in plain.costmaps.items()
        }
        outcomes = [drive_through(params).outcome for params in (plain, plain.replace(**costmaps))]
        assert outcomes == ["controller_failure", "goal"]

    def test_a_goal_behind_a_zone_from_wall_to_wall_is_out_of_reach(self):
        episode = drive("rpp", "jazzy", keepout=zone(2.0, 3.0, 0.0, 3.0))
        assert episode.outcome == "planner_failure"

    def test_a_local_costmap_in_an_odom_frame_sees_the_zone_where_it_is(self):
        params = plain_navigation(release="jazzy")
        rolling = load_preset("jazzy").local_costmap.replace(
            plugins=("inflation_layer",), keepout_filters={"keepout": KeepoutFilter(mask=self.ZONE)}
        )
        navigator = Navigator(PlainFollower(), params.replace(local_costmap=rolling), "plain")
        navigator.reset(context())
        Drive(navigator, map_in_odom=Pose(7.0, -3.0, 1.2)).run(20)
        seen = navigator.seen_costmap
        rows, cols = np.nonzero(seen.costmap.costs == 254)
        assert len(rows)
        for row, col in zip(rows, cols, strict=True):
            x = seen.costmap.origin_x + (col + 0.5) * seen.costmap.resolution
            y = seen.costmap.origin_y + (row + 0.5) * seen.costmap.resolution
            frame = seen.frame
            at_x = frame.x + np.cos(frame.yaw) * x - np.sin(frame.yaw) * y
            at_y = frame.y + np.sin(frame.yaw) * x + np.cos(frame.yaw) * y
            assert 2.0 - 0.05 < at_x < 3.0 + 0.05
            assert at_y < 2.0 + 0.05


class TestSpeed:
    ZONE = zone(1.2, 2.6, 0.0, 3.0)

    @pytest.mark.parametrize("release", RELEASES)
    @pytest.mark.parametrize("name", [*CONTROLLERS, "shim_rpp"])
    @pytest.mark.parametrize("options", [{"percentage": True, "multiplier": 0.4}, {"multiplier": 0.0013}])
    def test_robots_keep_the_limit_inside_and_only_there(self, name, release, options):
        """The global costmap sees the robot once a second; the Graceful Controller is slower than its limit."""
        episode = drive(name, release, speed=self.ZONE, **options)
        kind = name.removeprefix("shim_")
        top = navigation(release).controller(kind).params[CONTROLLERS[kind]]
        limit = 0.4 * top if "percentage" in options else 0.13
        x, v = episode.trajectory[:-1, 0], episode.commands[:, 0]
        assert episode.outcome == "goal"
        slowest = 0.1 if name == "graceful" else limit - 0.02
        assert slowest <= v[(x > 2.0) & (x < 2.6)].max() <= limit + 1e-6
        assert v[x > 2.9].max() > limit + 0.01

    @pytest.mark.parametrize("name", CONTROLLERS)
    def test_a_run_outside_all_zones_is_the_same_to_the_byte(self, name):
        free = zone(0.0, 0.0, 0.0, 0.0)
        plain, filtered = drive(name, "jazzy"), drive(name, "jazzy", keepout=free, speed=free)
        assert plain.trajectory.tobytes() == filtered.trajectory.tobytes()
        assert plain.commands.tobytes() == filtered.commands.tobytes()

    def test_a_follower_without_speed_limits_is_refused(self):
        params = plain_navigation()
        limited = params.local_costmap.replace(speed_filters={"speed": SpeedFilter(mask=self.ZONE)})
        navigator = Navigator(PlainFollower(), params.replace(local_costmap=limited), "plain")
        with pytest.raises(ConfigError, match=r"^local_costmap\.speed_filters: expected a controller with set_speed"):
            navigator.reset(context())
