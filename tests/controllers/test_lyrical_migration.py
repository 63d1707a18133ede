"""Files of Humble and Jazzy that are migrated to Lyrical, and back."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from controllers.nav2_params import parse_nav2_params
from controllers.nav2_params.file.document import read_document
from controllers.nav2_params.file.yaml_edits import Edits, entries
from controllers.nav2_params.migration import migrate_file
from tests.oracle_data import DATA, needs_data

RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "nav2_params.yaml"
JAZZY = """
controller_server:
  ros__parameters:
    controller_frequency: 20.0  # Hz
    progress_checker_plugins: ["progress_checker"]
    goal_checker_plugins: ["goal_checker"]
    controller_plugins: ["FollowPath", "Precise"]
    goal_checker: {plugin: "nav2_controller::SimpleGoalChecker", xy_goal_tolerance: 0.1}
    FollowPath:
      plugin: "nav2_mppi_controller::MPPIController"
      prune_distance: 1.2  # m
      motion_model: "Ackermann"
      ax_max: 2.0
      AckermannConstraints:
        min_turning_r: 0.4
      critics: ["GoalCritic"]
    Precise:
      plugin: "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
      desired_linear_vel: 0.3  # slow
      stateful: true
behavior_server:
  ros__parameters:
    local_costmap_topic: local_costmap/costmap_raw
    behavior_plugins: ["backup"]
    backup:
      plugin: "nav2_behaviors::BackUp"
bt_navigator:
  ros__parameters:
    action_server_result_timeout: 900.0
    error_code_names:
      - compute_path_error_code
      - my_error_code
velocity_smoother:
  ros__parameters:
    max_velocity: [0.5, 0.0, 2.0]
"""
SHIM = """
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: nav2_rotation_shim_controller::RotationShimController
      primary_controller: nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController
      # The shim's own:
      angular_dist_threshold: 0.7
      max_angular_accel: 2.0
      # The primary controller's:
      desired_linear_vel: 0.3  # slow
      lookahead_dist: 0.5
      max_robot_pose_search_dist: 8.0
      use_interpolation: true
