"""Single calls: costmaps, plans and commands compared with the recorded ones."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from controllers.base import ControllerAbort, ControllerError, LocalPlan, PathFollower, Twist
from controllers.dwb.controller import DwbFollower
from controllers.navigator.path_handler import FeasiblePathHandler
from controllers.rpp.controller import RppFollower
from controllers.rpp.lyrical import LyricalRppFollower
from evolution.validation.measures import Cases, Measure
from evolution.validation.oracle import Oracle, Preset, ragged
from evolution.validation.recorded import Arrays
from evolution.validation.setup import follower_setup, full_costmaps, make_follower, make_planner, path_handler_of
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import NoPathError
from gym_mapbench.planners.navfn import NavfnPlanner
from gym_mapbench.world.scenario import Pose

OTHERS = {"Graceful": "graceful", "RotationShim": "shim"}
"""Prefix of the column names, by controller, for controllers that only some recordings have."""


WHOLE_BEARINGS = ">= 0.95"
"""Target of the Rotation Shim's commands in Lyrical with the recorded parameters: the recorder was built with the
integer ``abs`` alone, and so did not turn on the spot for bearings between ``angular_dist_threshold`` and 1 rad."""


def costmap_measures(oracle: Oracle) -> list[Measure]:
    """Share of cells whose cost is the recorded one."""
    cases, cells = Cases("costmap_cell_agreement", ">= 1"), 0
    for preset in oracle.presets:
        ours, plans = full_costmaps(oracle, preset), oracle.table("plans", preset)
        for number, recorded in zip(plans["map_id"], plans["costmap"], strict=True):
            differs = ours[int(number)].costs != recorded[::-1]
            cells += differs.size
            cases.add(float(differs.mean()), f"preset {preset.name} map {number}")
    return [cases.agreement(cells)]


def navfn_measures(oracle: Oracle) -> list[Measure]:
    """Relative errors of the potentials, and the largest distance of a path from the recorded one."""
    potentials, paths = Cases("navfn_potential_rel_err_max", "< 1e-6"), Cases("navfn_path_dev_cells_max", "< 1e-3")
    planner = make_planner(oracle)
    for preset in oracle.presets:
        costmaps, plans = full_costmaps(oracle, preset), oracle.table("plans", preset)
        for number, recorded in _potentials(plans):
            ours = planner.potential(costmaps[number], preset.start, preset.goal)
            potentials.add(_potential_error(ours, recorded[::-1]), f"preset {preset.name} map {number}")
        for number, found, path in zip(plans["map_id"], plans["found"], ragged(plans, "path"), strict=True):
            error = _path_deviation(_plan(planner, costmaps[int(number)], preset.start, preset.goal), path, bool(found))
            paths.add(error / preset.resolution, f"preset {preset.name} map {number}")
    return [*([potentials.largest()] if potentials.errors else []), paths.largest()]


def _potentials(plans: Arrays) -> Iterator[tuple[int, NDArray[np.float32]]]:
    """Yield the id of a map and its recorded potential, for the maps that have one; Lyrical's recordings have none."""
    if "potential" in plans:
        yield from zip(plans["potential_map_id"].tolist(), plans["potential"], strict=True)


def local_plan_measures(oracle: Oracle) -> list[Measure]:
    """Largest difference of the path handler's local plans from the recorded ones, m and rad (Lyrical)."""
    plans, lengths = Cases("local_plan_abs_err_max", "<= 0"), Cases("local_plan_length_abs_err_max", "<= 1e-6")
    if oracle.release != "lyrical":
        return []
    for unit in each_unit(oracle, "RPP"):
        recorded = recorded_path(unit.recorded, "local_path", unit.row)
        ours = unit.local.path if unit.local is not None else np.empty((0, 3))
        same = ours.shape == recorded.shape
        plans.add(float(np.abs(ours - recorded).max()) if same else np.inf, unit.name)
        length = unit.local.length if unit.local is not None else np.inf
        lengths.add(abs(length - float(unit.recorded["local_path_length"][unit.row])), unit.name)
    return [plans.largest(), lengths.largest()]


def rpp_measures(oracle: Oracle) -> list[Measure]:
    """Largest difference of a command's components, and of the carrot's; an exception counts as a zero command."""
    commands, carrots = Cases("rpp_cmd_abs_err_max", "< 1e-6"), Cases("rpp_carrot_abs_err_max", "< 1e-6")
    for unit in each_unit(oracle, "RPP"):
        if not isinstance(unit.follower, RppFollower):
            continue
        command = _command(unit)
        commands.add(difference(command, unit.recorded["rpp_cmd"][unit.row]), unit.name)
        carrots.add(difference(unit.follower.carrot, unit.recorded["rpp_carrot"][unit.row]), unit.name)
    return [commands.largest(), carrots.largest()]


