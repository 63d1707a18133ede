"""``mapbench params``, and the options that say how a parameter file is read."""

from __future__ import annotations

import pytest
import yaml

from controllers.nav2_params import load_preset, parse_nav2_params, read_nav2_params
from controllers.tree_xml.reading import read_tree
from evolution.cli import main
from evolution.commands import COMMON, driving_options, options
from evolution.commands.parameter_file import add_reading_options, shared_defines
from evolution.driving import DriveSettings
from gym_mapbench.errors import ConfigError
from gym_mapbench.planners import PLANNERS
from tests.controllers.trees import FOLLOW, PLAN, xml_of
from tests.evolution.commands.test_cli import OFFICE

HUMBLE = """
controller_server:
  ros__parameters:
    controller_frequency: 50.0  # faster than our world
    progress_checker_plugin: "progress_checker"
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: "nav2_mppi_controller::MPPIController"
      vx_max: 0.6
      reset_period: 1.0  # only in Humble
      critics: ["GoalCritic", "PathAngleCritic", "ObstaclesCritic", "PathAlignLegacyCritic"]
      PathAngleCritic:
        forward_preference: false
      PathAlignLegacyCritic: {offset_from_furthest: 10, cost_weight: 7.0}
local_costmap:
  local_costmap:
    ros__parameters:
      footprint: "[[<x>, 0.1], [-0.1, 0.1], [-0.1, -0.1], [<x>, -0.1]]"
      inflation_layer: {plugin: "nav2_costmap_2d::InflationLayer", inflation_radius: 0.6, cost_scaling_factor: 4.0}
planner_server:
  ros__parameters:
    GridBased: {plugin: "nav2_navfn_planner/NavfnPlanner", tolerance: 0.3}
recoveries_server:
  ros__parameters:
    recovery_plugins: ["spin"]
    costmap_topic: local_costmap/costmap_raw
    global_frame: odom
    spin: {plugin: "nav2_recoveries/Spin"}
bt_navigator:
  ros__parameters:
    plugin_lib_names:
    - nav2_spin_action_bt_node
    - my_own_bt_node
"""
TEB = "controller_server: {ros__parameters: {controller_plugins: [F], F: {plugin: teb_local_planner::Teb}}}\n"


@pytest.fixture
def humble(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(HUMBLE)
    return path


def parsed(*argv):
    return main(["params", *map(str, argv)])


def converted(tmp_path, path, target):
    out = tmp_path / f"{target}.yaml"
    assert parsed("convert", path, "--to", target, "--out", out) == 0
    return out


def test_check_says_what_a_file_means(humble, capsys):
    assert parsed("check", humble) == 0
    said = capsys.readouterr().out
    assert "read as Nav2 Humble, as planner_server.GridBased.plugin (line 22) tells" in said
    assert "drives: FollowPath (MPPI); plans: NavFn" in said
    assert "radius 0.22 m, 0.6 m/s forwards" in said
    assert "left to the robot: local_costmap.local_costmap.footprint (line 18): <x> has no value" in said
    assert parsed("check", humble, "--define", "x=0.2", "--nav2", "jazzy", "--verbose") == 2
    assert "only Nav2 Humble has the critic 'PathAlignLegacyCritic'" in capsys.readouterr().err
    assert parsed("check", humble, "--define", "x=0.2") == 0
    assert "footprint (-0.1, -0.1) (0.2, -0.1) (0.2, 0.1) (-0.1, 0.1)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["check", "thesis"], "expected a parameter file"),
        (["check", "nowhere.yaml"], "nowhere.yaml"),
        (["check", "FILE", "--define", "y=1"], "unknown template 'y'"),
        (["check", "FILE", "--define", "x"], "expected NAME=VALUE"),
        (["check", "FILE", "--only", "teb"], "unknown controller 'teb'"),
        (["check", "FILE", "--robot", "burger"], "did you mean 'turtlebot3_burger'"),
        (["convert", "FILE", "--to", "humble", "--out", "FILE"], "expected a new file"),
        (["convert", "nowhere.yaml", "--to", "humble"], "cannot be read"),
        (["convert", "FILE"], "expected --nav2 with the distribution to convert for, humble or jazzy or lyrical"),
        (["bench", "--only", "dwb"], "--only: expected a parameter file"),
        (["bench", "--params", "fair", "--nav2", "jazzy"], "--nav2 jazzy: the preset fair is for Nav2 Humble"),
    ],
)
def test_refusals_are_one_line(humble, argv, said, capsys):
    argv = [str(humble) if word == "FILE" else word for word in argv]
    command = [argv[0], "barn.yaml", *argv[1:]] if argv[0] == "bench" else ["params", *argv]
    if argv[0] == "bench":
        command[1] = "examples/office.yaml"
    assert main(command) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1


