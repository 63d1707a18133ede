from __future__ import annotations

from importlib.metadata import EntryPoint

import pytest

from controllers.nav2_params import load_preset, parse_nav2_params
from controllers.navigator.navigator import Navigator
from controllers.registry import CONTROLLERS, FOLLOWERS, make_controller
from controllers.rl import as_controller
from gym_mapbench import registry
from gym_mapbench.errors import ConfigError, PluginError
from gym_mapbench.trust import only_code_named_in
from tests.controllers.plain_follower import PlainFollower


def test_names():
    assert {"dwb", "mppi", "rpp"} <= set(CONTROLLERS.names())


@pytest.mark.parametrize("name", ["dwb", "mppi", "rpp"])
def test_values_of_the_preset(name):
    controller = make_controller(name)
    assert isinstance(controller, Navigator)
    assert controller.name == name
    assert controller.params == load_preset("thesis")
    assert controller.follower.params.model_dump(mode="json", exclude_none=True) == (
        load_preset("thesis").controllers[name].params
    )


def test_fair_preset():
    assert make_controller("dwb", preset="fair").follower.params.max_vel_x == 0.5


@pytest.mark.parametrize(("preset", "top"), [("fair", 1.9), ("jazzy_fair", 1.9), ("thesis", 1.0), ("jazzy", 1.0)])
def test_the_graceful_controller_has_the_limits_of_a_fair_preset(preset, top):
    params = make_controller("graceful", preset=preset).follower.params
    assert (params.v_angular_max, params.v_linear_max) == (top, 0.5)
    assert params.release == load_preset(preset).release


def test_a_shim_nobody_configured_is_around_the_controller_of_the_preset():
    follower = make_controller("shim_dwb", preset="fair", angular_dist_threshold=0.5).follower
    assert follower.primary.params.max_vel_x == 0.5
    assert (follower.params.angular_dist_threshold, follower.params.angular_disengage_threshold) == (0.5, 0.785)
    assert make_controller("shim_graceful", preset="jazzy").follower.params.angular_disengage_threshold == 0.3925


def test_some_parameters_differ():
    params = make_controller("dwb", vx_samples=7, **{"PathAlign.scale": 3.0}).follower.params
    assert (params.vx_samples, params.PathAlign.scale) == (7, 3.0)
    assert params.PathAlign.forward_point_distance == 0.1
    assert params.GoalAlign.scale == 24.0


def test_newer_name_is_understood():
    assert make_controller("rpp", max_linear_vel=0.3).follower.params.desired_linear_vel == 0.3


def test_label():
    assert make_controller("rpp", label="slow", desired_linear_vel=0.1).name == "slow"


def test_own_name_in_a_parameter_file():
    section = {
        "controller_plugins": ["FollowPath"],
        "FollowPath": {"plugin": "dwb_core::DWBLocalPlanner", "critics": ["PathDist"]},
    }
    document = {"controller_server": {"ros__parameters": section}}
    navigation = parse_nav2_params(document, load_preset("thesis")).navigation
    for name in ("FollowPath", "dwb"):
        assert make_controller(name, navigation=navigation).follower.params.critics == ("PathDist",)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"name": "dbw"}, "unknown controller 'dbw'; did you mean 'dwb'?"),
        ({"name": "rpp", "lookahead_distance": 1.0}, "rpp.lookahead_distance: unknown parameter; did you mean"),
        ({"name": "dwb", "PathAlign.scael": 1.0}, "'PathAlign.scale'"),
        ({"name": "rpp", "use_dynamic_window": True}, "only other releases of Nav2 have this parameter"),
        ({"name": "rpp", "lookahead_dist": -1.0}, "rpp.lookahead_dist: expected greater than 0, got -1.0"),
        ({"name": "rpp", "preset": "tesis"}, "unknown preset 'tesis'; did you mean 'thesis'?"),
        ({"name": "model.zip", "gamma": 1.0}, "model.zip: a model takes no parameters, got gamma"),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises(ConfigError) as refused:
        make_controller(**arguments)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("arguments", "path"),
    [
        ({"name": "learned=runs/lr=3/m.zip"}, "runs/lr=3/m.zip"),
        ({"name": "runs/lr=3/m.zip", "label": "learned"}, "runs/lr=3/m.zip"),
    ],
)
def test_the_folder_of_a_model_may_have_an_equals_sign(arguments, path):
    named = only_code_named_in(["bench", "--controllers", "dwb,learned=runs/lr=3/m.zip"])
    with named, pytest.raises(ConfigError, match=f"^learned: {path} does not exist"):
        make_controller(**arguments)


