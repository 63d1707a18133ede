"""Files of Lyrical: how they are told, what is read, what Lyrical itself would not start with, and what is written."""

from __future__ import annotations

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.behaviors import BehaviorServer, DriveLimits
from controllers.checkers import GoalChecker, ProgressChecker
from controllers.nav2_params import load_preset, parse_nav2_params, write_nav2_params
from controllers.nav2_params.navigation import ControllerServer, NavigationParams
from controllers.nav2_params.plugin_settings import ControllerPlugin, PlannerPlugin
from controllers.nav2_params.values import write_values
from controllers.path_handler import PathHandler
from controllers.rotation_shim.params import params_around
from controllers.rpp.params import RppParams
from gym_mapbench.costmap import CostmapParams, InflationLayer
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.robot import make_robot
from tests.controllers.test_parameter_files import DWB, MPPI, RPP, SHIM, found, node, with_controller, with_layers

LYRICAL_MPPI = {**MPPI, "motion_model": "drive", "drive": {"plugin": "mppi::DiffDriveMotionModel"}}
HANDLER = {"path_handler_plugins": ["PathHandler"]}


def lyrical(document):
    return parse_nav2_params(document, release="lyrical").navigation


def follow_path(group, **server):
    return lyrical(with_controller(group, **server)).controllers["FollowPath"].params


# --- Recognition -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("document", "release"),
    [
        (with_controller(DWB, **HANDLER), "lyrical"),
        (with_controller(LYRICAL_MPPI), "lyrical"),
        (with_controller({**MPPI, "motion_model": "DiffDrive", "sgf_order": 2}), "humble"),
        (with_controller({**RPP, "max_linear_vel": 0.4}), "lyrical"),
        (with_controller({**RPP, "use_dynamic_window": True}), "lyrical"),
        (with_controller({**SHIM, "primary_controller": DWB}), "lyrical"),
        (
            with_controller({**SHIM, **DWB, **SHIM, "primary_controller": "dwb_core::DWBLocalPlanner"}, **HANDLER),
            "humble",
        ),
        (with_controller(DWB, goal_checker={"path_length_tolerance": 2.0}), "lyrical"),
        ({"planner_server": node(GridBased={"max_cycles_factor": 4})}, "lyrical"),
        ({"bt_navigator": node(bt_search_directories=["a"])}, "lyrical"),
        ({"bt_navigator": node(error_code_name_prefixes=["spin"])}, "jazzy"),  # Kilted's files have it as well
        (
            {"planner_server": node(GridBased={"plugin": "nav2_navfn_planner/NavfnPlanner", "max_cycles_factor": 4})},
            "humble",
        ),
    ],
)
def test_the_keys_of_section_0_tell_lyrical(document, release):
    assert parse_nav2_params(document).recognition.release == release


def test_a_file_that_mixes_lyrical_and_older_ones_needs_a_word():
    document = with_controller({**RPP, "use_dynamic_window": True, "stateful": True})
    with pytest.raises(
        ConfigError, match=r"use_dynamic_window: the file mixes .*this is Lyrical's, but .*stateful is Jazz"
    ):
        parse_nav2_params(document)
    read = parse_nav2_params(document, release="lyrical")
    assert read.recognition.against == ("controller_server.FollowPath.stateful",)
    assert read.named("other_release") == ("controller_server.FollowPath.stateful",)


# --- Reading ---------------------------------------------------------------------------------------------------------


def test_the_path_handler_and_the_goal_checker_are_read():
    checker = {"plugin": "nav2_controller::AxisGoalChecker", "along_path_tolerance": 0.1, "is_overshoot_valid": True}
    handler = {"plugin": "nav2_controller::FeasiblePathHandler", "prune_distance": 3.0, "enforce_path_rotation": True}
    document = with_controller(
        DWB,
        path_handler_plugins=["mine"],
        mine=handler,
        goal_checker_plugins=["checker"],
        checker=checker,
        progress_checker_plugins=[],
    )
    server = lyrical(document).controller_server
    assert server.path_handler == PathHandler(prune_distance=3.0, enforce_path_rotation=True)
    assert server.goal_checker == GoalChecker(plugin="axis", along_path_tolerance=0.1, is_overshoot_valid=True)
    assert server.progress_checker.plugin == "none"


