"""Single calls of MPPI, compared with the recorded ones under the recorded noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.mppi.evaluation import Evaluation, evaluate
from controllers.mppi.params import MppiParams
from controllers.mppi.path_handler import PathHandler
from evolution.validation.measures import Cases, Measure
from evolution.validation.oracle import Oracle, Preset
from evolution.validation.setup import follower_params, follower_setup, is_reproduced
from evolution.validation.units import Unit, difference, each_unit

UNDEFINED_READ = {"humble": "PathAlignCritic"}
"""The critic, by release, that reads past the end of its array: a few of its costs depend on the memory there."""

LARGEST = {"humble": "<= 0.026", "jazzy": "<= 1e-5"}
SHARE = {"humble": ">= 0.95", "jazzy": ">= 1"}
"""Targets of the commands by release: the largest error, m/s and rad/s, and the share within :data:`WITHIN`.

Humble's are wider because the costs in :data:`UNDEFINED_READ` change a few commands.
"""

WITHIN = 1e-4


def mppi_measures(oracle: Oracle) -> list[Measure]:
    """Measure the costs of the critics and the commands.

    A cost's error is relative to the recorded cost, or to 1 where that is smaller: the soft-max works on
    differences with a temperature of 0.3. Calls in which every trajectory collides are left out of the
    commands: Nav2 then draws new noise, which was not recorded.
    """
    release = oracle.release
    if not is_reproduced(oracle, "MPPI"):
        return []
    costs = Cases("mppi_cost_rel_err_max", "<= 1e-5")
    undefined = Cases("mppi_path_align_rel_err_max", "undefined read")
    commands = Cases("mppi_cmd_abs_err_max", LARGEST[release])
    for preset in oracle.presets:
        recorded = oracle.table("units_mppi", preset)
        rows = {int(row): position for position, row in enumerate(recorded["unit_index"])}
        for unit in each_unit(oracle, "MPPI", preset):
            ours = _evaluate(oracle, preset, unit)
            if unit.row in rows:
                errors = _cost_errors(ours, recorded["critic_cost"][rows[unit.row]])
                for critic, error in zip(recorded["critics"], errors, strict=True):
                    cases = undefined if critic == UNDEFINED_READ.get(release) else costs
                    cases.add(error, f"{unit.name} {critic}")
            if not unit.recorded["mppi_fail_flag"][unit.row]:
                commands.add(difference(ours.command, unit.recorded["mppi_cmd_stepwise"][unit.row]), unit.name)
    share = commands.share_within(WITHIN, "mppi_cmd_within_1e-4", SHARE[release])
    of_memory = [undefined.largest()] if undefined.errors else []
    return [costs.largest(), *of_memory, commands.largest(), share]


def _evaluate(oracle: Oracle, preset: Preset, unit: Unit) -> Evaluation:
    """Evaluate one recorded call with the recorded noise and control sequence."""
    params = MppiParams(**follower_params(oracle, "MPPI"))
    noise = oracle.arrays("mppi_noise.npz")
    paths = PathHandler(params)
    paths.set_plan(unit.plan)
    path = paths.local_path(unit.pose, unit.costmap)
    return evaluate(
        params,
        follower_setup(oracle, preset),
        unit.pose,
        unit.velocity,
        path,
        unit.costmap,
        (unit.recorded["mppi_seq_in_vx"][unit.row], unit.recorded["mppi_seq_in_wz"][unit.row]),
        (noise["vx"], noise["wz"]),
        paths.goal(path),
    )


def _cost_errors(ours: Evaluation, recorded: NDArray[np.float32]) -> NDArray[np.float64]:
    """Largest relative difference over the batch, for each critic."""
    expected = recorded.astype(np.float64)
    errors: NDArray[np.float64] = (np.abs(ours.costs - expected) / np.maximum(np.abs(expected), 1.0)).max(axis=1)
    return errors
