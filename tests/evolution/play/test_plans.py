"""Plans: the runs of a variant are those of the command that the page shows."""

from __future__ import annotations

import shlex

import pytest

from controllers.nav2_params import PRESETS, load_preset
from controllers.nav2_params.values import with_values
from evolution.cli import build_parser
from evolution.commands import driving_options
from evolution.driving import DriveSettings, JobPlan, ParameterFile
from evolution.play.catalogue import state_of
from evolution.play.messages.requests import AskParameters, Session, WorldSettings
from evolution.play.plans import changed_file, command_lines, parameter_files, planned
from evolution.play.scenes import scene_of
from evolution.play.worlds import FILE, Given
from evolution.search import controllers_from
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.robot import ROBOTS
from tests.controllers.trees import FOLLOW, PLAN, xml_of

CHANGES = {"dwb": {"PathAlign.scale": 20.0}, "mppi": {"temperature": 0.4}, "rpp": {"lookahead_dist": 0.9}}
SHARED = {"local_costmap.inflation_layer.inflation_radius": 0.7, "global_costmap.inflation_layer.inflation_radius": 0.6}
USERS_FILE = """# my robot
controller_server:
  ros__parameters:
    controller_plugins: ["FollowPath"]
    FollowPath:
      plugin: "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"  # the fast one
      desired_linear_vel: 0.4
      lookahead_dist: 0.7  # tuned in May
"""


def session_of(session, settings, variants):
    return Session.from_mapping({**session, "settings": settings, "variants": variants}, "session")


def plans_of_command(line, folder):
    """Return the runs that a command line would do, as ``mapbench bench`` reads it."""
    words = shlex.split(line)
    args = build_parser("bench").parse_args(words[1:])
    file = folder / args.params[0]
    args.params, args.verbose = str(file) if file.exists() else args.params[0], False
    specs = driving_options.controllers_of(args)
    return JobPlan(specs, driving_options.drive_settings(args), args.seed, args.repeats)


def check_commands(shown, given, folder):
    variants = planned(shown, given)
    for name, text in parameter_files(variants).items():
        (folder / name).write_text(text)
    of_commands = [plans_of_command(line, folder) for line in command_lines(variants, shown.scene.name)]
    for one in variants:
        (name,) = one.plan.names
        fitting = [plan for plan in of_commands if plan.settings == one.plan.settings and name in plan.names]
        assert fitting, one.variant.name
        assert (fitting[0].root_seed, fitting[0].repeats) == (one.plan.root_seed, one.plan.repeats)


@pytest.mark.parametrize("preset", [name for name in PRESETS if load_preset(name).release in RELEASES])
def test_changed_values_change_nothing_else(preset, given, session):
    variants = [{"name": name, "controller": name, "parameters": changes} for name, changes in CHANGES.items()]
    own = DriveSettings(navigation=preset)
    for one in planned(session_of(session, {"preset": preset, "shared": SHARED}, variants), given):
        name = one.variant.name
        assert one.plan.settings == own.replace(navigation=with_values(own.navigation, name, CHANGES[name] | SHARED))


@pytest.mark.parametrize(
    "settings",
    [
        {"preset": "thesis"},
        {"preset": "jazzy", "noise": "nominal", "seed": 7, "repeats": 3},
        {"preset": "fair", "robot": "jackal"},
        {"preset": "thesis", "robot_radius": 0.3},
        {"preset": "jazzy_fair", "shared": SHARED},
    ],
)
def test_the_command_does_the_same_runs(settings, given, session, tmp_path):
    variants = [{"name": name, "controller": name} for name in CHANGES]
    variants += [{"name": f"{name} new", "controller": name, "parameters": one} for name, one in CHANGES.items()]
    check_commands(session_of(session, settings, variants), given, tmp_path)


def test_variants_without_changes_share_a_command(given, session):
    shown = session_of(session, {"preset": "thesis"}, [{"name": name, "controller": name} for name in CHANGES])
    (line,) = command_lines(planned(shown, given), shown.scene.name)
    assert "--controllers dwb,mppi,rpp --params thesis" in line


def test_a_robot_is_known_by_its_registered_name_and_one_that_cannot_be_loaded_is_left_out(
    given, room, session, monkeypatch, caplog
):
    def points():
        return {"broken": ["no_such_module:robot"]}

    monkeypatch.setitem(ROBOTS._entries, "small", ROBOTS.get("jackal").replace(radius=0.12))
    monkeypatch.setattr(ROBOTS, "_points", points)
    robots = state_of(given, [scene_of(room)], WorldSettings(preset="thesis"), given.controllers).robots
    assert [one.name for one in robots] == sorted([*ROBOTS.built_in, "small"])
    assert "not on the page: robot 'broken': no_such_module:robot cannot be loaded" in caplog.text
    shown = session_of(session, {"preset": "thesis", "robot": "small"}, [{"name": "rpp", "controller": "rpp"}])
    (one,) = planned(shown, given)
    assert one.plan.settings.robot.radius == 0.12
    assert "--robot small" in command_lines([one], shown.scene.name)[0]


@pytest.fixture
def of_file(tmp_path):
    """A parameter file, and what the command line gives with it."""
    path = tmp_path / "robot.yaml"
    path.write_text(USERS_FILE)
    return Given(controllers_from(["FollowPath", "mppi"]), ParameterFile(params=str(path)))


