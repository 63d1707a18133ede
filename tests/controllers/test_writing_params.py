"""Parameter files that are written: in the words of their release, and nothing is lost on the way back to ROS."""

from __future__ import annotations

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.behaviors import BehaviorServer, BehaviorTree, DriveLimits, default_tree
from controllers.checkers import GoalChecker, ProgressChecker
from controllers.nav2_params import (
    PRESETS,
    NavigationParams,
    load_preset,
    parameters_of_ours,
    parse_nav2_params,
    write_nav2_params,
)
from controllers.nav2_params.navigation import ControllerServer, VelocitySmoother
from controllers.nav2_params.plugin_settings import ControllerPlugin, PlannerPlugin
from controllers.nav2_params.plugins import CONTROLLERS
from gym_mapbench.costmap import CostmapParams, InflationLayer, ObservationSource, ObstacleLayer
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.robot import make_robot

positive = st.floats(0.01, 10)
axes = st.tuples(positive, st.just(0.0), positive)
negative_axes = st.tuples(positive, st.just(0.0), positive).map(lambda axis: tuple(-value for value in axis))
corners = st.just(((0.3, 0.2), (-0.3, 0.2), (0.0, -0.25)))
obstacle_layers = st.builds(
    ObstacleLayer,
    enabled=st.booleans(),
    scan=st.builds(
        ObservationSource, clearing=st.booleans(), obstacle_max_range=positive, max_obstacle_height=positive
    ),
)
costmap_params = st.builds(
    CostmapParams,
    robot_radius=st.none() | positive,
    footprint=st.none() | corners,
    resolution=positive,
    rolling_window=st.booleans(),
    plugins=st.permutations(["static_layer", "obstacle_layer", "inflation_layer"]).map(tuple),
    obstacle_layer=obstacle_layers,
    inflation_layer=st.builds(InflationLayer, inflation_radius=positive, inflate_unknown=st.booleans()),
)
controllers = st.dictionaries(
    st.sampled_from(["FollowPath", "dwb", "rpp", "Precise"]),
    st.builds(ControllerPlugin, kind=st.just("rpp"), params=st.fixed_dictionaries({"lookahead_dist": positive}))
    | st.builds(
        ControllerPlugin,
        kind=st.sampled_from(["dwb", "shim_dwb"]),
        params=st.just({"critics": ["PathDist"], "PathDist.scale": 2.0}),
    )
    | st.builds(
        ControllerPlugin,
        kind=st.sampled_from(["graceful", "shim_graceful"]),
        params=st.fixed_dictionaries({"lambda": positive}),
    )
    | st.builds(
        ControllerPlugin,
        kind=st.sampled_from(["shim_mppi", "shim_rpp"]),
        params=st.fixed_dictionaries({"angular_dist_threshold": positive, "max_angular_accel": positive}),
    ),
)
navigations = st.builds(
    NavigationParams,
    controller_server=st.builds(
        ControllerServer,
        controller_frequency=st.floats(20.0, 100.0),  # MPPI does not start with less
        failure_tolerance=st.sampled_from([-1.0, 0.0, 0.3]),
        progress_checker=st.builds(ProgressChecker, plugin=st.sampled_from(["simple", "pose"])),
        goal_checker=st.builds(GoalChecker, plugin=st.sampled_from(["simple", "stopped"]), xy_goal_tolerance=positive),
    ),
    controllers=controllers,
    planner=st.builds(PlannerPlugin, name=st.just("navfn"), params=st.fixed_dictionaries({"tolerance": positive}))
    | st.builds(PlannerPlugin, name=st.just("smac_2d"), params=st.fixed_dictionaries({"allow_unknown": st.booleans()}))
    | st.builds(PlannerPlugin, name=st.just("theta_star"), params=st.fixed_dictionaries({"w_euc_cost": positive})),
    local_costmap=costmap_params,
    global_costmap=costmap_params,
    behavior_server=st.builds(BehaviorServer, behavior_plugins=st.sampled_from([(), ("wait",), ("spin", "wait")]))
    | st.builds(
        BehaviorServer,
        behavior_plugins=st.just(("backup",)),
        backup=st.builds(DriveLimits, acceleration_limit=positive, minimum_speed=positive),
    ),
    bt=st.builds(BehaviorTree, recoveries=st.booleans(), number_of_retries=st.integers(0, 9)),
    velocity_smoother=st.none()
    | st.builds(VelocitySmoother, max_velocity=axes, max_decel=negative_axes, feedback=st.just("CLOSED_LOOP")),
)


def without_the_trees_numbers(navigation):
    tree = default_tree(navigation.release)
    return navigation.replace(bt=tree.replace(bt_loop_duration=navigation.bt.bt_loop_duration))


@settings(max_examples=60, deadline=None)
@given(navigations)
def test_what_is_written_reads_back_the_same(navigation):
    expected = without_the_trees_numbers(navigation)
    assert parse_nav2_params(write_nav2_params(navigation)).navigation == expected


