"""The navigator's loop against the recorded one: same order, same ticks, on the recorded plant."""

from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.base import Context
from controllers.navigator.navigator import Navigator
from evolution.validation.oracle import Oracle
from evolution.validation.setup import make_follower, navigation_of, robot_of
from gym_mapbench.world.scenario import Pose, wrap_angle
from tests.oracle_data import ORACLE, needs_oracle

pytestmark = needs_oracle
PERIOD, TICKS = 0.05, 5


class RecordedPlant:
    """The integrator of the recorded runs: 100 Hz, bounded accelerations, heading at mid-step."""

    def __init__(self, start: Pose) -> None:
        self.pose, self.v, self.w = start, 0.0, 0.0

    def drive(self, command) -> None:
        dt = PERIOD / TICKS
        for _ in range(TICKS):
            self.v += float(np.clip(command[0] - self.v, -2.5 * dt, 2.5 * dt))
            self.w += float(np.clip(command[1] - self.w, -3.2 * dt, 3.2 * dt))
            x, y, yaw = self.pose
            middle = yaw + self.w * dt / 2
            self.pose = Pose(
                x + self.v * math.cos(middle) * dt, y + self.v * math.sin(middle) * dt, wrap_angle(yaw + self.w * dt)
            )


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
    plant, commands = RecordedPlant(preset.start), []
    while navigator.status == "running":
        pose = np.array(plant.pose)
        command = navigator.act({"pose": pose, "odom": pose, "velocity": np.array((plant.v, plant.w))})
        commands.append(command)
        plant.drive(command)
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
