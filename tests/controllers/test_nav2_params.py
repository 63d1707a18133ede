"""Parameter files: what is read, what is refused and how."""

from __future__ import annotations

import contextlib
import copy

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.checkers import GoalChecker, ProgressChecker
from controllers.nav2_params import load_preset, parse_nav2_params, read_nav2_params
from controllers.nav2_params.navigation import VelocitySmoother
from controllers.nav2_params.parsing import SECTIONS
from controllers.nav2_params.plugin_settings import PlannerPlugin
from gym_mapbench.costmap import CostmapParams, InflationLayer, ObservationSource, ObstacleLayer
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.robot import make_robot
from tests.oracle_data import DATA, needs_data

SAMPLE = """
amcl:
  ros__parameters: {use_sim_time: true, alpha1: 0.2}
controller_server:
  ros__parameters:
    use_sim_time: true
    controller_frequency: 10
    progress_checker_plugins: [pose_checker]
    goal_checker_plugins: [precise]
    controller_plugins: [FollowPath, Slow]
    pose_checker: {plugin: "nav2_controller::PoseProgressChecker", required_movement_angle: 0.3}
    precise: {plugin: "nav2_controller::StoppedGoalChecker", xy_goal_tolerance: 0.1}
    loose: {plugin: "nav2_controller::SimpleGoalChecker", xy_goal_tolerance: 1.0}
    unused: {plugin: "somebody::Else"}
    FollowPath:
      plugin: "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
      desired_linear_vel: 0.4
      transform_tolerance: 0.1
    Slow:
      plugin: "dwb_core::DWBLocalPlanner"
      max_vel_x: 0.1
      max_speed_xy: 0.1
      max_vel_theta: 0.5
      critics: [PathDist, GoalDist]
      PathDist.scale: 2.0
      GoalDist: {scale: 3.0}
local_costmap:
  local_costmap:
    ros__parameters:
      rolling_window: true
      width: 4
      footprint: "[[0.2, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.2, -0.1]]"
      plugins: [obstacles, spread]
      obstacles:
        plugin: "nav2_costmap_2d::ObstacleLayer"
        observation_sources: camera laser
        camera: {data_type: PointCloud2, topic: /points}
        laser: {topic: /scan, data_type: LaserScan, clearing: true, obstacle_range: 2.0}
      spread: {plugin: "nav2_costmap_2d::InflationLayer", inflation_radius: 0.3}
velocity_smoother:
  ros__parameters: {max_velocity: [0.3, 0.0, 1.0], max_velocity: [0.26, 0.0, 1.0], odom_topic: odom}
"""
PARSED = yaml.safe_load(SAMPLE)


def sample(**changes):
    """Return the sample as a mapping, with parameters of its controller server or whole nodes changed."""
    document = copy.deepcopy(PARSED)
    for name, value in changes.items():
        if name in SECTIONS:
            document[name] = value
        else:
            document["controller_server"]["ros__parameters"][name] = value
    return document


def follow_path(**params):
    plugin = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
    return sample(FollowPath={"plugin": plugin, **params})


def mppi(**params):
    return sample(FollowPath={"plugin": "nav2_mppi_controller::MPPIController", "model_dt": 0.1, **params})


def costmap(**params):
    return sample(local_costmap={"local_costmap": {"ros__parameters": params}})


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "nav2_params.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


# --- What is read ----------------------------------------------------------------------------------------------------