def test_the_adaptive_checker_has_thresholds_of_its_own():
    group = {"plugin": "nav2_controller::AdaptiveToleranceGoalChecker", "rot_stopped_velocity": 0.2}
    checker = lyrical(with_controller(DWB, goal_checker=group)).controller_server.goal_checker
    assert (checker.plugin, checker.trans_stopped_velocity, checker.rot_stopped_velocity) == ("adaptive", 0.1, 0.2)
    assert (checker.fine_xy_goal_tolerance, checker.required_stagnation_cycles) == (0.1, 15)


def test_defaults_are_those_of_lyricals_code():
    rpp, graceful, mppi = (
        follow_path(RPP),
        follow_path({"plugin": "nav2_graceful_controller::GracefulController"}),
        None,
    )
    mppi = follow_path(LYRICAL_MPPI)
    assert (rpp["max_linear_decel"], rpp["use_dynamic_window"], rpp["min_distance_to_obstacle"]) == (-2.5, False, -1.0)
    assert not {"stateful", "max_robot_pose_search_dist", "use_interpolation"} & rpp.keys()
    assert (graceful["deceleration_max"], graceful["obstacle_cost_margin"], graceful["beta"]) == (2.5, 1, 0.4)
    assert (mppi["sgf_order"], mppi["TrajectoryValidator"]["collision_lookahead_time"]) == (2, 2.0)
    assert not {"prune_plan", "prune_distance", "forward_prune_distance"} & follow_path(DWB).keys()


def test_the_older_name_of_the_top_speed_counts_first():
    read = parse_nav2_params(
        with_controller({**RPP, "max_linear_vel": 0.9, "desired_linear_vel": 0.4}), release="lyrical"
    )
    assert read.navigation.controllers["FollowPath"].params["desired_linear_vel"] == 0.4
    assert read.named("unused") == ("controller_server.FollowPath.max_linear_vel",)
    assert follow_path({**RPP, "max_linear_vel": 0.9})["desired_linear_vel"] == 0.9


def test_removed_parameters_are_listed_and_have_no_effect():
    document = with_controller({**LYRICAL_MPPI, "prune_distance": 0.5}, controller_frequency=20.0)
    kind, why = found(document, "lyrical")["controller_server.FollowPath.prune_distance"]
    assert (kind, "path handler" in why) == ("other_release", True)
    kinds = found(with_controller({**DWB, "shorten_transformed_plan": False}), "lyrical")
    assert kinds["controller_server.FollowPath.shorten_transformed_plan"][0] == "other_release"


def test_the_shims_primary_controller_is_read_from_its_own_block():
    inside = {**RPP, "lookahead_dist": 0.4, "max_angular_accel": 1.0}
    read = parse_nav2_params(
        with_controller({**SHIM, "max_angular_accel": 2.0, "lookahead_dist": 0.9, "primary_controller": inside})
    )
    params = params_around(RppParams)(**read.navigation.controllers["FollowPath"].params)
    assert (params.max_angular_accel, params.of_primary().max_angular_accel, params.lookahead_dist) == (2.0, 1.0, 0.4)
    assert params.of_primary().rotate_to_heading_angular_vel == 1.8  # the default, not the shim's
    assert read.named("unused") == ("controller_server.FollowPath.lookahead_dist",)


def test_a_shim_that_is_not_configured_leaves_the_controller_inside_as_it_is():
    preset = load_preset("lyrical_fair")
    params = params_around(RppParams)(**preset.controller("shim_rpp").params)
    assert params.of_primary().rotate_to_heading_angular_vel == 1.9
    assert RppParams(**preset.controller("rpp").params).rotate_to_heading_angular_vel == 1.9


def test_the_back_up_has_limits_and_the_layer_a_radius_of_its_own():
    server = node(behavior_plugins=["backup"], backup={"plugin": "nav2_behaviors::BackUp", "minimum_speed": 0.2})
    limits = lyrical({"behavior_server": server}).behavior_server.backup
    assert (limits.acceleration_limit, limits.deceleration_limit, limits.minimum_speed) == (2.5, -2.5, 0.2)
    document = with_layers(["inflation_layer"], inflation_layer={"custom_inscribed_radius": 0.3})
    assert lyrical(document).local_costmap.inflation_layer.custom_inscribed_radius == 0.3
    assert parse_nav2_params(document, release="jazzy").named("other_release")
    with pytest.raises(ConfigError, match="custom_inscribed_radius: Nav2 Jazzy has none"):
        CostmapParams(inflation_layer=InflationLayer(custom_inscribed_radius=0.3), release="jazzy")


