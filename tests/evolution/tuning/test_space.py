"""Search spaces: what ships fits the controllers, and a bad file is refused in one line."""

from __future__ import annotations

from dataclasses import replace

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from controllers.nav2_params import load_preset, read_nav2_params
from controllers.nav2_params.values import values_of, with_values
from evolution.driving import DriveSettings
from evolution.tuning import SearchSpace, TuneSettings, TuningPlan, read_space, shipped_space, space_for
from evolution.tuning.parameter_text import text_of_settings, writable_space
from evolution.tuning.space import ParameterRange
from gym_mapbench.errors import ConfigError
from tests.evolution.tuning import fakes

CONTROLLERS = ("dwb", "mppi", "rpp", "graceful")
LIMITS = {
    *("max_vel_x", "min_vel_x", "max_speed_xy", "max_vel_theta", "acc_lim_x", "acc_lim_theta", "decel_lim_x"),
    *("vx_max", "vx_min", "wz_max", "ax_max", "ax_min", "az_max", "v_linear_max", "v_linear_min", "v_angular_max"),
    *("desired_linear_vel", "rotate_to_heading_angular_vel", "max_angular_accel"),
}


def shipped(controller, preset):
    settings = DriveSettings(navigation=preset)
    return settings.navigation, space_for(settings, controller)


@pytest.mark.parametrize("preset", ["fair", "jazzy_fair"])
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_shipped_spaces_name_parameters_of_the_controller(controller, preset):
    navigation, space = shipped(controller, preset)
    known = values_of(navigation, controller)
    assert len(space.parameters) >= 12
    assert set(space.parameters) <= set(known)
    for name, one in space.sampled.items():
        assert one.choices or one.low <= known[name] <= one.high, name


@pytest.mark.parametrize("preset", ["fair", "jazzy_fair"])
@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("end", ["low", "high"])
def test_controllers_accept_the_ends_of_the_bounds(controller, preset, end):
    navigation, space = shipped(controller, preset)
    ends = {
        name: one.choices[0] if one.choices else one.rounded(getattr(one, end)) for name, one in space.sampled.items()
    }
    ends = {name: int(value) if space.parameters[name].integer else value for name, value in ends.items()}
    values = space.completed(ends)
    found = values_of(with_values(navigation, controller, values), controller)
    assert {name: found[name] for name in values} == values


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_limits_are_fixed_and_the_inflation_is_tuned(controller):
    names = set(shipped_space(controller).parameters)
    assert not LIMITS & names
    layers = [f"{costmap}.inflation_layer" for costmap in ("local_costmap", "global_costmap")]
    assert {f"{layer}.{key}" for layer in layers for key in ("inflation_radius", "cost_scaling_factor")} <= names


def test_a_shim_has_the_space_of_the_controller_inside():
    assert shipped_space("shim_rpp") == shipped_space("rpp")


def test_a_release_drops_what_it_does_not_have():
    assert "curvature_lookahead_dist" in shipped("rpp", "jazzy")[1].parameters
    assert "curvature_lookahead_dist" not in shipped("rpp", "thesis")[1].parameters
    assert "ObstaclesCritic.repulsion_weight" not in shipped("mppi", "thesis")[1].parameters


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({}, "parameters: expected at least one parameter, got none"),
        ({"parameters": {"sim_tim": {"low": 1, "high": 2}}}, "unknown parameter 'sim_tim'; did you mean 'sim_time'"),
        ({"parameters": {"sim_time": {"low": 3, "high": 2}}}, "expected low below high, got low 3 and high 2"),
        ({"parameters": {"sim_time": {"low": 0, "high": 2, "log": True}}}, "expected low above 0 with log, got 0"),
        ({"parameters": {"sim_time": {"low": 1}}}, "expected low and high, choices, or same_as"),
        ({"parameters": {"vx_samples": {"low": 1.5, "high": 9, "integer": True}}}, "expected whole numbers"),
        ({"parameters": {"Twirling.scale": {"low": 1, "high": 2}}}, "expected a critic that the controller lists"),
        (
            {"parameters": {"sim_time": {"same_as": "vx_samples"}}},
            "expected a parameter of the space, got 'vx_samples'",
        ),
        ({"parameter": {}}, "unknown key 'parameter'; did you mean 'parameters'?"),
    ],
)
def test_bad_files_are_refused_in_one_line(document, message, tmp_path):
    path = tmp_path / "space.yaml"
    path.write_text(yaml.safe_dump(document))
    with pytest.raises(ConfigError) as error:
        space_for(DriveSettings(navigation="thesis"), "dwb", path)
    assert message in str(error.value)
    assert str(error.value).startswith(str(path))