@pytest.mark.parametrize("settings", [{}, {"noise": "nominal"}, {"robot": "jackal"}, {"robot_radius": 0.2}])
def test_the_command_does_the_same_runs_with_a_file(settings, of_file, session, tmp_path):
    variants = [
        {"name": "mine", "controller": "FollowPath"},
        {"name": "far", "controller": "FollowPath", "parameters": {"lookahead_dist": 1.1}},
    ]
    check_commands(session_of(session, {"preset": FILE, **settings}, variants), of_file, tmp_path)


def test_a_file_keeps_its_own_behaviour_tree(session, tmp_path):
    """The tree's path is relative to the file."""
    path, tree = tmp_path / "robot.yaml", xml_of(f"<Sequence>{PLAN}{FOLLOW}</Sequence>")
    path.write_text(f"bt_navigator: {{ros__parameters: {{default_nav_to_pose_bt_xml: mine.xml}}}}\n{USERS_FILE}")
    (tmp_path / "mine.xml").write_text(tree)
    given = Given(controllers_from(["FollowPath"]), ParameterFile(params=str(path), nav2="humble"))
    for parameters in ({}, {"lookahead_dist": 1.1}):
        variant = {"name": "a", "controller": "FollowPath", "parameters": parameters}
        (one,) = planned(session_of(session, {"preset": FILE}, [variant]), given)
        assert one.plan.settings.navigation.bt.xml == tree


def test_a_file_may_have_controllers_that_are_not_built_here(session, tmp_path):
    """``mapbench bench`` takes such a file where the others are named."""
    path = tmp_path / "robot.yaml"
    path.write_text(
        "controller_server: {ros__parameters: {controller_plugins: [Teb, Pursuit], Teb: {plugin: 'teb::Teb'}, "
        "Pursuit: {plugin: 'nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController'}}}"
    )
    given = Given(controllers_from(["Pursuit"]), ParameterFile(params=str(path)))
    (one,) = planned(session_of(session, {"preset": FILE}, [{"name": "a", "controller": "Pursuit"}]), given)
    assert one.plan.settings.navigation.controllers["Pursuit"].kind == "rpp"


@pytest.mark.parametrize(("given_value", "saved_value"), [(1.1, "1.1"), (1, "1.0")])
def test_a_saved_file_keeps_all_but_the_changed_values(of_file, session, given_value, saved_value):
    """A whole number is saved as a double where Nav2 has a double."""
    variants = [{"name": "far", "controller": "FollowPath", "parameters": {"lookahead_dist": given_value}}]
    document = {**session, "settings": {"preset": FILE}, "variants": variants, "variant": "far"}
    saved = changed_file(AskParameters.from_mapping(document, "save"), of_file)
    assert saved == USERS_FILE.replace("lookahead_dist: 0.7", f"lookahead_dist: {saved_value}")


def test_lists_are_changed_as_the_page_gives_them(given, session):
    critics = ["RotateToGoal", "BaseObstacle", "PathDist", "GoalDist"]
    variants = [{"name": "dwb", "controller": "dwb", "parameters": {"critics": critics}}]
    (one,) = planned(session_of(session, {"preset": "thesis"}, variants), given)
    assert list(one.plan.settings.navigation.controller("dwb").params["critics"]) == critics
    variants[0]["parameters"] = {"critics": "PathDist"}
    with pytest.raises(ConfigError, match="critics: expected a list, got 'PathDist'"):
        planned(session_of(session, {"preset": "thesis"}, variants), given)


@pytest.mark.parametrize(
    ("settings", "parameters", "problem"),
    [
        ({"preset": "thesis"}, {"lookahead": 1.0}, "unknown parameter 'lookahead'"),
        ({"preset": "thesis"}, {"lookahead_dist": "far"}, "lookahead_dist: expected"),
        ({"preset": "thesis"}, {"lookahead_dist": -1.0}, "lookahead_dist: expected"),
        ({"preset": "thesis"}, {"release": "jazzy"}, "unknown parameter 'release'"),
        ({"preset": "thesis"}, {"lookahead_dist": [1]}, "expected a number, a text, true or false"),
        ({"preset": "thesys"}, {}, "unknown preset 'thesys'"),
        ({"preset": "thesis", "robot": "tank"}, {}, "unknown robot 'tank'"),
        ({"preset": "thesis", "noise": "loud"}, {}, "unknown noise level 'loud'"),
        ({"preset": "thesis", "robot": "jackal", "robot_radius": 0.2}, {}, "expected one of them"),
    ],
)
def test_errors_name_what_is_wrong(settings, parameters, problem, given, session):
    variants = [{"name": "rpp", "controller": "rpp", "parameters": parameters}]
    with pytest.raises(ConfigError, match=problem):
        planned(session_of(session, settings, variants), given)


@pytest.mark.parametrize("name", ["sac", "models/sac.zip", "os:system"])
def test_controllers_are_those_of_the_command_line(name, given, session):
    with pytest.raises(ConfigError, match="controller"):
        planned(session_of(session, {"preset": "thesis"}, [{"name": "x", "controller": name}]), given)
