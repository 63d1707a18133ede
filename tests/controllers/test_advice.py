"""What ``mapbench params check`` says of parameters with which a controller is known to get slow or to stop."""

from __future__ import annotations

import pytest
import yaml

from controllers.nav2_params import advise, read_nav2_params
from controllers.nav2_params.plugins import CONTROLLERS
from controllers.nav2_params.presets import PRESETS, load_preset
from evolution.cli import main
from gym_mapbench.ros_params import overlay
from tests.test_documents import ROOT

SLOW = {
    "dwb": ({}, {"forward_prune_distance": 1.0}, "forward_prune_distance 2:"),
    "mppi": (
        {"PathFollowCritic": {"threshold_to_consider": 0.5}, "prune_distance": 0.7},
        {"PathFollowCritic": {"threshold_to_consider": 0.5}, "prune_distance": 1.7},
        "threshold_to_consider 0.5, prune_distance 0.7:",
    ),
    "rpp": ({}, {"lookahead_dist": 0.4}, "lookahead_dist 0.6:"),
    "graceful": ({}, {"slowdown_radius": 0.6}, "slowdown_radius 1.5, motion_target_dist 0.6:"),
}
"""Controller -> parameters that are known to be slow, parameters that help, and what is said of the first."""


def said_of(kind, **params):
    """Return the advice for Humble's parameters with some changes."""
    plugin = CONTROLLERS[kind]
    return plugin.advice(plugin.complete(overlay(load_preset("thesis").controller(kind).params, params)))


@pytest.mark.parametrize("kind", SLOW)
def test_what_helps_silences_the_advice(kind):
    slow, fast, said = SLOW[kind]
    assert said in said_of(kind, **slow)
    assert not said_of(kind, **fast)
    assert said_of(f"shim_{kind}", **slow) == said_of(kind, **slow)


def test_what_is_off_is_not_advised_on():
    assert not said_of("rpp", use_collision_detection=False)
    assert not said_of("mppi", PathFollowCritic={"enabled": False})
    assert not said_of("mppi", critics=["GoalCritic", "CostCritic"])


def test_a_whole_plan_is_the_longest():
    plugin = CONTROLLERS["dwb"]
    params = overlay(load_preset("jazzy").controller("dwb").params, {"forward_prune_distance": -1.0})
    assert "forward_prune_distance -1:" in plugin.advice(plugin.complete(params))


@pytest.mark.parametrize("preset", ["jazzy_fair", "lyrical_fair"])
@pytest.mark.parametrize(("deviation", "said"), [(0.15, "vx_std 0.15:"), (0.2, "vx_std 0.2:"), (0.25, ""), (0.4, "")])
def test_narrow_samples_of_newer_releases_are_advised_on(preset, deviation, said):
    plugin = CONTROLLERS["mppi"]
    params = overlay(load_preset(preset).controller("mppi").params, {"vx_std": deviation})
    assert plugin.advice(plugin.complete(params)).startswith(said)
    assert bool(plugin.advice(plugin.complete(params))) == bool(said)


def test_humble_gets_one_advice_for_mppi():
    assert "vx_std" not in said_of("mppi")


@pytest.mark.parametrize("preset", PRESETS)
def test_releases_differ(preset):
    controllers = load_preset(preset).controllers
    said = {name for name, one in controllers.items() if CONTROLLERS[one.kind].advice(one.params)}
    silent = {"dwb"} if preset.startswith("lyrical") else set()
    assert said == {"dwb", "mppi", "rpp", "graceful"} & set(controllers) - silent


def test_check_prints_it(tmp_path, capsys):
    file = ROOT / "examples/nav2_params.yaml"
    assert main(["params", "check", str(file)]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("may get slow or stop: ")]
    assert [line.split(": ", 1)[1] for line in lines] == advise(read_nav2_params(file))
    values = yaml.safe_load(file.read_text(encoding="utf-8"))
    own = values["controller_server"]["ros__parameters"]
    own["FollowPath"]["forward_prune_distance"] = 1.0
    own["Pursuit"]["lookahead_dist"] = 0.4
    mended = tmp_path / "mended.yaml"
    mended.write_text(yaml.safe_dump(values), encoding="utf-8")
    assert main(["params", "check", str(mended)]) == 0
    assert "may get slow or stop" not in capsys.readouterr().out
