"""RPP against what Nav2's own code recorded, call by call and run by run."""

from __future__ import annotations

import contextlib
import math

import numpy as np
import pytest

from controllers.base import ControllerError, FollowerSetup, Twist
from controllers.rpp.controller import RppFollower
from controllers.rpp.params import ROS_ONLY_KEYS, RppParams
from gym_mapbench.costmap import Costmap, CostmapParams, InflationLayer, LayeredCostmap
from gym_mapbench.errors import NoPathError
from gym_mapbench.planners.navfn import NavfnParams, NavfnPlanner
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose
from tests.oracle_data import each_recording

# Trajectories and commands are recorded to five decimals, in float32.
STORED = 2e-5


def make_follower(recorded, **changes):
    made = RppFollower(RppParams(**recorded.params("RPP", ROS_ONLY_KEYS, **changes)))
    made.reset(make_setup(recorded))
    return made


def make_setup(recorded):
    radius, inflation = (recorded.spec[key] for key in ("robot_radius", "inflation_radius"))
    return FollowerSetup(Footprint.from_radius(radius), 0.05, 0.25, 0.25, inflation, 3.0, np.random.default_rng(0))


def make_planner(recorded):
    return NavfnPlanner(NavfnParams(release=recorded.release))


def full_costmaps(recorded):
    plans = recorded.load("plans")
    grids = (np.ascontiguousarray(costs[::-1]) for costs in plans["costmap"])
    return {
        int(map_id): Costmap(costs, recorded.spec["resolution"], 0.0, 0.0)
        for map_id, costs in zip(plans["map_id"], grids, strict=True)
    }


def each_unit_vector(recorded, make, column):
    """Compare each recorded call with that of a new follower; yield its number and the follower."""
    costmaps, units = full_costmaps(recorded), recorded.load("units")
    for i, map_id in enumerate(units["map_id"]):
        made = make()
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
    for i, made in each_unit_vector(recorded, lambda: make_follower(recorded), "rpp"):
        assert made.carrot == pytest.approx(carrots[i], abs=1e-8)


def rolling_window(recorded, map_id, start):
    """The recorded 3 m x 3 m local costmap: the map's part around the robot, inflated by itself, at 5 Hz."""
    spec, maps = recorded.spec, recorded.arrays("maps.npz")
    occupied = maps["occupied"][maps["map_id"].tolist().index(map_id)]
    params = CostmapParams(
        rolling_window=True,
        width=3,
        height=3,
        resolution=spec["resolution"],
        plugins=("static_layer", "inflation_layer"),
        inflation_layer=InflationLayer(
            inflation_radius=spec["inflation_radius"], cost_scaling_factor=spec["cost_scaling_factor"]
        ),
    )
    grid = GridMap.from_image_array(occupied, spec["resolution"])
    window = LayeredCostmap(params, grid, Footprint.from_radius(spec["robot_radius"]))
    window.reset(start)
    return window


def drive(recorded, made, costmap, window, ticks):
    """Drive by the oracle's conditions; yields state and command of every 20 Hz tick, None where there was none."""
    start, goal = recorded.spec["start"], Pose(*recorded.spec["goal"])
    x, y, yaw, v, w = (*start, 0.0, 0.0)
    planner = make_planner(recorded)
    seen = costmap
    for tick in range(ticks):
        pose = Pose(x, y, yaw)
        if tick % 20 == 0:
            with contextlib.suppress(NoPathError):
                made.set_plan(planner.plan(costmap, pose, goal))
        if window is not None and tick % 4 == 0:
            seen = window.update(pose)
        velocity = Twist(*(speed if abs(speed) > 0.001 else 0.0 for speed in (v, w)))
        try:
            command = made.compute_velocity_commands(pose, velocity, seen, tick * 0.05)
        except ControllerError:
            command = None
        yield (x, y, yaw, v, w), command
        to_v, to_w = command or (0.0, 0.0)
        for _ in range(5):
            v += min(max(to_v - v, -0.025), 0.025)
            w += min(max(to_w - w, -0.032), 0.032)
            x += v * math.cos(yaw + w * 0.005) * 0.01
            y += v * math.sin(yaw + w * 0.005) * 0.01
            yaw += w * 0.01


@pytest.mark.parametrize(
    ("variant", "local"), [("default", "full"), ("default", "rolling"), ("short_lookahead", "full")]
)
@each_recording
def test_closed_loop_runs_come_out_the_same(recorded, variant, local):
    costmaps, runs = full_costmaps(recorded), recorded.load("runs")
    for run in recorded.runs("RPP", variant, local):
        rows = slice(*runs["offset"][run["index"] : run["index"] + 2])
        made = make_follower(recorded, **recorded.variant(f"RPP/{variant}"))
        start = Pose(*recorded.spec["start"])
        window = rolling_window(recorded, run["map"], start) if local == "rolling" else None
        compare(drive(recorded, made, costmaps[run["map"]], window, rows.stop - rows.start), runs, rows, run)


def compare(driven, runs, rows, run):
    """Every command and every state of a run, up to what is stored of them."""
    states, commands = zip(*driven, strict=True)
    assert [command is None for command in commands] == runs["exception"][rows].tolist(), run["map"]
    told = np.array([command or (0.0, 0.0) for command in commands])
    assert told == pytest.approx(runs["cmd"][rows], abs=STORED), run["map"]
    error = np.array(states) - runs["traj"][rows]
    error[:, 2] = np.arctan2(np.sin(error[:, 2]), np.cos(error[:, 2]))
    assert np.abs(error).max() < STORED, run["map"]