def test_a_file_is_read_section_by_section():
    read = parse_nav2_params(sample())
    server = read.navigation.controller_server
    assert server.controller_frequency == 10.0
    assert server.failure_tolerance == 0.0
    assert server.progress_checker == ProgressChecker(plugin="pose", required_movement_angle=0.3)
    assert server.goal_checker == GoalChecker(plugin="stopped", xy_goal_tolerance=0.1)
    rpp, dwb = read.navigation.controllers["FollowPath"], read.navigation.controllers["Slow"]
    assert (rpp.kind, rpp.params["desired_linear_vel"], rpp.params["lookahead_dist"]) == ("rpp", 0.4, 0.6)
    assert (dwb.kind, dwb.params["PathDist"]["scale"], dwb.params["GoalDist"]["scale"]) == ("dwb", 2.0, 3.0)
    assert read.navigation.velocity_smoother.max_velocity == (0.26, 0.0, 1.0)
    assert read.navigation.local_costmap == CostmapParams(
        rolling_window=True,
        width=4,
        footprint=((0.2, 0.1), (-0.2, 0.1), (-0.2, -0.1), (0.2, -0.1)),
        plugins=("obstacle_layer", "inflation_layer"),
        obstacle_layer=ObstacleLayer(scan=ObservationSource(clearing=True, obstacle_max_range=2.0)),
        inflation_layer=InflationLayer(inflation_radius=0.3),
        release="jazzy",
    )


def names(document, kind):
    return set(parse_nav2_params(document).named(kind))


def test_what_only_ros_needs_is_listed():
    assert names(sample(), "ros_only") == {
        "amcl",
        "controller_server.FollowPath.transform_tolerance",
        "controller_server.use_sim_time",
        "local_costmap.local_costmap.obstacles.laser.topic",
        "local_costmap.local_costmap.obstacles.laser.data_type",
        "velocity_smoother.odom_topic",
    }


def test_plugins_that_nothing_asks_for_are_listed_apart():
    assert names(sample(), "unused") == {"controller_server.loose", "controller_server.unused"}
    planners = {
        "planner_plugins": ["GridBased", "Second"],
        "GridBased.plugin": "a::B",
        "Second.plugin": "somebody::Else",
    }
    document = costmap(plugins=[], voxel_layer={"plugin": "nav2_costmap_2d::VoxelLayer"})
    unused = names({**document, "planner_server": {"ros__parameters": planners}}, "unused")
    assert unused >= {"planner_server.Second", "local_costmap.local_costmap.voxel_layer"}


def test_what_may_change_how_the_real_robot_drives_is_listed_apart():
    document = sample(bt_navigator={"ros__parameters": {"default_nav_to_pose_bt_xml": "mine.xml"}})
    document["door_opener"] = {"ros__parameters": {"doors": ["north"]}}
    document["/robot/**"] = {"ros__parameters": {"use_sim_time": True, "controller_frequency": 5.0}}
    assert names(document, "left_out") == {
        "door_opener",
        "/robot/**",
        "local_costmap.local_costmap.obstacles.camera",
        "local_costmap.local_costmap.obstacles.laser.max_obstacle_height",
        "bt_navigator.default_nav_to_pose_bt_xml",
    }
    (other,) = (finding for finding in parse_nav2_params(document).findings if finding.name == "/robot/**")
    assert (
        other.why == "no section that is read has such a name; write the parameters under the nodes that they are for"
    )
    document["/robot/**"] = {"ros__parameters": {"use_sim_time": True}}
    assert "/robot/**" in names(document, "ros_only")


def test_the_sections_of_a_second_robot_are_said_to_be_left_out():
    """A robot's Nav2 uses them, so they must not be listed as keys that Nav2 does not use."""
    read = parse_nav2_params({"robot_1": sample(), "robot_2": sample()})
    (second,) = (finding for finding in read.findings if finding.name == "robot_2.controller_server")
    assert second.kind == "left_out"
    assert second.why == "a second section for controller_server; robot_1.controller_server counts"


def test_a_preset_stands_in_for_what_the_file_leaves_out(write):
    read = read_nav2_params(write(SAMPLE))
    behind = load_preset("jazzy")
    assert list(read.navigation.controllers) == ["FollowPath", "Slow", "mppi"]
    assert read.navigation.controllers["mppi"] == behind.controllers["mppi"]
    assert read.navigation.global_costmap == behind.global_costmap
    left_out = ("planner_server", "global_costmap", "behavior_server", "bt_navigator", "controllers.mppi")
    assert read.defaulted == left_out


