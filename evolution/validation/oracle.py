"""Recorded Nav2 results, read from a directory and checked once.

The format is described in the README of the directory. Row 0 of every grid is the *top* there; maps are
returned with row 0 at the bottom, as everywhere in this project.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from evolution.validation.recorded import Arrays, read_arrays, read_config, read_json
from gym_mapbench.errors import MapFormatError
from gym_mapbench.releases import RELEASES, Release
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose

_REQUIRED = {
    "maps.npz": ("occupied", "map_id"),
    "plans": ("map_id", "costmap", "found", "path", "path_offset"),
    "runs": ("traj", "cmd", "offset"),
    "units": (
        *("map_id", "pose", "vel", "plan_from", "rpp_cmd", "rpp_exception", "rpp_carrot", "dwb_cmd"),
        *("mppi_cmd_stepwise", "mppi_fail_flag", "mppi_seq_in_vx", "mppi_seq_in_wz"),
    ),
    "units_dwb": ("critics", "twist", "total", "raw_score", "illegal_by", "offset", "best_index"),
    "units_mppi": ("unit_index", "critics", "critic_cost"),
    "mppi_noise.npz": ("vx", "wz"),
}

_NOT_OF_CONTROLLER = ("robot_given_as", "inflation_radius")
"""Options of a variant that belong to the robot or its costmaps, not to the controller."""

TREE_REPLAN = "tree_replan"
"""The variant of Lyrical's recordings with the replanning of its default tree; the controller is the same."""

_NEVER_DRIVEN: dict[str, Any] = {"strict_success": False, "time": 0.0, "min_clearance": None}


@dataclass(frozen=True)
class Preset:
    """Robot, costmap and task of one preset: lengths in m, poses (x, y, yaw)."""

    name: str
    resolution: float
    robot_radius: float
    inflation_radius: float
    cost_scaling_factor: float
    footprint_padding: float
    start: Pose
    goal: Pose


class Oracle:
    """A directory of recorded results.

    Args:
        directory: Path of the directory.

    Raises:
        MapFormatError: If a file is missing, unreadable, or lacks a field.
    """

    def __init__(self, directory: str | Path) -> None:
        self.directory = Path(directory)
        self.config = read_config(directory)
        for key in ("presets", "simulation", "controllers", "variants", "planner"):
            if not isinstance(self.config.get(key), dict):
                raise MapFormatError(f"{self.directory / 'config.json'}: expected a mapping under {key!r}, found none")
        self.release: Release = self._release()
        self._cache: dict[str, Arrays] = {}

    @cached_property
    def presets(self) -> tuple[Preset, ...]:
        """The presets in the order of ``config.json``."""
        return tuple(self._preset(name, values) for name, values in self.config["presets"].items())

    def maps(self, preset: Preset) -> dict[int, GridMap]:
        """Maps by id, at the preset's resolution."""
        recorded = self.arrays("maps.npz")
        if recorded["occupied"].ndim != 3:
            raise MapFormatError(
                f"{self.directory / 'maps.npz'}: occupied: expected shape (maps, rows, cols), "
                f"got {recorded['occupied'].shape}"
            )
        return {
            int(number): GridMap.from_image_array(cells, preset.resolution)
            for number, cells in zip(recorded["map_id"], recorded["occupied"], strict=True)
        }

    def table(self, kind: str, preset: Preset) -> Arrays:
        """Arrays of ``KIND_PRESET.npz``, kind one of plans, runs, units, units_dwb, units_mppi."""
        return self.arrays(f"{kind}_{preset.name}.npz", kind)

    def runs(self, preset: Preset) -> list[dict[str, Any]]:
        """Records of ``runs_PRESET.json``."""
        path = self.directory / f"runs_{preset.name}.json"
        records: list[dict[str, Any]] = read_json(path, list)
        records = [_NEVER_DRIVEN | record if _was_not_driven(record) else record for record in records]
        needed = ("map", "controller", "variant", "local_costmap", "reason", "strict_success", "time", "min_clearance")
        for position, record in enumerate(records):
            missing = [key for key in needed if not isinstance(record, dict) or key not in record]
            if missing:
                raise MapFormatError(f"{path}: run {position}: expected {missing[0]!r}, found none")
        return records

    def controller_params(self, controller: str, variant: str) -> dict[str, Any]:
        """Parameters of a controller in one of its variants, by their names in ``config.json``; a text means none."""
        recorded = self.config["controllers"][controller]
        params = {**({} if isinstance(recorded, str) else recorded), **self._changes(controller, variant)}
        return {name: value for name, value in params.items() if name not in _NOT_OF_CONTROLLER}

    def costmap_of(self, preset: Preset, controller: str, variant: str) -> Preset:
        """The preset with the inflation radius that a variant of a controller was recorded with."""
        radius = self._changes(controller, variant).get("inflation_radius", preset.inflation_radius)
        return replace(preset, inflation_radius=float(radius))

    def _changes(self, controller: str, variant: str) -> dict[str, Any]:
        """Return what a variant changes; nothing for the default."""
        unchanged = variant in ("default", TREE_REPLAN)
        return {} if unchanged else dict(self.config["variants"][f"{controller}/{variant}"])

    def arrays(self, name: str, kind: str | None = None) -> Arrays:
        """All arrays of one ``.npz`` file, read once."""
        if name not in self._cache:
            self._cache[name] = read_arrays(self.directory / name, _REQUIRED[kind or name])
        return self._cache[name]

    def _release(self) -> Release:
        """Return the release of Nav2 whose code was recorded."""
        branch = self.config.get("nav2_branch", "humble")
        for release in RELEASES:
            if release == branch:
                return release
        expected = " or ".join(RELEASES)
        raise MapFormatError(f"{self.directory / 'config.json'}: nav2_branch: expected {expected}, got {branch!r}")

    def _preset(self, name: str, values: dict[str, Any]) -> Preset:
        lengths = ("resolution", "robot_radius", "inflation_radius", "cost_scaling_factor", "footprint_padding")
        try:
            return Preset(
                name=name,
                start=Pose(*map(float, values["start"])),
                goal=Pose(*map(float, values["goal"])),
                **{key: float(values[key]) for key in lengths},
            )
        except (KeyError, TypeError, ValueError) as error:
            raise MapFormatError(
                f"{self.directory / 'config.json'}: presets.{name}: not a complete preset ({error})"
            ) from None


def _was_not_driven(record: object) -> bool:
    """Whether a run ended before it began; such records carry no measures."""
    return isinstance(record, dict) and record.get("reason") == "no_path"


def ragged(arrays: Arrays, name: str) -> Iterator[NDArray[Any]]:
    """Yield the items of a ragged list: ``array[offset[i]:offset[i + 1]]``."""
    offset = arrays[f"{name}_offset"] if f"{name}_offset" in arrays else arrays["offset"]
    for begin, end in itertools.pairwise(offset):
        yield arrays[name][begin:end]
