"""``mapbench export --format gazebo``: whose parameters, whose tree, for which release."""

from __future__ import annotations

import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from controllers.nav2_params import load_preset, read_nav2_params
from evolution.cli import build_parser, main
from evolution.commands.driving_options import drive_settings
from evolution.driving import DriveSettings
from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio import load_maps, load_scenarios
from gym_mapbench.mapio.runner_results import COLUMNS
from tests.mapio.samples import MOVINGAI_MAP, MOVINGAI_SCEN

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
OFFICE = str(EXAMPLES / "office.yaml")


def exported(folder, *options, source=OFFICE):
    assert main(["export", str(source), "--format", "gazebo", *options, "--out", str(folder)]) == 0
    return yaml.safe_load((folder / "nav2_params.yaml").read_text())


@pytest.mark.parametrize("preset", ["thesis", "jazzy", "lyrical"])
def test_a_bundle_is_of_the_release_whose_parameters_drive(tmp_path, preset):
    exported(tmp_path / "bundle", "--params", preset)
    read = read_nav2_params(tmp_path / "bundle" / "nav2_params.yaml")
    expected = load_preset(preset)
    assert read.recognition.release == expected.release
    assert read.navigation.controllers == expected.controllers
    assert read.navigation.planner == expected.planner
    assert read.navigation.velocity_smoother == expected.velocity_smoother
    tree = ElementTree.parse(tmp_path / "bundle" / "behavior_trees" / "mppi.xml").getroot()
    assert tree.get("BTCPP_format") == (None if preset == "thesis" else "4")
    assert float(tree.find(".//BackUp").get("backup_speed")) == expected.bt.backup_speed
    assert tree.find(".//FollowPath").get("controller_id") == "mppi"


@pytest.mark.parametrize("preset", ["thesis", "lyrical"])
def test_an_exported_file_names_the_first_controllers_tree_in_the_package(tmp_path, preset):
    written = exported(tmp_path / "bundle", "--params", preset, "--controllers", "rpp,dwb")
    named = written["bt_navigator"]["ros__parameters"]["default_nav_to_pose_bt_xml"]
    package = ElementTree.parse(tmp_path / "bundle" / "package.xml").getroot().findtext("name")
    assert named == f"$(find-pkg-share {package})/behavior_trees/rpp.xml"
    read = read_nav2_params(tmp_path / "bundle" / "nav2_params.yaml")
    assert read.navigation.bt.xml == (tmp_path / "bundle" / "behavior_trees" / "rpp.xml").read_text()
    assert read.asked_for == "rpp"
    assert read.named("left_out") == ()


def test_an_own_tree_is_exported_with_the_libraries_that_humble_loads_for_it(tmp_path):
    example = EXAMPLES / "own_tree.yaml"
    given = yaml.safe_load(example.read_text())["bt_navigator"]["ros__parameters"]
    written = exported(tmp_path / "bundle", "--params", str(example))["bt_navigator"]["ros__parameters"]
    assert written["plugin_lib_names"] == given["plugin_lib_names"]


@pytest.mark.parametrize(("form", "name"), [("map_server", "office.yaml"), ("mapset", "maps.mapset.json")])
def test_a_start_and_goal_of_the_command_line_are_written(tmp_path, form, name):
    argv = ["export", OFFICE, "--format", form, "--start", "0.8,2.2,0", "--goal", "2.5,2.2,0.1"]
    assert main([*argv, "--out", str(tmp_path / "out")]) == 0
    (scenario,) = load_scenarios(tmp_path / "out" / name)
    assert (scenario.start, scenario.goal) == ((0.8, 2.2, 0.0), (2.5, 2.2, 0.1))


@pytest.fixture
def three_maps(tmp_path):
    """A folder of two maps with a task and one without."""
    folder = tmp_path / "three"
    folder.mkdir()
    for name in ("a", "b", "open"):
        shutil.copy(EXAMPLES / "office.pgm", folder / f"{name}.pgm")
        (folder / f"{name}.yaml").write_text(Path(OFFICE).read_text().replace("office.pgm", f"{name}.pgm"))
        if name != "open":
            shutil.copy(EXAMPLES / "office_poses.yaml", folder / f"{name}_poses.yaml")
    return folder