def test_convert_renames_writes_out_exchanges_and_lists(humble, tmp_path, capsys):
    out = converted(tmp_path, humble, "jazzy")
    text, said = out.read_text(), capsys.readouterr().err
    assert "# faster than our world" in text  # comments stay
    assert "<x>" in text  # and templates
    server = yaml.safe_load(text)["controller_server"]["ros__parameters"]
    assert server["progress_checker_plugins"] == ["progress_checker"]
    group = server["FollowPath"]
    assert "reset_period" not in group
    assert group["critics"] == ["GoalCritic", "PathAngleCritic", "ObstaclesCritic", "PathAlignCritic"]
    assert group["PathAlignCritic"] == {"offset_from_furthest": 10, "cost_weight": 7.0}
    assert group["PathAngleCritic"] == {"mode": 1, "cost_weight": 2.0, "max_angle_to_furthest": 1.2}
    assert group["ObstaclesCritic.collision_cost"] == 10000.0
    behaviors = yaml.safe_load(text)["behavior_server"]["ros__parameters"]
    assert behaviors == {
        "behavior_plugins": ["spin"],
        "local_costmap_topic": "local_costmap/costmap_raw",
        "local_frame": "odom",
        "spin": {"plugin": "nav2_behaviors::Spin"},
    }
    assert yaml.safe_load(text)["bt_navigator"]["ros__parameters"] == {"plugin_lib_names": ["my_own_bt_node"]}
    for line in (
        "line 10: controller_server.FollowPath.reset_period: taken out",
        "written out as 1.2, Humble's default",
        "new in Jazzy and at its default: ax_max 3.0",
    ):
        assert line in said


def test_the_target_is_named_by_nav2_alone_or_by_to(humble, capsys):
    assert parsed("convert", humble, "--nav2", "lyrical") == 0
    first = capsys.readouterr()
    assert "from Nav2 Humble to Lyrical" in first.err
    assert parsed("convert", humble, "--to", "lyrical", "--nav2", "humble") == 0
    assert capsys.readouterr() == first
    assert yaml.safe_load(first.out)["controller_server"]["ros__parameters"]["PathHandler"]["prune_distance"] == 1.5


def test_a_converted_file_is_recognised_as_what_it_is_and_comes_back(humble, tmp_path):
    jazzy = converted(tmp_path, humble, "jazzy")
    read = parse_nav2_params(yaml.safe_load(jazzy.read_text()))
    assert read.recognition.release == "jazzy"
    assert not read.named("other_release")
    back = converted(tmp_path, jazzy, "humble")
    text = back.read_text()
    assert "global_frame: odom" in text
    assert "local_frame" not in text
    read = parse_nav2_params(yaml.safe_load(text))
    assert (read.recognition.release, read.recognition.against) == ("humble", ())
    assert not read.named("other_release")
    params = read.navigation.controllers["FollowPath"].params
    assert params["PathAngleCritic"]["forward_preference"] is False
    assert params["PathAngleCritic"]["max_angle_to_furthest"] == 1.2
    critic = params["ObstaclesCritic"]
    assert (critic["inflation_radius"], critic["cost_scaling_factor"], critic["collision_cost"]) == (0.6, 4.0, 10000.0)