def test_the_velocity_smoother_is_on_where_the_file_configures_it(write):
    path = write(SAMPLE)
    assert read_nav2_params(path).navigation.velocity_smoother is not None
    assert read_nav2_params(path, velocity_smoother=False).navigation.velocity_smoother is None
    without = sample()
    del without["velocity_smoother"]
    assert read_nav2_params(write(yaml.safe_dump(without))).navigation.velocity_smoother is None


def test_namespaces_and_both_separators_of_a_class_are_understood():
    document = {"robot_1": sample()}
    planner = {"GridBased": {"plugin": "nav2_navfn_planner::NavfnPlanner", "tolerance": 0.2}}
    document["robot_1"]["/robot_1/planner_server"] = {"ros__parameters": planner}
    read = parse_nav2_params(document)
    assert read.navigation.planner == PlannerPlugin(name="navfn", params={"tolerance": 0.2, "release": "jazzy"})
    assert "robot_1.amcl" in read.named("ros_only")


def test_an_obstacle_layer_without_a_lidar_neither_marks_nor_clears():
    layer = {"plugin": "nav2_costmap_2d::ObstacleLayer"}
    read = parse_nav2_params(costmap(plugins=["obstacle_layer"], obstacle_layer=layer))
    assert read.navigation.local_costmap.obstacle_layer == ObstacleLayer(
        scan=ObservationSource(marking=False, clearing=False)
    )


def test_dwb_is_what_follow_path_means_unless_told():
    document = sample(FollowPath={"max_vel_x": 0.2, "critics": ["PathDist"]}, controller_plugins=["FollowPath"])
    assert parse_nav2_params(document).navigation.controllers["FollowPath"].kind == "dwb"


def test_names_of_newer_releases_are_understood():
    handler = {"prune_distance": 2.0, "enforce_path_inversion": True}
    params = parse_nav2_params(mppi(PathHandler=handler)).navigation.controllers["FollowPath"].params
    assert (params["prune_distance"], params["enforce_path_inversion"]) == (2.0, True)
    params = parse_nav2_params(follow_path(max_linear_vel=0.3)).navigation.controllers["FollowPath"].params
    assert params["desired_linear_vel"] == 0.3


def test_a_controller_is_found_by_name_then_by_kind():
    navigation = parse_nav2_params(sample()).navigation
    assert navigation.controller("Slow") is navigation.controller("dwb")
    with pytest.raises(ConfigError, match="did you mean 'FollowPath'"):
        navigation.controller("FolowPath")


@needs_data
def test_the_bringup_file_of_humble_is_the_preset_but_for_its_robot_and_smoother():
    read = read_nav2_params(DATA / "map_server" / "nav2_params.yaml")
    navigation, thesis = read.navigation, load_preset("thesis")
    assert navigation.controllers["FollowPath"] == thesis.controllers["dwb"]
    assert read.defaulted == ("controllers.mppi", "controllers.rpp")
    assert "bt_navigator.plugin_lib_names" in read.named("ros_only")
    assert navigation.velocity_smoother.max_velocity == (0.26, 0.0, 1.0)
    changes = {
        "controllers": thesis.controllers,
        "velocity_smoother": thesis.velocity_smoother,
        "local_costmap": navigation.local_costmap.replace(robot_radius=None),
        "global_costmap": navigation.global_costmap.replace(robot_radius=None),
    }
    assert navigation.replace(**changes) == thesis