@pytest.mark.parametrize(
    ("options", "names"),
    [
        (["--format", "map_server", "--map", "open,b"], ["b", "open"]),
        (["--format", "map_server"], ["a", "b", "open"]),
        (["--format", "mapset", "--map", "b", "--start", "0.8,2.2,0", "--goal", "2.5,2.2,0"], ["b"]),
        (["--format", "gazebo", "--map", "b", "--start", "0.8,2.2,0", "--goal", "2.5,2.2,0"], ["b"]),
    ],
)
def test_some_maps_may_be_chosen(three_maps, tmp_path, options, names):
    assert main(["export", str(three_maps), *options, "--out", str(tmp_path / "out")]) == 0
    written = tmp_path / "out" / ("maps.mapset.json" if "mapset" in options else "")
    assert [one.name for one in load_maps(written)] == names


def test_some_tasks_of_a_map_may_be_chosen(tmp_path):
    (tmp_path / "tiny.map").write_text(MOVINGAI_MAP)
    scen = tmp_path / "tiny.map.scen"
    scen.write_text(MOVINGAI_SCEN.replace("maps/", ""))
    argv = ["export", str(scen), "--format", "mapset", "--out", str(tmp_path / "out")]
    first, *_ = [one.name for one in load_scenarios(scen)]
    assert main([*argv, "--map", first]) == 0
    assert [one.name for one in load_scenarios(tmp_path / "out" / "maps.mapset.json")] == [first]


@pytest.mark.parametrize("form", ["map_server", "gazebo"])
def test_a_map_that_is_not_there_is_refused(tmp_path, capsys, form):
    argv = ["export", OFFICE, "--format", form, "--map", "offce", "--out", str(tmp_path / "out")]
    assert main(argv) == 2
    expected = "--map: unknown map 'offce'; did you mean 'office'? (expected one of: office)"
    assert capsys.readouterr().err == f"mapbench export: {expected}\n"
    assert not (tmp_path / "out").exists()


def test_gazebo_is_among_the_formats_that_an_error_names(tmp_path, capsys):
    assert main(["export", OFFICE, "--format", "ros2", "--out", str(tmp_path / "out")]) == 2
    assert "unknown map format 'ros2' (expected one of: barn, gazebo, image" in capsys.readouterr().err


def test_the_distribution_may_be_named_alone(tmp_path):
    exported(tmp_path / "bundle", "--nav2", "jazzy", "--controllers", "mppi")
    text = (tmp_path / "bundle" / "nav2_params.yaml").read_text()
    assert text.splitlines()[0] == "# Nav2 Jazzy."
    assert '#   mppi.noise: "numpy"' in text
    assert "(Jazzy)" in (tmp_path / "bundle" / "README.md").read_text()
    assert not list((tmp_path / "bundle").rglob("*.world"))


@pytest.mark.parametrize("release", ["humble", "jazzy", "lyrical"])
def test_controllers_that_no_preset_has_are_exported(tmp_path, release):
    names = ["dwb", "graceful", "shim_rpp"]
    written = exported(tmp_path / "bundle", "--nav2", release, "--controllers", ",".join(names))
    server = written["controller_server"]["ros__parameters"]
    assert server["controller_plugins"] == names
    assert server["graceful"]["plugin"] == "nav2_graceful_controller::GracefulController"
    assert server["shim_rpp"]["plugin"] == "nav2_rotation_shim_controller::RotationShimController"
    assert "nav2_graceful_controller" in (tmp_path / "bundle" / "package.xml").read_text()


@pytest.mark.parametrize(("preset", "other"), [("fair", "jazzy_fair"), ("thesis", "jazzy")])
def test_the_distribution_alone_keeps_the_limits_of_a_run(preset, other):
    recorded = DriveSettings.from_mapping(DriveSettings(navigation=preset).model_dump(mode="json"), "run")
    assert drive_settings(given("--nav2", "jazzy"), recorded).navigation == load_preset(other)
    assert drive_settings(given("--nav2", "humble"), recorded).navigation == load_preset(preset)


