"""The obstacle layer: the hits and the free space of a lidar, cell by cell.

Source: nav2_costmap_2d/plugins/obstacle_layer.cpp.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from gym_mapbench.costmap.grid import NO_INFORMATION
from gym_mapbench.costmap.layer import Box, Cells, Costs, Layer, LayerContext, LayerEntry, Window
from gym_mapbench.costmap.scan import LaserScan, Observation
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.footprint import clear_polygon, touch_footprint
from gym_mapbench.kernels.layers import combine, shifted
from gym_mapbench.kernels.obstacle_layer import clear_rays, mark_hits
from gym_mapbench.kernels.raytrace import touch
from gym_mapbench.quantities import NonNegative
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import Keys, RosPlugin, Section, in_every_release
from gym_mapbench.settings import Settings
from gym_mapbench.world.scenario import Pose

SCAN = {"topic": "/scan", "data_type": "LaserScan"}


class ObservationSource(Settings):
    """A lidar as an obstacle layer uses it: an entry of its ``observation_sources``.

    Args:
        marking: Whether hits mark obstacles.
        clearing: Whether rays clear the cells they pass.
        obstacle_max_range: Farthest hit that is marked, m.
        obstacle_min_range: Nearest hit that is marked, m.
        raytrace_max_range: How far along a ray cells are cleared, m.
        raytrace_min_range: Distance along a ray from which on cells are cleared, m.
        min_obstacle_height: Lowest point that is used at all, m.
        max_obstacle_height: Highest point that is used at all, m.
        inf_is_valid: Whether a ray that hits nothing clears as if it ended just short of the sensor's range.
    """

    marking: bool = True
    clearing: bool = False
    obstacle_max_range: NonNegative = 2.5
    obstacle_min_range: NonNegative = 0.0
    raytrace_max_range: NonNegative = 3.0
    raytrace_min_range: NonNegative = 0.0
    min_obstacle_height: float = 0.0
    max_obstacle_height: float = 0.0
    inf_is_valid: bool = False


class ObstacleLayer(Settings):
    """Nav2's ``ObstacleLayer`` with one lidar.

    Args:
        enabled: Whether the layer writes at all.
        footprint_clearing_enabled: Whether the cells under the robot are set free.
        combination_method: 0 overwrites, 1 writes the greater cost, 2 (Jazzy) does so except over unknown cells.
        min_obstacle_height: Lowest hit that is marked, m.
        max_obstacle_height: Highest hit that is marked, m.
        scan: The lidar.
    """

    enabled: bool = True
    footprint_clearing_enabled: bool = True
    combination_method: Literal[0, 1, 2] = 1
    min_obstacle_height: float = 0.0
    max_obstacle_height: float = 2.0
    scan: ObservationSource = ObservationSource()


class ObstacleGrid(Layer):
    """The two-dimensional layer: the newest scan clears, then marks, at every update until there is a newer one.

    Args:
        layer: The layer's options.
        context: Size, release, the footprint to clear, and whether cells never seen are unknown.

    Attributes:
        costs: ``(rows, cols)`` uint8, the cells as observed: 0 free, 254 occupied, 255 never seen.
    """

    def __init__(self, layer: ObstacleLayer, context: LayerContext) -> None:
        self.layer = layer
        self._jazzy = context.costmap.release != "humble"
        self._corners = context.footprint.corners
        self._default = context.costmap.default_cost
        self._observation: Observation | None = None
        self._writes_all = False
        self.costs: Costs = np.full(context.shape, self._default, np.uint8)
        self.reset()

    def observe(self, scan: LaserScan, sensor: Pose, height: float) -> None:
        """Take a new scan from a sensor at a pose in the costmap's frame, ``height`` m above the ground."""
        source = self.layer.scan
        observation = scan.observe(sensor, height, inf_is_valid=source.inf_is_valid)
        if not source.min_obstacle_height <= observation.z <= source.max_obstacle_height:
            observation = Observation(observation.origin, observation.points[:0], observation.z)
        self._observation = observation

    def reset(self) -> None:
        """Forget all cells; the newest scan remains for the next update."""
        self.clear_cells()

    def clear_cells(self) -> None:
        """Forget all cells; of a voxel layer the voxels remain, as in Nav2."""
        self.costs = np.full_like(self.costs, self._default)

    def clear_square(self, cells: Cells, *, outside: bool) -> None:
        """Forget the cells of a square, or all others; of a voxel layer the voxels remain."""
        row0, col0, row1, col1 = cells
        forgotten = np.full(self.costs.shape, outside)
        forgotten[row0:row1, col0:col1] = not outside
        self.costs[forgotten] = NO_INFORMATION
        self._writes_all = True

    def roll(self, d_row: int, d_col: int) -> None:
        """Keep the cells that stay in the window."""
        self.costs = shifted(self.costs, d_row, d_col, self._default)

    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:
        """Clear along the rays of the newest scan, then mark its hits; the robot's footprint is freed later."""
        for corner in window.corners if self._writes_all else ():
            touch(box, *corner)
        self._writes_all = False
        if self._observation is not None:
            if self.layer.scan.clearing:
                self._clear(window, self._observation, box)
            if self.layer.scan.marking and self._is_marked(self._observation.z):
                self._mark(window, self._observation, box)
        if self.layer.footprint_clearing_enabled:
            self._placed = touch_footprint(self._corners, *robot, box)

    def update_costs(self, window: Window, master: Costs, cells: Cells) -> None:
        """Free the robot's own cells, then write."""
        if self.layer.footprint_clearing_enabled:
            clear_polygon(self.costs, *window.geometry, self._placed)
        combine(master, self.costs, *cells, self.layer.combination_method)

    def _is_marked(self, z: float) -> bool:
        """Whether the layer marks hits at this height, m."""
        return self.layer.min_obstacle_height <= z <= self.layer.max_obstacle_height

    def _clear(self, window: Window, seen: Observation, box: Box) -> None:
        source = self.layer.scan
        ranges = source.raytrace_min_range, source.raytrace_max_range
        clear_rays(self.costs, *window.geometry, *seen.origin[:2], seen.points, *ranges, box)

    def _mark(self, window: Window, seen: Observation, box: Box) -> None:
        source = self.layer.scan
        ranges = source.obstacle_min_range, source.obstacle_max_range
        mark_hits(self.costs, *window.geometry, *seen.origin[:2], seen.points, *ranges, self._jazzy, box)