"""
UNSTAMPED = "since Jazzy publishes Twist by default; Kilted publishes TwistStamped"


@pytest.fixture
def migrate(tmp_path):
    def migrate(text, target, source=None):
        path = tmp_path / "params.yaml"
        path.write_text(text)
        return migrate_file(path, target, source)

    return migrate


def parameters(text, node="controller_server"):
    return yaml.safe_load(text)[node]["ros__parameters"]


def controllers(text, release=None):
    return parse_nav2_params(yaml.safe_load(text), release=release).navigation.controllers


def test_a_file_of_jazzy_becomes_one_of_lyrical(migrate):
    migration = migrate(JAZZY, "lyrical")
    assert (migration.source, migration.target) == ("jazzy", "lyrical")
    for comment in ("# Hz", "# slow"):
        assert comment in migration.text
    server = parameters(migration.text)
    assert server["PathHandler"] == {"plugin": "nav2_controller::FeasiblePathHandler", "prune_distance": 1.2}
    group = server["FollowPath"]
    assert group["motion_model"] == "ackermann"
    assert group["ackermann"] == {"plugin": "mppi::AckermannMotionModel", "min_turning_r": 0.4}
    assert not {"prune_distance", "AckermannConstraints"} & group.keys()
    assert server["Precise"]["max_linear_vel"] == 0.3
    assert parameters(migration.text, "bt_navigator") == {"error_code_name_prefixes": ["compute_path", "my"]}
    assert parameters(migration.text, "velocity_smoother")["enable_stamped_cmd_vel"] is False
    read = parse_nav2_params(yaml.safe_load(migration.text))
    assert (read.recognition.release, read.recognition.against) == ("lyrical", ())
    assert not read.named("other_release")
    assert read.navigation.controllers["FollowPath"].params["AckermannConstraints"] == {"min_turning_r": 0.4}


@pytest.mark.parametrize("target", ["humble", "jazzy", "lyrical"])
def test_other_nodes_keep_their_parameters(migrate, target):
    """slam_toolbox has a transform_timeout of its own; drivers of robots have an enable_stamped_cmd_vel, too."""
    own_names = {"transform_timeout": 0.2, "enable_stamped_cmd_vel": True, "action_server_result_timeout": 3.0}
    other = yaml.safe_dump({"slam_toolbox": {"ros__parameters": own_names}})
    own = "recoveries_server:\n  ros__parameters: {transform_timeout: 0.1}\n"
    text = migrate(f"{JAZZY}{other}{own}", target).text
    assert parameters(text, "slam_toolbox") == own_names
    assert parameters(text, "behavior_server") == {"transform_tolerance": 0.1}


def test_a_node_that_loses_its_last_parameter_still_has_a_value(migrate):
    """ROS reads no file with a key that has no value, so no node would start."""
    tree = "  ros__parameters:\n    plugin_lib_names:\n      - nav2_wait_action_bt_node\n"
    text = f"bt_navigator:\n{tree}velocity_smoother:\n  ros__parameters: {{smoothing_frequency: 20.0}}\n"
    assert yaml.safe_load(migrate(text, "jazzy", "humble").text)["bt_navigator"] == {"ros__parameters": {}}


def test_every_rename_and_every_default_that_changes_the_run_has_a_line(migrate):
    migration = migrate(JAZZY, "lyrical")
    assert list(migration.done) == [
        "line 19: controller_server.Precise.desired_linear_vel: renamed to max_linear_vel",
        "line 11: controller_server.FollowPath.prune_distance: moved to PathHandler.prune_distance",
        "controller_server.path_handler_plugins: PathHandler inserted; it cuts the plan for all controllers",
        "controller_server.FollowPath: new in Lyrical and at its default: model_delay_vx 0.0, model_delay_vy 0.0, "
        "model_delay_wz 0.0, clamp_raw_controls False, sgf_order 2, TrajectoryValidator.collision_lookahead_time 2.0, "
        "TrajectoryValidator.consider_footprint False",
        "controller_server.Precise: new in Lyrical and at its default: use_dynamic_window False, min_linear_vel -0.5, "
        "max_angular_vel 2.5, min_angular_vel -2.5, max_linear_accel 2.5, max_linear_decel -2.5, max_angular_decel "
        "-3.2, min_distance_to_obstacle -1.0, allow_obstacle_checking_beyond_goal False",
        "controller_server.FollowPath.motion_model: now ackermann, a block with the class mppi::AckermannMotionModel",
        f"controller_server.enable_stamped_cmd_vel: written out as false, {UNSTAMPED}",
        "controller_server.goal_checker: new in Lyrical and at its default: path_length_tolerance 1.0: the goal is not "
        "reached while more of the local plan is left",
        f"behavior_server.enable_stamped_cmd_vel: written out as false, {UNSTAMPED}",
        "behavior_server.backup: new in Lyrical and at its default: acceleration_limit 2.5, deceleration_limit -2.5, "
        "minimum_speed 0.1: the robot slows down before the end",
        "line 30: bt_navigator.error_code_names: renamed to error_code_name_prefixes",
        f"velocity_smoother.enable_stamped_cmd_vel: written out as false, {UNSTAMPED}",
    ]
    assert list(migration.lost) == [
        "line 20: controller_server.Precise.stateful: taken out: in Lyrical the goal checker alone is stateful",
        "line 29: bt_navigator.action_server_result_timeout: taken out: Lyrical has no such parameter",
    ]


@pytest.mark.parametrize(
    ("before", "after", "key"),
    [
        (
            "    max_velocity:",
            "    service_introspection_mode: disabled\n    max_velocity:",
            "velocity_smoother.service_introspection_mode",
        ),
        ("error_code_names:", "error_code_name_prefixes:", "bt_navigator.error_code_name_prefixes"),
    ],
)
def test_a_file_of_kilted_publishes_stamped_commands_already(migrate, before, after, key):
    kilted = JAZZY.replace(before, after)
    migration = migrate(kilted, "lyrical")
    assert "enable_stamped_cmd_vel" not in migration.text
    assert migration.done[0] == f"{key}: a key of Kilted, which publishes TwistStamped by default"
    older = migrate(kilted, "jazzy")
    for node in ("controller_server", "behavior_server", "velocity_smoother"):
        assert parameters(older.text, node)["enable_stamped_cmd_vel"] is True
    said = migrate(kilted, "lyrical", "jazzy")
    assert parameters(said.text)["enable_stamped_cmd_vel"] is False


def test_a_default_of_the_controller_becomes_the_path_handlers(migrate):
    text = JAZZY.replace("      prune_distance: 1.2  # m\n", "")
    migration = migrate(text, "lyrical")
    assert parameters(migration.text)["PathHandler"]["prune_distance"] == 1.5
    assert "PathHandler.prune_distance: written out as 1.5, Jazzy's default of " in "\n".join(migration.done)


@pytest.mark.parametrize("target", ["humble", "jazzy"])
def test_a_parameter_that_is_written_out_is_not_at_its_default(migrate, target):
    lyrical = migrate(JAZZY.replace("prune_distance: 1.2", "prune_distance: 0.7"), "lyrical").text
    done = migrate(lyrical, target).done
    written = "controller_server.FollowPath.prune_distance: written out as 0.7, the path handler's prune_distance"
    assert written in done
    (new,) = [line for line in done if line.startswith("controller_server.FollowPath: new in")]
    assert " prune_distance" not in new
    assert "inversion_xy_tolerance 0.2" in new


def test_the_round_trip_through_lyrical_keeps_the_controllers(migrate):
    text = JAZZY.replace("      stateful: true\n", "")
    back = migrate(migrate(text, "lyrical").text, "jazzy")
    assert back.source == "lyrical"
    assert controllers(back.text) == controllers(text)
    assert "PathHandler" not in back.text
    assert parameters(back.text, "bt_navigator")["error_code_names"] == ["compute_path_error_code", "my_error_code"]


@pytest.mark.parametrize("target", ["humble", "jazzy"])
def test_the_legacy_inflation_layer_is_the_layer_of_older_releases(migrate, target):
    layer = "{plugin: nav2_costmap_2d::LegacyInflationLayer, inflation_radius: 0.4}"
    text = f"local_costmap: {{local_costmap: {{ros__parameters: {{plugins: [old], old: {layer}}}}}}}\n"
    migration = migrate(text, target, "lyrical")
    assert text.replace("Legacy", "") == migration.text
    wanted = "local_costmap.local_costmap.old.plugin: written nav2_costmap_2d::InflationLayer, which finds the same"
    assert any(wanted in line for line in migration.done)
    assert migrate(text, "lyrical", "lyrical").text == text


def test_a_rotation_shims_primary_controller_gets_a_block_and_gives_it_back(migrate):
    migration = migrate(SHIM, "lyrical", "humble")
    assert "# slow" in migration.text
    assert parameters(migration.text)["FollowPath"] == {
        "plugin": "nav2_rotation_shim_controller::RotationShimController",
        "primary_controller.plugin": "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
        "primary_controller.max_angular_accel": 2.0,
        "angular_dist_threshold": 0.7,
        "angular_disengage_threshold": 0.785,
        "max_angular_accel": 2.0,
        "primary_controller.max_linear_vel": 0.3,
        "primary_controller.lookahead_dist": 0.5,
    }
    assert parameters(migration.text)["PathHandler"]["max_robot_pose_search_dist"] == 8.0
    params = controllers(migration.text)["FollowPath"].params
    assert (params["desired_linear_vel"], params["primary_controller"]["max_angular_accel"]) == (0.3, 2.0)
    back = migrate(migration.text, "humble")
    assert controllers(back.text) == controllers(SHIM)


def test_a_block_of_a_primary_controller_moves_to_the_left(migrate):
    text = """
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: nav2_rotation_shim_controller::RotationShimController
      primary_controller:  # MPPI
        # It needs a motion model:
        plugin: nav2_mppi_controller::MPPIController
        motion_model: omni
        omni:
          plugin: mppi::OmniMotionModel
        critics: [GoalCritic, PathAngleCritic]
        PathAngleCritic:
          mode: 1  # none
      angular_dist_threshold: 0.5
    PathHandler:
      plugin: nav2_controller::FeasiblePathHandler
      prune_distance: 1.1
