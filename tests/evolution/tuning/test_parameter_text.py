"""The file that a tuning writes, read again."""

from __future__ import annotations

import pytest

from controllers.nav2_params import read_nav2_params
from controllers.nav2_params.file.yaml_edits import SharedValueError
from evolution.driving import ParameterFile
from evolution.tuning import ParameterRange, SearchSpace, text_of_file, writable_space
from tests.controllers.trees import FOLLOW, PLAN, xml_of

RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
FILE = """bt_navigator:
  ros__parameters:
    default_nav_to_pose_bt_xml: $(find-pkg-share mine)/trees/mine.xml
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    goal_checker_plugins: [loose, precise]
    loose: {plugin: "nav2_controller::SimpleGoalChecker", xy_goal_tolerance: 0.4}
    precise: {plugin: "nav2_controller::SimpleGoalChecker", xy_goal_tolerance: 0.1}
    FollowPath:
      plugin: "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
      lookahead_dist: 0.6
"""


def test_a_tuned_file_keeps_its_own_behaviour_tree(tmp_path):
    follow = FOLLOW.replace("/>", ' goal_checker_id="precise"/>')
    tree = xml_of(f"<Sequence>{PLAN}{follow}</Sequence>")
    (tmp_path / "trees").mkdir()
    (tmp_path / "trees" / "mine.xml").write_text(tree)
    (tmp_path / "nav2_params.yaml").write_text(FILE)
    file = ParameterFile(params=str(tmp_path / "nav2_params.yaml"), nav2="humble")
    text = text_of_file(file, read_nav2_params(file.params, release="humble"), "FollowPath")
    (result := tmp_path / "far" / "from" / "the" / "package" / "tuned").mkdir(parents=True)
    text.write(result / "nav2_params.yaml", {"lookahead_dist": 0.4})
    tuned = read_nav2_params(result / "nav2_params.yaml", release="humble").navigation
    assert tuned.bt.xml == tree
    assert tuned.controller_server.goal_checker.xy_goal_tolerance == 0.1
    assert tuned.controllers["FollowPath"].params["lookahead_dist"] == 0.4


SERVER = f"""  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: "{RPP}"
      lookahead_dist: 0.6  # mine
"""
COSTMAP = """  local_costmap:
    ros__parameters:
      plugins: [inflation_layer]
      inflation_layer: {plugin: "nav2_costmap_2d::InflationLayer", inflation_radius: 0.5}
"""
IN_SERVER = "controller_server:\n  ros__parameters: {controller_plugins: [FollowPath]}\n"


@pytest.mark.parametrize(
    "text",
    [
        f"/**:\n{SERVER}local_costmap:\n{COSTMAP}",
        f"/robot_1/controller_server:\n{SERVER}/robot_1/local_costmap:\n{COSTMAP}",
        f"/robot_1/**:\n{SERVER}robot_1/local_costmap:\n{COSTMAP}",
        f"/**/controller_server:\n{SERVER}/**/local_costmap:\n{COSTMAP}",
        f"{IN_SERVER}/**:\n{SERVER}local_costmap:\n{COSTMAP}",
        f"/robot_1/controller_server:\n{SERVER}/robot_2/controller_server:\n{SERVER}local_costmap:\n{COSTMAP}",
    ],
)
def test_a_value_is_written_where_it_stands(tmp_path, text):
    path = tmp_path / "nav2_params.yaml"
    path.write_text(text)
    file = ParameterFile(params=str(path), nav2="humble")
    own = text_of_file(file, read_nav2_params(path, release="humble"), "FollowPath")
    values = {"lookahead_dist": 0.4, "local_costmap.inflation_layer.inflation_radius": 0.3}
    changed = own.with_values(values)
    expected = text.replace("dist: 0.6", "dist: 0.4", 1).replace("radius: 0.5", "radius: 0.3")
    assert changed == expected
    added = own.with_values({"rotate_to_heading_min_angle": 0.5}).splitlines()
    assert set(added) - set(text.splitlines()) == {"      rotate_to_heading_min_angle: 0.5"}


def test_of_two_sections_that_give_a_value_the_one_that_counts_is_changed(tmp_path):
    path = tmp_path / "nav2_params.yaml"
    path.write_text(f"controller_server:\n{SERVER}/**: {{ros__parameters: {{FollowPath.lookahead_dist: 0.7}}}}\n")
    file = ParameterFile(params=str(path), nav2="humble")
    own = text_of_file(file, read_nav2_params(path, release="humble"), "FollowPath")
    assert own.with_values({"lookahead_dist": 0.4}) == path.read_text().replace("0.7", "0.4")


@pytest.mark.parametrize("before", ["", f"local_costmap:\n{COSTMAP}"])
def test_a_value_that_a_section_gives_to_both_costmaps_has_no_place(tmp_path, before):
    path = tmp_path / "nav2_params.yaml"
    radius = 'inflation_layer: {plugin: "nav2_costmap_2d::InflationLayer", inflation_radius: 0.5}'
    path.write_text(f"{before}/**:\n{SERVER}    {radius}\n    plugins: [inflation_layer]\n")
    file = ParameterFile(params=str(path), nav2="humble")
    own = text_of_file(file, read_nav2_params(path, release="humble"), "FollowPath")
    assert isinstance(own.refusal("local_costmap.inflation_layer.inflation_radius"), SharedValueError)
    assert own.refusal("lookahead_dist") is None


@pytest.mark.parametrize("given", ["lookahead_dist: *far", "<<: *ahead", "lookahead_dist: &near 0.6"])
def test_one_line_names_the_parameters_that_are_not_tuned_since_others_share_their_values(tmp_path, caplog, given):
    path = tmp_path / "nav2_params.yaml"
    anchors = "distances: &ahead {lookahead_dist: &far 0.6}\n"
    path.write_text(f"{anchors}controller_server:\n{SERVER.replace('lookahead_dist: 0.6', given)}")
    read = read_nav2_params(path, release="humble")
    own = text_of_file(ParameterFile(params=str(path), nav2="humble"), read, "FollowPath")
    space = {"lookahead_dist": ParameterRange(low=0.3, high=0.9), "lookahead_time": ParameterRange(low=1, high=2)}
    kept = writable_space(SearchSpace(parameters=space), own)
    assert list(kept.parameters) == ["lookahead_time"]
    shared = "YAML anchors, aliases or sections for several nodes share their values"
    assert caplog.messages == [f"{path}: not tuned, as {shared}: lookahead_dist"]
