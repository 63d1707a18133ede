"""Parameter files as they are met: of all releases, with templates, leftovers, and other makers' plugins."""

from __future__ import annotations

import contextlib
import copy
import math

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.nav2_params import PRESETS, parse_nav2_params, read_nav2_params, robot_of, summarise
from controllers.nav2_params.file.document import read_document
from controllers.nav2_params.migration import migrate_file
from controllers.nav2_params.presets import read_preset
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES
from gym_mapbench.ros_params import fill_templates, nest_dotted, parse_defines
from gym_mapbench.ros_params.templates import find_template
from gym_mapbench.world.robot import RobotSpec
from tests.oracle_data import DATA, needs_data

DWB = {"plugin": "dwb_core::DWBLocalPlanner", "max_vel_x": 0.3, "max_vel_theta": 1.0, "critics": ["PathDist"]}
MPPI = {"plugin": "nav2_mppi_controller::MPPIController"}
RPP = {"plugin": "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"}
LASER = {"observation_sources": "scan", "scan": {"data_type": "LaserScan", "clearing": True, "obstacle_range": 1.5}}
CAMERA = {"observation_sources": "cloud", "cloud": {"data_type": "PointCloud2", "obstacle_max_range": 4.0}}
OBSTACLES, VOXEL, INFLATION = (f"nav2_costmap_2d::{name}Layer" for name in ("Obstacle", "Voxel", "Inflation"))


def node(**params):
    return {"ros__parameters": params}


def with_controller(group, **server):
    return {"controller_server": node(controller_plugins=["FollowPath"], FollowPath=group, **server)}


def with_layers(names, **layers):
    """A file with these layers; Nav2's inflation layer gets its class."""
    if "inflation_layer" in names:
        layers["inflation_layer"] = {"plugin": INFLATION, **layers.get("inflation_layer", {})}
    return {"local_costmap": {"local_costmap": node(plugins=names, **layers)}}


def found(document, release=None):
    return {
        finding.name: (finding.kind, finding.why) for finding in parse_nav2_params(document, None, release).findings
    }


@pytest.fixture
def write(tmp_path):
    def write(document):
        path = tmp_path / "params.yaml"
        path.write_text(document if isinstance(document, str) else yaml.safe_dump(document, sort_keys=False))
        return path

    return write


# --- Releases --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("document", "release"),
    [
        ({"planner_server": node(GridBased={"plugin": "nav2_navfn_planner/NavfnPlanner"})}, "humble"),
        ({"planner_server": node(GridBased={"plugin": "nav2_navfn_planner::NavfnPlanner"})}, "jazzy"),
        (with_controller({**MPPI, "reset_period": 2.0}, progress_checker_plugins=["progress_checker"]), "humble"),
        (with_controller({**MPPI, "ax_max": 2.0}, progress_checker_plugin="progress_checker"), "jazzy"),
        (with_controller(DWB, progress_checker_plugin="progress_checker"), "humble"),
        (with_controller(DWB, costmap_update_timeout=0.3), "jazzy"),
        ({**with_controller(DWB), "docking_server": node(max_retries=3)}, "jazzy"),
        ({"recoveries_server": node(recovery_plugins=["spin"]), "bt_navigator": node()}, "humble"),
        (with_controller({**DWB, "stateful": True}), "humble"),  # RPP's stateful is Jazzy's, DWB's is no one's
    ],
)
def test_the_release_is_told_by_the_keys(document, release):
    recognition = parse_nav2_params(document).recognition
    assert (recognition.release, recognition.given) == (release, False)
    other = {"humble": "jazzy", "jazzy": "humble"}[release]
    given = parse_nav2_params(document, None, other).recognition
    assert (given.release, given.told_by, given.given) == (other, (), True)


def test_what_starts_only_one_release_counts_before_what_drives_by_it_and_that_before_the_rest():
    planner = {"planner_server": node(GridBased={"plugin": "nav2_navfn_planner::NavfnPlanner"})}
    document = {**with_controller({**MPPI, "reset_period": 1.0}, progress_checker_plugin="progress_checker"), **planner}
    recognition = parse_nav2_params(document).recognition
    assert recognition.release == "jazzy"
    assert recognition.told_by == ("planner_server.GridBased.plugin",)
    assert recognition.against == (
        "controller_server.FollowPath.reset_period",
        "controller_server.progress_checker_plugin",
    )


@pytest.mark.parametrize(
    "given",
    [
        {"max_linear_accel": 2.5, "max_linear_decel": 2.5},
        {"max_linear_accel": 2.5, "max_robot_pose_search_dist": 10.0},
        {"min_distance_to_obstacle": 0.0},
        {"min_distance_to_obstacle": 0.0, "stateful": True},
    ],
)
@pytest.mark.parametrize("shim", [False, True])
def test_parameters_of_rpp_that_foxy_or_kilted_has_as_well_do_not_tell_lyrical(given, shim):
    group = {**RPP, **given}
    if shim:
        group |= {"plugin": SHIM["plugin"], "primary_controller": RPP["plugin"]}
    planner = {"planner_server": node(GridBased={"plugin": "nav2_navfn_planner::NavfnPlanner"})}
    assert parse_nav2_params({**with_controller(group), **planner}).recognition.release == "jazzy"


def test_a_file_that_mixes_the_distributions_needs_a_word(write):
    path = write(with_controller({**MPPI, "reset_period": 1.0, "ax_max": 2.0}))
    with pytest.raises(
        ConfigError, match=r"line 8: .*ax_max: the file mixes .*reset_period is Humble's; .*--nav2 humble"
    ):
        read_nav2_params(path)
    jazzy = read_nav2_params(path, release="jazzy")
    assert jazzy.navigation.controllers["FollowPath"].params["ax_max"] == 2.0
    assert jazzy.named("other_release") == ("controller_server.FollowPath.reset_period",)
    humble = read_nav2_params(path, release="humble")
    assert humble.navigation.controllers["FollowPath"].params["reset_period"] == 1.0
    assert humble.named("other_release") == ("controller_server.FollowPath.ax_max",)


def test_a_critic_that_only_the_other_release_has_is_refused_with_the_nearest():
    document = with_controller({**MPPI, "critics": ["PathAlignLegacyCritic", "GoalCritic"], "time_steps": 40})
    with pytest.raises(ConfigError, match=r"only Nav2 Humble has the critic 'PathAlignL.*'PathAlignCritic'"):
        parse_nav2_params(document, None, "jazzy")
    read = parse_nav2_params(document, None, "humble")
    assert read.navigation.controllers["FollowPath"].params["critics"] == ["PathAlignCritic", "GoalCritic"]
    assert read.named("replaced") == ("controller_server.FollowPath.PathAlignLegacyCritic",)


def test_a_jazzy_file_has_the_defaults_of_jazzy():
    document = with_controller(MPPI, costmap_update_timeout=0.3)
    params = parse_nav2_params(document).navigation.controllers["FollowPath"].params
    assert (params["ax_max"], params["PathAngleCritic"]["cost_weight"]) == (3.0, 2.2)


def test_files_of_foxy_and_galactic_are_read_under_todays_names():
    document = {
        **with_controller({**RPP, "max_allowed_time_to_collision": 0.7}, goal_checker_plugin="precise"),
        "recoveries_server": node(
            recovery_plugins=["spin", "wait"], spin={"plugin": "nav2_recoveries/Spin"}, transform_timeout=0.1
        ),
        "bt_navigator": node(default_bt_xml_filename="old.xml"),
    }
    precise = {"plugin": "nav2_controller::SimpleGoalChecker", "xy_goal_tolerance": 0.05}
    document["controller_server"]["ros__parameters"]["precise"] = precise
    read = parse_nav2_params(document)
    assert read.recognition.release == "humble"
    assert read.navigation.controller_server.goal_checker.xy_goal_tolerance == 0.05
    assert read.navigation.behavior_server.behavior_plugins == ("spin", "wait")
    params = read.navigation.controllers["FollowPath"].params
    assert params["max_allowed_time_to_collision_up_to_carrot"] == 0.7
    assert set(read.named("renamed")) == {
        "recoveries_server",
        "recoveries_server.recovery_plugins",
        "controller_server.goal_checker_plugin",
        "controller_server.FollowPath.max_allowed_time_to_collision",
    }
    assert set(read.named("other_release")) == {
        "recoveries_server.transform_timeout",
        "bt_navigator.default_bt_xml_filename",
    }


def test_a_recoveries_server_that_was_left_over_keeps_no_release_from_starting():
    recoveries = {name: {"plugin": f"nav2_recoveries/{name.capitalize()}"} for name in ("spin", "wait")}
    document = {
        "planner_server": node(GridBased={"plugin": "nav2_navfn_planner::NavfnPlanner"}),
        "recoveries_server": node(recovery_plugins=[*recoveries], max_rotational_vel=0.3, **recoveries),
    }
    read = parse_nav2_params(document)
    assert read.recognition.release == "jazzy"
    assert read.named("other_release") == ("recoveries_server",)
    assert read.navigation.behavior_server.max_rotational_vel == 1.0


