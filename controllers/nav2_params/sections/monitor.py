"""Reads the collision monitor of a parameter file, and writes it as a release has it."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from controllers.collision_monitor import (
    ACTION_TYPES,
    POLYGON_TYPES,
    SOURCE_TYPES,
    CollisionMonitor,
    MonitorPolygon,
    MonitorSource,
    VelocityRange,
)
from controllers.nav2_params.file.keys import COLLISION_MONITOR, MONITOR_POLYGON, MONITOR_SOURCE
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import Keys, Section

CORNERS_LEAST = 4
"""Least number of corners with which the monitor of any release starts; its message says three."""
_OF_ACTIONS: Mapping[str, frozenset[str]] = {
    "slowdown": frozenset({"slowdown_ratio"}),
    "limit": frozenset({"linear_limit", "angular_limit"}),
    "approach": frozenset({"time_before_collision", "simulation_time_step"}),
}
UNUSED: Mapping[str, frozenset[str]] = {
    action: frozenset().union(*(names for other, names in _OF_ACTIONS.items() if other != action))
    for action in ("stop", "none", *_OF_ACTIONS)
}
"""Action -> parameters that only other actions read."""
GROUPS = ("polygons", "observation_sources")


def read_monitor(section: Section) -> CollisionMonitor:
    """Read the collision monitor's section.

    A polygon whose shape comes by a topic, and a source that is not the lidar, are left out and listed.

    Raises:
        ConfigError: If a value is wrong, or the release does not start with it.
    """
    optional = section.findings.release == "humble"
    names = _take_list(section, "polygons", optional)
    sources = {name: _read_source(section.take_group(name)) for name in _take_list(section, "observation_sources")}
    polygons = {name: _read_polygon(section.take_group(name)) for name in names}
    section.leave_groups()
    own = section.read(COLLISION_MONITOR, [name for name in CollisionMonitor.model_fields if name not in GROUPS])
    built = {name: polygon for name, polygon in polygons.items() if polygon is not None}
    monitor = section.make(CollisionMonitor, {**own, "polygons": built, "observation_sources": sources})
    _tell_sources(section, monitor)
    return monitor


def _take_list(section: Section, key: str, optional: bool = False) -> tuple[str, ...]:
    if key not in section.values and not optional:
        raise ConfigError(f"{section.name}.{key}: expected a list of names, got none")
    return section.take_names(key, ())


def _tell_sources(section: Section, monitor: CollisionMonitor) -> None:
    """List the sources of points for which the lidar does not stand, and polygons that have no others."""
    for name, source in monitor.observation_sources.items():
        if source.enabled and name not in monitor.lidar_sources:
            why = f"{source.type}: the robots here have one lidar"
            section.findings.add("left_out", f"{section.name}.{name}", why)
    for name, polygon in monitor.polygons.items():
        if polygon.enabled and monitor.lidar_sources and not monitor.sees(polygon):
            section.findings.add("left_out", f"{section.name}.{name}", "none of its sources is the lidar")


def _read_source(group: Section) -> MonitorSource:
    _refuse_others(group, "type", SOURCE_TYPES[group.findings.release])
    return group.build(MonitorSource, MONITOR_SOURCE)


def _read_polygon(group: Section) -> MonitorPolygon | None:
    """Read one polygon; None if its shape comes by a topic."""
    release = group.findings.release
    _refuse_others(group, "type", POLYGON_TYPES[release])
    _refuse_others(group, "action_type", ACTION_TYPES[release])
    if _comes_by_topic(group):
        group.findings.add("left_out", group.name, "its shape comes by a topic")
        return None
    names = group.take_names("velocity_polygons", ())
    shapes = {name: _read_shape(group.take_group(name)) for name in names}
    group.leave_groups()
    values = group.read(MONITOR_POLYGON, [*MonitorPolygon.model_fields, "max_points"])
    _count_from_least(group, values)
    _read_points(group, values)
    return group.make(MonitorPolygon, {**values, "velocity_polygons": shapes})


def _refuse_others(group: Section, key: str, known: tuple[str, ...]) -> None:
    """Refuse a value with which the release's monitor does not start."""
    value = group.values.get(key, known[0])
    if value not in known:
        release = group.findings.release.capitalize()
        raise ConfigError(f"{group.name}.{key}: expected {', '.join(known)} in Nav2 {release}, got {value!r}")


def _comes_by_topic(group: Section) -> bool:
    """Whether a topic gives the shape; Humble has no such topic."""
    values, shape = group.values, "radius" if group.values.get("type") == "circle" else "points"
    by_topic = "polygon_sub_topic" in values and shape not in values and values.get("action_type") != "approach"
    return by_topic and group.findings.release != "humble" and values.get("type") != "velocity_polygon"


