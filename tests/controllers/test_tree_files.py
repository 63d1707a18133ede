"""Behaviour trees that parameter files name."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from controllers.nav2_params import (
    NavigationParams,
    parse_nav2_params,
    read_nav2_params,
    robot_of,
    summarise,
    write_nav2_params,
)
from controllers.nav2_params.file.document import Document
from controllers.tree_xml.nodes import NODES
from evolution import configuration_of
from evolution.benchmark.parameter_differences import parameter_rows
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.robot import make_robot
from tests.controllers.trees import FOLLOW, PLAN, xml_of

SIMPLE = "nav2_controller::SimpleGoalChecker"
RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
OWN_TREE = "$(find-pkg-share my_robot)/behavior_trees/mine.xml"


DRIVES = {"spin": "Spin", "drive_on_heading": "DriveOnHeading"}
DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "howto" / "tree.md"


def node(**params):
    return {"ros__parameters": params}


def with_tree(folder, tree: str, place: str = "behavior_trees/mine.xml", named: str = OWN_TREE, **nodes):
    """Read a parameter file in the package's folder ``config`` whose tree is in the package."""
    for name, text in ((place, tree), ("config/nav2_params.yaml", "")):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    document = {"bt_navigator": node(default_nav_to_pose_bt_xml=named), **nodes}
    return parse_nav2_params(Document(document, folder=folder / "config"), release="humble")


@pytest.mark.parametrize("place", ["behavior_trees/mine.xml", "config/mine.xml"])
def test_the_tree_that_a_file_names_is_found_in_its_package(tmp_path, place):
    tree = xml_of(f"<Sequence>{PLAN}{FOLLOW}</Sequence>")
    read = with_tree(tmp_path, tree, place)
    assert read.navigation.bt.xml == tree
    assert read.named("left_out") == ()


def test_an_absolute_path_of_a_tree_is_taken(tmp_path):
    tree = xml_of(f"<Sequence>{PLAN}{FOLLOW}</Sequence>")
    assert with_tree(tmp_path, tree, "far.xml", str(tmp_path / "far.xml")).navigation.bt.xml == tree


def test_the_libraries_that_humble_loads_for_an_own_tree_are_kept(tmp_path):
    tree, libraries = xml_of(f"<Sequence>{PLAN}{FOLLOW}</Sequence>"), ["nav2_spin_action_bt_node", "of_my_robot", 7]
    navigator = node(default_nav_to_pose_bt_xml=OWN_TREE, plugin_lib_names=libraries)
    read = with_tree(tmp_path, tree, bt_navigator=navigator)
    assert read.ros_only == {"bt_navigator": {"plugin_lib_names": ["nav2_spin_action_bt_node"]}}
    assert "bt_navigator.plugin_lib_names" in read.named("ros_only")
    default = parse_nav2_params({"bt_navigator": node(plugin_lib_names=libraries)}, release="humble")
    assert default.ros_only == {}  # Humble's own list has all that its default tree needs


INCLUDED = f'<root><BehaviorTree ID="Drive"><Sequence>{PLAN}{FOLLOW}</Sequence></BehaviorTree></root>'


def with_includes(folder, *includes: str):
    """Read a file whose tree includes others and has their tree ``Drive``."""
    tree = xml_of('<SubTree ID="Drive" __shared_blackboard="true"/>').replace(
        "<BehaviorTree", "".join(includes) + "<BehaviorTree", 1
    )
    return with_tree(folder, tree)


@pytest.mark.parametrize(
    ("place", "include"),
    [
        ("behavior_trees/parts/drive.xml", '<include path="parts/drive.xml"/>'),
        ("other/drive.xml", '<include ros_pkg="my_robot" path="other/drive.xml"/>'),
        ("behavior_trees/drive.xml", '<include path="drive.xml"/><include path="./drive.xml"/>'),
    ],
)
def test_trees_of_included_files_are_read(tmp_path, place, include):
    (tmp_path / place).parent.mkdir(parents=True)
    (tmp_path / place).write_text(INCLUDED.replace("<root>", '<root><include path="drive.xml"/>'))
    read = with_includes(tmp_path, include)
    assert read.named("left_out") == ()
    assert read.navigation.bt.xml.count("<BehaviorTree") == 2
    assert "include" not in read.navigation.bt.xml


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (None, "expected the file drive.xml in the package or beside the tree"),
        ("<root", "drive.xml: not an XML file"),
        (INCLUDED.replace("Drive", "Main"), "expected a different ID for each"),
        (INCLUDED.replace(PLAN, "<Inverter>" * 2000 + PLAN + "</Inverter>" * 2000), "drive.xml: expected a tree of at"),
        ("<root><include path='" + 300 * "a" + "'/></root>", "aaa in the package or beside the tree"),
    ],
)
def test_an_include_that_does_not_fit_is_told(tmp_path, text, why):
    (tmp_path / "behavior_trees").mkdir()
    if text is not None:
        (tmp_path / "behavior_trees" / "drive.xml").write_text(text)
    (finding,) = (
        one for one in with_includes(tmp_path, '<include path="drive.xml"/>').findings if one.kind == "left_out"
    )
    assert why in finding.why