def test_converting_to_its_own_release_changes_old_names_alone(humble, tmp_path):
    text = converted(tmp_path, humble, "humble").read_text()
    changed = {line for line in text.splitlines() if line not in HUMBLE.splitlines()}
    assert changed == {
        "behavior_server:",
        '    behavior_plugins: ["spin"]',
        "    spin: {plugin: nav2_behaviors/Spin}",
    }


def test_converting_gives_foxys_back_up_todays_name(humble, tmp_path):
    foxy = 'recovery_plugins: ["spin", "back_up"]\n    back_up.plugin: a/B'
    humble.write_text(HUMBLE.replace('recovery_plugins: ["spin"]', foxy))
    text = converted(tmp_path, humble, "humble").read_text()
    assert "    behavior_plugins: [spin, backup]\n    backup.plugin: a/B\n" in text


@pytest.mark.parametrize(("tree", "kept"), [("default_bt_xml_filename", None), ("/opt/tree.xml", "/opt/tree.xml")])
def test_a_tree_that_an_older_launch_file_gave_is_no_file(tree, kept, humble, tmp_path, capsys):
    given = yaml.safe_load(HUMBLE)
    given["bt_navigator"]["ros__parameters"]["default_bt_xml_filename"] = tree
    humble.write_text(yaml.safe_dump(given))
    node = yaml.safe_load(converted(tmp_path, humble, "jazzy").read_text())["bt_navigator"]["ros__parameters"]
    assert node.get("default_nav_to_pose_bt_xml") == kept
    assert "default_bt_xml_filename" not in node
    assert ("taken out: a word that an older launch file replaces" in capsys.readouterr().err) == (kept is None)


def test_converting_finds_nodes_inside_a_node(humble, tmp_path):
    inside = "local_costmap:\n  ros__parameters: {use_sim_time: true}\n  local_costmap:\n"
    layers = "observation_sources: scan, scan: {obstacle_range: 2.0}"
    layer = f"      obstacle_layer: {{plugin: 'nav2_costmap_2d::ObstacleLayer', {layers}}}\n      footprint:"
    text = HUMBLE.replace("local_costmap:\n  local_costmap:\n", inside).replace("      footprint:", layer)
    humble.write_text(text)
    assert "{obstacle_max_range: 2.0}" in converted(tmp_path, humble, "humble").read_text()


def test_the_world_keeps_up_with_the_files_controller_and_robot(humble, capsys):
    parser = options.argparse.ArgumentParser()
    driving_options.add_drive_options(parser)
    driving_options.add_controllers_option(parser)
    args = parser.parse_args(["--params", str(humble), "--define", "x=0.2"], options.argparse.Namespace(**COMMON))
    settings = driving_options.drive_settings(args)
    assert (settings.environment.control_hz, settings.environment.physics_hz) == (50.0, 100.0)
    assert settings.environment.robot.footprint is not None
    assert settings.environment.robot.max_linear_velocity == 0.6
    assert [spec.name for spec in driving_options.named_controllers(args)] == ["FollowPath"]
    assert "mine.yaml: read as Nav2 Humble" in capsys.readouterr().err
    fast = humble.with_name("fast.yaml")
    fast.write_text("velocity_smoother: {ros__parameters: {max_velocity: [8.0, 0.0, 2.0]}}")
    args = parser.parse_args(["--params", str(fast)], options.argparse.Namespace(**COMMON))
    world = driving_options.drive_settings(args).environment
    assert (world.robot.max_linear_velocity, world.control_hz, world.physics_hz) == (8.0, 20.0, 160.0)