def test_other_inflation_layers_are_approximated():
    document = with_layers(["old"], old={"plugin": "mine::AsymmetricInflationLayer", "inflation_radius": 0.4})
    read = parse_nav2_params(document, release="lyrical")
    assert read.navigation.local_costmap.inflation_layer.inflation_radius == 0.4
    assert read.named("replaced") == ("local_costmap.local_costmap.old",)


def test_the_legacy_inflation_layer_finds_distances_as_before_lyrical():
    legacy = {"plugin": "nav2_costmap_2d::LegacyInflationLayer", "inflation_radius": 0.4}
    document = with_layers(["old"], old=legacy)
    read = parse_nav2_params(document, release="lyrical")
    assert read.navigation.local_costmap.inflation_layer == InflationLayer(inflation_radius=0.4, brushfire=True)
    assert (read.named("replaced"), read.named("unknown")) == ((), ())
    written = write_nav2_params(read.navigation)
    group = written["local_costmap"]["local_costmap"]["ros__parameters"]["inflation_layer"]
    assert group["plugin"] == legacy["plugin"]
    assert "brushfire" not in group
    again = parse_nav2_params(written, release="lyrical").navigation
    assert again.local_costmap.inflation_layer == read.navigation.local_costmap.inflation_layer
    legacy["custom_inscribed_radius"] = 0.3
    read = parse_nav2_params(document, release="lyrical")
    assert read.navigation.local_costmap.inflation_layer.custom_inscribed_radius == -1.0
    assert read.named("unused") == ("local_costmap.local_costmap.old.custom_inscribed_radius",)
    for release in ("humble", "jazzy"):
        with pytest.raises(ConfigError, match=r"old\.plugin: Nav2 \w+ has no LegacyInflationLayer; --nav2 lyrical has"):
            parse_nav2_params(document, release=release)
        with pytest.raises(ConfigError, match=r"inflation_layer\.brushfire: expected false, as all layers of Nav2"):
            CostmapParams(inflation_layer=InflationLayer(brushfire=True), release=release)
    with pytest.raises(ConfigError, match="custom_inscribed_radius: the LegacyInflationLayer has none"):
        CostmapParams(inflation_layer=InflationLayer(brushfire=True, custom_inscribed_radius=0.3), release="lyrical")


# --- Refusals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("document", "said"),
    [
        (with_controller(MPPI), r"FollowPath.motion_model: Nav2 Lyrical does not start .*expected diff_drive\.plugin"),
        (
            with_controller({**MPPI, "motion_model": "DiffDrive"}),
            r"expected DiffDrive\.plugin, for instance mppi::Diff",
        ),
        (
            with_controller({**DWB, **SHIM, "primary_controller": "dwb_core::DWBLocalPlanner"}),
            r"primary_controller: expected a group .* without which Nav2 Lyrical does not start",
        ),
        (
            {"planner_server": node(GridBased={"plugin": "nav2_navfn_planner/NavfnPlanner"})},
            r"GridBased.plugin: Nav2 Lyrical has no class .* it is written 'nav2_navfn_planner::NavfnPlanner'",
        ),
        (
            {"behavior_server": node(behavior_plugins=["spin"], spin={"plugin": "nav2_behaviors/Spin"})},
            r"spin.plugin: Nav2 Lyrical has no class",
        ),
        (
            with_controller(DWB, path_handler_plugins=["p"]),
            r"p.plugin: expected the class of this path handler, got none",
        ),
        (with_controller(DWB, path_handler_plugins=[]), "expected at least one name"),
        (with_controller(DWB, **HANDLER, PathHandler={"plugin": "mine::Handler"}), "'mine::Handler' is not built here"),
    ],
)
def test_what_lyrical_does_not_start_with_is_refused_with_the_reason(document, said):
    with pytest.raises(ConfigError, match=said):
        parse_nav2_params(document, release="lyrical")


