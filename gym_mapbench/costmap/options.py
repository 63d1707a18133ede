"""Options of a costmap that are no layer's, under the names and with the defaults of Nav2 Humble's code.

Source: nav2_costmap_2d (Humble).
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, field_validator, model_validator

from gym_mapbench.costmap.grid import FREE_SPACE, NO_INFORMATION
from gym_mapbench.errors import ConfigError
from gym_mapbench.files.documents import parse_yaml
from gym_mapbench.quantities import Natural, NonNegative, Positive
from gym_mapbench.releases import Release
from gym_mapbench.settings import Settings
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.robot import RobotSpec

MAX_CELLS = 25_000_000
"""Largest costmap: 5000 x 5000 cells."""


class CostmapOptions(Settings):
    """What every layer may know about its costmap.

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
        publish_frequency: Publications per second, Hz. The recovery behaviours see the published costmap; without a
            positive rate they see none, and fail.
        track_unknown_space: Whether unknown cells stay unknown (255) instead of free.
        use_maximum: Whether the static layer writes the greater cost instead of overwriting.
        lethal_cost_threshold: Map value, 0 to 100, from which on a cell is an obstacle.
        unknown_cost_value: Map value, as an unsigned byte, that means unknown.
        trinary_costmap: Whether map values below the threshold are free rather than scaled.
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
    lethal_cost_threshold: Annotated[Natural, Field(le=100)] = 100
    unknown_cost_value: Annotated[Natural, Field(le=255)] = 255
    trinary_costmap: bool = True
    release: Release = "humble"

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

    @model_validator(mode="after")
    def _of_a_size(self) -> CostmapOptions:
        cells = self.width / self.resolution * self.height / self.resolution
        if cells > MAX_CELLS:
            raise ConfigError(f"width, height and resolution: expected at most {MAX_CELLS} cells, got {cells:.3g}")
        return self

    @property
    def default_cost(self) -> int:
        """Cost of the cells in which no layer has written."""
        return NO_INFORMATION if self.track_unknown_space else FREE_SPACE

    def make_footprint(self, robot: RobotSpec) -> Footprint:
        """Return the padded footprint: that of these options where they give one, else that of the robot."""
        corners = self.footprint if self.footprint or self.robot_radius else robot.footprint
        if corners:
            return Footprint.from_corners(np.array(corners), self.footprint_padding)
        return Footprint.from_radius(self.robot_radius or robot.radius, self.footprint_padding)