def test_foxys_tree_asks_for_back_up():
    document = {"recoveries_server": node(recovery_plugins=["spin", "back_up", "wait"], back_up={"plugin": "a/BackUp"})}
    read = parse_nav2_params(document)
    assert read.navigation.behavior_server.behavior_plugins == ("spin", "backup", "wait")
    assert read.named("missing") == read.named("unused") == ()


def test_files_of_dashing_and_eloquent_are_read_under_todays_names():
    dwb = {key: value for key, value in DWB.items() if key != "plugin"}
    document = {
        "dwb_controller": node(controller_frequency=15.0, **dwb, **{"goal_checker.xy_goal_tolerance": 0.1}),
        "navfn_planner": node(tolerance=0.2),
        "recoveries_server": node(plugin_names=["Spin"], plugin_types=["nav2_recoveries/Spin"]),
        "local_costmap": {
            "local_costmap": node(
                plugin_names=["obstacles", "inflation"],
                plugin_types=["nav2_costmap_2d::ObstacleLayer", "nav2_costmap_2d::InflationLayer"],
                **{"inflation.inflation_radius": 0.4, "observation_sources": "scan", "scan": {"clearing": True}},
            )
        },
    }
    navigation = parse_nav2_params(document).navigation
    assert navigation.controller_server.controller_frequency == 15.0
    assert navigation.controller_server.goal_checker.xy_goal_tolerance == 0.1
    assert navigation.controllers["FollowPath"].params["max_vel_x"] == 0.3
    assert navigation.planner.params["tolerance"] == 0.2
    assert navigation.behavior_server.behavior_plugins == ("spin",)
    assert navigation.local_costmap.plugins == ("obstacle_layer", "inflation_layer")
    assert navigation.local_costmap.obstacle_layer.scan.clearing
    assert navigation.local_costmap.inflation_layer.inflation_radius == 0.4


def test_eloquents_lists_of_classes_are_followed():
    document = {
        "controller_server": node(
            controller_plugin_types=["dwb_core::DWBLocalPlanner"], FollowPath={"critics": ["PathDist"]}
        ),
        "planner_server": node(
            planner_plugin_types=["nav2_navfn_planner/NavfnPlanner"], **{"GridBased.tolerance": 0.1}
        ),
    }
    navigation = parse_nav2_params(document).navigation
    assert (navigation.controllers["FollowPath"].kind, navigation.planner.params["tolerance"]) == ("dwb", 0.1)


def test_zeros_that_the_motion_model_does_not_read_are_no_errors():
    car = {**MPPI, "motion_model": "Ackermann", "vy_std": 0.0, "AckermannConstraints": {"min_turning_r": 1.0}}
    assert parse_nav2_params(with_controller(car)).navigation.controllers["FollowPath"].params["vy_std"] == 0.2
    read = parse_nav2_params(with_controller({**MPPI, "vy_std": 0.0, "AckermannConstraints": {"min_turning_r": 0.0}}))
    assert read.navigation.controllers["FollowPath"].params["vy_std"] == 0.2
    assert len(read.named("unused")) == 2


# --- What Nav2 ignores ------------------------------------------------------------------------------------------------


def test_leftovers_and_stray_keys_are_listed_and_nothing_is_refused():
    group = {**DWB, "vy_samples": 0, "desired_linear_vel": 0.4, "primary_controller": "x", "anything": 1}
    document = with_controller(group, controller_plugin_types=["dwb_core::DWBLocalPlanner"])
    document["planner_server"] = node(
        GridBased={
            "plugin": "nav2_smac_planner/SmacPlanner2D",
            "reverse_penalty": 2.1,
            "smoother": {"optimizer": {"a": 1}},
        }
    )
    kinds = found(document)
    server = "controller_server.FollowPath"
    assert kinds[f"{server}.desired_linear_vel"] == ("other_release", "a parameter of Regulated Pure Pursuit")
    assert kinds[f"{server}.primary_controller"] == ("other_release", "a parameter of the Rotation Shim")
    assert kinds[f"{server}.anything"] == ("unknown", "")
    assert kinds["controller_server.controller_plugin_types"][0] == "other_release"
    assert kinds["planner_server.GridBased.reverse_penalty"][0] == "other_release"
    assert kinds["planner_server.GridBased.smoother.optimizer.a"][0] == "other_release"


def test_of_two_sections_the_one_in_its_place_counts():
    right = {"local_costmap": node(width=4)}
    document = {
        "robot": {"local_costmap": {"local_costmap": node(width=6)}},
        "local_costmap": {**right, **node(width=9)},
    }
    read = parse_nav2_params({"local_costmap": right, "robot": document["robot"]})
    assert read.navigation.local_costmap.width == 4
    assert read.named("left_out") == ("robot.local_costmap.local_costmap",)
    read = parse_nav2_params({"local_costmap": document["local_costmap"]})
    assert (read.navigation.local_costmap.width, read.named("unused")) == (4, ("local_costmap",))
    slipped = with_controller(DWB)
    slipped["controller_server"]["goal_checker"] = {"xy_goal_tolerance": 0.1}
    assert parse_nav2_params(slipped).named("left_out") == ("controller_server.goal_checker",)
    flat = {"a": {"planner_server": node()}, "planner_server": node(planner_plugins=["GridBased"])}
    assert parse_nav2_params(flat).named("left_out") == ("a.planner_server",)


@pytest.mark.parametrize(
    "name",
    ["local_costmap/local_costmap", "/robot/local_costmap/local_costmap", "/**/local_costmap", "/*/local_costmap"],
)
def test_names_of_a_costmaps_node_that_ros_accepts(name):
    assert parse_nav2_params({name: node(width=4)}).navigation.local_costmap.width == 4
    assert parse_nav2_params({"/**": {"local_costmap": node(width=4)}}).navigation.local_costmap.width == 4


@pytest.mark.parametrize("path", [("local_costmap",), ("robot", "local_costmap"), ("/robot/local_costmap",)])
def test_a_costmap_without_its_namespace_is_named(path):
    """The node is ``/local_costmap/local_costmap``, and ROS ignores a section for ``/local_costmap``."""
    document = node(width=4)
    for key in reversed(path):
        document = {key: document}
    full = ".".join(path)
    read = parse_nav2_params(document)
    assert read.navigation.local_costmap.width == 4
    assert read.named("misplaced") == (full,)
    (line,) = [line for line in summarise(read) if line.startswith("ROS gives to no node")]
    assert line.endswith(f"expected under {full}.local_costmap, the costmap's namespace and name")


def test_a_key_given_twice_counts_as_in_ros(write):
    path = write("local_costmap: {local_costmap: {ros__parameters: {width: 3,\n width: 4}}}")
    read = read_nav2_params(path)
    assert read.navigation.local_costmap.width == 4
    assert read.named("repeated") == ("local_costmap.local_costmap.width",)


def test_a_name_of_another_release_beside_todays_counts_for_nothing():
    read = parse_nav2_params(with_controller({**RPP, "max_linear_vel": 0.9, "desired_linear_vel": 0.4}))
    assert read.navigation.controllers["FollowPath"].params["desired_linear_vel"] == 0.4
    assert read.named("unused") == ("controller_server.FollowPath.max_linear_vel",)


def test_localisation_and_servers_of_other_tasks_do_not_drive():
    names = (
        "slam_toolbox",
        "mh_amcl",
        "ekf_filter_node",
        "docking_server",
        "route_server",
        "keepout_filter_mask_server",
    )
    document = {**with_controller(DWB), **{name: node(a=1) for name in names}, "door_opener": node(b=1)}
    kinds = found(document)
    assert {kinds[name][0] for name in names} == {"ros_only"}
    assert kinds["door_opener"] == ("left_out", "")


# --- Plugins that are not built --------------------------------------------------------------------------------------


def test_another_makers_controller_is_named_and_only_goes_on(write):
    path = write({**with_controller({"plugin": "teb_local_planner::TebLocalPlannerROS", "max_vel_x": 1.0})})
    with pytest.raises(ConfigError, match=r"line 6: .*FollowPath\.plugin: .*TebLocalPlannerROS.*--only dwb|mppi|rpp"):
        read_nav2_params(path)
    read = read_nav2_params(path, only="rpp")
    assert (list(read.navigation.controllers), read.own_controllers) == (["rpp"], ())
    assert list(read_nav2_params(path, anyone=True).navigation.controllers) == ["dwb", "mppi", "rpp"]
    for wrong in ("FollowPath", "teb"):
        with pytest.raises(ConfigError):
            read_nav2_params(path, only=wrong)


def test_a_foreign_controller_beside_the_trees_own_is_left_out(write):
    document = with_controller(DWB)
    server = document["controller_server"]["ros__parameters"]
    server |= {"controller_plugins": ["Other", "FollowPath"], "Other": {"plugin": "vector_pursuit::VectorPursuit"}}
    read = read_nav2_params(write(document))
    assert (read.own_controllers, list(read.foreign)) == (("FollowPath",), ["Other"])
    server["controller_plugins"] = ["Other", "Mine"]
    server["Mine"] = server.pop("FollowPath")
    with pytest.raises(ConfigError, match="VectorPursuit"):
        read_nav2_params(write(document))
    assert list(read_nav2_params(write(document), only="Mine").navigation.controllers) == ["Mine"]