def test_what_only_lyrical_has_is_refused_elsewhere():
    with pytest.raises(ConfigError, match="path_handler: Nav2 Jazzy has none"):
        NavigationParams(
            release="jazzy", controller_server=ControllerServer(path_handler=PathHandler(prune_distance=1.0))
        )
    with pytest.raises(ConfigError, match="max_cycles_factor: Nav2 Humble has no such parameter"):
        PlannerPlugin(params={"max_cycles_factor": 8})
    checker = ControllerServer(goal_checker=GoalChecker(plugin="adaptive"))
    with pytest.raises(
        ConfigError, match="expected one of simple, stopped, position, got Lyrical's goal checker adaptive"
    ):
        NavigationParams(release="jazzy", controller_server=checker)


# --- Presets and writing ---------------------------------------------------------------------------------------------


def test_lyricals_example():
    preset = load_preset("lyrical")
    mppi, rpp, smoother = preset.controller("mppi").params, preset.controller("rpp").params, preset.velocity_smoother
    assert preset.controller_server.path_handler.prune_distance == 2.0
    assert preset.controller_server.goal_checker.path_length_tolerance == 1.0
    assert (mppi["motion_model"], mppi["batch_size"], mppi["regenerate_noises"]) == ("DiffDrive", 2000, True)
    assert (rpp["desired_linear_vel"], rpp["use_dynamic_window"]) == (0.5, False)
    assert (smoother.max_accel, smoother.max_decel) == ((3.0, 0.0, 3.5), (-3.0, 0.0, -3.5))
    for costmap in (preset.local_costmap, preset.global_costmap):
        assert (costmap.inflation_layer.inflation_radius, costmap.inflation_layer.cost_scaling_factor) == (0.70, 3.0)


def test_lyrical_fair_gives_every_controller_the_robots_limits():
    preset, robot = load_preset("lyrical_fair"), make_robot("turtlebot3_waffle")
    before = load_preset("jazzy_fair")
    assert preset.velocity_smoother == before.velocity_smoother
    for name, keys in {
        "dwb": ("max_vel_x", "max_vel_theta", "acc_lim_x", "decel_lim_theta"),
        "mppi": ("vx_max", "wz_max", "ax_max", "ax_min", "az_max"),
        "rpp": ("desired_linear_vel", "rotate_to_heading_angular_vel", "max_angular_accel"),
        "graceful": ("v_linear_max", "v_angular_max"),
    }.items():
        ours, theirs = preset.controller(name).params, before.controller(name).params
        assert [ours[key] for key in keys] == [theirs[key] for key in keys]
    assert preset.controller("rpp").params["desired_linear_vel"] == robot.max_linear_velocity


def test_what_is_written_is_lyricals():
    nodes = write_nav2_params(load_preset("lyrical"))
    server = nodes["controller_server"]["ros__parameters"]
    assert server["path_handler_plugins"] == ["PathHandler"]
    assert server["PathHandler"]["plugin"] == "nav2_controller::FeasiblePathHandler"
    assert server["mppi"]["motion_model"] == "diff_drive"
    assert server["mppi"]["diff_drive"] == {"plugin": "mppi::DiffDriveMotionModel"}
    assert (server["rpp"]["max_linear_vel"], "desired_linear_vel" in server["rpp"]) == (0.5, False)
    assert nodes["bt_navigator"]["ros__parameters"]["error_code_name_prefixes"] == ["compute_path", "follow_path"]
    assert nodes["behavior_server"]["ros__parameters"]["backup"]["acceleration_limit"] == 2.5
    assert nodes["velocity_smoother"]["ros__parameters"]["enable_stamped_cmd_vel"] is False


@pytest.mark.parametrize("kind", ["shim_dwb", "shim_mppi", "shim_rpp", "shim_graceful"])
def test_a_shim_is_written_with_a_block_inside_and_comes_back(kind):
    own = {"critics": ["PathDist"]} if kind == "shim_dwb" else {}
    plugin = ControllerPlugin(kind=kind, params={**own, "max_angular_accel": 2.0, "release": "lyrical"})
    document = write_nav2_params(NavigationParams(release="lyrical", controllers={"FollowPath": plugin}))
    group = document["controller_server"]["ros__parameters"]["FollowPath"]
    assert group["max_angular_accel"] == 2.0
    assert "plugin" in group["primary_controller"]
    assert "critics" not in group
    read = parse_nav2_params(document)
    assert (read.recognition.release, read.navigation.controllers["FollowPath"]) == ("lyrical", plugin)
    assert {finding.kind for finding in read.findings} <= {"ros_only", "unused"}