def test_parameters_of_ones_own_have_no_counterpart():
    fair = load_preset("fair")
    recorded = DriveSettings(navigation=fair.replace(planner=fair.planner.replace(name="smac_2d", params={})))
    assert drive_settings(given("--nav2", "humble"), recorded).navigation == recorded.navigation
    with pytest.raises(ConfigError, match="--nav2 jazzy: expected --params beside it, as these parameters"):
        drive_settings(given("--nav2", "jazzy"), recorded)


def given(*options):
    return build_parser().parse_args(["export", OFFICE, "--format", "gazebo", "--out", "bundle", *options])


USERS = """
controller_server:
  ros__parameters:
    costmap_update_timeout: 0.4
    controller_plugins: [FollowPath, Second]
    FollowPath:
      plugin: nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController
      transform_tolerance: 0.7
    Second:
      plugin: nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController
      transform_tolerance: 0.8
global_costmap:
  global_costmap:
    ros__parameters: {publish_frequency: 3.0, transform_tolerance: 0.6, map_topic: /other/map}
"""


@pytest.mark.parametrize(
    ("controllers", "tolerances"),
    [
        ([], {"FollowPath": 0.7, "Second": 0.8}),
        (["--controllers", "Second,rpp"], {"Second": 0.8, "rpp": 0.7}),
        (["--controllers", "slow=Second"], {"slow": 0.8}),
    ],
)
def test_what_only_ros_reads_comes_back_as_the_user_gave_it(tmp_path, controllers, tolerances):
    (tmp_path / "users.yaml").write_text(USERS)
    written = exported(tmp_path / "bundle", "--params", str(tmp_path / "users.yaml"), "--nav2", "humble", *controllers)
    server = written["controller_server"]["ros__parameters"]
    assert server["controller_plugins"] == list(tolerances)
    assert {name: server[name]["transform_tolerance"] for name in tolerances} == tolerances
    assert {name for name in server if name in ("FollowPath", "Second")} <= set(tolerances)
    assert server["costmap_update_timeout"] == 0.4
    costmap = written["global_costmap"]["global_costmap"]["ros__parameters"]
    assert (costmap["publish_frequency"], costmap["transform_tolerance"]) == (3.0, 0.6)
    assert "map_topic" not in costmap


@pytest.mark.parametrize(
    ("options", "controllers"),
    [
        ([], ["dwb", "mppi", "rpp"]),
        (["--params", "jazzy"], ["dwb", "mppi", "rpp"]),
        (["--params", "users.yaml", "--nav2", "humble"], ["FollowPath", "Second"]),
        (["--controllers", "mppi"], ["mppi"]),
    ],
)
def test_the_maps_of_a_run_are_exported_with_its_controllers_unless_a_file_names_others(
    study_path, tmp_path, monkeypatch, options, controllers
):
    monkeypatch.chdir(tmp_path)
    Path("users.yaml").write_text(USERS)
    written = exported(Path("package"), *options, source=study_path / "runs" / "gini_6" / "seed-0000")
    assert written["controller_server"]["ros__parameters"]["controller_plugins"] == controllers


def test_the_lidar_of_the_bundle_is_the_robots(tmp_path):
    exported(tmp_path / "bundle", "--robot", "turtlebot3_burger")
    model = ElementTree.parse(tmp_path / "bundle" / "models" / "mapbench_robot" / "model.sdf").getroot()
    lidar = model.find(".//sensor[@name='lidar']")
    assert lidar.findtext("pose").split()[0] == "-0.032"
    assert lidar.findtext("ray/range/min") == "0.12"


def test_a_bundle_is_no_benchmark_though_its_file_is_called_so(tmp_path, capsys):
    exported(tmp_path / "bundle")
    (tmp_path / "results.csv").write_text(",".join(COLUMNS) + "\n")
    argv = ["import-results", str(tmp_path / "results.csv"), "--ours", str(tmp_path / "bundle")]
    assert main(argv) == 2
    assert "expected a directory of results, got a ROS 2 package for Gazebo" in capsys.readouterr().err
