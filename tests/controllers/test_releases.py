"""Three releases, one code: what the presets hold, what belongs together, and what only one of them has."""

from __future__ import annotations

import pytest

from controllers.checkers import GoalChecker
from controllers.nav2_params import PRESETS, NavigationParams, load_preset
from controllers.nav2_params.navigation import ControllerServer
from controllers.nav2_params.plugin_settings import ControllerPlugin, PlannerPlugin
from controllers.registry import make_controller
from gym_mapbench.costmap import CostmapParams
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.robot import make_robot


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_of_one_release_throughout(name):
    preset = load_preset(name)
    assert preset.release == (name.partition("_")[0] if name.partition("_")[0] in RELEASES else "humble")
    assert {plugin.params["release"] for plugin in preset.controllers.values()} == {preset.release}
    assert preset.planner.params["release"] == preset.local_costmap.release == preset.release
    further = ["graceful"] if "fair" in name else []  # which has other limits there than by default
    assert list(preset.controllers) == ["dwb", "mppi", "rpp", *further]


def test_jazzys_example():
    preset = load_preset("jazzy")
    mppi, rpp = preset.controller("mppi").params, preset.controller("rpp").params
    for costmap in (preset.local_costmap, preset.global_costmap):
        assert (costmap.inflation_layer.inflation_radius, costmap.inflation_layer.cost_scaling_factor) == (0.70, 3.0)
    assert (mppi["batch_size"], mppi["regenerate_noises"], mppi["prune_distance"]) == (2000, True, 1.7)
    assert (mppi["ax_max"], mppi["ax_min"], mppi["az_max"], mppi["open_loop"]) == (3.0, -3.0, 3.5, False)
    assert (mppi["CostCritic"]["trajectory_point_step"], mppi["PathAlignCritic"]["trajectory_point_step"]) == (2, 4)
    assert (mppi["PathAngleCritic"]["mode"], mppi["PathAngleCritic"]["max_angle_to_furthest"]) == (0, 1.0)
    assert "reset_period" not in mppi
    assert (rpp["curvature_lookahead_dist"], rpp["stateful"], "use_interpolation" in rpp) == (1.0, True, False)
    assert preset.bt.backup_speed == 0.15
    assert preset.velocity_smoother.max_velocity == (0.5, 0.0, 2.0)
    # DWB has no example of its own: Humble's values.
    dwb, before = (load_preset(name).controller("dwb").params for name in ("jazzy", "thesis"))
    assert {**dwb, "release": "humble"} == before


def test_jazzy_fair_gives_every_controller_the_robots_limits():
    preset, robot = load_preset("jazzy_fair"), make_robot("turtlebot3_waffle")
    v, w = robot.max_linear_velocity, robot.max_angular_velocity
    gain, turn = robot.max_linear_acceleration, robot.max_angular_acceleration
    dwb, mppi, rpp = (preset.controller(name).params for name in ("dwb", "mppi", "rpp"))
    assert (dwb["max_vel_x"], dwb["max_speed_xy"], dwb["max_vel_theta"]) == (v, v, w)
    assert (dwb["acc_lim_x"], dwb["decel_lim_x"], dwb["acc_lim_theta"]) == (gain, -gain, turn)
    assert (mppi["vx_max"], mppi["wz_max"]) == (v, w)
    assert (mppi["ax_max"], mppi["ax_min"], mppi["az_max"]) == (gain, -gain, turn)
    assert (rpp["desired_linear_vel"], rpp["rotate_to_heading_angular_vel"], rpp["max_angular_accel"]) == (v, w, turn)
    smoother = preset.velocity_smoother
    assert (smoother.max_velocity, smoother.max_accel) == ((v, 0.0, w), (gain, 0.0, turn))


def test_what_is_not_said_is_the_releases_own():
    trees = [NavigationParams(release=release).bt.backup_speed for release in RELEASES]
    assert trees == [0.05, 0.15, 0.15]
    limits = [NavigationParams(release=release).behavior_server.backup.acceleration_limit for release in RELEASES]
    assert limits == [0.0, 0.0, 2.5]
    jazzy = NavigationParams(release="jazzy")
    assert jazzy.planner.params["release"] == jazzy.global_costmap.release == "jazzy"


@pytest.mark.parametrize(
    ("options", "where"),
    [
        ({"controllers": {"rpp": ControllerPlugin(kind="rpp")}}, "controllers.rpp"),
        ({"planner": PlannerPlugin()}, "planner"),
        ({"local_costmap": CostmapParams()}, "local_costmap"),
    ],
)
def test_releases_do_not_mix(options, where):
    assert NavigationParams(**options).release == "humble"
    with pytest.raises(ConfigError, match=f"{where}: expected parameters of Nav2's jazzy, got humble's"):
        NavigationParams(release="jazzy", **options)


def test_only_lyrical_looks_along_and_across_the_path():
    server = ControllerServer(goal_checker=GoalChecker(plugin="axis"))
    assert NavigationParams(release="lyrical", controller_server=server).release == "lyrical"
    with pytest.raises(ConfigError, match=r"plugin: expected one of simple, stopped, position, got Lyrical's"):
        NavigationParams(controller_server=server)


def test_changes_of_a_controller_are_read_by_its_release():
    made = make_controller("mppi", preset="jazzy", **{"PathAngleCritic.mode": 1, "az_max": 2.0})
    assert (made.follower.params.az_max, made.follower.params.PathAngleCritic.mode) == (2.0, 1)
    with pytest.raises(ConfigError, match="reset_period"):
        make_controller("mppi", preset="jazzy", reset_period=2.0)
    with pytest.raises(ConfigError, match="az_max"):
        make_controller("mppi", preset="thesis", az_max=2.0)
    with pytest.raises(ConfigError, match="stateful"):
        make_controller("rpp", preset="fair", stateful=True)


@pytest.mark.parametrize("name", ["navfn", "smac_2d", "theta_star", "gym_mapbench.planners:SMAC_2D"])
@pytest.mark.parametrize("release", RELEASES)
def test_a_planner_given_by_name_is_of_the_release(name, release):
    """A file of an earlier version holds no release of a Smac 2D or Theta*."""
    assert NavigationParams(release=release, planner={"name": name}).planner.params["release"] == release
    other = "jazzy" if release == "humble" else "humble"
    with pytest.raises(ConfigError, match=rf"planner: expected .*, got {other}'s, as the option release says"):
        NavigationParams(release=release, planner={"name": name, "params": {"release": other}})