def dynamic_window_measures(oracle: Oracle) -> list[Measure]:
    """Largest difference of the commands of RPP with its dynamic window around the recorded last command (Lyrical)."""
    commands = Cases("rpp_dynamic_window_cmd_abs_err_max", "< 1e-6")
    if oracle.release != "lyrical":
        return []
    for unit in each_unit(oracle, "RPP", changes={"use_dynamic_window": True}):
        if isinstance(unit.follower, LyricalRppFollower):
            unit.follower.last_command = Twist(*unit.recorded["last_cmd"][unit.row].tolist())
            commands.add(difference(_command(unit), unit.recorded["rpp_dynamic_window_cmd"][unit.row]), unit.name)
    return [commands.largest()]


def dwb_measures(oracle: Oracle) -> list[Measure]:
    """Whether the same sample is chosen, and how far scores differ; 1 if a sample is legal on one side only."""
    choices, scores = Cases("dwb_choice_agreement", ">= 1"), Cases("dwb_score_rel_err_max", "<= 1e-6")
    for preset in oracle.presets:
        recorded = oracle.table("units_dwb", preset)
        totals, best = list(ragged(recorded, "total")), recorded["best_index"]
        for unit in each_unit(oracle, "DWB", preset):
            if not isinstance(unit.follower, DwbFollower):
                continue
            ours = unit.follower.evaluate(unit.pose, unit.velocity, unit.costmap, 0.0)
            scores.add(_score_error(ours.totals, totals[unit.row]), unit.name)
            none_legal = bool((totals[unit.row] < 0).all())
            same = ours.best == -1 if none_legal else ours.best == best[unit.row]
            choices.add(0.0 if same else 1.0, unit.name)
    return [choices.agreement(), scores.largest()]


def other_measures(oracle: Oracle) -> list[Measure]:
    """Largest difference of a command's components, for each further controller that was recorded.

    Lyrical's Rotation Shim is compared with the recorder's threshold, and with Nav2's.
    """
    measures = []
    for kind, column in OTHERS.items():
        whole = kind == "RotationShim" and oracle.release == "lyrical"
        commands = _other_commands(oracle, kind, column, _recorders_threshold(oracle) if whole else {})
        if not commands.errors:
            continue
        measures.append(commands.largest())
        if whole:
            nav2s = _other_commands(oracle, kind, column, {})
            measures.append(nav2s.share_within(1e-6, f"{column}_cmd_within_1e-6", WHOLE_BEARINGS))
    return measures


def _recorders_threshold(oracle: Oracle) -> dict[str, float]:
    """Return the threshold that acts if the bearing is cut off to an integer before the comparison, rad."""
    threshold = oracle.config["controllers"]["RotationShim"]["angular_dist_threshold"]
    return {"angular_dist_threshold": math.nextafter(math.floor(threshold) + 1.0, 0.0)}


def _other_commands(oracle: Oracle, kind: str, column: str, changes: Mapping[str, Any]) -> Cases:
    """Compare the commands of a controller, with some of its parameters changed, if it was recorded."""
    commands = Cases(f"{column}_cmd_abs_err_max", "< 1e-6")
    for preset in oracle.presets:
        recorded = oracle.table("units", preset).get(f"{column}_cmd")
        if recorded is None or kind not in oracle.config["controllers"]:
            continue
        for unit in each_unit(oracle, kind, preset, changes):
            commands.add(difference(_command(unit), recorded[unit.row]), unit.name)
    return commands


@dataclass(frozen=True)
class Unit:
    """One recorded call: a freshly reset controller with its plan, and the arguments of the call."""

    preset: Preset
    row: int
    name: str
    follower: PathFollower
    plan: NDArray[np.float64]
    pose: Pose
    velocity: Twist
    costmap: Costmap
    recorded: Arrays
    local: LocalPlan | None


