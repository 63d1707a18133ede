"""Single calls of MPPI, compared with the recorded ones under the recorded noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.base import STOP, Twist
from controllers.mppi.evaluation import Evaluation, evaluate
from controllers.mppi.params import MppiParams
from controllers.mppi.path_handler import PathHandler, end_of
from evolution.validation.measures import Cases, Measure
from evolution.validation.oracle import Oracle, Preset
from evolution.validation.setup import follower_params, follower_setup
from evolution.validation.units import Unit, difference, each_unit

UNDEFINED_READ = {"humble": "PathAlignCritic"}
"""The critic, by release, that reads past the end of its array: a few of its costs depend on the memory there."""

LARGEST = {"humble": "<= 0.026", "jazzy": "<= 1e-5", "lyrical": "<= 1e-5"}
SHARE = {"humble": ">= 0.95", "jazzy": ">= 1", "lyrical": ">= 1"}
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
    costs = Cases("mppi_cost_rel_err_max", "<= 1e-5")
    undefined = Cases("mppi_path_align_rel_err_max", "undefined read")
    commands = Cases("mppi_cmd_abs_err_max", LARGEST[release])
    steps = _Steps()
    for preset in oracle.presets:
        recorded = oracle.table("units_mppi", preset)
        rows = {int(row): position for position, row in enumerate(recorded["unit_index"])}
        for unit in each_unit(oracle, "MPPI", preset):
            ours, failed = _evaluate(oracle, preset, unit), bool(unit.recorded["mppi_fail_flag"][unit.row])
            if unit.row in rows and not (failed and release == "lyrical"):
                errors = _cost_errors(ours, recorded["critic_cost"][rows[unit.row]])
                for critic, error in zip(recorded["critics"], errors, strict=True):
                    cases = undefined if critic == UNDEFINED_READ.get(release) else costs
                    cases.add(error, f"{unit.name} {critic}")
            if not failed:
                commands.add(difference(ours.command, unit.recorded["mppi_cmd_stepwise"][unit.row]), unit.name)
            if release == "lyrical":
                steps.add(ours, unit)
    share = commands.share_within(WITHIN, "mppi_cmd_within_1e-4", SHARE[release])
    of_memory = [undefined.largest()] if undefined.errors else []
    return [costs.largest(), *of_memory, commands.largest(), share, *(steps.measures() if release == "lyrical" else [])]


class _Steps:
    """The steps of a call, which Lyrical's recordings hold one by one.

    Lyrical asks no critic after one that all trajectories fail. Its recordings have single critics' costs of such calls
    all the same, and with them another result; they are left out.
    """

    def __init__(self) -> None:
        self._starts = Cases("mppi_start_abs_err_max", "<= 1e-6")
        self._sequences = Cases("mppi_sequence_abs_err_max", "<= 5e-5")
        self._furthest = Cases("mppi_furthest_agreement", ">= 1")
        self._verdicts = Cases("mppi_validator_agreement", ">= 1")

    def add(self, ours: Evaluation, unit: Unit) -> None:
        """Compare one call."""
        row, recorded = unit.row, unit.recorded
        self._starts.add(difference(ours.start, recorded["mppi_speed_used"][row]), unit.name)
        self._verdicts.add(float(ours.refused != recorded["mppi_validator_reset"][row]), unit.name)
        if recorded["mppi_fail_flag"][row]:
            return
        self._furthest.add(float(ours.furthest != recorded["mppi_furthest"][row]), unit.name)
        for v, w, name in (
            (ours.softmax_v, ours.softmax_w, "softmax"),
            (ours.filtered_v, ours.filtered_w, "filtered"),
            (ours.limited_v, ours.limited_w, "out"),
        ):
            errors = v - recorded[f"mppi_seq_{name}_vx"][row], w - recorded[f"mppi_seq_{name}_wz"][row]
            self._sequences.add(float(np.abs(errors).max()), f"{unit.name} {name}")

    def measures(self) -> list[Measure]:
        """The largest errors and the shares that agree."""
        shares = self._furthest.agreement(), self._verdicts.agreement()
        return [self._starts.largest(), self._sequences.largest(), *shares]


def _evaluate(oracle: Oracle, preset: Preset, unit: Unit) -> Evaluation:
    """Evaluate one recorded call with the recorded noise and control sequence."""
    params = MppiParams(**follower_params(oracle, "MPPI"))
    noise, recorded = oracle.arrays("mppi_noise.npz"), unit.recorded
    if unit.local is None:
        paths = PathHandler(params)
        paths.set_plan(unit.plan)
        path = paths.local_path(unit.pose, unit.costmap)
        goal = paths.goal(path)
    else:
        path, goal = unit.local.path, end_of(unit.local.path)
    return evaluate(
        params,
        follower_setup(oracle, preset),
        unit.pose,
        unit.velocity,
        path,
        unit.costmap,
        (recorded["mppi_seq_in_vx"][unit.row], recorded["mppi_seq_in_wz"][unit.row]),
        (noise["vx"], noise["wz"]),
        goal,
        Twist(*recorded["last_cmd"][unit.row].tolist()) if "last_cmd" in recorded else STOP,
    )


def _cost_errors(ours: Evaluation, recorded: NDArray[np.float32]) -> NDArray[np.float64]:
    """Largest relative difference over the batch, for each critic."""
    expected = recorded.astype(np.float64)
    errors: NDArray[np.float64] = (np.abs(ours.costs - expected) / np.maximum(np.abs(expected), 1.0)).max(axis=1)
    return errors
