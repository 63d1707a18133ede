"""Parameter files whose nodes have no sections of their own, but parameters under ``/**``."""

from __future__ import annotations

import itertools
from copy import deepcopy

import pytest
import yaml

from controllers.nav2_params import load_preset, parse_nav2_params, read_nav2_params
from controllers.nav2_params.migration import migrate_file
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES

RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
MPPI = "nav2_mppi_controller::MPPIController"
DIFF_DRIVE = {"motion_model": "diff_drive", "diff_drive": {"plugin": "mppi::DiffDriveMotionModel"}}
SERVER = {
    "controller_plugins": ["FollowPath"],
    "controller_frequency": 10.0,
    "goal_checker_plugins": ["goal_checker"],
    "goal_checker": {"plugin": "nav2_controller::SimpleGoalChecker", "xy_goal_tolerance": 0.11},
    "FollowPath": {"plugin": RPP, "lookahead_dist": 0.77},
}
SMOOTHER = {"smoothing_frequency": 25.0, "max_velocity": [0.4, 0.0, 1.0]}


def sections(release: str) -> dict[str, dict]:
    """Return the sections of a file of a release."""
    separator = "/" if release == "humble" else "::"
    progress = {"progress_checker_plugin": "pc"} if release == "humble" else {"progress_checker_plugins": ["pc"]}
    progress["pc"] = {"plugin": "nav2_controller::SimpleProgressChecker", "movement_time_allowance": 7.0}
    handler = {
        "path_handler_plugins": ["PathHandler"],
        "PathHandler": {"plugin": "nav2_controller::FeasiblePathHandler"},
    }
    plugins = {name: {"plugin": f"nav2_behaviors{separator}{name.title()}"} for name in ("spin", "wait")}
    return {
        "controller_server": {**SERVER, **progress, **(handler if release == "lyrical" else {})},
        "planner_server": {
            "planner_plugins": ["GridBased"],
            "GridBased": {"plugin": f"nav2_navfn_planner{separator}NavfnPlanner", "tolerance": 0.3},
        },
        "behavior_server": {"behavior_plugins": ["spin", "wait"], **plugins, "simulate_ahead_time": 1.5},
        "velocity_smoother": SMOOTHER,
    }


def apart(release: str, space: str = "") -> dict:
    return {f"{space}{name}": {"ros__parameters": values} for name, values in deepcopy(sections(release)).items()}


def together(release: str, name: str = "/**") -> dict:
    merged: dict = {"use_sim_time": True}
    for values in deepcopy(sections(release)).values():
        merged |= values
    return {name: {"ros__parameters": merged}}


def written(folder, document: dict):
    path = folder / "nav2_params.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False))
    return path


@pytest.mark.parametrize("name", ["/**", "/*", "/robot_1/**", "/robot_1/*"])
@pytest.mark.parametrize("release", RELEASES)
def test_nodes_without_a_section_have_the_parameters_of_a_wildcard(release, name):
    read, usual = (parse_nav2_params(document) for document in (together(release, name), apart(release)))
    assert read.recognition.release == usual.recognition.release == release
    assert read.navigation == usual.navigation
    assert read.defaulted == usual.defaulted
    assert read.navigation.controllers["FollowPath"].params["lookahead_dist"] == 0.77
    assert {finding.kind for finding in read.findings} <= {"ros_only", "missing"}


def test_the_keys_that_tell_the_release_are_named_as_in_the_file(tmp_path):
    told = read_nav2_params(written(tmp_path, together("jazzy"))).recognition.told_by
    assert "/**.progress_checker_plugins" in told
    assert all(name.startswith("/**.") for name in told)


def test_findings_and_errors_are_named_as_in_the_file(tmp_path):
    document = together("humble")
    document["/**"]["ros__parameters"] |= {"wrong_key": 1, "default_nav_to_pose_bt_xml": "none.xml"}
    read = read_nav2_params(written(tmp_path, document))
    assert read.named("unknown") == ("/**.wrong_key",)
    assert read.named("left_out") == ("/**.default_nav_to_pose_bt_xml",)
    document["/**"]["ros__parameters"]["FollowPath"]["lookahead_dist"] = "far"
    with pytest.raises(ConfigError, match=r"line \d+: .*FollowPath\.lookahead_dist: expected"):
        read_nav2_params(written(tmp_path, document))


def test_a_costmap_may_stand_in_a_wildcard_of_its_namespace():
    document = {
        **apart("humble"),
        "/local_costmap/**": {"ros__parameters": {"robot_radius": 0.31, "plugins": ["static_layer"]}},
    }
    document["/local_costmap/**"]["ros__parameters"]["static_layer"] = {"plugin": "nav2_costmap_2d::StaticLayer"}
    read = parse_nav2_params(document, load_preset("thesis"))
    assert read.navigation.local_costmap.robot_radius == 0.31
    assert "global_costmap" in read.defaulted


@pytest.mark.parametrize("common", [{"use_sim_time": True}, {"transform_tolerance": 0.3, "odom_topic": "odom"}])
def test_parameters_that_tell_no_node_make_no_section(common):
    document = {"/**": {"ros__parameters": common}, **apart("humble")}
    usual, read = (parse_nav2_params(one, load_preset("thesis")) for one in (apart("humble"), document))
    assert (read.defaulted, read.recognition.release) == (usual.defaulted, "humble")


