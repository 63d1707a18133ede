"""Nav2's collision monitor: its parameters.

Source: nav2_collision_monitor (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field, model_validator

from gym_mapbench.errors import ConfigError
from gym_mapbench.quantities import Count, NonNegative, Positive
from gym_mapbench.releases import Release
from gym_mapbench.settings import Settings

Corners = Annotated[tuple[tuple[float, float], ...], Field(min_length=3)]
ActionType = Literal["stop", "slowdown", "limit", "approach", "none"]
SourceType = Literal["scan", "pointcloud", "range", "polygon", "costmap"]

_SINCE_JAZZY = ("polygon", "circle", "velocity_polygon")
POLYGON_TYPES: Mapping[Release, tuple[str, ...]] = {
    "humble": ("polygon", "circle"),
    "jazzy": _SINCE_JAZZY,
    "lyrical": _SINCE_JAZZY,
}
"""Release -> types of polygons with which its monitor starts."""
_ACTIONS_SINCE_JAZZY = ("stop", "slowdown", "limit", "approach", "none")
ACTION_TYPES: Mapping[Release, tuple[str, ...]] = {
    "humble": ("stop", "slowdown", "approach"),
    "jazzy": _ACTIONS_SINCE_JAZZY,
    "lyrical": _ACTIONS_SINCE_JAZZY,
}
"""Release -> actions with which its monitor starts."""
SOURCE_TYPES: Mapping[Release, tuple[str, ...]] = {
    "humble": ("scan", "pointcloud", "range"),
    "jazzy": ("scan", "pointcloud", "range", "polygon"),
    "lyrical": ("scan", "pointcloud", "range", "polygon", "costmap"),
}
"""Release -> types of sources with which its monitor starts."""


class VelocityRange(Settings):
    """One shape of a velocity polygon, and the commands for which it counts.

    Args:
        points: Corners, m.
        linear_min: Lowest speed, m/s; of a holonomic polygon in Lyrical, of the speed's magnitude.
        linear_max: Highest speed, m/s.
        theta_min: Lowest turn rate, rad/s.
        theta_max: Highest turn rate, rad/s.
        direction_start_angle: Holonomic polygons: first direction of motion, rad.
        direction_end_angle: Holonomic polygons: last direction of motion, counter-clockwise, rad.
    """

    points: Corners
    linear_min: float
    linear_max: float
    theta_min: float
    theta_max: float
    direction_start_angle: float = -math.pi
    direction_end_angle: float = math.pi


class MonitorPolygon(Settings):
    """One polygon or circle around the robot, and what the monitor does while enough points are inside.

    Args:
        type: ``polygon``, ``circle``, or (since Jazzy) ``velocity_polygon``: the command selects the shape.
        action_type: ``stop``; ``slowdown`` multiplies the command by ``slowdown_ratio``; ``limit`` (since Jazzy) caps
            it; ``approach`` slows down so that a collision stays ``time_before_collision`` away; ``none``.
        enabled: Whether the polygon counts.
        min_points: Number of points that trigger the action; Humble's ``max_points`` plus 1.
        points: Corners of a ``polygon``, m; None: an ``approach`` polygon takes the local costmap's footprint.
        radius: Radius of a ``circle``, m.
        slowdown_ratio: ``slowdown``: factor of the command.
        linear_limit: ``limit``: highest speed, m/s.
        angular_limit: ``limit``: highest turn rate, rad/s.
        time_before_collision: ``approach``: seconds that are simulated.
        simulation_time_step: ``approach``: step of the simulation, s.
        trigger_consecutive_points: Lyrical: consecutive commands with enough points that trigger the action; not
            ``approach``.
        release_consecutive_points: Lyrical: consecutive commands without enough points that end it; not ``approach``.
        sources_names: Since Jazzy: the sources whose points count; None for all.
        velocity_polygons: Shapes of a ``velocity_polygon`` by name, in order; the first in range counts.
        holonomic: Whether the shapes of a ``velocity_polygon`` also ask for a direction of motion.
    """

    type: Literal["polygon", "circle", "velocity_polygon"]
    action_type: ActionType
    enabled: bool = True
    min_points: int = 4
    points: Corners | None = None
    radius: Positive | None = None
    slowdown_ratio: NonNegative = 0.5
    linear_limit: NonNegative = 0.5
    angular_limit: NonNegative = 0.5
    time_before_collision: Positive = 2.0
    simulation_time_step: Annotated[float, Field(ge=1e-3)] = 0.1
    trigger_consecutive_points: Count = 1
    release_consecutive_points: Count = 1
    sources_names: tuple[str, ...] | None = None
    velocity_polygons: Mapping[str, VelocityRange] = Field(default_factory=dict)
    holonomic: bool = False

    @model_validator(mode="after")
    def _has_a_shape(self) -> MonitorPolygon:
        if self.type == "circle" and self.radius is None:
            raise ConfigError("radius: expected the radius of the circle, got none")
        if self.type == "velocity_polygon" and not self.velocity_polygons:
            raise ConfigError("velocity_polygons: expected at least one shape, got none")
        if self.type == "polygon" and self.action_type != "approach" and self.points is None:
            raise ConfigError("points: expected the corners of the polygon, got none")
        return self


class MonitorSource(Settings):
    """A source of points.

    Args:
        type: What it measures.
        enabled: Whether its points count.
    """

    type: SourceType = "scan"
    enabled: bool = True


class CollisionMonitor(Settings):
    """Nav2's ``collision_monitor`` between the velocity smoother and the robot.

    Args:
        polygons: The polygons by name, in order.
        observation_sources: The sources by name. The lidar stands for the laser scans, or else the point clouds.
        base_shift_correction: Whether points are moved by what the robot has moved since they were measured.
        enabled: Lyrical: whether the monitor does anything.
    """

    polygons: Mapping[str, MonitorPolygon] = Field(default_factory=dict)
    observation_sources: Mapping[str, MonitorSource] = Field(default_factory=dict)
    base_shift_correction: bool = True
    enabled: bool = True

    @model_validator(mode="after")
    def _sources_are_known(self) -> CollisionMonitor:
        for name, polygon in self.polygons.items():
            for source in polygon.sources_names or ():
                if source not in self.observation_sources:
                    known = ", ".join(self.observation_sources) or "none"
                    raise ConfigError(f"{name}.sources_names: expected names of {known}, got {source!r}")
        return self

    @property
    def lidar_sources(self) -> frozenset[str]:
        """Names of the enabled sources for which the lidar stands."""
        enabled = {name: source.type for name, source in self.observation_sources.items() if source.enabled}
        kind = "scan" if "scan" in enabled.values() else "pointcloud"
        return frozenset(name for name, type_ in enabled.items() if type_ == kind)

    def sees(self, polygon: MonitorPolygon) -> bool:
        """Return whether the lidar's points count for a polygon."""
        names = polygon.sources_names
        return bool(self.lidar_sources if names is None else self.lidar_sources.intersection(names))