def test_a_file_replaces_or_extends_the_shipped_space(tmp_path):
    path = tmp_path / "space.yaml"
    settings = DriveSettings(navigation="thesis")
    path.write_text("parameters: {max_vel_x: {low: 0.2, high: 0.4}}")
    assert set(space_for(settings, "dwb", path).parameters) == {"max_vel_x"}
    path.write_text("extends: true\nparameters: {max_vel_x: {low: 0.2, high: 0.4}}")
    assert set(space_for(settings, "dwb", path).parameters) == {"max_vel_x", *shipped("dwb", "thesis")[1].parameters}
    assert read_space(path).extends


@given(st.floats(1e-4, 1e4), st.booleans())
def test_rounded_values_have_three_digits_and_are_near(value, negative):
    one = ParameterRange(low=-1e4, high=1e4)
    signed = -value if negative else value
    rounded = one.rounded(signed)
    assert abs(rounded - signed) <= 0.005 * value
    assert float(f"{rounded:.3g}") == rounded


@pytest.mark.parametrize(
    ("low", "high", "sampled"), [(0.5, 1.047, 1.0466), (0.12348, 0.2, 0.1235), (-1.047, 0, -1.0466)]
)
def test_rounded_values_stay_within_the_bounds(low, high, sampled):
    assert low <= ParameterRange(low=low, high=high).rounded(sampled) <= high


def test_own_values_outside_of_the_bounds_go_to_the_nearest_bound():
    assert ParameterRange(low=1, high=2).nearest(3.0) == 2.0
    assert ParameterRange(low=1, high=9, integer=True).nearest(20) == 9
    assert ParameterRange(choices=(True, False)).nearest(False) is False
    assert ParameterRange(choices=("last", "sum")).nearest("product") == "last"


def test_followers_take_the_value_of_another_parameter():
    space = SearchSpace(parameters={"a": ParameterRange(low=0.1, high=1), "b": ParameterRange(same_as="a")})
    assert space.completed({"a": 0.12345}) == {"a": 0.123, "b": 0.123}
    assert space.without(frozenset("a")).parameters == {}


def test_whole_numbers_are_written_as_doubles_where_nav2_has_doubles():
    text = text_of_settings(DriveSettings(navigation=load_preset("thesis")), "rpp")
    radius = "local_costmap.inflation_layer.inflation_radius"
    changed = yaml.safe_load(text.with_values({"lookahead_dist": 1, radius: 1}))
    assert repr(changed["controller_server"]["ros__parameters"]["rpp"]["lookahead_dist"]) == "1.0"
    layer = changed["local_costmap"]["local_costmap"]["ros__parameters"]["inflation_layer"]
    assert repr(layer["inflation_radius"]) == "1.0"


def test_parameters_without_a_place_in_the_file_are_left_out():
    settings = DriveSettings(navigation=load_preset("thesis"))
    text = text_of_settings(settings, "dwb")
    space = space_for(settings, "dwb")
    assert writable_space(space, text) == space
    local = text.text.replace("global_costmap:", "other_costmap:")
    kept = writable_space(space, replace(text, text=local))
    assert set(space.parameters) - set(kept.parameters) == {
        name for name in space.parameters if name.startswith("global_costmap")
    }


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("use_rotate_to_heading", {"low": 0, "high": 1}, "use_rotate_to_heading: expected a valid boolean, got 0.618"),
        ("lookahead_dist", {"choices": ["near", "far"]}, "lookahead_dist: expected"),
        ("lookahead_dist", {"low": -2, "high": -1}, "lookahead_dist: expected greater than 0"),
        ("local_costmap.plugins", {"choices": ["a"]}, "local_costmap.plugins: expected a parameter with one value"),
    ],
)
def test_bounds_that_the_controller_refuses_are_refused_before_the_first_run(name, values, message):
    space = SearchSpace.from_mapping({"parameters": {name: values}}, "space")
    with pytest.raises(ConfigError, match=f"^space: the controller accepts no value of the search space.*{message}"):
        TuningPlan("rpp", fakes.WORLD, space, fakes.maps(1, 1), fakes.maps(1, 2), TuneSettings())


def test_fractions_for_a_whole_number_are_refused():
    space = SearchSpace(parameters={"vx_samples": ParameterRange(low=5, high=30)})
    with pytest.raises(ConfigError, match=r"vx_samples: expected a valid integer, got a number with a fractional part"):
        TuningPlan("dwb", fakes.WORLD, space, fakes.maps(1, 1), fakes.maps(1, 2), TuneSettings())


def test_the_example_file_can_be_tuned():
    read = read_nav2_params("examples/nav2_params.yaml")
    settings = DriveSettings(navigation=read.navigation)
    assert "lookahead_dist" in space_for(settings, "Pursuit").parameters
