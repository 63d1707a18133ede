"""The navigator's loop against the recorded one: same order, same ticks, on the recorded plant."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.base import STOP, Context, Twist
from controllers.navigator.navigator import Navigator
from evolution.validation.around.plant import RecordedPlant
from evolution.validation.oracle import Oracle
from evolution.validation.setup import make_follower, navigation_of, robot_of
from tests.oracle_data import ORACLE, needs_oracle

pytestmark = needs_oracle
PERIOD, TICKS = 0.05, 5


@pytest.fixture(scope="module")
def oracle() -> Oracle:
    return Oracle(ORACLE)


def drive_again(oracle: Oracle, preset, record) -> tuple[Navigator, np.ndarray]:
    follower = make_follower(oracle, record["controller"], record["variant"], record.get("seed"))
    navigator = Navigator(
        follower, navigation_of(oracle, preset, record["local_costmap"]), "again", abort_is_exception=True
    )
    grid = oracle.maps(preset)[record["map"]]
    navigator.reset(
        Context(robot_of(oracle, preset), grid, preset.start, preset.goal, PERIOD, np.random.default_rng(0))
    )
    plant, commands = RecordedPlant(preset.start, STOP), []
    while navigator.status == "running":
        pose = np.array(plant.pose)
        command = navigator.act({"pose": pose, "odom": pose, "velocity": np.array(plant.velocity)})
        commands.append(command)
        plant.command = Twist(*command)
        for _ in range(TICKS):
            plant.advance(0.0)
    return navigator, np.array(commands)


# Preset, controller, map: to the goal, or to the end of patience.
CASES = [
    ("A", "RPP", 0, "goal"),
    ("A", "RPP", 4, "controller_exception"),
    ("B", "RPP", 3, "controller_exception"),
    ("B", "DWB", 0, "goal"),
]


@pytest.mark.parametrize(("preset_name", "controller", "number", "reason"), CASES)
def test_recorded_run_is_driven_again(oracle, preset_name, controller, number, reason):
    preset = next(preset for preset in oracle.presets if preset.name == preset_name)
    wanted = {"map": number, "controller": controller, "variant": "default", "local_costmap": "full"}
    record = next(run for run in oracle.runs(preset) if wanted.items() <= run.items())
    assert record["reason"] == reason
    navigator, commands = drive_again(oracle, preset, record)
    assert (navigator.status == "succeeded") is record["success"]
    assert (len(commands) - 1) * PERIOD == pytest.approx(record["time"])
    assert sum(event.kind == "replan_failure" for event in navigator.events) == record["n_replan_fail"]
    offset = oracle.table("runs", preset)["offset"]
    recorded = oracle.table("runs", preset)["cmd"][offset[record["index"]] : offset[record["index"] + 1]]
    assert commands[:-1] == pytest.approx(recorded[: len(commands) - 1], abs=2e-5)