@pytest.mark.parametrize("name", PRESETS)
def test_presets_survive_ros_and_json(name):
    preset = load_preset(name)
    document = yaml.safe_load(yaml.safe_dump(write_nav2_params(preset)))
    read = parse_nav2_params(document)
    assert read.recognition.release == preset.release
    assert read.recognition.against == ()
    assert read.named("unknown") == read.named("other_release") == ()
    assert read.named("unused") == ()
    assert read.navigation == preset
    assert NavigationParams(**preset.model_dump(mode="json")) == preset


def test_a_value_without_effect_is_written_if_the_file_reads_differently_without_it():
    given = {"critics": ["PathDist"], "Twirling.scale": 7.0}
    unlisted = NavigationParams(controllers={"dwb": ControllerPlugin(kind="dwb", params=given)})
    written = write_nav2_params(unlisted)
    group = written["controller_server"]["ros__parameters"]["dwb"]
    assert [name for name, value in group.items() if isinstance(value, dict)] == ["PathDist", "Twirling"]
    read = parse_nav2_params(written)
    assert read.navigation == unlisted
    assert read.named("unused") == ("controller_server.dwb.Twirling.scale",)


def test_a_rotation_shim_is_written_with_the_controller_inside():
    thesis = load_preset("thesis")
    navigation = thesis.replace(controllers={"FollowPath": thesis.controller("shim_rpp")})
    written = write_nav2_params(navigation)["controller_server"]["ros__parameters"]["FollowPath"]
    assert written["plugin"] == "nav2_rotation_shim_controller::RotationShimController"
    assert written["primary_controller"] == CONTROLLERS["rpp"].names["humble"]
    assert (written["desired_linear_vel"], written["angular_dist_threshold"]) == (0.5, 0.785)


def test_what_is_written_is_what_ros_takes():
    thesis = load_preset("thesis")
    document = write_nav2_params(thesis, robot=make_robot("jackal"), follow_path="rpp")
    server = document["controller_server"]["ros__parameters"]
    assert server["controller_plugins"] == ["dwb", "mppi", "FollowPath"]
    assert server["FollowPath"]["plugin"] == CONTROLLERS["rpp"].names["humble"]
    for name in ("local_costmap", "global_costmap"):
        written = document[name][name]["ros__parameters"]
        assert written["footprint"] == "[[0.21, 0.165], [-0.21, 0.165], [-0.21, -0.165], [0.21, -0.165]]"
        assert "robot_radius" not in written
    assert write_nav2_params(thesis, robot=make_robot("turtlebot3_burger"))["local_costmap"]["local_costmap"][
        "ros__parameters"
    ]["robot_radius"] == pytest.approx(0.105)
    assert document["velocity_smoother"]["ros__parameters"]["max_velocity"] == [0.5, 0.0, 2.5]
    assert _values_of_type(document, tuple | type(None)) == []


def _values_of_type(value, kind):
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return ([value] if isinstance(value, kind) else []) + [
        found for item in inner for found in _values_of_type(item, kind)
    ]


def test_parameters_of_ours_stay_out():
    thesis = load_preset("thesis")
    mppi = {"noise": "nav2", "noise_seed": 7, "PathAlignCritic.humble_search": False}
    ours = thesis.replace(
        controllers={**thesis.controllers, "mppi": ControllerPlugin(kind="mppi", params=mppi)},
        bt=BehaviorTree(recoveries=False, spin_dist=3.0),
    )
    document = write_nav2_params(ours)
    text = yaml.safe_dump(document)
    assert not any(
        name in text
        for name in ("noise:", "noise_seed", "humble_search", "release", "recoveries", "spin_dist", "retries")
    )
    assert parameters_of_ours(ours) == {f"mppi.{name}": value for name, value in mppi.items()}
    assert set(document["bt_navigator"]["ros__parameters"]) == {
        "use_sim_time",
        "bt_loop_duration",
        "global_frame",
        "robot_base_frame",
        "odom_topic",
    }
    jazzy = load_preset("jazzy")
    assert parameters_of_ours(jazzy) == {"mppi.noise": "numpy", "mppi.noise_seed": 5489}
    inside = jazzy.replace(controllers={"turning": jazzy.controller("shim_mppi")})
    assert parameters_of_ours(inside) == {"turning.noise": "numpy", "turning.noise_seed": 5489}
    assert "noise_seed" not in write_nav2_params(inside)["controller_server"]["ros__parameters"]["turning"]


