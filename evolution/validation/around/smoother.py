"""Velocity smoother: ours is given the recorded commands and odometry, and its output compared."""

from __future__ import annotations

import numpy as np

from controllers.base import Twist
from controllers.nav2_params.navigation import VelocitySmoother as VelocitySmootherParams
from controllers.navigator.rate import TIME_RESOLUTION
from controllers.navigator.velocity_smoother import VelocitySmoother
from evolution.validation.around.behaviors import same_commands
from evolution.validation.around.plant import STEP, RecordedPlant
from evolution.validation.around.recordings import AroundOracle, Record
from evolution.validation.around.robot import Command
from evolution.validation.measures import Cases, Measure
from gym_mapbench.world.scenario import Pose

TICK = 0.001
"""Seconds between two looks at what is due."""


def smoother_measures(oracle: AroundOracle) -> list[Measure]:
    """Share of runs of the smoother with the recorded output."""
    cases = Cases("smoother_identical", ">= 1")
    for case in oracle.smoother:
        cases.add(float(not same_commands(replay(case), case["out"])), str(case["id"]))
    return [cases.agreement()]


def replay(case: Record) -> list[Command]:
    """Smooth the commands of one case on the recorded plant; returns what was published, with its time."""
    params = VelocitySmootherParams(**{name: case[name] for name in VelocitySmootherParams.model_fields})
    smoother = VelocitySmoother(params, first_time=int(1000 / params.smoothing_frequency) / 1000)
    plant, published = RecordedPlant(Pose(0.0, 0.0), Twist(0.0, 0.0)), []
    commands, odom_period = list(case["cmds"]), round(case["odom_period_ms"])
    for tick in range(round(case["end"] / TICK) + 1):
        now = tick * TICK
        if tick and tick % round(STEP / TICK) == 0:
            plant.advance(now)
        if tick % odom_period == 0:
            smoother.measure(Twist(*(np.array(plant.velocity) * case["odom_gain"]).tolist()), now)
        while commands and commands[0][0] <= now + TIME_RESOLUTION:
            time, v, w = commands.pop(0)
            smoother.take(Twist(v, w), time)
        output = smoother.advance(now)
        if output is not None:
            published.append((now, *output))
            plant.command = output
    return published