# --- What is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("document", "message"),
    [
        (follow_path(lookahead_dist="far"), "controller_server.FollowPath.lookahead_dist: expected a valid number"),
        (sample(FollowPath=3), "controller_server.FollowPath: expected a group of parameters, got int"),
        (sample(controller_plugins="FollowPath"), "controller_plugins: expected a list of names, got 'FollowPath'"),
        (sample(controller_plugins=["A", False]), "controller_plugins: expected a list of names, got False among them"),
        (sample(controller_plugins=["Fast"]), "controller_server.Fast.plugin: expected the class of this controller"),
        (sample(controller_plugins=["Slow", "Slow"]), "expected no name twice"),
        (sample(goal_checker_plugins=[]), "goal_checker_plugins: expected at least one name"),
        (sample(precise={"plugin": "mine::Checker"}), "precise.plugin: goal checker 'mine::Checker' is not built here"),
        (sample(precise={"plugin": "nav2_controller::SimpleGaolChecker"}), "did you mean 'nav2_controller::SimpleGoal"),
        (sample(controller_frequency="fast"), "controller_server.controller_frequency: expected a valid number"),
        (sample(controller_frequency=0), "controller_server.controller_frequency: expected greater than 0"),
        (sample(controller_server={}), "controller_server: expected a group 'ros__parameters'"),
        ({"controler_server": {"ros__parameters": {}}}, "did you mean 'controller_server'"),
        ({"amcl": {"ros__parameters": {}}}, "found none"),
        ([1, 2], "expected the nodes of a nav2_params.yaml, got list"),
        (None, "the file is empty"),
        (costmap(plugins=["sonar"]), "sonar.plugin: expected the class of this layer"),
        (costmap(footprint="[[0, 0"), "footprint"),
        (costmap(width=0), "local_costmap.local_costmap.width: expected greater than 0"),
        (costmap(width=0, robot_radios=0.2), "robot_radios is no parameter, did you mean 'robot_radius'?"),
        (sample(velocity_smoother={"ros__parameters": {"max_accel": [1.0, 0.0]}}), "max_accel: expected three values"),
        (sample(velocity_smoother={"ros__parameters": {"max_decel": [1.0, 0.0, 1.0]}}), "expected no positive value"),
        (
            sample(Slow={"plugin": "dwb_core::DWBLocalPlanner", "PathDist.scale": 1, "PathDist": {"scale": 2}}),
            "PathDist",
        ),
        (
            sample(Slow={"plugin": "dwb_core::DWBLocalPlanner", "critics": ["PathDost"]}),
            "controller_server.Slow.critics: unknown critic 'PathDost'; did you mean 'PathDist'?",
        ),
        (mppi(critics=["CostCritc"]), "unknown critic 'CostCritc'; did you mean 'CostCritic'?"),
        (mppi(vx_max="<v>"), "FollowPath.vx_max: the template <v> has no value; give it one with --define v=VALUE"),
        (mppi(ax_max=3.0, reset_period=1.0), "mixes the distributions"),
    ],
)
def test_refusals_name_the_parameter_in_one_line(document, message):
    with pytest.raises(ConfigError) as raised:
        parse_nav2_params(document)
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_keys_that_nav2_ignores_are_listed_with_what_may_be_meant():
    document = mppi(CostCritic={"cost_wieght": 1.0}, zzz=1, vy_min=-0.5)
    document["velocity_smoother"]["ros__parameters"]["max_velocty"] = [1.0, 0.0, 1.0]
    server = "controller_server.FollowPath"
    found = {finding.name: (finding.kind, finding.why) for finding in parse_nav2_params(document).findings}
    assert found[f"{server}.CostCritic.cost_wieght"] == ("unknown", "did you mean 'CostCritic.cost_weight'?")
    assert found[f"{server}.zzz"] == ("unknown", "")
    assert found[f"{server}.vy_min"][0] == "other_release"
    assert found["velocity_smoother.max_velocty"] == ("unknown", "did you mean 'max_velocity'?")


def test_a_misspelt_name_is_said_with_what_is_missing_for_it():
    document = sample(Slow={"plugin": "dwb_core::DWBLocalPlanner", "critcs": ["PathDist"]})
    with pytest.raises(
        ConfigError, match=r"critics: expected at least .*critcs is no parameter, did you mean 'critics"
    ):
        parse_nav2_params(document)