def test_a_node_that_is_not_built_is_told_with_its_name_and_the_file_in_which_it_is(tmp_path):
    (tmp_path / "behavior_trees").mkdir()
    gripper = '<Action ID="CloseGripper" name="grip the box"/>'
    (tmp_path / "behavior_trees" / "drive.xml").write_text(INCLUDED.replace(PLAN, gripper + PLAN))
    read = with_includes(tmp_path, '<include path="drive.xml"/>')
    (finding,) = (one for one in read.findings if one.kind == "left_out")
    why = "drive.xml: CloseGripper 'grip the box': a node that is not built here; Nav2's default tree drives here"
    assert finding.why == why


def test_files_that_include_one_another_without_end_are_told(tmp_path):
    (tmp_path / "behavior_trees").mkdir()
    for number in range(1000):
        (tmp_path / "behavior_trees" / f"{number}.xml").write_text(f'<root><include path="{number + 1}.xml"/></root>')
    (finding,) = (one for one in with_includes(tmp_path, '<include path="0.xml"/>').findings if one.kind == "left_out")
    assert "expected at most 100 files that include each other, got more" in finding.why


def test_a_path_that_is_no_file_name_is_told(tmp_path):
    read = with_tree(tmp_path, "", named="a" * 5000)
    assert read.named("left_out") == ("bt_navigator.default_nav_to_pose_bt_xml",)


def test_a_drive_on_the_heading_has_the_limits_of_its_plugin(tmp_path):
    drive = '<DriveOnHeading dist_to_travel="0.3" speed="0.9"/>'
    plugins = {name: {"plugin": f"nav2_behaviors/{ros}"} for name, ros in DRIVES.items()}
    plugins["drive_on_heading"]["acceleration_limit"] = 0.5
    behaviors = node(behavior_plugins=list(plugins), **plugins)
    smoother = node(max_velocity=[0.5, 0.0, 1.0], min_velocity=[-0.1, 0.0, -1.0])
    read = with_tree(
        tmp_path,
        xml_of(f"<Sequence>{drive}{PLAN}{FOLLOW}</Sequence>"),
        behavior_server=behaviors,
        velocity_smoother=smoother,
    )
    server = read.navigation.behavior_server
    assert server.behavior_plugins == ("spin",)
    assert server.drive_on_heading is not None
    assert server.drive_on_heading.acceleration_limit == 0.5
    assert robot_of(read, make_robot("turtlebot3_waffle")).max_linear_velocity == 0.9
    written = write_nav2_params(read.navigation)["behavior_server"]["ros__parameters"]
    assert written["behavior_plugins"] == ["spin", "drive_on_heading"]
    assert written["drive_on_heading"] == {"plugin": "nav2_behaviors/DriveOnHeading", "acceleration_limit": 0.5}


def test_a_tree_misses_the_behaviours_that_it_runs_or_cancels(tmp_path):
    asks = "<DriveOnHeading/><CancelWait/><CancelControl/>"
    behaviors = node(behavior_plugins=["spin"])
    read = with_tree(tmp_path, xml_of(f"<Sequence>{asks}{PLAN}{FOLLOW}</Sequence>"), behavior_server=behaviors)
    assert read.named("missing") == ("behavior_server.wait", "behavior_server.drive_on_heading")


def test_a_tree_misses_the_controller_that_it_names(tmp_path):
    tree = xml_of(f"<Sequence>{PLAN}{FOLLOW}</Sequence>").replace('"FollowPath"', '"FolowPath"')
    server = node(controller_plugins=["FollowPath"], FollowPath={"plugin": RPP})
    (missing,) = (one for one in with_tree(tmp_path, tree, controller_server=server).findings if one.kind == "missing")
    assert (missing.name, missing.why) == (
        "controller_server.FolowPath",
        "expected in controller_plugins, got 'FollowPath'",
    )