def check_combination(layer: ObstacleLayer, release: Release) -> None:
    """Refuse a combination method that the release does not have.

    Raises:
        ConfigError: Beginning with the name of the option.
    """
    if release == "humble" and layer.combination_method == 2:
        raise ConfigError("combination_method: expected 0 or 1 (2 is new in Jazzy), got 2")


LIDAR_PLANE = 0.0, "the robot's lidar lies in the plane of its base"
"""Height of the lidar, m, and why."""


def lower_height(section: Section) -> None:
    """Lower ``min_obstacle_height`` of a layer or a source to the plane of the lidar, so that no hit is too low."""
    section.cap("min_obstacle_height", *LIDAR_PLANE)


def adapt(section: Section) -> None:
    """Lower the heights of a layer, and take 1 for a combination method that there is not, as Nav2 does since Jazzy."""
    lower_height(section)
    if section.findings.release != "humble":
        section.correct("combination_method", (0, 1, 2), 1)


def name_lidar(values: dict[str, Any], release: Release) -> dict[str, Any]:
    """Add the keys of a written layer that name its lidar; the options of the lidar form a group of their own."""
    return {**values, "observation_sources": "scan", "scan": {**SCAN, **values["scan"]}}


OBSERVATION_SOURCE = RosPlugin(
    {},
    "an observation source",
    ObservationSource,
    Keys(
        ros_only=frozenset(
            {
                "data_type",
                "expected_update_rate",
                "sensor_frame",
                "topic",
                "transport_type",
            }
        ),
        renamed={"obstacle_range": "obstacle_max_range", "raytrace_range": "raytrace_max_range"},
        left_out=frozenset({"observation_persistence"}),
    ),
    adapt=lower_height,
)
"""An entry of ``observation_sources``; the robots here have one lidar, whose beams lie in a horizontal plane."""
OBSTACLE_KEYS = Keys(
    ros_only=frozenset({"map_vis_z", "observation_sources", "plugin", "tf_filter_tolerance", "transform_tolerance"}),
)
OBSTACLE_LAYER = LayerEntry(
    ObstacleLayer,
    ObstacleGrid,
    observes=True,
    check=check_combination,
    nav2=RosPlugin(
        in_every_release("nav2_costmap_2d::ObstacleLayer"),
        "the obstacle layer",
        ObstacleLayer,
        OBSTACLE_KEYS,
        adapt=adapt,
        arrange=name_lidar,
    ),
)