SHIM = {"plugin": "nav2_rotation_shim_controller::RotationShimController", "angular_dist_threshold": 0.7}


@pytest.mark.parametrize("primary", ["dwb_core::DWBLocalPlanner", "dwb_core/DWBLocalPlanner", {**DWB}])
def test_a_rotation_shim_and_its_primary_controller_share_a_group(primary):
    own = DWB if isinstance(primary, str) else {}
    document = with_controller({**own, **SHIM, "primary_controller": primary, "max_vel_y": 0.1})
    read = parse_nav2_params(document, release="humble")
    plugin = read.navigation.controllers["FollowPath"]
    assert (plugin.kind, plugin.params["max_vel_x"], plugin.params["angular_dist_threshold"]) == ("shim_dwb", 0.3, 0.7)
    assert read.named("replaced") == ("controller_server.FollowPath.max_vel_y",)
    assert read.named("unknown") == ()
    assert "drives: FollowPath (the Rotation Shim around DWB)" in "\n".join(summarise(read))


def test_the_robot_of_a_shim_turns_as_fast_as_either_wants():
    shim = {**DWB, **SHIM, "primary_controller": "dwb_core::DWBLocalPlanner", "max_vel_theta": 0.7}
    for rate, highest in ((0.5, 1.0), (1.3, 1.3)):  # a spin of the recoveries turns with 1 rad/s
        read = parse_nav2_params(with_controller({**shim, "rotate_to_heading_angular_vel": rate}))
        robot = robot_of(read, RobotSpec())
        assert (robot.max_angular_velocity, robot.max_linear_velocity) == (highest, 0.3)
    graceful = {"plugin": "nav2_graceful_controller::GracefulController", "v_linear_max": 0.4, "v_angular_max": 0.8}
    for scale, highest in ((0.1, 1.0), (0.5, 0.4 * math.pi)):
        read = parse_nav2_params(with_controller({**graceful, "rotation_scaling_factor": scale}))
        robot = robot_of(read, RobotSpec())
        assert robot.max_angular_velocity == pytest.approx(highest)
        assert robot.max_linear_velocity == 0.4


@pytest.mark.parametrize("shim", [False, True])
def test_mppi_that_does_not_start_with_the_rate_of_the_server_is_refused(shim, write):
    around = {"plugin": "nav2_rotation_shim_controller::RotationShimController", "primary_controller": MPPI["plugin"]}
    mppi = {**MPPI, "model_dt": 0.05, **(around if shim else {})}
    said = (
        r"line \d+: controller_server\.FollowPath\.model_dt: expected at least the control period \(0\.1 s\), got 0\.05"
    )
    with pytest.raises(ConfigError, match=said):
        read_nav2_params(write(with_controller(mppi, controller_frequency=10.0)))
    read = parse_nav2_params(with_controller({**mppi, "model_dt": 0.1}, controller_frequency=10.0))
    assert read.navigation.controllers["FollowPath"].params["model_dt"] == 0.1


def test_mppi_of_a_preset_does_not_keep_a_slow_server_from_starting(write):
    read = read_nav2_params(write(with_controller(DWB, controller_frequency=10.0)))
    assert {plugin.kind for plugin in read.navigation.controllers.values()} >= {"dwb", "mppi"}


def test_a_rotation_shim_whose_primary_controller_is_not_there():
    with pytest.raises(ConfigError, match=r"FollowPath.primary_controller: expected the class .* inside, got none"):
        parse_nav2_params(with_controller(SHIM))
    foreign = with_controller({**SHIM, "primary_controller": "teb_local_planner::TebLocalPlannerROS"})
    assert parse_nav2_params(foreign).foreign["FollowPath"] == (
        "controller_server.FollowPath.primary_controller: the controller 'teb_local_planner::TebLocalPlannerROS' is "
        "not built here"
    )


def test_the_graceful_controller_tells_its_release():
    graceful = {"plugin": "nav2_graceful_controller::GracefulController", "lambda": 1.5, "transform_tolerance": 0.2}
    for release, own in (("humble", {"motion_target_dist": 0.5}), ("jazzy", {"max_lookahead": 0.8})):
        read = parse_nav2_params(with_controller({**graceful, **own}))
        params = read.navigation.controllers["FollowPath"].params
        assert (read.navigation.release, params["lambda"]) == (release, 1.5)
        assert own.items() <= params.items()


def test_robots_that_move_sideways_drive_straight_on():
    read = parse_nav2_params(with_controller({**DWB, "max_vel_y": 0.3, "min_vel_y": -0.3}))
    assert read.navigation.controllers["FollowPath"].params["max_vel_y"] == 0.0
    assert len(read.named("replaced")) == 2
    read = parse_nav2_params(with_controller({**MPPI, "motion_model": "Omni"}))
    assert read.navigation.controllers["FollowPath"].params["motion_model"] == "DiffDrive"
    assert read.named("replaced") == ("controller_server.FollowPath.motion_model",)


@pytest.mark.parametrize(
    ("ros_class", "planner"),
    [("nav2_smac_planner/SmacPlannerHybrid", "smac_2d"), ("mine::Planner", "navfn")],
)
def test_a_planner_that_is_not_built_has_a_stand_in(ros_class, planner):
    read = parse_nav2_params({"planner_server": node(GridBased={"plugin": ros_class, "own": 1, "tolerance": 0.3})})
    assert (read.navigation.planner.name, read.navigation.planner.params["tolerance"]) == (planner, 0.3)
    assert (read.named("replaced"), read.named("detail")) == (
        ("planner_server.GridBased",),
        ("planner_server.GridBased.own",),
    )


@pytest.mark.parametrize(
    ("names", "plugins", "refused"),
    [
        (["GridBased", "Other"], {"GridBased": {"plugin": "nav2_navfn_planner/NavfnPlanner"}}, "Other"),
        (["GridBased", "Other"], {"Other": {"plugin": "mine::Planner"}, "GridBased": {"tolerance": 0.2}}, "GridBased"),
        (["Mine"], {"Mine": {"tolerance": 0.2}}, "Mine"),
        (["GridBased", "Other"], {"GridBased.plugin": "mine::A", "Other.plugin": "mine::B"}, ""),
        (["GridBased"], {"GridBased": {"tolerance": 0.2}}, ""),
    ],
)
def test_every_planner_has_a_class_but_nav2s_own(names, plugins, refused):
    """Nav2 gives ``GridBased`` a class only where it is alone in the list."""
    document = {"planner_server": node(planner_plugins=names, **plugins)}
    if not refused:
        assert parse_nav2_params(document).navigation.planner.name == "navfn"
        return
    with pytest.raises(
        ConfigError, match=rf"planner_server\.{refused}\.plugin: expected the class of this planner, got"
    ):
        parse_nav2_params(document)


@pytest.mark.parametrize("release", ["humble", "jazzy", "lyrical"])
def test_every_release_has_a_goal_checker_of_the_position_alone(release):
    document = with_controller(
        DWB, goal_checker_plugins=["near"], near={"plugin": "nav2_controller::PositionGoalChecker", "stateful": False}
    )
    checker = parse_nav2_params(document, None, release).navigation.controller_server.goal_checker
    assert (checker.plugin, checker.stateful) == ("position", False)


def test_a_goal_checker_of_a_later_release_is_refused():
    document = with_controller(DWB, goal_checker_plugins=["near"], near={"plugin": "nav2_controller::AxisGoalChecker"})
    with pytest.raises(ConfigError, match=r"near\.plugin: Nav2 Humble has no AxisGoalChecker"):
        parse_nav2_params(document, None, "humble")


def test_behaviours_of_other_classes_are_left_out():
    server = node(
        behavior_plugins=["spin", "backup"],
        spin={"plugin": "mine/Twirl"},
        backup={"plugin": "nav2_behaviors::BackUp", "acceleration_limit": 2.5},
    )
    read = parse_nav2_params({"behavior_server": server})
    assert read.navigation.behavior_server.behavior_plugins == ("backup",)
    assert read.named("left_out") == ("behavior_server.spin",)


GRACEFUL = {"plugin": "nav2_graceful_controller::GracefulController"}
CHECKERS = {
    "loose": {"plugin": "nav2_controller::SimpleGoalChecker", "xy_goal_tolerance": 1.0},
    "precise": {"plugin": "nav2_controller::StoppedGoalChecker", "xy_goal_tolerance": 0.1},
    "quick": {"plugin": "nav2_controller::SimpleProgressChecker", "movement_time_allowance": 2.0},
    "turning": {"plugin": "nav2_controller::PoseProgressChecker"},
    "far": {"plugin": "nav2_controller::FeasiblePathHandler", "prune_distance": 5.0},
    "near": {"plugin": "nav2_controller::FeasiblePathHandler", "prune_distance": 1.0},
}
LISTS = {
    "goal_checker": ("goal_checker_plugins", ["loose", "precise"]),
    "progress_checker": ("progress_checker_plugins", ["quick", "turning"]),
    "path_handler": ("path_handler_plugins", ["far", "near"]),
}