def test_each_release_in_its_own_words():
    nodes = {name: write_nav2_params(load_preset(name)) for name in ("thesis", "jazzy")}
    humble, jazzy = ({node: values.get("ros__parameters") for node, values in of.items()} for of in nodes.values())
    assert humble["controller_server"]["progress_checker_plugin"] == "progress_checker"
    assert jazzy["controller_server"]["progress_checker_plugins"] == ["progress_checker"]
    assert "progress_checker_plugin" not in jazzy["controller_server"]
    assert humble["planner_server"]["GridBased"]["plugin"] == "nav2_navfn_planner/NavfnPlanner"
    assert jazzy["planner_server"]["GridBased"]["plugin"] == "nav2_navfn_planner::NavfnPlanner"
    assert jazzy["behavior_server"]["spin"]["plugin"] == "nav2_behaviors::Spin"
    assert (humble["behavior_server"]["global_frame"], jazzy["behavior_server"]["global_frame"]) == ("odom", "map")
    assert "local_costmap_topic" in jazzy["behavior_server"]
    assert jazzy["bt_navigator"]["error_code_names"] == ["compute_path_error_code", "follow_path_error_code"]
    unstamped = [name for name, values in jazzy.items() if values and values.get("enable_stamped_cmd_vel") is False]
    assert unstamped == ["controller_server", "behavior_server", "velocity_smoother"]
    assert "enable_stamped_cmd_vel" not in yaml.safe_dump(nodes["thesis"])


KEPT = """
robot_1/controller_server:
  ros__parameters:
    use_sim_time: false
    odom_topic: /wheels
    odom_duration: 0.4
    controller_plugins: [Slow]
    goal_checker_plugins: [near]
    near: {plugin: "nav2_controller::SimpleGoalChecker", xy_goal_tolerance: 0.1}
    Slow: {plugin: "dwb_core::DWBLocalPlanner", critics: [PathDist], transform_tolerance: 0.7}
local_costmap:
  local_costmap:
    ros__parameters:
      global_frame: wheels
      publish_frequency: 2.5
      transform_tolerance: 0.3
      plugins: [walls, spread]
      walls:
        plugin: "nav2_costmap_2d::VoxelLayer"
        publish_voxel_map: true
        observation_sources: laser
        laser: {topic: /front, clearing: true, expected_update_rate: 5.0}
      spread: {plugin: "nav2_costmap_2d::InflationLayer"}
planner_server:
  ros__parameters:
    expected_planner_frequency: 20.0
    planner_plugins: [Quick]
    Quick: {plugin: "nav2_smac_planner/SmacPlanner2D", max_planning_time: 1.5}
"""


def test_what_serves_ros_alone_comes_back_as_it_was():
    read = parse_nav2_params(yaml.safe_load(KEPT))
    assert read.navigation.local_costmap.publish_frequency == 2.5
    document = write_nav2_params(read.navigation, ros_only=read.ros_only)
    server = document["controller_server"]["ros__parameters"]
    assert (server["odom_duration"], server["Slow"]["transform_tolerance"]) == (0.4, 0.7)
    assert (server["odom_topic"], server["use_sim_time"]) == ("/odom", True)  # those of the simulated robot
    costmap = document["local_costmap"]["local_costmap"]["ros__parameters"]
    assert (costmap["publish_frequency"], costmap["transform_tolerance"], costmap["global_frame"]) == (2.5, 0.3, "odom")
    assert costmap["voxel_layer"]["publish_voxel_map"] is True
    assert costmap["voxel_layer"]["scan"]["expected_update_rate"] == 5.0
    assert costmap["voxel_layer"]["scan"]["topic"] == "/scan"
    planner = document["planner_server"]["ros__parameters"]
    assert (planner["expected_planner_frequency"], planner["GridBased"]["max_planning_time"]) == (20.0, 1.5)
    assert parse_nav2_params(document).ros_only == {
        node: {**kept, "use_sim_time": True} for node, kept in read.ros_only.items()
    } | {node: {"use_sim_time": True} for node in ("behavior_server", "bt_navigator", "global_costmap")}


def test_what_is_kept_makes_no_groups_of_its_own():
    read = parse_nav2_params(yaml.safe_load(KEPT))
    others = read.navigation.replace(controllers={"mine": read.navigation.controllers["Slow"]})
    server = write_nav2_params(others, ros_only=read.ros_only)["controller_server"]["ros__parameters"]
    assert "Slow" not in server


def test_writing_refuses_what_ros_does_not_have():
    server = ControllerServer(progress_checker=ProgressChecker(plugin="none"))
    with pytest.raises(ConfigError, match="one that ROS has, got 'none'"):
        write_nav2_params(NavigationParams(controller_server=server))
    with pytest.raises(ConfigError, match="unknown controller 'teb'"):
        write_nav2_params(load_preset("thesis"), follow_path="teb")


@pytest.mark.parametrize(("release", "timeouts"), [("jazzy", (0.3, 1.0)), ("humble", (None, None))])
def test_only_jazzys_servers_give_up_to_wait_for_their_costmaps(release, timeouts):
    written = write_nav2_params(load_preset("thesis" if release == "humble" else release))
    servers = [written[name]["ros__parameters"] for name in ("controller_server", "planner_server")]
    assert tuple(server.get("costmap_update_timeout") for server in servers) == timeouts