def test_values_are_written_where_lyrical_reads_them():
    text = yaml.safe_dump(with_controller({**SHIM, "primary_controller": {**RPP, "max_linear_vel": 0.3}}))
    written = write_values(
        text, "FollowPath", {"desired_linear_vel": 0.4, "lookahead_dist": 0.7, "closed_loop": False}, {}
    )
    group = yaml.safe_load(written)["controller_server"]["ros__parameters"]["FollowPath"]
    assert group["primary_controller"] == {**RPP, "max_linear_vel": 0.4, "lookahead_dist": 0.7}
    assert group["closed_loop"] is False
    values = parse_nav2_params(yaml.safe_load(written)).navigation.controllers["FollowPath"].params
    assert (values["desired_linear_vel"], values["lookahead_dist"]) == (0.4, 0.7)


def test_a_server_without_a_progress_check_is_lyricals():
    server = ControllerServer(progress_checker=ProgressChecker(plugin="none"))
    document = write_nav2_params(NavigationParams(release="lyrical", controller_server=server))
    assert document["controller_server"]["ros__parameters"]["progress_checker_plugins"] == []
    assert parse_nav2_params(document, release="lyrical").navigation.controller_server.progress_checker.plugin == "none"
    with pytest.raises(ConfigError, match="expected one that ROS has"):
        write_nav2_params(NavigationParams(release="jazzy", controller_server=server))


@pytest.mark.parametrize("release", RELEASES)
def test_files_of_a_release_are_recognised_when_they_come_back(release):
    preset = {"humble": "thesis"}.get(release, release)
    recognition = parse_nav2_params(write_nav2_params(load_preset(preset))).recognition
    assert (recognition.release, recognition.against) == (release, ())


positive = st.floats(0.01, 10)
goal_checkers = st.builds(
    GoalChecker,
    plugin=st.sampled_from(["simple", "stopped", "position", "axis", "adaptive"]),
    path_length_tolerance=positive,
    along_path_tolerance=positive,
    required_stagnation_cycles=st.integers(1, 99),
)
handlers = st.builds(
    PathHandler,
    prune_distance=positive,
    max_robot_pose_search_dist=st.none() | st.floats(-1, 9),
    enforce_path_rotation=st.booleans(),
)
KINDS = {
    "dwb": st.fixed_dictionaries({"critics": st.just(["PathDist"]), "sim_time": positive}),
    "mppi": st.fixed_dictionaries(
        {"sgf_order": st.sampled_from([1, 2]), "TrajectoryValidator.consider_footprint": st.booleans()}
    ),
    "rpp": st.fixed_dictionaries({"desired_linear_vel": positive, "use_dynamic_window": st.booleans()}),
    "graceful": st.fixed_dictionaries(
        {"footprint_scaling_factor": positive, "obstacle_cost_margin": st.integers(0, 9)}
    ),
}
plugins = st.sampled_from([(kind, shim) for kind in KINDS for shim in ("", "shim_")]).flatmap(
    lambda found: KINDS[found[0]].map(
        lambda params: ControllerPlugin(kind=f"{found[1]}{found[0]}", params={**params, "release": "lyrical"})
    )
)
navigations = st.builds(
    NavigationParams,
    release=st.just("lyrical"),
    controllers=st.dictionaries(st.sampled_from(["FollowPath", "Precise"]), plugins),
    controller_server=st.builds(ControllerServer, goal_checker=goal_checkers, path_handler=handlers),
    planner=st.builds(
        PlannerPlugin,
        params=st.fixed_dictionaries({"max_cycles_factor": st.integers(1, 9), "release": st.just("lyrical")}),
    ),
    behavior_server=st.builds(BehaviorServer, backup=st.builds(DriveLimits, acceleration_limit=positive)),
    local_costmap=st.builds(
        lambda radius: CostmapParams(inflation_layer=InflationLayer(custom_inscribed_radius=radius), release="lyrical"),
        st.floats(-1, 1),
    ),
)


@settings(max_examples=60, deadline=None)
@given(navigations)
def test_what_is_written_for_lyrical_reads_back_the_same(navigation):
    read = parse_nav2_params(write_nav2_params(navigation), release="lyrical")
    assert read.navigation == navigation
    told = {finding.name for finding in read.findings if finding.kind not in ("ros_only", "unused")}
    # An empty list, with which Nav2 does not start, and a controller for which the default tree does not ask.
    assert told <= {"controller_server.controller_plugins", "controller_server.FollowPath"}
