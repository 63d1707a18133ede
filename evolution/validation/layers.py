"""Costmap layers: ours are fed with recorded scans, and their grids compared with those of Nav2's own layers.

The format is described in the README of the recorded directory; row 0 of its grids is at the bottom, as in ours.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from evolution.validation.measures import Cases, Measure
from evolution.validation.recorded import Arrays, read_arrays, read_config
from gym_mapbench.costmap import CostmapParams, LaserScan, LayeredCostmap
from gym_mapbench.costmap.obstacle_layer import ObstacleGrid
from gym_mapbench.errors import ConfigError, MapFormatError
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose

Grids = Mapping[int, NDArray[np.uint8]]

NO_RETURN = 65535
OBSERVING = {"local": "voxel_layer", "global": "obstacle_layer"}
VOXELS = ("z_voxels", "origin_z", "z_resolution", "mark_threshold", "unknown_threshold", "max_obstacle_height")
ONLY_THE_NEWEST = {"observation_persistence": 0.0, "expected_update_rate": 0.0}
FIELDS = ("pose", "sensor", "layer", "master")
SAMPLES = {"local": ("sample", "sample"), "global": ("gsample", "gmaster_sample")}
"""Names of the lists of updates after which the layer and the costmap were recorded."""


@dataclass(frozen=True)
class Recording:
    """One of the two costmaps on one drive under one condition.

    Args:
        name: The drive and the condition, in words.
        which: ``local`` or ``global``.
        grid: The static map; its resolution is rounded to float32, as in a map message.
        scans: One scan for each pose.
        poses: ``(n, 3)`` poses of the robot in the costmap's frame, m and rad.
        sensors: ``(n, 2)`` positions of the sensor, m; its heading is that of the robot.
        layers: Grid of the obstacle or voxel layer, by update.
        costmaps: Grid of the costmap, by update.
    """

    name: str
    which: str
    grid: GridMap
    scans: Sequence[LaserScan]
    poses: NDArray[np.float64]
    sensors: NDArray[np.float64]
    layers: Grids
    costmaps: Grids


class LayersOracle:
    """A directory of recorded layers.

    Args:
        directory: Path of the directory.

    Raises:
        MapFormatError: If a file is missing, unreadable, or lacks a field.
    """

    def __init__(self, directory: str | Path) -> None:
        self.directory = Path(directory)
        self.config = config = read_config(directory)
        try:
            self.params = {which: costmap_params(config, which) for which in OBSERVING}
            self.footprint = Footprint.from_radius(config["robot_radius"], config["footprint_padding"])
            self.sensor_height = float(config["sensor_z_m"])
            self._scans = {name: _scan_format(config, values["scans"]) for name, values in config["conditions"].items()}
            self._files = [(f"map {entry['map']}", str(entry["file"])) for entry in config["sequences"]]
            self._resolution = float(np.float32(config["local"]["resolution"]))
        except (ArithmeticError, AttributeError, ConfigError, KeyError, TypeError, ValueError) as error:
            problem = f"expected {error}, found none" if isinstance(error, KeyError) else str(error)
            raise MapFormatError(f"{self.directory / 'config.json'}: {problem}") from None

    @staticmethod
    def is_in(directory: str | Path) -> bool:
        """Whether a directory of recorded results is one of layers."""
        return "scan_sets" in read_config(directory)

    def recordings(self) -> Iterator[Recording]:
        """Yield both costmaps of every drive under every condition.

        Raises:
            MapFormatError: If a file is missing, unreadable, or lacks a field, or its fields do not fit each other.
        """
        fields = [f"{name}.{which}_{what}" for name in self._scans for which in OBSERVING for what in FIELDS]
        fields += [f"ranges_{name}" for name in self.config["scan_sets"]]
        samples = [name for names in SAMPLES.values() for name in names]
        for drive, file in self._files:
            path = self.directory / file
            arrays = read_arrays(path, ("occupied", *samples, *fields))
            try:
                grid = GridMap(arrays["occupied"], self._resolution)
                for condition in self._scans:
                    for which in OBSERVING:
                        yield self._recording(f"{drive} {condition}", which, grid, arrays, condition)
            except (ConfigError, ValueError) as error:
                raise MapFormatError(f"{path}: {error}") from None

    def _recording(self, name: str, which: str, grid: GridMap, arrays: Arrays, condition: str) -> Recording:
        poses, sensors, *grids = (arrays[f"{condition}.{which}_{what}"] for what in FIELDS)
        by_update = [
            _by_update(sample, arrays[sample], recorded) for sample, recorded in zip(SAMPLES[which], grids, strict=True)
        ]
        ranges_name, unit, geometry = self._scans[condition]
        units, beams = arrays[f"ranges_{ranges_name}"], self.config["beams"]
        for what, array, columns in (("pose", poses, 3), ("sensor", sensors, 2), ("scan", units, beams)):
            if array.shape != (len(poses), columns):
                raise ValueError(f"{name}: {what}: expected shape ({len(poses)}, {columns}), got {array.shape}")
        ranges = np.where(units == NO_RETURN, np.inf, units * unit).astype(np.float32)
        scans = [LaserScan(beams, *geometry) for beams in ranges]
        return Recording(name, which, grid, scans, poses, sensors, *by_update)


def _by_update(name: str, updates: NDArray[np.integer], grids: NDArray[np.uint8]) -> Grids:
    if len(updates) != len(grids):
        raise ValueError(f"{name}: expected {len(grids)} updates, one for each grid, got {len(updates)}")
    return dict(zip(updates.tolist(), grids, strict=True))


def costmap_params(config: Mapping[str, Any], which: str) -> CostmapParams:
    """Return the options of the recorded ``local`` or ``global`` costmap; those missing are Nav2 bringup's."""
    options = dict(config[which])
    voxels = {name: options.pop(name) for name in VOXELS if name in options}
    scan = {"max_obstacle_height": 2.0, **config["scan"]}
    for name, value in ONLY_THE_NEWEST.items():
        if scan.pop(name, value) != value:
            raise ConfigError(f"scan.{name}: expected {value:g}, got {config['scan'][name]}")
    layer = {OBSERVING[which]: {**voxels, "scan": scan}}
    return CostmapParams(**options, **layer, inflation_layer=config["inflation"])