def test_a_section_of_its_own_is_the_only_one():
    document = {**apart("humble", "/robot_1/"), "/robot_2/**": {"ros__parameters": {"controller_frequency": 5.0}}}
    assert parse_nav2_params(document).navigation.controller_server.controller_frequency == 10.0


@pytest.mark.parametrize(("source", "target"), [*itertools.permutations(RELEASES, 2)])
def test_a_wildcard_is_converted_as_sections_are(tmp_path, source, target):
    found = []
    for document in (together(source), apart(source)):
        migration = migrate_file(written(tmp_path, document), target)
        found.append(parse_nav2_params(yaml.safe_load(migration.text)))
    wild, usual = found
    assert wild.recognition.release == usual.recognition.release == target
    assert wild.navigation == usual.navigation
    assert wild.named("unknown") == wild.named("other_release") == ()


def test_the_progress_checker_that_the_tree_names_is_found_beside_it(tmp_path):
    document = together("jazzy")
    server = document["/**"]["ros__parameters"]
    server |= {"progress_checker_plugins": ["other", "pc"], "progress_checker_id": "pc"}
    migration = migrate_file(written(tmp_path, document), "humble")
    assert yaml.safe_load(migration.text)["/**"]["ros__parameters"]["progress_checker_plugin"] == "pc"


def split(key: str) -> dict:
    document = together("humble")
    server = {key: document["/**"]["ros__parameters"].pop(key)}
    return {**document, "controller_server": {"ros__parameters": server}}


def shared_controller() -> dict:
    return {**together("humble"), "controller_server": {"ros__parameters": {"FollowPath": {"lookahead_dist": 0.5}}}}


def other_robot() -> dict:
    """A file with two robots, whose controllers share parameters."""
    shared = {"/**": {"ros__parameters": {"FollowPath": {"lookahead_time": 1.0}}}}
    return {**apart("humble", "/robot_1/"), **apart("humble", "/robot_2/"), **shared}


def shared_name() -> dict:
    document = together("humble")
    document["/**"]["ros__parameters"]["global_frame"] = "odom"
    return document


@pytest.mark.parametrize(
    ("document", "target", "message"),
    [
        (
            shared_controller(),
            "jazzy",
            "/**.FollowPath.lookahead_dist: expected in one section, got it in controller_server as well",
        ),
        (other_robot(), "jazzy", "FollowPath: expected all parameters in one section, got others in /**"),
        (
            split("controller_plugins"),
            "lyrical",
            "FollowPath: expected beside controller_plugins, which is in controller_server",
        ),
        (split("FollowPath"), "lyrical", "FollowPath: expected beside controller_plugins, which is in /**"),
        (shared_name(), "jazzy", "/**.global_frame: expected under behavior_server, got a section for several nodes"),
    ],
)
def test_what_cannot_be_converted_in_a_wildcard_is_refused(tmp_path, document, target, message):
    with pytest.raises(ConfigError) as error:
        migrate_file(written(tmp_path, document), target, "humble")
    assert message in str(error.value)


def of_two_sections(source: str, name: str, kind: str) -> tuple[dict, dict]:
    """Return a file whose controller has its parameters in one section, and the same with a part under ``/**``."""
    lyrical = source == "lyrical"
    shared, own = {
        "rpp": ({"max_linear_vel" if lyrical else "desired_linear_vel": 0.37}, SERVER["FollowPath"]),
        "mppi": (
            {"vx_max": 0.37, "ConstraintCritic": {"cost_weight": 3.0}, **({} if lyrical else {"prune_distance": 1.1})},
            {
                "plugin": MPPI,
                "model_dt": 0.1,
                "critics": ["ConstraintCritic", "CostCritic"],
                **(DIFF_DRIVE if lyrical else {}),
            },
        ),
    }[kind]
    documents = apart(source), apart(source)
    for document, group in zip(documents, ({**own, **shared}, own), strict=True):
        server = document["controller_server"]["ros__parameters"]
        del server["FollowPath"]
        server |= {"controller_plugins": [name], name: group}
    return documents[0], {"/**": {"ros__parameters": {"use_sim_time": True, name: shared}}, **documents[1]}


@pytest.mark.parametrize("kind", ["rpp", "mppi"])
@pytest.mark.parametrize("name", ["FollowPath", "Slow"])
@pytest.mark.parametrize(("source", "target"), [*itertools.permutations(RELEASES, 2)])
def test_a_controller_of_two_sections_is_converted_as_in_one(tmp_path, source, target, name, kind):
    found = []
    for document in of_two_sections(source, name, kind):
        text = migrate_file(written(tmp_path, document), target, source).text
        found.append(parse_nav2_params(yaml.safe_load(text), release=target))
    one, two = found
    assert two.navigation == one.navigation
    assert two.named("unknown") == two.named("other_release") == ()


def test_the_lines_of_a_conversion_name_the_section_of_each_parameter(tmp_path):
    _, document = of_two_sections("jazzy", "Slow", "mppi")
    lines = migrate_file(written(tmp_path, document), "lyrical", "jazzy").done
    assert any(line.endswith("/**.Slow.prune_distance: moved to PathHandler.prune_distance") for line in lines)


def test_a_controller_apart_from_its_list_is_converted_where_the_path_handler_does_not_matter(tmp_path):
    migration = migrate_file(written(tmp_path, split("controller_plugins")), "jazzy", "humble")
    assert parse_nav2_params(yaml.safe_load(migration.text)).own_controllers == ("FollowPath",)