def test_the_world_keeps_up_with_the_robot_of_the_command(tmp_path):
    parser = options.argparse.ArgumentParser()
    driving_options.add_drive_options(parser)
    speeds = {8.1: 180.0, 5.0: 100.0}
    for speed, physics in speeds.items():
        file = tmp_path / "fast.yaml"
        file.write_text(f"{{max_linear_velocity: {speed}, radius: 0.3}}")
        args = parser.parse_args(["--robot", str(file)], options.argparse.Namespace(**COMMON))
        settings = driving_options.drive_settings(args)
        assert (settings.environment.control_hz, settings.environment.physics_hz) == (20.0, physics)
        assert (settings.robot.name, settings.robot.max_linear_velocity) == ("fast", speed)
        assert settings.navigation.local_costmap.robot_radius is None


def test_only_drives_with_another_controller_than_the_files(tmp_path):
    path = tmp_path / "teb.yaml"
    path.write_text(TEB)
    parser = options.argparse.ArgumentParser()
    add_reading_options(parser)
    driving_options.add_controllers_option(parser)
    parser.add_argument("--params")
    with pytest.raises(ConfigError, match=r"line 1: .*--only"):
        driving_options.named_controllers(parser.parse_args(["--params", str(path)]))
    args = parser.parse_args(["--params", str(path), "--only", "rpp"])
    assert [spec.name for spec in driving_options.named_controllers(args)] == ["rpp"]
    args = parser.parse_args(["--params", str(path), "--controllers", "dwb,rpp"])
    assert [spec.name for spec in driving_options.named_controllers(args)] == ["dwb", "rpp"]


def test_each_of_several_files_gets_the_values_of_its_own_templates(humble, tmp_path):
    other = tmp_path / "other.yaml"
    other.write_text("controller_server: {ros__parameters: {controller_frequency: <hz>}}\n")
    paths = [str(humble), str(other), "fair"]
    assert shared_defines(["x=0.2", "hz=10"], paths) == {paths[0]: ["x=0.2"], paths[1]: ["hz=10"], "fair": []}
    assert all(found == ["y=1"] for found in shared_defines(["y=1"], paths).values())
    argv = ["bench", OFFICE, "--params", "fair", "--params", str(humble), "--controllers", "rpp", "--time-limit", "1"]
    assert main([*argv, "--define", "x=0.2", "--workers", "1", "--format", "json"]) == 0


def test_a_config_says_how_a_file_is_read(humble, tmp_path):
    path = tmp_path / "teb.yaml"
    path.write_text(TEB)
    settings = DriveSettings(navigation={"params": str(humble), "nav2": "humble", "define": {"x": "0.2"}})
    assert settings.navigation.local_costmap.footprint[0] == (0.2, 0.1)
    assert list(DriveSettings(navigation={"params": str(path), "only": "dwb"}).navigation.controllers) == ["dwb"]
    with pytest.raises(ConfigError, match=r"navigation: .*unknown key 'nav'; did you mean 'nav2'"):
        DriveSettings(navigation={"params": str(humble), "nav": "humble"})


class TestAChangedPreset:
    def test_only_what_is_named_changes(self):
        fair = DriveSettings(navigation="fair").navigation
        changed = DriveSettings(navigation={"preset": "fair", "local_costmap": {"width": 4}}).navigation
        assert changed == fair.replace(local_costmap=fair.local_costmap.replace(width=4))
        assert DriveSettings(navigation={"preset": "fair"}).navigation == fair

    def test_a_planner_of_another_name_has_its_own_parameters(self):
        navfn = {"preset": "jazzy_fair", "planner": {"params": {"tolerance": 0.25}}}
        params = DriveSettings(navigation=navfn).navigation.planner.params
        assert (params["tolerance"], params["release"]) == (0.25, "jazzy")
        smac = {"preset": "fair", "planner": {"name": "smac_2d", "params": {"tolerance": 0.25}}}
        planner = DriveSettings(navigation=smac).navigation.planner
        assert (planner.name, planner.params["tolerance"]) == ("smac_2d", 0.25)

    @pytest.mark.parametrize(
        ("navigation", "message"),
        [
            ({"planner": {"name": "smac_2d"}}, "expected one of the keys preset, params or controllers, got planner"),
            ({}, "got none"),
            ({"preset": "fai"}, "did you mean 'fair'"),
            ({"preset": "fair", "plannr": {}}, "did you mean 'planner'"),
        ],
    )
    def test_bad_changes_are_one_line(self, navigation, message):
        with pytest.raises(ConfigError, match=message) as caught:
            DriveSettings(navigation=navigation)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("preset", ["thesis", "jazzy", "lyrical"])