def _scan_format(config: Mapping[str, Any], name: str) -> tuple[str, float, tuple[float, float, float, float]]:
    """Return the name of a set of scans, its unit in m, and the geometry that all its scans share."""
    increment, range_max = 2 * np.pi / config["beams"], config["scan_sets"][name]["range_max_m"]
    return name, float(config["range_unit_m"]), (0.0, increment, float(config["range_min_m"]), float(range_max))


def layer_measures(oracle: LayersOracle) -> list[Measure]:
    """Replay every drive under every condition; measure the share of identical grids and the cells that differ."""
    layers, costmaps = ({which: Cases(f"{which}_cells_differ_mean", "0") for which in OBSERVING} for _ in range(2))
    for recording in oracle.recordings():
        compare(oracle, recording, layers[recording.which], costmaps[recording.which])
    identical = [
        cases[which].share_within(0, f"{which}_{what}_identical", ">= 0.999")
        for which in OBSERVING
        for what, cases in (("layer", layers), ("costmap", costmaps))
    ]
    return [*identical, *(costmaps[which].mean() for which in OBSERVING)]


def compare(oracle: LayersOracle, recording: Recording, layers: Cases, costmaps: Cases) -> None:
    """Add the number of cells that differ in every recorded grid of the layer and of the costmap."""
    costmap = LayeredCostmap(oracle.params[recording.which], recording.grid, oracle.footprint)
    layer = cast(ObstacleGrid, costmap.layer(OBSERVING[recording.which]))
    # The local costmap was updated at every pose, the global one only at those where it was recorded.
    updates = range(len(recording.scans)) if recording.which == "local" else sorted(recording.layers)
    for update in updates:
        pose = Pose(*recording.poses[update].tolist())
        x, y = recording.sensors[update].tolist()
        costmap.observe(recording.scans[update], Pose(x, y, pose.yaw), oracle.sensor_height)
        costs = costmap.update(pose).costs
        name = f"{recording.name} update {update}"
        if update in recording.layers:
            layers.add(_differing(layer.costs, recording.layers[update]), name)
        if update in recording.costmaps:
            costmaps.add(_differing(costs, recording.costmaps[update]), name)


def _differing(ours: NDArray[np.uint8], recorded: NDArray[np.uint8]) -> int:
    """Count the cells that differ; all cells if the shapes differ."""
    return int((ours != recorded).sum()) if ours.shape == recorded.shape else max(ours.size, recorded.size)