@pytest.mark.parametrize(
    ("place", "tree", "why"),
    [
        ("elsewhere.xml", "", "expected the file behavior_trees/mine.xml in the package or beside the parameter file"),
        ("behavior_trees/mine.xml", "<root", "not an XML file"),
        (
            "behavior_trees/mine.xml",
            xml_of(f"<Sequence>{PLAN}<DockRobot/>{FOLLOW}</Sequence>"),
            "mine.xml: DockRobot: a node that is not built here;",
        ),
    ],
)
def test_a_tree_that_cannot_drive_here_is_left_out_with_the_reason(tmp_path, place, tree, why):
    read = with_tree(tmp_path, tree, place)
    (finding,) = (finding for finding in read.findings if finding.kind == "left_out")
    assert read.navigation.bt.xml == ""
    assert finding.name == "bt_navigator.default_nav_to_pose_bt_xml"
    assert why in finding.why
    assert finding.why.endswith("; Nav2's default tree drives here")


def test_the_plugins_that_an_own_tree_names_count(tmp_path):
    follow = FOLLOW.replace("/>", ' goal_checker_id="precise"/>').replace('"FollowPath"', '"Slow"')
    tree = xml_of(f"<Sequence>{PLAN}{follow}<Wait/></Sequence>")
    checkers = {name: {"plugin": SIMPLE, "xy_goal_tolerance": t} for name, t in (("loose", 0.4), ("precise", 0.1))}
    controllers = {name: {"plugin": RPP} for name in ("Fast", "Slow")}
    plugins = {"goal_checker_plugins": list(checkers), "controller_plugins": list(controllers)}
    server = node(**plugins, **checkers, **controllers)
    behaviors = node(behavior_plugins=["spin"])
    read = with_tree(tmp_path, tree, controller_server=server, behavior_server=behaviors)
    assert read.navigation.controller_server.goal_checker.xy_goal_tolerance == 0.1
    assert read.asked_for == "Slow"
    assert read.named("missing") == ("behavior_server.wait",)


def test_numbers_of_the_default_tree_are_refused_beside_a_tree():
    tree = xml_of(f"<Sequence>{PLAN}{FOLLOW}</Sequence>")
    with pytest.raises(ConfigError, match=r"bt\.replanning_frequency: expected it in the XML of the tree"):
        NavigationParams(bt={"xml": tree, "replanning_frequency": 2.0})
    with pytest.raises(ConfigError, match=r"bt\.xml: SequenceStar: a node of Humble, which Jazzy does not"):
        NavigationParams(release="jazzy", bt={"xml": tree.replace("Sequence", "SequenceStar")})


def test_layers_that_a_tree_clears_have_to_exist():
    clear = '<ClearEntireCostmap service_name="local_costmap/clear_entirely_local_costmap" plugins="voxels"/>'
    tree = xml_of(f"<Sequence>{PLAN}{FOLLOW}{clear}</Sequence>")
    with pytest.raises(ConfigError, match=r"local_costmap of bt\.xml: expected .*, got 'voxels'"):
        NavigationParams(release="lyrical", bt={"xml": tree})


def test_the_robot_backs_up_as_fast_as_its_own_tree_says(tmp_path):
    back = '<BackUp backup_dist="0.3" backup_speed="0.7"/>'
    smoother = node(max_velocity=[0.5, 0.0, 1.0], min_velocity=[-0.1, 0.0, -1.0])
    read = with_tree(tmp_path, xml_of(f"<Sequence>{PLAN}{FOLLOW}{back}</Sequence>"), velocity_smoother=smoother)
    assert robot_of(read, make_robot("turtlebot3_waffle")).max_reverse_velocity == 0.7


def test_the_document_names_every_node():
    table = DOCUMENT.read_text(encoding="utf-8").partition("## Nodes")[2]
    assert {name for name in NODES if f"`{name}`" not in table} == set()


def test_the_example_names_its_tree():
    read = read_nav2_params(DOCUMENT.parents[2] / "examples" / "own_tree.yaml")
    assert "IsPathValid" in read.navigation.bt.xml
    assert any(line.startswith("behaviour tree: the file's own, of ") for line in summarise(read))


def test_the_comparison_of_the_document_is_one_of_trees_alone():
    (command,) = re.findall(
        r"^mapbench bench .*own_tree(?:.*\\\n)*.*$", DOCUMENT.read_text(encoding="utf-8"), re.MULTILINE
    )
    (robot,) = re.findall(r"--robot (\w+)", command)
    example = str(DOCUMENT.parents[2] / "examples" / "own_tree.yaml")
    two = [configuration_of(name, params, ["rpp"], robot=robot) for name, params in (("a", "thesis"), ("b", example))]
    assert [row["key"] for row in parameter_rows(two)] == ["bt_navigator.default_nav_to_pose_bt_xml"]