def several(names, named, release):
    """Read a controller server with several plugins of some kinds, and a tree that names some."""
    lists = dict(LISTS[name] for name in names)
    document = with_controller(GRACEFUL, **lists, **CHECKERS)
    return parse_nav2_params({**document, "bt_navigator": node(**named)}, release=release)


@pytest.mark.parametrize(
    ("release", "kinds"),
    [
        ("humble", ["goal_checker"]),
        ("jazzy", ["goal_checker", "progress_checker"]),
        ("lyrical", ["goal_checker", "progress_checker", "path_handler"]),
    ],
)
def test_of_several_checkers_that_of_the_tree_counts(release, kinds):
    last = {kind: LISTS[kind][1][1] for kind in kinds}
    read = several(kinds, {f"{kind}_id": name for kind, name in last.items()}, release)
    server = read.navigation.controller_server
    assert (server.goal_checker.plugin, server.goal_checker.xy_goal_tolerance) == ("stopped", 0.1)
    assert server.progress_checker.plugin == ("simple" if release == "humble" else "pose")
    assert server.path_handler.prune_distance == (1.0 if release == "lyrical" else 2.0)
    assert "controller_server.loose" in read.named("unused")
    assert read.named("unknown") == ()


@pytest.mark.parametrize(
    ("release", "kind"),
    [
        *((release, "goal_checker") for release in RELEASES),
        *((release, "progress_checker") for release in RELEASES[1:]),
        ("lyrical", "path_handler"),
    ],
)
def test_a_tree_that_names_none_of_several_checkers_is_refused(release, kind):
    """As ``findGoalCheckerId``, which takes an empty name for one plugin alone."""
    key, (first, second) = LISTS[kind]
    for named in ({}, {f"{kind}_id": ""}):
        with pytest.raises(
            ConfigError, match=rf"server\.{key}: .*default tree names none of {first}, {second}, .*{kind}_id: {first}$"
        ):
            several([kind], named, release)
    with pytest.raises(
        ConfigError, match=rf"server\.{key}: expected 'mine' among them, as bt_navigator\.{kind}_id says"
    ):
        several([kind], {f"{kind}_id": "mine"}, release)


def test_the_tree_names_the_planner():
    planners = {
        "A": {"plugin": "nav2_theta_star_planner/ThetaStarPlanner"},
        "B": {"plugin": "nav2_navfn_planner/NavfnPlanner"},
    }
    document = {"planner_server": node(planner_plugins=["A", "B"], **planners), "bt_navigator": node(planner_id="B")}
    read = parse_nav2_params(document)
    assert read.navigation.planner.name == "navfn"
    assert (read.named("missing"), read.named("unused")) == ((), ("planner_server.A",))
    del document["bt_navigator"]
    read = parse_nav2_params(document)
    assert (read.navigation.planner.name, read.named("missing")) == ("theta_star", ("planner_server.GridBased",))
    with pytest.raises(
        ConfigError, match=r"planner_plugins: expected 'C' among them, as bt_navigator\.planner_id says"
    ):
        parse_nav2_params({**document, "bt_navigator": node(planner_id="C")})


@pytest.mark.parametrize(
    ("release", "counts", "other", "kind"),
    [
        ("humble", {"progress_checker_plugin": "turning"}, {"progress_checker_plugins": ["quick", "mine"]}, "pose"),
        ("jazzy", {"progress_checker_plugins": ["turning"]}, {"progress_checker_plugin": "quick"}, "pose"),
        ("humble", {}, {"progress_checker_plugins": ["turning"]}, "simple"),
        ("lyrical", {}, {"progress_checker_plugin": "turning"}, "simple"),
    ],
)
def test_the_progress_checker_is_that_of_the_releases_own_key(release, counts, other, kind):
    """Nav2 does not read the other release's key; without its own it has the checker ``progress_checker``."""
    read = parse_nav2_params(with_controller(GRACEFUL, **counts, **other, **CHECKERS), release=release)
    assert read.navigation.controller_server.progress_checker.plugin == kind
    assert read.named("other_release") == tuple(f"controller_server.{key}" for key in other)


def missing(names, **navigator):
    read = parse_nav2_params({"behavior_server": node(behavior_plugins=names), "bt_navigator": node(**navigator)})
    return {finding.name.partition(".")[2]: finding.why for finding in read.findings if finding.kind == "missing"}


def test_plugins_for_which_nav2s_default_tree_asks_are_named():
    assert missing(["wait", "spin", "backup"]) == {}
    assert missing(["spin", "wait"]) == {"backup": "expected in behavior_plugins"}
    assert missing(["spin", "back_up", "wait"]) == {"backup": "expected in behavior_plugins, got 'back_up'"}
    assert missing([]) == dict.fromkeys(("spin", "backup", "wait"), "expected in behavior_plugins")
    default = "$(find-pkg-share nav2_bt_navigator)/behavior_trees/navigate_to_pose_w_replanning_and_recovery.xml"
    in_full = default.replace("$(find-pkg-share nav2_bt_navigator)", "/opt/ros/humble/share/nav2_bt_navigator")
    for tree in (default, in_full):
        assert list(missing(["spin", "wait"], default_nav_to_pose_bt_xml=tree)) == ["backup"]
        assert parse_nav2_params({"bt_navigator": node(default_nav_to_pose_bt_xml=tree)}).named("left_out") == ()
    assert missing(["spin", "wait"], default_nav_to_pose_bt_xml="/mine/without_backup.xml") == {}
    assert parse_nav2_params({"behavior_server": node()}).named("missing") == ()
    lines = summarise(parse_nav2_params({"behavior_server": node(behavior_plugins=["spin", "wait"])}))
    wanted = "the behaviour tree needs: behavior_server.backup: expected in behavior_plugins"
    assert wanted in lines


def test_a_behaviour_has_no_parameters_of_its_own():
    """In Nav2 each behaviour reads those of the server."""
    spin = {"plugin": "nav2_behaviors/Spin", "simulate_ahead_time": 0.5, "speed": 1.0}
    read = parse_nav2_params({"behavior_server": node(behavior_plugins=["spin"], spin=spin)})
    assert read.navigation.behavior_server.simulate_ahead_time == 2.0
    assert {finding.name: finding.why for finding in read.findings if finding.kind == "unused"} == {
        "behavior_server.spin.simulate_ahead_time": "all behaviours read behavior_server.simulate_ahead_time",
        "behavior_server.spin.speed": "this behaviour has no parameters of its own",
    }


def test_humbles_back_up_is_read_with_its_limits_and_jazzys_has_none():
    server = node(behavior_plugins=["backup"], backup={"plugin": "nav2_behaviors/BackUp", "acceleration_limit": 2.5})
    read = parse_nav2_params({"behavior_server": server}, release="humble")
    assert read.navigation.behavior_server.backup.acceleration_limit == 2.5
    read = parse_nav2_params({"behavior_server": server}, release="jazzy")
    assert read.navigation.behavior_server.backup.acceleration_limit == 0.0
    assert read.named("other_release") == ("behavior_server.backup.acceleration_limit",)


# --- Costmaps ---------------------------------------------------------------------------------------------------------


def test_of_two_voxel_layers_the_one_with_a_lidar_is_built():
    document = with_layers(["eyes", "lidar"], eyes={"plugin": VOXEL, **CAMERA}, lidar={"plugin": VOXEL, **LASER})
    read = parse_nav2_params(document)
    assert read.navigation.local_costmap.plugins == ("voxel_layer",)
    assert read.navigation.local_costmap.voxel_layer.scan.obstacle_max_range == 1.5
    blind = "local_costmap.local_costmap.lidar.scan.max_obstacle_height"
    assert set(read.named("left_out")) == {"local_costmap.local_costmap.eyes", blind}
    (line,) = [line for line in summarise(read) if blind in line]
    assert "0 by default, so Nav2 sees no point above the floor" in line


@pytest.mark.parametrize("names", ["laser", "scan laser", ["laser"]])
def test_an_observation_source_without_a_block_sees_nothing(names):
    """Nav2 listens to the topic ``laser`` with defaults that drop every point above the floor."""
    layer = {"plugin": VOXEL, "enabled": True, "observation_sources": names, "scan": {"data_type": "LaserScan"}}
    read = parse_nav2_params(with_layers(["eyes"], eyes=layer))
    scan = read.navigation.local_costmap.voxel_layer.scan
    assert (scan.marking or scan.clearing) == ("scan" in names)
    (line,) = [line for line in summarise(read) if "laser has no block" in line]
    assert "local_costmap.eyes.observation_sources: laser has no block in local_costmap.local_costmap.eyes" in line
    assert "(it has scan), so Nav2 sees nothing by it" in line
    shared = parse_nav2_params(with_layers(["eyes"], eyes={"plugin": VOXEL}, observation_sources="laser"))
    assert "local_costmap.local_costmap.observation_sources" in shared.named("left_out")
    assert not shared.navigation.local_costmap.voxel_layer.scan.marking