def test_a_planner_of_the_command_line_is_of_the_parameters_release(preset):
    parser = options.argparse.ArgumentParser()
    driving_options.add_drive_options(parser)
    own = load_preset(preset)
    for name in PLANNERS.built_in:
        given = parser.parse_args(["--params", preset, "--planner", name], options.argparse.Namespace(**COMMON))
        planner = driving_options.drive_settings(given).navigation.planner
        assert planner.name == name
        assert planner.params.get("release", own.release) == own.release
        assert planner.costmap_update_timeout == own.planner.costmap_update_timeout


@pytest.mark.parametrize("named", ["trees/mine.xml", "$(find-pkg-share mine)/trees/mine.xml"])
def test_convert_brings_the_tree_that_the_new_folder_lacks(tmp_path, capsys, named):
    tree, included = (
        xml_of('<SubTree ID="Inside" _autoremap="true"/>'),
        f'<BehaviorTree ID="Inside"><Sequence>{PLAN}{FOLLOW}</Sequence></BehaviorTree>',
    )
    files = {
        "mine.yaml": f"bt_navigator: {{ros__parameters: {{default_nav_to_pose_bt_xml: {named}}}}}\n",
        "trees/mine.xml": tree.replace("<BehaviorTree", '<include path="inside.xml"/><BehaviorTree', 1),
        "trees/inside.xml": f"<root>{included}</root>",
    }
    for name, text in files.items():
        (tmp_path / "from" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "from" / name).write_text(text)
    (tmp_path / "to").mkdir()
    for out in ("from/jazzy.yaml", "to/jazzy.yaml"):
        argv = ["convert", str(tmp_path / "from" / "mine.yaml"), "--to", "jazzy", "--nav2", "humble", "--out"]
        assert main(["params", *argv, str(tmp_path / out)]) == 0
        read = read_nav2_params(tmp_path / out, release="jazzy")
        assert [node.name for node in read_tree(read.navigation.bt.xml, "jazzy").walk()][1:] == [
            "ComputePathToPose",
            "FollowPath",
        ]
    assert "mine.xml: the behaviour tree of" in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.glob("*/*.xml")) == ["mine.xml"]


@pytest.mark.parametrize(
    ("inside", "refusal"),
    [
        (f"<Sequence>{PLAN}{FOLLOW}</Sequence>", ""),
        (
            f"<SequenceStar name='main'>{PLAN}{FOLLOW}</SequenceStar>",
            "; Nav2 Jazzy does not take it: mine.xml: SequenceStar 'main': a node of Humble, which Jazzy does not have",
        ),
        (None, "; Nav2 Jazzy does not take it: expected the file trees/mine.xml in the package or beside the par"),
    ],
)
def test_convert_says_that_a_tree_is_not_converted(tmp_path, capsys, inside, refusal):
    (tmp_path / "trees").mkdir()
    if inside is not None:
        (tmp_path / "trees" / "mine.xml").write_text(xml_of(inside))
    file = tmp_path / "mine.yaml"
    file.write_text("bt_navigator: {ros__parameters: {default_nav_to_pose_bt_xml: trees/mine.xml}}\n")
    name = "bt_navigator.default_nav_to_pose_bt_xml"
    assert main(["params", "convert", str(file), "--to", "jazzy", "--nav2", "humble"]) == 0
    told = capsys.readouterr().err.splitlines()
    expected = f"{name}: the behaviour tree is not converted, it stays one of Nav2 Humble{refusal}"
    assert any(line.startswith(expected) for line in told)
    assert main(["params", "convert", str(file), "--to", "humble", "--nav2", "humble"]) == 0
    assert "not converted" not in capsys.readouterr().err