LAUGHS = "a0: &a0 [x, x]\n" + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "just words",
        "controller_server: [1, 2",
        "controller_server:\n  ros__parameters:\n\t- x",
        b"\xff\xfe\x00\x01",
        b"\x00" * 100,
        "[" * 1000,
        LAUGHS + "controller_server: {ros__parameters: {controller_frequency: *a11}}",
        "controller_server: {ros__parameters: &loop {FollowPath: *loop, controller_plugins: [FollowPath]}}",
        "controller_server: &loop {ros__parameters: 3, inner: *loop}",
        "2020-99-99: 1",
        '"a\\nb": {planner_server: {ros__parameters: {"planner_plugins": "x\\ny"}}}',
    ],
)
def test_what_is_no_parameter_file_costs_one_line(text, write):
    path = write(text)
    with pytest.raises(ConfigError, match=r"nav2_params\.yaml'?: ") as raised:
        read_nav2_params(path)
    assert len(str(raised.value).splitlines()) == 1
    assert len(str(raised.value)) < 1000


def test_a_missing_file_and_a_directory_cost_one_line(tmp_path):
    for path in (tmp_path / "none.yaml", tmp_path):
        with pytest.raises(ConfigError, match="cannot be read"):
            read_nav2_params(path)


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_any_document_is_read_or_refused(data):
    junk = st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
        max_leaves=8,
    )
    document = sample()
    group = data.draw(st.sampled_from(_groups(document)))
    group[data.draw(st.sampled_from(list(group)) | st.text(max_size=8))] = data.draw(junk)
    with contextlib.suppress(ConfigError):
        parse_nav2_params(document)


def _groups(value):
    return [value, *(g for inner in value.values() if isinstance(inner, dict) for g in _groups(inner))]


# --- Presets ---------------------------------------------------------------------------------------------------------


def test_thesis_has_the_values_of_the_examples():
    thesis = load_preset("thesis")
    assert list(thesis.controllers) == ["dwb", "mppi", "rpp"]
    assert thesis.velocity_smoother == VelocitySmoother()
    assert thesis.controllers["dwb"].params["max_vel_x"] == 0.26
    assert thesis.controllers["mppi"].params["batch_size"] == 2000
    assert thesis.controllers["mppi"].params["CostCritic"]["consider_footprint"] is False
    assert thesis.controllers["rpp"].params["use_interpolation"] is False
    assert thesis.local_costmap == CostmapParams.example_local()
    assert thesis.global_costmap == CostmapParams.example_global()


def test_fair_gives_everybody_the_limits_of_the_robot():
    robot, fair = make_robot("turtlebot3_waffle"), load_preset("fair")
    dwb, mppi, rpp = (fair.controllers[name].params for name in ("dwb", "mppi", "rpp"))
    tops = {dwb["max_vel_x"], dwb["max_speed_xy"], mppi["vx_max"], rpp["desired_linear_vel"]}
    assert tops == {robot.max_linear_velocity}
    assert {dwb["max_vel_theta"], mppi["wz_max"], rpp["rotate_to_heading_angular_vel"]} == {robot.max_angular_velocity}
    assert {dwb["acc_lim_theta"], rpp["max_angular_accel"]} == {robot.max_angular_acceleration}
    assert dwb["acc_lim_x"] == robot.max_linear_acceleration
    assert fair.velocity_smoother.max_velocity == (robot.max_linear_velocity, 0.0, robot.max_angular_velocity)
    others = {"controllers": {}, "velocity_smoother": None}
    assert fair.replace(**others) == load_preset("thesis").replace(**others)


def test_an_unknown_preset_is_refused():
    with pytest.raises(ConfigError, match="unknown preset 'thesys'; did you mean 'thesis'"):
        load_preset("thesys")