def test_layers_that_are_off_do_not_see():
    """A lidar of a layer that is off keeps no point cloud out, and such a layer no other of its class."""
    document = with_layers(
        ["off", "eyes"], off={"plugin": OBSTACLES, "enabled": False, **LASER}, eyes={"plugin": VOXEL, **CAMERA}
    )
    read = parse_nav2_params(document)
    assert read.navigation.local_costmap.voxel_layer.scan.obstacle_max_range == 4.0
    assert "local_costmap.local_costmap.eyes.cloud" in read.named("replaced")
    off = {"plugin": VOXEL, "enabled": False, **LASER}
    read = parse_nav2_params(with_layers(["off", "lidar"], off=off, lidar={"plugin": VOXEL, **LASER}))
    assert read.navigation.local_costmap.voxel_layer.enabled
    assert "local_costmap.local_costmap.off" in read.named("left_out")


def test_without_any_lidar_a_point_cloud_stands_for_it():
    camera = {**CAMERA, "cloud": {**CAMERA["cloud"], "inf_is_valid": True}}
    read = parse_nav2_params(with_layers(["eyes"], eyes={"plugin": VOXEL, **camera}))
    layer = read.navigation.local_costmap.voxel_layer
    assert (layer.scan.marking, layer.scan.obstacle_max_range, layer.scan.inf_is_valid) == (True, 4.0, False)
    assert read.named("replaced") == ("local_costmap.local_costmap.eyes.cloud",)
    assert "local_costmap.local_costmap.eyes.cloud.inf_is_valid" in read.named("left_out")


def test_the_spatio_temporal_voxel_layer_is_approximated():
    stvl = {
        "plugin": "spatio_temporal_voxel_layer/SpatioTemporalVoxelLayer",
        "voxel_decay": 15.0,
        "update_footprint_enabled": False,
        "observation_sources": "mark clear",
        "mark": {"data_type": "PointCloud2", "marking": True, "clearing": False, "obstacle_range": 3.0},
        "clear": {"data_type": "PointCloud2", "marking": False, "clearing": True},
    }
    read = parse_nav2_params(with_layers(["stvl"], stvl=stvl))
    layer = read.navigation.local_costmap.voxel_layer
    assert (layer.scan.clearing, layer.scan.obstacle_max_range, layer.footprint_clearing_enabled) == (True, 3.0, False)
    assert read.named("replaced")[0] == "local_costmap.local_costmap.stvl"
    assert "local_costmap.local_costmap.stvl.voxel_decay" in read.named("detail")


def test_filters_and_other_layers_are_left_out():
    document = with_layers(
        ["inflation_layer", "sonar"],
        filters=["keepout"],
        keepout={"plugin": "nav2_costmap_2d::KeepoutFilter", "enabled": "KEEPOUT_ZONE_ENABLED"},
        sonar={"plugin": "nav2_costmap_2d::RangeSensorLayer"},
    )
    read = parse_nav2_params(document)
    assert read.navigation.local_costmap.plugins == ("inflation_layer",)
    assert {name.rpartition(".")[2] for name in read.named("left_out")} == {"keepout", "sonar"}


@pytest.mark.parametrize("key", ["plugins", "filters"])
@pytest.mark.parametrize("value", [3, "static_layer", {"static_layer": {}}, [3]])
def test_lists_of_layers_hold_names(key, value):
    with pytest.raises(ConfigError, match=rf"local_costmap\.{key}: expected a list of names, got "):
        parse_nav2_params({"local_costmap": {"local_costmap": node(**{key: value})}})


def test_what_is_left_out_of_the_layers_has_its_own_reason():
    keepout = {"plugin": "nav2_costmap_2d::KeepoutFilter", "filter_info_topic": "zones"}
    static = {"plugin": "nav2_costmap_2d::StaticLayer"}
    why = found(with_layers(["map", "peers", "keepout"], map=static, peers=static, keepout=keepout))
    prefix = "local_costmap.local_costmap"
    assert why[f"{prefix}.peers"] == ("left_out", "a second static layer, and one is built")
    kind, said = why[f"{prefix}.keepout"]
    assert (kind, said) == ("left_out", "the file has no node whose filter_info_topic is zones")


@pytest.mark.parametrize(
    ("document", "refused"),
    [
        (with_layers(["static_layer", "v"], v={"plugin": VOXEL}), r"local_costmap\.static_layer"),
        (with_layers(["voxel_layer"], voxel_layer=LASER), r"local_costmap\.voxel_layer"),
        (with_controller(DWB, goal_checker_plugins=["g"], g={}), r"controller_server\.g"),
        (with_controller(DWB, progress_checker_plugins=["p"], p={}), r"controller_server\.p"),
        (
            {"controller_server": node(controller_plugins=["FollowPath", "b"], FollowPath={}, b=DWB)},
            r"controller_server\.FollowPath",
        ),
    ],
)
def test_nav2_gives_a_class_to_its_own_lists_alone(document, refused):
    with pytest.raises(ConfigError, match=rf"{refused}\.plugin: expected the class of this .*, got none"):
        parse_nav2_params(document)


def test_the_layers_of_nav2s_own_list_have_a_class():
    names = ["static_layer", "obstacle_layer", "inflation_layer"]
    document = {"local_costmap": {"local_costmap": node(plugins=names, obstacle_layer=LASER)}}
    assert parse_nav2_params(document).navigation.local_costmap.plugins == tuple(names)


def test_more_than_one_lidar_is_one_here_and_old_scans_are_said():
    layer = {
        "plugin": "nav2_costmap_2d::ObstacleLayer",
        "observation_sources": ["front", "rear"],
        "front": {"observation_persistence": 1.0},
        "rear": {"observation_persistence": 0.0},
    }
    names = set(parse_nav2_params(with_layers(["o"], o=layer)).named("left_out"))
    prefix = "local_costmap.local_costmap.o"
    assert names == {f"{prefix}.rear"} | {
        f"{prefix}.front.{name}" for name in ("observation_persistence", "max_obstacle_height")
    }


# --- Templates --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("<min_x>", "min_x"),
        ("a/$(var ns)/b", "ns"),
        ("$(find-pkg-share my_pkg)/x", "my_pkg"),
        ("${r}", "r"),
        ("@r@", "r"),
    ],
)
def test_templates_are_found_and_filled(text, name):
    assert find_template([1, text]).name == name
    assert "7" in fill_templates(f"key: {text}", {name: "7"})
    assert fill_templates(f"key: {text}", {}) == f"key: {text}"


def test_a_footprint_without_values_is_left_to_the_robot(write):
    text = "local_costmap: {local_costmap: {ros__parameters: {footprint: '[[<a>, <b>], [<a>, 0.1], [-0.1, 0.0]]'}}}"
    read = read_nav2_params(write(text))
    assert read.navigation.local_costmap.footprint is None
    assert read.named("template") == ("local_costmap.local_costmap.footprint",)
    read = read_nav2_params(write(text), defines={"a": "0.2", "b": "-0.1"})
    assert read.navigation.local_costmap.footprint == ((0.2, -0.1), (0.2, 0.1), (-0.1, 0.0))


def test_a_template_that_drives_needs_a_value_and_others_none(write):
    text = (
        "# <not this>\n'<ns>/planner_server':\n  ros__parameters:\n    topic: /<ns>/x\n    GridBased: {{tolerance: {}}}"
    )
    path = write(text.format("$(var tolerance)"))
    with pytest.raises(ConfigError, match=r"line 5: .*tolerance: the template .* --define tolerance=VALUE"):
        read_nav2_params(path)
    assert read_nav2_params(path, defines={"tolerance": "0.3"}).navigation.planner.params["tolerance"] == 0.3
    with pytest.raises(ConfigError, match="unknown template 'tolerence'; did you mean 'tolerance'"):
        read_nav2_params(path, defines={"tolerence": "0.3"})
    with pytest.raises(ConfigError, match=r"line 5: .*\{\{ tol \}\} has no value"):
        read_nav2_params(write(text.format("{{ tol }}")))


def test_placeholders_of_nav2s_own_launch_files_take_values():
    assert fill_templates("enabled: KEEPOUT_ZONE_ENABLED", {"KEEPOUT_ZONE_ENABLED": "true"}) == "enabled: true"


@pytest.mark.parametrize("options", [["x"], ["=1"], ["x=1", "x=2"], ["x=a\nb"]])
def test_a_define_that_is_none_is_refused(options):
    with pytest.raises(ConfigError, match="--define"):
        parse_defines(options)


# --- Lines ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("max_vel_x: fast", "line 6: controller_server.FollowPath.max_vel_x: expected a valid number"),
        ("PathDist.scale: -1.0", "line 6: controller_server.FollowPath.PathDist.scale: expected greater than or equal"),
        (
            "PathDist:\n        scale: -1.0",
            "line 7: controller_server.FollowPath.PathDist.scale: expected greater than or",
        ),
        ("sim_time: <t>", "line 6: controller_server.FollowPath.sim_time: the template <t> has no value"),
        ("min_vel_x: 1.0", "line 6: controller_server.FollowPath.min_vel_x: expected at most max_vel_x"),
    ],
)
def test_a_refusal_names_the_line_and_the_key(text, said, write):
    head = "controller_server:\n  ros__parameters:\n    controller_plugins: [FollowPath]\n    FollowPath:\n"
    path = write(f"{head}      critics: [PathDist]\n      {text}\n")
    with pytest.raises(ConfigError) as raised:
        read_nav2_params(path)
    assert f"{path}: {said}" in str(raised.value)