"""
    migration = migrate(text, "jazzy")
    group = parameters(migration.text)["FollowPath"]
    assert group == {
        "plugin": "nav2_rotation_shim_controller::RotationShimController",
        "primary_controller": "nav2_mppi_controller::MPPIController",
        "motion_model": "Omni",
        "prune_distance": 1.1,
        "critics": ["GoalCritic", "PathAngleCritic"],
        "PathAngleCritic": {"mode": 1},
        "angular_dist_threshold": 0.5,
    }
    for comment in ("# It needs a motion model:", "# none"):
        assert comment in migration.text
    assert "PathHandler" not in migration.text


def test_parameters_that_begin_to_count_have_a_line(migrate):
    text = JAZZY.replace("stateful: true", "use_dynamic_window: true")
    migration = migrate(text, "lyrical", "jazzy")
    line = "line 20: controller_server.Precise.use_dynamic_window: counts in Lyrical, and not in Jazzy"
    assert line in migration.done


def test_an_insert_survives_the_removal_of_the_first_parameter():
    text = "a:\n  b: 1\n  c: 2\n"
    root = yaml.compose(text)
    found = {entry.name: entry for entry in entries(root)}
    edits = Edits(text)
    edits.insert(found["a"].value, "new", 3)
    edits.remove(found["a.b"])
    assert yaml.safe_load(edits.apply()) == {"a": {"new": 3, "c": 2}}


def test_the_committed_example_is_migrated(migrate):
    migration = migrate(EXAMPLE.read_text(), "lyrical")
    read = parse_nav2_params(yaml.safe_load(migration.text))
    assert (read.recognition.release, read.recognition.against) == ("lyrical", ())
    assert not read.named("other_release")


@needs_data
@pytest.mark.parametrize("path", sorted((DATA / "nav2_params").glob("*.yaml")), ids=lambda path: path.stem)
def test_published_files_keep_their_meaning_on_the_way_through_lyrical(path, tmp_path):
    before = migrate_file(path, "lyrical")
    (tmp_path / "lyrical.yaml").write_text(before.text)
    (tmp_path / "back.yaml").write_text(migrate_file(tmp_path / "lyrical.yaml", before.source).text)
    first, back = (parse_nav2_params(read_document(file)) for file in (path, tmp_path / "back.yaml"))
    assert back.recognition.release == first.recognition.release
    lost = {line.partition(": ")[2].partition(":")[0].rpartition(".")[2] for line in before.lost}
    for name, plugin in first.navigation.controllers.items():
        ours, theirs = plugin.params, back.navigation.controllers[name].params
        assert {key for key in ours if ours[key] != theirs[key]} <= lost | {"ObstaclesCritic"}


@pytest.mark.parametrize("seed", ["1", "4", "7"])
def test_the_report_has_one_order_whatever_the_seed_of_hashes(tmp_path, seed):
    names = ("min_linear_vel", "max_angular_vel", "max_linear_accel", "max_linear_decel", "max_angular_decel")
    path = tmp_path / "nav2_params.yaml"
    controller = {"plugin": RPP, **dict.fromkeys(names, 1.0)}
    server = {"controller_plugins": ["FollowPath"], "FollowPath": controller}
    path.write_text(yaml.safe_dump({"controller_server": {"ros__parameters": server}}, sort_keys=False))
    script = (
        "import sys; from controllers.nav2_params.migration import migrate_file; "
        "print(*migrate_file(sys.argv[1], 'lyrical', 'jazzy').done, sep='\\n')"
    )
    environment = {**os.environ, "PYTHONHASHSEED": seed}
    command = [sys.executable, "-c", script, path]
    said = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert said.stdout.splitlines() == list(migrate_file(path, "lyrical", "jazzy").done)
    assert "max_linear_accel: counts in Lyrical" in said.stdout