def test_convert_says_nothing_of_trees_that_nav2_brings(tmp_path, capsys):
    file, brought = tmp_path / "mine.yaml", "$(find-pkg-share nav2_bt_navigator)/behavior_trees/follow_point.xml"
    file.write_text(f"bt_navigator: {{ros__parameters: {{default_nav_to_pose_bt_xml: {brought}}}}}\n")
    assert main(["params", "convert", str(file), "--to", "jazzy", "--nav2", "humble"]) == 0
    assert "not converted" not in capsys.readouterr().err


def test_a_conversion_refuses_to_change_an_alias_and_keeps_the_others(tmp_path, capsys):
    path, new = tmp_path / "old.yaml", tmp_path / "new.yaml"
    shared = "shared: &shared {progress_checker_plugin: progress_checker}\n"
    own = "controller_server:\n  ros__parameters:\n    failure_tolerance: &t 0.3\n    controller_frequency: *t\n"
    path.write_text(f"{shared}{own}    <<: *shared\n")
    assert main(["params", "convert", str(path), "--to", "jazzy", "--nav2", "humble"]) == 2
    assert "line 1: progress_checker_plugin: expected a value alone, got an alias of YAML" in capsys.readouterr().err
    path.write_text(f"{own}    progress_checker_plugin: &name progress_checker\n    speed_limit_topic: *name\n")
    assert main(["params", "convert", str(path), "--to", "jazzy", "--nav2", "humble"]) == 2
    assert "line 5: progress_checker_plugin: expected a value alone, got an anchor of YAML" in capsys.readouterr().err
    path.write_text(f"{own}    progress_checker_plugin: progress_checker\n")
    assert main(["params", "convert", str(path), "--to", "jazzy", "--nav2", "humble", "--out", str(new)]) == 0
    assert new.read_text() == f"{own}    progress_checker_plugins: [progress_checker]\n"


def test_a_parameter_is_not_inserted_into_a_merged_group(tmp_path, capsys):
    path = tmp_path / "old.yaml"
    shared = "shared: &shared {use_sim_time: true}\n"
    own = "velocity_smoother:\n  ros__parameters:\n    <<: *shared\n    max_accel: [2.0, 0.0, 3.0]\n"
    path.write_text(shared + own)
    assert main(["params", "convert", str(path), "--to", "lyrical", "--nav2", "humble"]) == 0
    text = capsys.readouterr().out
    assert shared in text
    assert "    enable_stamped_cmd_vel: false\n    max_accel: [2.0, 0.0, 3.0]\n" in text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "controller_server:\n  ros__parameters:\n    FollowPath.plugin: 'nav2_mppi_controller::MPPIController'\n"
            "    FollowPath: {vx_max: 0.4}\n",
            "controller_server.FollowPath.plugin: expected in a group 'FollowPath', got a dotted name beside it",
        ),
        (
            "local_costmap:\n  local_costmap:\n    ros__parameters:\n      robot_radius: {{ radius }}\n",
            "line 4: expected a value or quotes around the template {{ radius }}",
        ),
    ],
)
def test_what_a_conversion_cannot_read_is_named(tmp_path, capsys, text, words):
    path = tmp_path / "params.yaml"
    path.write_text(text)
    assert main(["params", "convert", str(path), "--to", "lyrical", "--nav2", "humble"]) == 2
    assert words in capsys.readouterr().err