# --- The robot --------------------------------------------------------------------------------------------------------


def test_the_smoothers_limits_are_the_robots_or_else_its_controllers():
    document = with_controller({**DWB, "acc_lim_x": 1.5, "min_vel_x": -0.2}) | with_layers([], robot_radius=0.3)
    robot = robot_of(parse_nav2_params(document), RobotSpec())
    assert (robot.radius, robot.max_linear_velocity, robot.max_reverse_velocity) == (0.3, 0.3, 0.2)
    assert (robot.max_linear_acceleration, robot.max_angular_velocity) == (1.5, 1.0)
    smoother = node(max_velocity=[0.8, 0.0, 2.0], min_velocity=[-0.1, 0.0, -2.0], max_accel=[0.5, 0.0, 4.0])
    robot = robot_of(parse_nav2_params({**document, "velocity_smoother": smoother}), RobotSpec())
    assert (robot.max_linear_velocity, robot.max_reverse_velocity, robot.max_angular_velocity) == (0.8, 0.1, 2.0)
    assert (robot.max_linear_acceleration, robot.max_angular_acceleration) == (2.5, 4.0)


@pytest.mark.parametrize(
    ("controller", "reverse"),
    [
        ({**RPP, "desired_linear_vel": 0.4, "allow_reversing": True, "use_rotate_to_heading": False}, (0.4, 0.4)),
        ({**RPP, "desired_linear_vel": 0.4, "allow_reversing": True}, (0.05, 0.4)),
        ({**RPP, "desired_linear_vel": 0.4}, (0.05, 0.15)),
        ({**GRACEFUL, "v_linear_max": 0.4, "allow_backward": True, "initial_rotation": False}, (0.4, 0.4)),
        ({**GRACEFUL, "v_linear_max": 0.4, "allow_backward": True}, (0.05, 0.15)),
        ({**SHIM, "primary_controller": RPP["plugin"], "allow_reversing": True, "desired_linear_vel": 0.4,
          "use_rotate_to_heading": False}, (0.4, 0.4)),
    ],
)  # fmt: skip
def test_a_controller_that_may_drive_backwards_does_so_as_fast_as_forwards(controller, reverse):
    """The robot's limit was that of the back-up. Humble's RPP does not reverse with ``use_rotate_to_heading``."""
    for release, expected in zip(("humble", "jazzy"), reverse, strict=True):
        read = parse_nav2_params(with_controller(controller), release=release)
        assert robot_of(read, RobotSpec()).max_reverse_velocity == expected


def test_a_footprint_becomes_a_body_of_at_most_eight_corners_and_no_dents():
    angles = [i * math.pi / 10 for i in range(20)]
    round_one = str([[round(math.cos(a), 3), round(math.sin(a), 3)] for a in angles])
    robot = robot_of(parse_nav2_params(with_layers([], footprint=round_one)), RobotSpec())
    assert len(robot.footprint) == 8
    dented = "[[0.3, 0.2], [0.1, 0.0], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]"
    robot = robot_of(parse_nav2_params(with_layers([], footprint=dented)), RobotSpec())
    assert len(robot.footprint) == 4
    assert robot.circumscribed_radius == pytest.approx(math.hypot(0.3, 0.2))


def test_a_file_without_shape_and_limits_leaves_the_robot_as_it_is():
    assert robot_of(parse_nav2_params({"planner_server": node()}), RobotSpec()) == RobotSpec()


# --- Types ------------------------------------------------------------------------------------------------------------


def mistyped(document, release=None):
    return {name: why for name, (kind, why) in found(document, release).items() if kind == "mistyped"}


def test_numbers_of_another_type_than_in_nav2_are_named():
    """Nav2 does not start with them; runs here are the same."""
    dwb = {**DWB, "sim_time": 2, "vx_samples": 20.0, "vtheta_samples": 20, "max_vel_x": 0.3}
    dwb |= {"PathDist.scale": 32, "GoalDist.scale": 24}
    document = with_controller(dwb, controller_frequency=20, goal_checker={"xy_goal_tolerance": 1})
    document |= with_layers(["inflation_layer"], inflation_layer={"inflation_radius": 1}, width=3, update_frequency=5)
    document["velocity_smoother"] = node(max_velocity=[0.5, 0, 2.5], min_velocity=[-0.5, 0.0, -2.5])
    document["bt_navigator"] = node(bt_loop_duration=10.0)
    assert mistyped(document) == {
        "controller_server.FollowPath.sim_time": "expected a double; write 2.0",
        "controller_server.FollowPath.vx_samples": "expected an integer; write 20",
        "controller_server.FollowPath.PathDist.scale": "expected a double; write 32.0",
        "controller_server.controller_frequency": "expected a double; write 20.0",
        "controller_server.goal_checker.xy_goal_tolerance": "expected a double; write 1.0",
        "local_costmap.local_costmap.inflation_layer.inflation_radius": "expected a double; write 1.0",
        "local_costmap.local_costmap.update_frequency": "expected a double; write 5.0",
        "velocity_smoother.max_velocity": "expected a list of doubles; write [0.5, 0.0, 2.5]",
        "bt_navigator.bt_loop_duration": "expected an integer; write 10",
    }


def test_optional_parameters_and_those_of_other_names_have_types_too():
    mppi = {**MPPI, "time_steps": 56.0, "ax_max": 3, "critics": ["CostCritic"], "CostCritic": {"critical_cost": 300}}
    assert mistyped(with_controller(mppi), "jazzy") == {
        "controller_server.FollowPath.time_steps": "expected an integer; write 56",
        "controller_server.FollowPath.ax_max": "expected a double; write 3.0",
        "controller_server.FollowPath.CostCritic.critical_cost": "expected a double; write 300.0",
    }
    rpp = with_controller({**RPP, "max_linear_vel": 1, "lookahead_dist": 0.6}, path_handler_plugins=["PathHandler"])
    assert mistyped(rpp) == {"controller_server.FollowPath.max_linear_vel": "expected a double; write 1.0"}


def test_empty_lists_are_named():
    """Nodes of ROS end at the start with "No parameter value set"."""
    document = with_layers(["inflation_layer"], filters=[]) | {"behavior_server": node(behavior_plugins=[])}
    wanted = "expected a list of one value or more"
    assert mistyped(document)["local_costmap.local_costmap.filters"] == wanted
    assert mistyped(document)["behavior_server.behavior_plugins"] == wanted


def test_types_of_what_stands_in_for_another_plugin_are_unknown():
    layer = {"plugin": "spatio_temporal_voxel_layer/SpatioTemporalVoxelLayer", "mark_threshold": 0.0, **LASER}
    assert mistyped(with_layers(["stvl"], stvl=layer)) == {}


def test_the_summary_names_wrong_types_first(write):
    read = read_nav2_params(write(with_controller({**DWB, "sim_time": 2})))
    wanted = "Nav2 does not start with: controller_server.FollowPath.sim_time (line 11): expected a double; write 2.0"
    assert summarise(read)[2] == wanted


# --- What is said -----------------------------------------------------------------------------------------------------


def test_the_summary_fits_one_screen_and_verbose_names_everything(write):
    document = with_controller({**MPPI, "motion_model": "Omni", "vx_mx": 0.4, **{f"stray{i}": i for i in range(60)}})
    document["door_opener"] = node(a=1)
    read = read_nav2_params(write(document))
    lines = summarise(read, RobotSpec())
    assert len(lines) < 12
    assert max(map(len, lines)) < 400
    text = "\n".join(lines)
    for said in (
        "read as Nav2 Humble",
        "FollowPath (MPPI)",
        "radius 0.22 m",
        "replaced: ",
        "door_opener (line ",
    ):
        assert said in text
    assert "controller_server.FollowPath.vx_mx (line 8); did you mean 'vx_max'?" in text
    assert "stray5 (line 14) and 54 more" in text
    assert "stray59" not in text
    assert "stray59" in "\n".join(summarise(read, RobotSpec(), verbose=True))


# --- Anything ---------------------------------------------------------------------------------------------------------

WHOLE = {
    **with_controller({**MPPI, "motion_model": "Omni", "critics": ["CostCritic"], "CostCritic": {"cost_weight": 1.0}}),
    **with_layers(
        ["v", "inflation_layer"], v={"plugin": VOXEL, **LASER}, footprint="[[0.1, 0.1], [-0.1, 0.1], [0, -0.2]]"
    ),
    "recoveries_server": node(recovery_plugins=["spin"], spin={"plugin": "nav2_recoveries/Spin"}),
    "planner_server": node(planner_plugin_types=["nav2_navfn_planner/NavfnPlanner"], planner_plugin_ids=["GridBased"]),
    "velocity_smoother": node(max_velocity=[0.3, 0.0, 1.0]),
    "dwb_controller": node(max_vel_x=0.2),
}
JUNK = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.sampled_from(["<a>", "$(var b)", "x", "", "Omni", "a.b"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["plugin", "a", "v", "scan"]), inner),
    max_leaves=6,
)


