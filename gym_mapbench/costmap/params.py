"""Options of Nav2's costmaps and their layers, under Nav2's names.

Source: nav2_costmap_2d (Humble).
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.files.documents import parse_yaml
from gym_mapbench.releases import Release
from gym_mapbench.settings import Settings
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.robot import RobotSpec

MAX_CELLS = 25_000_000
"""Largest costmap: 5000 x 5000 cells."""

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
OBSTACLE_LAYERS = ("obstacle_layer", "voxel_layer")
LAYERS = ("static_layer", *OBSTACLE_LAYERS, "inflation_layer")


class StaticLayer(Settings):
    """Nav2's ``StaticLayer``: writes the map.

    Args:
        enabled: Whether the layer writes.
    """

    enabled: bool = True


class InflationLayer(Settings):
    """Nav2's ``InflationLayer``: cost around obstacles.

    Args:
        enabled: Whether the layer writes at all.
        inflation_radius: Reach, m, rounded up to whole cells.
        cost_scaling_factor: Decay of the cost, 1/m.
        inflate_unknown: Whether any cost replaces "unknown", not only an inscribed obstacle's.
        inflate_around_unknown: Whether unknown cells are inflated like obstacles.
    """

    enabled: bool = True
    inflation_radius: NonNegative = 0.55
    cost_scaling_factor: NonNegative = 10.0
    inflate_unknown: bool = False
    inflate_around_unknown: bool = False


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


BRINGUP_SCAN = ObservationSource(clearing=True, max_obstacle_height=2.0)


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


class VoxelLayer(ObstacleLayer):
    """Nav2's ``VoxelLayer`` with one lidar: as ``ObstacleLayer``, and columns of voxels.

    Args:
        z_voxels: Voxels in a column.
        z_resolution: Height of a voxel, m.
        origin_z: Height at which the lowest voxel begins, m.
        mark_threshold: How many marked voxels a column may have and still not be an obstacle.
        unknown_threshold: How many unknown voxels a cleared column may have and still be free; as in Nav2,
            the voxels by which the column is shorter than 16 are not counted against it.
    """

    z_voxels: Annotated[int, Field(ge=1, le=16)] = 10
    z_resolution: Positive = 0.2
    origin_z: float = 0.0
    mark_threshold: Annotated[int, Field(ge=0, le=16)] = 0
    unknown_threshold: Annotated[int, Field(ge=0, le=16)] = 15


class CostmapParams(Settings):
    """Options of one costmap, named and defaulted as in Nav2 Humble's code.

    Args:
        robot_radius: Radius of the robot, m; None takes the robot's own. A ``footprint`` takes precedence.
        footprint: Corners ``((x, y), ...)`` m, or Nav2's text form ``"[[x, y], ...]"``; None takes ``robot_radius``.
        footprint_padding: How far every corner is moved away from both axes, m.
        resolution: Side of a cell, m, of a costmap that does not take its size from the map.
        width: Extent along x, m, of a costmap that does not take its size from the map.
        height: Extent along y, m; likewise.
        origin_x: World x of the first lower-left corner, m; a rolling window stays aligned to it.
        origin_y: World y of the same corner, m.
        rolling_window: Whether the costmap is a window that follows the robot.
        update_frequency: Updates per second, Hz.
        publish_frequency: Rate at which the costmap is published, Hz, which is how the recovery behaviours see it; they
            see none if it is not positive, and fail.
        track_unknown_space: Whether unknown cells stay unknown (255) instead of free.
        use_maximum: Whether the static layer writes the greater cost instead of overwriting.
        lethal_cost_threshold: Map value, 0 to 100, from which on a cell is an obstacle.
        unknown_cost_value: Map value, as an unsigned byte, that means unknown.
        trinary_costmap: Whether map values below the threshold are free rather than scaled.
        plugins: Names of the layers in the order in which they write.
        static_layer: Options of the layer of this name, as in the next three.
        obstacle_layer: Likewise.
        voxel_layer: Likewise.
        inflation_layer: Likewise.
        release: Release of Nav2 whose layers these are; not a parameter of Nav2. Jazzy's voxel layer loses no ray that
            leaves the window and obeys ``min_obstacle_height``, its obstacle layer also checks ranges in metres, its
            inflation layer starts over after a reset, and ``combination_method`` may be 2.
    """

    robot_radius: Positive | None = None
    footprint: tuple[tuple[float, float], ...] | None = None
    footprint_padding: NonNegative = 0.01
    resolution: Positive = 0.1
    width: Annotated[int, Field(gt=0)] = 5
    height: Annotated[int, Field(gt=0)] = 5
    origin_x: float = 0.0
    origin_y: float = 0.0
    rolling_window: bool = False
    update_frequency: Positive = 5.0
    publish_frequency: float = 1.0
    track_unknown_space: bool = False
    use_maximum: bool = False
    lethal_cost_threshold: Annotated[int, Field(ge=0, le=100)] = 100
    unknown_cost_value: Annotated[int, Field(ge=0, le=255)] = 255
    trinary_costmap: bool = True
    plugins: tuple[str, ...] = ("static_layer", "obstacle_layer", "inflation_layer")
    static_layer: StaticLayer = StaticLayer()
    obstacle_layer: ObstacleLayer = ObstacleLayer()
    voxel_layer: VoxelLayer = VoxelLayer()
    inflation_layer: InflationLayer = InflationLayer()
    release: Release = "humble"

    @classmethod
    def example_local(cls, **changes: Any) -> CostmapParams:
        """Return the local costmap of ``nav2_bringup/params/nav2_params.yaml``: 3 m x 3 m around the robot."""
        example: dict[str, Any] = {
            "publish_frequency": 2.0,
            "rolling_window": True,
            "width": 3,
            "height": 3,
            "resolution": 0.05,
            "plugins": ("voxel_layer", "inflation_layer"),
            "voxel_layer": VoxelLayer(z_voxels=16, z_resolution=0.05, scan=BRINGUP_SCAN),
            "inflation_layer": InflationLayer(cost_scaling_factor=3.0),
        }
        return cls(**{**example, **changes})

    @classmethod
    def example_global(cls, **changes: Any) -> CostmapParams:
        """Return the global costmap of ``nav2_bringup/params/nav2_params.yaml``: the whole map."""
        example: dict[str, Any] = {
            "update_frequency": 1.0,
            "resolution": 0.05,
            "track_unknown_space": True,
            "obstacle_layer": ObstacleLayer(scan=BRINGUP_SCAN),
            "inflation_layer": InflationLayer(cost_scaling_factor=3.0),
        }
        return cls(**{**example, **changes})

    @field_validator("footprint", mode="before")
    @classmethod
    def _read_footprint(cls, value: object) -> object:
        """Read Nav2's text form; an empty list means none."""
        corners = value
        if isinstance(value, str):
            try:
                corners, _ = parse_yaml(value, "footprint")
            except ConfigError:
                raise ConfigError(f"expected corners '[[x, y], ...]' in m, got {value[:80]!r}") from None
        return None if corners in (None, [], ()) else corners

    @field_validator("footprint")
    @classmethod
    def _at_least_three(cls, value: tuple[tuple[float, float], ...] | None) -> tuple[tuple[float, float], ...] | None:
        if value is not None and len(set(value)) < 3:
            raise ConfigError(f"expected at least 3 different corners, got {len(set(value))}")
        return value

    @field_validator("plugins")
    @classmethod
    def _known_layers(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for name in value:
            if name not in LAYERS:
                raise unknown_name("costmap layer", name, LAYERS)
        return value

    @model_validator(mode="after")
    def _of_a_size(self) -> CostmapParams:
        cells = self.width / self.resolution * self.height / self.resolution
        if cells > MAX_CELLS:
            raise ConfigError(f"width, height and resolution: expected at most {MAX_CELLS} cells, got {cells:.3g}")
        return self

    @model_validator(mode="after")
    def _known_combinations(self) -> CostmapParams:
        for name in OBSTACLE_LAYERS:
            if self.release == "humble" and self.writes(name) and getattr(self, name).combination_method == 2:
                raise ConfigError(f"{name}.combination_method: expected 0 or 1 (2 is new in Jazzy), got 2")
        return self

    def writes(self, layer: str) -> bool:
        """Whether a layer of this name is among the plugins and enabled."""
        return layer in self.plugins and bool(getattr(self, layer).enabled)

    @property
    def observes(self) -> bool:
        """Whether a layer looks at scans."""
        return any(self.writes(name) for name in OBSTACLE_LAYERS)

    def make_footprint(self, robot: RobotSpec) -> Footprint:
        """Return the padded footprint: that of these options where they give one, else that of the robot."""
        corners = self.footprint if self.footprint or self.robot_radius else robot.footprint
        if corners:
            return Footprint.from_corners(np.array(corners), self.footprint_padding)
        return Footprint.from_radius(self.robot_radius or robot.radius, self.footprint_padding)
