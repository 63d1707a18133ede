"""RPP against what Nav2's own code recorded, call by call and run by run."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest

from controllers.base import STOP, ControllerError, Twist
from evolution.validation.around.plant import RecordedPlant
from evolution.validation.setup import costmap_params, footprint_of, make_planner
from gym_mapbench.costmap import LayeredCostmap
from gym_mapbench.errors import NoPathError
from gym_mapbench.world.scenario import Pose
from tests.oracle.recordings import each_recording

# Trajectories and commands are recorded to five decimals, in float32.
STORED = 2e-5


def each_unit_vector(recorded, controller, column):
    """Compare each recorded call with that of a new follower; yield its number and the follower."""
    costmaps, units = recorded.costmaps, recorded.load("units")
    for i, map_id in enumerate(units["map_id"]):
        made = recorded.follower(controller)
        begin, end = units["path_offset"][i : i + 2]
        made.set_plan(units["path"][begin:end])
        call = Pose(*units["pose"][i].tolist()), Twist(*units["vel"][i].tolist()), costmaps[int(map_id)], 0.0
        message = str(units[f"{column}_exception"][i])
        if message:
            with pytest.raises(ControllerError) as raised:
                made.compute_velocity_commands(*call)
            assert str(raised.value) == message
        else:
            assert made.compute_velocity_commands(*call) == pytest.approx(units[f"{column}_cmd"][i], abs=1e-8)
        yield i, made


@each_recording
def test_unit_vectors(recorded):
    carrots = recorded.load("units")["rpp_carrot"]
    for i, made in each_unit_vector(recorded, "RPP", "rpp"):
        assert made.carrot == pytest.approx(carrots[i], abs=1e-8)


def rolling_window(recorded, map_id):
    """The recorded 3 m x 3 m local costmap: the map's part around the robot, inflated by itself, at 5 Hz."""
    params = costmap_params(recorded.oracle, recorded.preset, rolling=True)
    window = LayeredCostmap(params, recorded.oracle.maps(recorded.preset)[map_id], footprint_of(recorded.preset))
    window.reset(recorded.preset.start)
    return window


def drive(recorded, made, costmap, window, ticks):
    """Drive by the oracle's conditions; yields state and command of every 20 Hz tick, None where there was none."""
    plant, planner, seen = RecordedPlant(recorded.preset.start, STOP), make_planner(recorded.oracle), costmap
    for tick in range(ticks):
        if tick % 20 == 0:
            with contextlib.suppress(NoPathError):
                made.set_plan(planner.plan(costmap, plant.pose, recorded.preset.goal))
        if window is not None and tick % 4 == 0:
            seen = window.update(plant.pose)
        velocity = Twist(*(speed if abs(speed) > 0.001 else 0.0 for speed in plant.velocity))
        try:
            command = made.compute_velocity_commands(plant.pose, velocity, seen, tick * 0.05)
        except ControllerError:
            command = None
        yield (*plant.pose, *plant.velocity), command
        plant.command = command or STOP
        for _ in range(5):
            plant.advance(0.0)


def check_runs(recorded, controller, variant, local, most=None, ticks=10_000):
    """Every command and every state of runs of one kind, up to what is stored of them.

    Args:
        recorded: The recording.
        controller: Name of the controller there.
        variant: Its variant.
        local: Local costmap, ``full`` or ``rolling``.
        most: Largest number of runs.
        ticks: Largest number of ticks of a run.
    """
    costmaps, runs = recorded.costmaps, recorded.load("runs")
    for run in recorded.runs(controller, variant, local)[:most]:
        begin, end = runs["offset"][run["index"] : run["index"] + 2]
        rows = slice(begin, min(end, begin + ticks))
        window = rolling_window(recorded, run["map"]) if local == "rolling" else None
        made = recorded.follower(controller, variant)
        driven = drive(recorded, made, costmaps[run["map"]], window, rows.stop - rows.start)
        compare(driven, runs, rows, run)


@pytest.mark.parametrize(
    ("variant", "local"), [("default", "full"), ("default", "rolling"), ("short_lookahead", "full")]
)
@each_recording
def test_closed_loop_runs_come_out_the_same(recorded, variant, local):
    check_runs(recorded, "RPP", variant, local)


def compare(driven, runs, rows, run):
    """Every command and every state of a run, up to what is stored of them."""
    states, commands = zip(*driven, strict=True)
    assert [command is None for command in commands] == runs["exception"][rows].tolist(), run["map"]
    told = np.array([command or (0.0, 0.0) for command in commands])
    assert told == pytest.approx(runs["cmd"][rows], abs=STORED), run["map"]
    error = np.array(states) - runs["traj"][rows]
    error[:, 2] = np.arctan2(np.sin(error[:, 2]), np.cos(error[:, 2]))
    assert np.abs(error).max() < STORED, run["map"]