def each_unit(
    oracle: Oracle, kind: str, only: Preset | None = None, changes: Mapping[str, Any] | None = None
) -> Iterator[Unit]:
    """Yield all recorded calls of one controller, with some of its parameters changed.

    Plans of Humble and Jazzy are those of our own planner, as the stored paths are rounded; Lyrical's are not.
    """
    planner = make_planner(oracle)
    for preset in oracle.presets if only is None else (only,):
        costmaps, units = full_costmaps(oracle, preset), oracle.table("units", preset)
        follower = make_follower(oracle, kind, **(changes or {}))
        for row, number in enumerate(units["map_id"]):
            costmap = costmaps[int(number)]
            follower.reset(follower_setup(oracle, preset))
            pose = Pose(*units["pose"][row].tolist())
            if oracle.release == "lyrical":
                plan = recorded_path(units, "path", row)
            else:
                plan = planner.plan(costmap, Pose(*units["plan_from"][row].tolist()), preset.goal)
            follower.set_plan(plan)
            yield Unit(
                preset=preset,
                row=row,
                name=f"preset {preset.name} map {number} sample {units['sample'][row]}",
                follower=follower,
                plan=plan,
                pose=pose,
                velocity=Twist(*units["vel"][row].tolist()),
                costmap=costmap,
                recorded=units,
                local=_give_local_plan(oracle, follower, plan, pose, costmap),
            )


def recorded_path(units: Arrays, name: str, row: int) -> NDArray[np.float64]:
    """Return one of the recorded paths, ``(n, 3)``."""
    begin, end = units[f"{name}_offset"][row : row + 2]
    path: NDArray[np.float64] = units[name][begin:end]
    return path


def _give_local_plan(
    oracle: Oracle, follower: PathFollower, plan: NDArray[np.float64], pose: Pose, costmap: Costmap
) -> LocalPlan | None:
    """Give the follower the local plan that the path handler cuts, which only Lyrical has."""
    if oracle.release != "lyrical":
        return None
    handler = FeasiblePathHandler(path_handler_of(oracle))
    handler.set_plan(plan)
    local = handler.local_plan(pose, costmap)
    take = getattr(follower, "take_local_plan", None)
    if take is not None:
        take(local)
    return local


def _command(unit: Unit) -> Twist:
    try:
        return unit.follower.compute_velocity_commands(unit.pose, unit.velocity, unit.costmap, 0.0)
    except (ControllerError, ControllerAbort):
        return Twist(np.nan, np.nan)


def difference(ours: tuple[float, float], recorded: NDArray[np.float64]) -> float:
    """Largest difference of two pairs; NaN (an exception) counts as zero."""
    return float(np.abs(np.nan_to_num(np.asarray(ours)) - np.nan_to_num(recorded)).max())


def _plan(planner: NavfnPlanner, costmap: Costmap, start: Pose, goal: Pose) -> NDArray[np.float64] | None:
    try:
        return planner.plan(costmap, start, goal)
    except NoPathError:
        return None


def _potential_error(ours: NDArray[np.float32], recorded: NDArray[np.float32]) -> float:
    """Largest relative difference over reached cells; 1 where only one side reached a cell."""
    ours = np.where(np.isfinite(ours) & (ours < 1e9), ours, np.nan).astype(float)
    both = np.isfinite(ours) & np.isfinite(recorded)
    if (np.isfinite(ours) != np.isfinite(recorded)).any():
        return 1.0
    return float((np.abs(ours[both] - recorded[both]) / np.maximum(np.abs(recorded[both]), 1.0)).max())


def _path_deviation(ours: NDArray[np.float64] | None, recorded: NDArray[np.float64], found: bool) -> float:
    """Largest distance, m, of a point of one path to the nearest of the other; infinite if only one exists."""
    if ours is None or not found:
        return 0.0 if (ours is None) == (not found) else np.inf
    if len(ours) == len(recorded):
        return float(np.hypot(*(ours - recorded)[:, :2].T).max())
    return max(_farthest_from(ours, recorded), _farthest_from(recorded, ours))


def _farthest_from(path: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Largest distance of a point of ``other`` to the nearest point of ``path``, m."""
    distances, _ = cKDTree(path[:, :2]).query(other[:, :2])
    return float(np.max(distances))


def _score_error(ours: NDArray[np.float32], recorded: NDArray[np.float32]) -> float:
    """Largest relative difference of the totals of samples; 1 where only one side is legal."""
    if ours.shape != recorded.shape or ((ours < 0) != (recorded < 0)).any():
        return 1.0
    legal = recorded >= 0
    if not legal.any():
        return 0.0
    return float((np.abs(ours[legal] - recorded[legal]) / np.maximum(np.abs(recorded[legal]), 1e-6)).max())