def groups(value):
    return [value, *(g for inner in value.values() if isinstance(inner, dict) for g in groups(inner))]


def spoilt(data):
    """A whole file with some keys gone, some stray ones and some values of the wrong type."""
    document = copy.deepcopy(WHOLE)
    for _ in range(data.draw(st.integers(1, 3))):
        group = data.draw(st.sampled_from(groups(document)))
        if group:
            key = data.draw(st.sampled_from(sorted(group)) | st.sampled_from(["stray", "plugin", "plugins", "filters"]))
            if data.draw(st.booleans()):
                group.pop(key, None)
            else:
                group[key] = data.draw(JUNK)
    return document


@settings(max_examples=150, deadline=None)
@given(st.data(), st.sampled_from([None, *RELEASES]))
def test_a_spoilt_file_is_read_or_refused_and_never_more(data, release):
    with contextlib.suppress(ConfigError):
        read = parse_nav2_params(spoilt(data), None, release)
        assert summarise(read, robot_of(read, RobotSpec()), verbose=True)


@settings(max_examples=60, deadline=None)
@given(data=st.data(), target=st.sampled_from(RELEASES), source=st.sampled_from([None, *RELEASES]))
def test_a_spoilt_file_is_migrated_to_a_yaml_file_or_refused(data, target, source, tmp_path_factory):
    path = tmp_path_factory.mktemp("spoilt") / "params.yaml"
    flow = data.draw(st.sampled_from([None, False, True]))
    path.write_text(yaml.safe_dump(spoilt(data), default_flow_style=flow, sort_keys=False))
    with contextlib.suppress(ConfigError):
        migration = migrate_file(path, target, source)
        assert isinstance(yaml.safe_load(migration.text), dict)


TWO_CHECKERS = with_controller(DWB, progress_checker_plugins=["quick", "turning"])


@pytest.mark.parametrize(("named", "other"), [("quick", "turning"), ("turning", "quick")])
def test_humble_gets_the_progress_checker_that_the_tree_names(named, other, write):
    file = write({**TWO_CHECKERS, "bt_navigator": node(progress_checker_id=named)})
    migration = migrate_file(file, "humble", "jazzy")
    server = yaml.safe_load(migration.text)["controller_server"]["ros__parameters"]
    assert server["progress_checker_plugin"] == named
    assert any(f"Humble has one, {named}; {other} does not count" in line for line in migration.lost)


def test_each_namespace_has_the_progress_checker_of_its_own_tree(write):
    robots = {
        name: {**copy.deepcopy(TWO_CHECKERS), "bt_navigator": node(progress_checker_id=named)}
        for name, named in (("one", "turning"), ("two", "quick"))
    }
    read = yaml.safe_load(migrate_file(write(robots), "humble", "jazzy").text)
    servers = [read[name]["controller_server"]["ros__parameters"] for name in robots]
    assert [server["progress_checker_plugin"] for server in servers] == ["turning", "quick"]


@pytest.mark.parametrize(
    ("navigator", "said"),
    [
        ({}, r"got quick, turning; name the one of your tree with bt_navigator\.progress_checker_id"),
        ({"progress_checker_id": "mine"}, "expected 'mine' among them"),
    ],
)
def test_several_progress_checkers_without_a_name_are_refused_for_humble(navigator, said, write):
    with pytest.raises(ConfigError, match=rf"params\.yaml: controller_server\.progress_checker_plugins: .*{said}"):
        migrate_file(write({**TWO_CHECKERS, "bt_navigator": node(**navigator)}), "humble", "jazzy")


def test_no_progress_checker_is_lost_on_the_way_to_humble(write):
    migration = migrate_file(write(with_controller(DWB, progress_checker_plugins=[])), "humble", "lyrical")
    assert "progress_checker_plugin" not in migration.text
    assert any("Humble always has one; without the key, it takes its default" in line for line in migration.lost)


@pytest.mark.parametrize("name", PRESETS)
def test_presets_hold_nothing_that_is_not_read(name):
    document = read_preset(name)
    read = parse_nav2_params(document, release=document.pop("release", "humble"))
    assert {finding.kind for finding in read.findings} <= {"ros_only"}


@needs_data
@pytest.mark.parametrize("path", sorted((DATA / "nav2_params").glob("*.yaml")), ids=lambda path: path.stem)
def test_files_in_the_wild_drive_or_say_in_one_line_why_not(path):
    read = refusal = None
    try:
        read = read_nav2_params(path)
    except ConfigError as error:
        refusal = str(error)
    if read is None:
        assert f"{path}: line " in refusal
        assert "--only" in refusal
    else:
        assert read.own_controllers
        assert len(summarise(read, robot_of(read, RobotSpec()))) <= 20


@needs_data
@pytest.mark.parametrize("target", RELEASES)
@pytest.mark.parametrize("path", sorted((DATA / "nav2_params").glob("*.yaml")), ids=lambda path: path.stem)
def test_files_in_the_wild_migrate_to_what_is_recognised_as_the_target(path, target, write):
    migration = migrate_file(path, target)
    read = parse_nav2_params(read_document(write(migration.text)))
    assert read.recognition.release == target
    own = [finding.name for finding in read.findings if finding.kind == "other_release"]
    assert not [name for name in own if name.rpartition(".")[2] in ("ax_max", "reset_period", "mode", "stateful")]
    again = migrate_file(write(migration.text), target)
    assert (again.text, again.lost) == (migration.text, ())


@pytest.mark.parametrize(
    ("document", "release", "name", "read"),
    [
        (
            {
                "planner_server": node(
                    GridBased={"plugin": "nav2_theta_star_planner/ThetaStarPlanner", "how_many_corners": 6}
                )
            },
            "humble",
            "planner_server.GridBased.how_many_corners",
            lambda navigation: navigation.planner.params["how_many_corners"] == 8,
        ),
        (
            with_controller(
                {**MPPI, "motion_model": "d", "d": {"plugin": "mppi::DiffDriveMotionModel"}, "sgf_order": 3}
            ),
            "lyrical",
            "controller_server.FollowPath.sgf_order",
            lambda navigation: navigation.controllers["FollowPath"].params["sgf_order"] == 2,
        ),
        (
            with_controller({**RPP, "inflation_cost_scaling_factor": 0.0}),
            "jazzy",
            "controller_server.FollowPath.inflation_cost_scaling_factor",
            lambda navigation: (
                navigation.controllers["FollowPath"].params["use_cost_regulated_linear_velocity_scaling"] is False
            ),
        ),
    ],
)
def test_values_that_nav2_corrects_with_a_warning_are_corrected(document, release, name, read):
    parsed = parse_nav2_params(document, None, release)
    assert read(parsed.navigation)
    assert parsed.named("replaced") == (name,)


@pytest.mark.parametrize(
    ("critics", "groups", "read"),
    [
        (["Mine", "GoalDist"], {"Mine": {"class": "PathAlign", "scale": 5.0}}, ["PathAlign", "GoalDist"]),
        (["GoalDistCritic", "PathAlignCritic"], {"PathAlignCritic.scale": 5.0}, ["GoalDist", "PathAlign"]),
        (["GoalAlign"], {"GoalAlign": {"class": "dwb_critics::PathAlignCritic", "scale": 5.0}}, ["PathAlign"]),
    ],
)
def test_critics_of_dwb_are_known_by_their_class(critics, groups, read):
    parsed = parse_nav2_params(with_controller({**DWB, "critics": critics, **groups}), None, "humble")
    params = parsed.navigation.controllers["FollowPath"].params
    assert (list(params["critics"]), params["PathAlign"]["scale"]) == (read, 5.0)
    assert not parsed.named("unknown")


def test_two_critics_of_one_class_are_refused():
    group = {**DWB, "critics": ["PathAlign", "Mine"], "Mine": {"class": "PathAlign"}}
    with pytest.raises(ConfigError, match=r"FollowPath\.critics: unknown critic 'Mine'"):
        parse_nav2_params(with_controller(group))


def test_parameters_for_every_node_count_for_each_section_that_reads_them(write):
    """They are no findings of the sections that do not read them, and a key that none reads is one finding."""
    every = {
        "use_sim_time": True,
        "controller_frequency": 7.0,
        "FollowPath": RPP,
        "FollowPath.lookahed_dist": 1.0,
        "x": 1,
    }
    document = {"/**": node(**every), "controller_server": node(controller_plugins=["FollowPath"])}
    document |= {"planner_server": node(), "local_costmap": {"local_costmap": node(width=4)}}
    read = parse_nav2_params(document)
    assert read.own_controllers == ("FollowPath",)
    assert read.navigation.controllers["FollowPath"].kind == "rpp"
    assert read.navigation.controller_server.controller_frequency == 7.0
    findings = {finding.name: (finding.kind, finding.why) for finding in read.findings}
    assert findings == {
        "/**.use_sim_time": ("ros_only", ""),
        "/**.FollowPath.lookahed_dist": ("unknown", "did you mean 'lookahead_dist'?"),
        "/**.x": ("unknown", ""),
    }
    wrong = write("/**: {ros__parameters: {controller_frequency: fast}}\ncontroller_server: {ros__parameters: {}}")
    with pytest.raises(ConfigError, match=r"line 1: /\*\*\.controller_frequency: "):
        read_nav2_params(wrong)