def _read_shape(group: Section) -> VelocityRange:
    values = group.read(Keys(), tuple(VelocityRange.model_fields))
    _read_points(group, values)
    return group.make(VelocityRange, values)


def _count_from_least(group: Section, values: dict[str, Any]) -> None:
    """Replace ``max_points``, which Humble knows alone and later releases prefer, by ``min_points``."""
    most = values.pop("max_points", None)
    if most is None:
        return
    if isinstance(most, bool) or not isinstance(most, int):
        raise ConfigError(f"{group.name}.max_points: expected a whole number, got {most!r}")
    values["min_points"] = most + 1
    if group.findings.release != "humble":
        group.findings.add("renamed", f"{group.name}.max_points", f"min_points: {most + 1}")


def _read_points(group: Section, values: dict[str, Any]) -> None:
    """Read corners in the form of the release; Humble's ``approach`` has no points."""
    if "points" not in values:
        return
    if group.findings.release == "humble" and values.get("action_type") == "approach":
        del values["points"]
        group.findings.add("unused", f"{group.name}.points")
        return
    read = as_flat if group.findings.release == "humble" else as_text
    corners = read(values["points"])
    if corners is None:
        wanted = FORMS[read]
        release = group.findings.release.capitalize()
        got = reprlib.repr(values["points"])
        raise ConfigError(f"{group.name}.points: expected {wanted} in Nav2 {release}, got {got}")
    values["points"] = corners


def as_flat(value: object) -> list[list[float]] | None:
    """Return the corners of Humble's flat list; None if it is no such list."""
    if not isinstance(value, (list, tuple)) or len(value) < 2 * CORNERS_LEAST or len(value) % 2:
        return None
    return [[value[i], value[i + 1]] for i in range(0, len(value), 2)] if _are_numbers(value) else None


def as_text(value: object) -> list[list[float]] | None:
    """Return the corners in the text of later releases; None if it is no such text."""
    try:
        corners = yaml.safe_load(value) if isinstance(value, str) else None
    except yaml.YAMLError:
        return None
    if not isinstance(corners, list) or len(corners) < CORNERS_LEAST:
        return None
    pairs = all(isinstance(corner, list) and len(corner) == 2 and _are_numbers(corner) for corner in corners)
    return corners if pairs else None


FORMS: Mapping[object, str] = {
    as_flat: f"a list [x1, y1, x2, y2, ...] of at least {CORNERS_LEAST} corners",
    as_text: f"a text '[[x1, y1], [x2, y2], ...]' of at least {CORNERS_LEAST} corners",
}


def _are_numbers(values: Sequence[object]) -> bool:
    return all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values)


def write_monitor(monitor: CollisionMonitor, release: Release) -> dict[str, Any]:
    """Return the ROS parameters of a collision monitor, without its topics and frames."""
    switch = {"enabled": monitor.enabled} if release == "lyrical" else {}
    sources = {name: {**source.model_dump(), "topic": "scan"} for name, source in monitor.observation_sources.items()}
    return {
        "base_shift_correction": monitor.base_shift_correction,
        **switch,
        "polygons": list(monitor.polygons),
        **{name: _write_polygon(polygon, release) for name, polygon in monitor.polygons.items()},
        "observation_sources": list(sources),
        **sources,
    }


def _write_polygon(polygon: MonitorPolygon, release: Release) -> dict[str, Any]:
    """Return one polygon with what its release, type and action have."""
    values = polygon.model_dump(mode="json", exclude_none=True)
    least, shapes = values.pop("min_points"), values.pop("velocity_polygons")
    for name in values.keys() & UNUSED[polygon.action_type]:
        del values[name]
    values = {name: value for name, value in values.items() if name not in MONITOR_POLYGON.missing.get(release, {})}
    if polygon.points is not None:
        values["points"] = write_corners(polygon.points, release)
    if polygon.type != "velocity_polygon":
        values.pop("holonomic", None)
    named = {"velocity_polygons": list(shapes)} if shapes else {}
    inner = {name: {**shape, "points": write_corners(shape["points"], release)} for name, shape in shapes.items()}
    count = {"max_points": least - 1} if release == "humble" else {"min_points": least}
    return {**values, **count, **named, **inner}


def write_corners(corners: Sequence[Sequence[float]], release: Release) -> list[float] | str:
    """Return corners in the form of a release; the monitor wants four, so a triangle gets its last corner twice."""
    repeated = corners[-1:] if len(corners) < CORNERS_LEAST else ()
    whole = [list(corner) for corner in (*corners, *repeated)]
    return [value for corner in whole for value in corner] if release == "humble" else str(whole)
