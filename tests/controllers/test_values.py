"""Single values of a parameter file: they are replaced in its text, and nothing else changes."""

from __future__ import annotations

import difflib

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.nav2_params import load_preset, parse_nav2_params, read_nav2_params, write_nav2_params
from controllers.nav2_params.values import unused_critics, values_of, with_values, write_values
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.robot import make_robot

FILE = "examples/nav2_params.yaml"
RADIUS, FACTOR = "local_costmap.inflation_layer.inflation_radius", "global_costmap.inflation_layer.cost_scaling_factor"
VALUES = {"sim_time": 1.23, "PathAlign.scale": 5.5, RADIUS: 0.4, FACTOR: 7.0, "GoalDist.aggregation_type": "sum"}


@pytest.fixture(scope="module")
def text():
    with open(FILE, encoding="utf-8") as file:
        return file.read()


def changed_lines(before, after):
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), lineterm="", n=0)
    return [line for line in lines if line[0] in "+-" and line[:3] not in ("+++", "---")]


def test_only_the_named_values_change(text, tmp_path):
    written = write_values(text, "FollowPath", VALUES, {})
    assert changed_lines(text, written) == [
        "+      sim_time: 1.23",
        "+      GoalDist.aggregation_type: sum",
        "-      PathAlign.scale: 32.0",
        "+      PathAlign.scale: 5.5",
        "-        inflation_radius: 0.45",
        "+        inflation_radius: 0.4",
        "-        cost_scaling_factor: 4.0",
        "+        cost_scaling_factor: 7.0",
    ]
    path = tmp_path / "tuned.yaml"
    path.write_text(written)
    expected = with_values(read_nav2_params(FILE).navigation, "FollowPath", VALUES)
    assert read_nav2_params(path).navigation == expected


numbers = st.floats(0.1, 5.0).map(lambda value: float(f"{value:.3g}"))


@settings(max_examples=25)  # 16 selections of names
@given(st.dictionaries(st.sampled_from(["lookahead_dist", "cost_scaling_dist", RADIUS, FACTOR]), numbers))
def test_a_written_preset_gives_the_values_back(values):
    navigation = load_preset("jazzy").replace(controllers={"rpp": load_preset("jazzy").controller("rpp")})
    before = yaml.safe_dump(write_nav2_params(navigation, robot=make_robot("turtlebot3_waffle")), sort_keys=False)
    own = values_of(navigation, "rpp")
    after = write_values(before, "rpp", values, own)
    found = values_of(parse_nav2_params(yaml.safe_load(after)).navigation, "rpp")
    assert {name: found[name] for name in values} == values
    assert len(changed_lines(before, after)) == 2 * sum(value != own[name] for name, value in values.items())


HAND = """
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath: {plugin: "dwb_core::DWBLocalPlanner", critics: [PathDist], PathDist: {scale: 1.0}}  # the driver
local_costmap:
  local_costmap:
    ros__parameters:
      plugins: [soft]
      soft:
        plugin: "nav2_costmap_2d::InflationLayer"
        inflation_radius: 0.5  # wide
"""


def test_comments_braces_and_names_of_layers_stay():
    written = write_values(HAND, "FollowPath", {"PathDist.scale": 2.0, "sim_time": 1.0, RADIUS: 0.3}, {})
    assert "PathDist: {scale: 2.0}}  # the driver" in written
    assert "{sim_time: 1.0, plugin:" in written
    assert "inflation_radius: 0.3  # wide" in written


def test_numbers_are_written_in_the_type_of_their_parameter():
    """Parameters of ROS are typed: Nav2 does not start with a whole number for a double."""
    known = values_of(load_preset("thesis"), "dwb")
    values = {
        "PathDist.scale": 2,
        "sim_time": 1,
        RADIUS: 1,
        "vx_samples": 25.0,
        "short_circuit_trajectory_evaluation": True,
    }
    written = yaml.safe_load(write_values(HAND, "FollowPath", values, known))
    dwb = written["controller_server"]["ros__parameters"]["FollowPath"]
    radius = written["local_costmap"]["local_costmap"]["ros__parameters"]["soft"]["inflation_radius"]
    found = [dwb["PathDist"]["scale"], dwb["sim_time"], radius, dwb["vx_samples"]]
    assert [repr(one) for one in found] == ["2.0", "1.0", "1.0", "25"]
    assert dwb["short_circuit_trajectory_evaluation"] is True


def test_a_missing_section_is_named():
    with pytest.raises(ConfigError, match=r"global_costmap\.inflation_layer\.cost.*: the file has no section global_c"):
        write_values(HAND, "FollowPath", {FACTOR: 1.0}, {})


def test_values_hold_only_layers_that_write():
    known = values_of(load_preset("thesis"), "dwb")
    assert known["sim_time"] == 1.7
    assert known["PathAlign.scale"] == 32.0
    assert known[RADIUS] == 0.55
    assert not [name for name in known if name.startswith("local_costmap.static_layer")]


def test_critics_that_are_not_listed_are_named():
    assert "Twirling" in unused_critics(load_preset("thesis"), "dwb")
    assert "PathAlign" not in unused_critics(load_preset("thesis"), "dwb")
    assert unused_critics(load_preset("thesis"), "rpp") == frozenset()


def test_a_wrong_value_is_refused():
    with pytest.raises(ConfigError, match="sim_time"):
        with_values(load_preset("thesis"), "dwb", {"sim_time": -1.0})


def test_the_value_of_a_critic_stands_under_the_name_that_the_file_gives_it():
    group = {"critics": ["Mine", "GoalDistCritic"], "Mine": {"class": "PathAlign"}, "GoalDistCritic": {"scale": 1.0}}
    text = yaml.safe_dump({"controller_server": {"ros__parameters": {"FollowPath": group}}})
    written = yaml.safe_load(write_values(text, "FollowPath", {"PathAlign.scale": 2.0, "GoalDist.scale": 3.0}, {}))
    assert written["controller_server"]["ros__parameters"]["FollowPath"] == {
        "critics": ["Mine", "GoalDistCritic"],
        "Mine": {"class": "PathAlign", "scale": 2.0},
        "GoalDistCritic": {"scale": 3.0},
    }