@pytest.mark.parametrize(
    ("wild", "own", "words"),
    [
        ("controller_plugins: [], failure_tolerance: fast", "{}", r"line 1: /\*\*\.failure_tolerance: expected a v"),
        ("FollowPath: {desired_linear_vel: 0.3}", "{}", r"line 1: /\*\*\.FollowPath\.critics: expected at least one"),
        ("controller_plugins: [A], A: {x: 1}", "{}", r"line 1: /\*\*\.A\.plugin: expected the class of this contr"),
        ("x: 1", "{controller_plugins: [A]}", r"line 2: controller_server\.A\.plugin: expected the class"),
        ("A: {x: 1}", "{controller_plugins: [A], A: {y: 1}}", r"line 2: controller_server\.A\.plugin: expected the c"),
    ],
)
def test_an_error_names_the_section_in_which_the_user_wrote_the_parameter(write, wild, own, words):
    path = write(f"/**: {{ros__parameters: {{{wild}}}}}\ncontroller_server: {{ros__parameters: {own}}}\n")
    with pytest.raises(ConfigError, match=words):
        read_nav2_params(path)


@pytest.mark.parametrize("misspelt", ["ros_parameters", "ROS__PARAMETERS", "ros__parameter"])
@pytest.mark.parametrize("section", ["controller_server", "planner_server", "local_costmap.local_costmap"])
def test_a_section_with_a_misspelt_group_of_parameters_is_refused_and_not_taken_from_a_preset(section, misspelt):
    node_ = {misspelt: {"use_sim_time": True, "FollowPath": RPP}}
    document = {"bt_navigator": node(), **nest_dotted({section: node_})}
    with pytest.raises(ConfigError, match=rf"^{section}: expected a group 'ros__parameters' in it.*got '{misspelt}'"):
        parse_nav2_params(document)


@pytest.mark.parametrize("values", [{"controller_frequency": 5.0}, {"FollowPath": RPP}])
def test_a_section_without_the_group_of_parameters_is_refused_and_not_taken_from_a_preset(values):
    with pytest.raises(ConfigError, match=r"^controller_server: expected a group 'ros__parameters' in it, as in ROS$"):
        parse_nav2_params({"bt_navigator": node(), "controller_server": values})


@pytest.mark.parametrize(
    ("group", "values", "unused"),
    [
        ("goal_checker", {"plugin": "nav2_controller::SimpleGoalChecker", "trans_stopped_velocity": 0.1}, 1),
        ("goal_checker", {"plugin": "nav2_controller::StoppedGoalChecker", "trans_stopped_velocity": 0.1}, 0),
        ("goal_checker", {"plugin": "nav2_controller::PositionGoalChecker", "yaw_goal_tolerance": 0.1}, 1),
        ("goal_checker", {"plugin": "nav2_controller::SimpleGoalChecker", "fine_xy_goal_tolerance": 0.1}, 1),
        ("progress_checker", {"plugin": "nav2_controller::SimpleProgressChecker", "required_movement_angle": 0.1}, 1),
        ("progress_checker", {"plugin": "nav2_controller::PoseProgressChecker", "required_movement_angle": 0.1}, 0),
        ("FollowPath", {**DWB, "critics": ["PathDist"], "GoalDist.scale": 2.0}, 1),
        ("FollowPath", {**DWB, "critics": ["PathDist"], "PathDist.scale": 2.0}, 0),
    ],
)
def test_parameters_of_other_checkers_and_of_unlisted_critics_are_named_as_unused(group, values, unused):
    read = parse_nav2_params({"controller_server": node(**{group: values})})
    last = [key for key in values if key not in ("plugin", "critics")][-1]
    assert read.named("unused") == ((f"controller_server.{group}.{last}",) * unused)


def test_a_group_that_comes_twice_is_named_as_ros_and_the_launch_files_read_it_differently(write):
    twice = "controller_server: {ros__parameters: {controller_frequency: %s}}\n"
    read = read_nav2_params(write(twice % 5.0 + twice % 7.0))
    assert read.navigation.controller_server.controller_frequency == 7.0
    lines = summarise(read)
    why = "an earlier group of this name, as with nav2_bringup's launch files; ROS alone merges both"
    assert f"left out: controller_server (line 2): {why}" in lines


def test_aliases_are_named_as_ros_reads_none(write):
    path = write(
        "common: &common {use_sim_time: true, controller_frequency: &rate 5.0}\n"
        "controller_server:\n  ros__parameters:\n    <<: *common\n    failure_tolerance: *rate\n"
        "    controller_plugins: &names [FollowPath]\n    FollowPath: {plugin: 'dwb_core::DWBLocalPlanner',"
        " critics: [PathDist], short_circuit_trajectory_evaluation: true}\n"
        "planner_server:\n  ros__parameters: {planner_plugins: *names, FollowPath: {plugin: x/NavfnPlanner}}"
    )
    read = read_nav2_params(path)
    assert read.navigation.controller_server.failure_tolerance == 5.0
    server = "controller_server"
    single = ("use_sim_time (line 2)", "controller_frequency (line 2)", "failure_tolerance (line 5)")
    named = ", ".join(f"{server}.{name}" for name in single)
    assert [line for line in summarise(read) if "alias" in line] == [
        f"ROS reads no alias: {named}: nav2_bringup's launch files write the value out",
        "ROS reads no alias: planner_server.planner_plugins (line 9)",
    ]


def test_a_footprint_that_is_a_list_is_named_as_nav2_reads_a_text():
    corners = [[0.2, 0.2], [0.2, -0.2], [-0.2, 0.0]]
    name = "local_costmap.local_costmap.footprint"
    document = {"local_costmap": {"local_costmap": node(footprint=corners)}}
    assert found(document)[name] == ("mistyped", f'expected a text; write "{corners}"')
    assert name not in found({"local_costmap": {"local_costmap": node(footprint=str(corners))}})


def test_a_file_with_one_controller_that_the_default_tree_does_not_ask_for_is_told():
    one = {"controller_server": node(controller_plugins=["Follow"], Follow=RPP)}
    assert found(one)["controller_server.FollowPath"] == ("missing", "expected in controller_plugins")
    named = {**one, "bt_navigator": node(default_nav_to_pose_bt_xml="/nowhere/mine.xml")}
    several = {"controller_server": node(controller_plugins=["A", "B"], A=RPP, B=DWB)}
    assert parse_nav2_params(named).named("missing") == parse_nav2_params(several).named("missing") == ()


def test_a_misspelt_controller_class_is_refused_with_the_nearest(write):
    path = write(with_controller({**DWB, "plugin": "dwb_core::DwbLocalPlanner"}))
    with pytest.raises(
        ConfigError, match=r"'dwb_core::DwbLocalPlanner' is not built here \(did you mean 'dwb_core::DWB"
    ):
        read_nav2_params(path)


def test_of_a_section_and_a_wildcard_the_later_counts_as_in_ros():
    own, every = {"controller_server": node(controller_frequency=5.0)}, {"/**": node(controller_frequency=7.0)}

    def frequency(document):
        return parse_nav2_params(document).navigation.controller_server.controller_frequency

    assert (frequency(every | own), frequency(own | every)) == (5.0, 7.0)


@pytest.mark.parametrize(
    ("wild", "section", "counts"),
    [
        ("/**", "/robot_1/planner_server", True),
        ("/robot_1/**", "/robot_1/planner_server", True),
        ("/robot_1/*", "/robot_1/planner_server", True),
        ("**/planner_server", "/robot_1/planner_server", True),
        ("/*/planner_server", "planner_server", False),
        ("/*", "/robot_1/planner_server", False),
        ("/*", "planner_server", True),
        ("/robot_2/**", "/robot_1/planner_server", False),
        ("/plan*", "planner_server", False),
    ],
)
def test_the_names_that_a_wildcard_matches(wild, section, counts):
    read = parse_nav2_params(
        {section: node(), wild: node(expected_planner_frequency=3.0, GridBased={"tolerance": 0.9})}
    )
    assert read.navigation.planner.params["tolerance"] == (0.9 if counts else 0.5)
    assert (wild in {*read.named("left_out"), *read.named("unused")}) != counts


def test_a_wildcard_for_a_costmap_and_the_costmap_itself_are_one_section():
    document = {"/**/local_costmap": node(width=4, height=6), "local_costmap": {"local_costmap": node(width=5)}}
    read = parse_nav2_params(document)
    assert (read.navigation.local_costmap.width, read.navigation.local_costmap.height) == (5, 6)
    assert not read.findings


def test_a_controller_for_every_node_without_its_list_is_not_converted_to_lyrical(write):
    """The path handler would not know which controllers it cuts the plan for."""
    path = write(yaml.safe_dump({"/**": node(FollowPath=RPP), "controller_server": node()}))
    with pytest.raises(ConfigError, match=r"/\*\*\.FollowPath: expected beside controller_plugins, or under contr"):
        migrate_file(path, "lyrical")
