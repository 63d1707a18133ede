"""The file that a tuning writes, read again."""

from __future__ import annotations

from controllers.nav2_params import read_nav2_params
from evolution.driving import ParameterFile
from evolution.tuning import text_of_file
from tests.controllers.trees import FOLLOW, PLAN, xml_of

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