def make_mine(navigation, speed=0.1):
    return Navigator(PlainFollower(), navigation, f"mine at {speed}")


def make_of_anything(**options):
    return as_controller(lambda observation: (0.1, 0.0), f"mine of {options}")


def make_learned():
    return as_controller(lambda observation: (0.1, 0.0), "learned")


def make_nothing():
    return None


def make_trouble(navigation):
    raise OSError("no robot there")


HERE = "tests.controllers.test_registry"


def test_any_function_of_a_module_makes_a_controller():
    assert make_controller(f"{HERE}:make_mine", speed=0.3).name == "mine at 0.3"
    assert make_controller(f"{HERE}:make_of_anything", speed=0.3).name == "mine of {'speed': 0.3}"
    with pytest.raises(ConfigError, match=f"controller '{HERE}:make_nothing': expected one with 'observation_keys'"):
        make_controller(f"{HERE}:make_nothing")
    with pytest.raises(PluginError, match=r"make_trouble': OSError: no robot there, test_registry.py line \d+"):
        make_controller(f"{HERE}:make_trouble")


def plain_policy(observation):
    return 0.1, 0.0


class PolicyObject:
    def predict(self, observation):
        return 0.1, 0.0


def make_policy():
    return plain_policy


ready = PolicyObject()
learned = make_learned()


@pytest.mark.parametrize(
    ("name", "got"),
    [
        (
            "plain_policy",
            "expected a class, or a function that makes a controller, got a callable that needs observation",
        ),
        ("PolicyObject", "expected one with 'observation_keys', got a PolicyObject"),
        ("make_policy", "expected one with 'observation_keys', got a function"),
        ("ready", "expected a class, or a function that makes a controller, got a PolicyObject"),
    ],
)
def test_a_policy_is_told_how_it_becomes_a_controller(name, got):
    with pytest.raises(ConfigError, match=f"{got}; controllers.rl.as_controller makes a controller of a policy"):
        make_controller(f"{HERE}:{name}")


def test_a_controller_is_not_taken_for_what_makes_one():
    with pytest.raises(ConfigError, match=r"a function that makes a controller, got a PolicyController$"):
        make_controller(f"{HERE}:learned")


class TestThirdParties:
    @pytest.fixture(autouse=True)
    def registered(self, monkeypatch):
        def points(group):
            assert group == "gym_mapbench.controllers"
            here = "tests.controllers.test_registry"
            return [
                EntryPoint("mine", f"{here}:make_mine", group),
                EntryPoint("learned", f"{here}:make_learned", group),
                EntryPoint("broken", f"{here}:nothing", group),
            ]

        monkeypatch.setattr(registry, "entry_points", points)

    def test_listed_with_the_others(self):
        assert CONTROLLERS.names() == tuple(sorted({"broken", "learned", "mine", *FOLLOWERS}))

    def test_gets_its_parameters_and_the_navigation(self):
        controller = make_controller("mine", preset="fair", speed=0.2)
        assert (controller.name, controller.params) == ("mine at 0.2", load_preset("fair"))

    def test_needs_no_navigation(self):
        assert make_controller("learned").name == "learned"

    def test_unknown_parameter(self):
        with pytest.raises(ConfigError, match="unknown parameter of mine 'sped'; did you mean 'speed'"):
            make_controller("mine", sped=0.2)

    def test_broken_entry_point(self):
        with pytest.raises(ConfigError, match=r"controller 'broken': .*:nothing cannot be loaded \(.*\)"):
            make_controller("broken")
