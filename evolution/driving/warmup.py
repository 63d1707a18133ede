"""What a new worker does before its first job: load the kernels, so that no run is charged for that."""

from __future__ import annotations

import os

from evolution.driving.jobs import ControllerSpec
from evolution.driving.one_run import environment_for, run_episode
from evolution.driving.worker import DriveSettings, build_controller
from gym_mapbench.config import EnvConfig
from gym_mapbench.gridmap import GridMap
from gym_mapbench.scenario import Pose, Scenario

ROOM = ("#" * 50, *["#" + "." * 48 + "#"] * 48, "#" * 50)


def warm_up(kinds: tuple[str, ...] = ("dwb", "mppi", "rpp")) -> None:
    """Drive each of the named controllers for half a second through an empty room.

    On a machine where nothing is compiled yet, workers that start together should not all compile the same
    kernels: each begins with another controller, and finds in numba's cache what the others have compiled.
    """
    turn = os.getpid() % len(kinds)
    scenario = Scenario(GridMap.from_rows(ROOM), Pose(0.6, 0.6), Pose(1.9, 1.9))
    settings = DriveSettings(environment=EnvConfig(time_limit=0.5), navigation="thesis")
    for kind in (*kinds[turn:], *kinds[:turn]):
        controller = build_controller(ControllerSpec(name=kind), settings)
        env = environment_for(settings.environment, controller)
        run_episode(env, controller, scenario, name=kind, seed=0)
