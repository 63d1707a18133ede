"""Migrates the collision monitor of a parameter file.

Since Jazzy the number of points is the least that triggers an action, corners are a text, and there are more types of
polygons, actions and sources; Lyrical adds a type of source, and keeps the curvature of a limited command.

Source: Nav2's migration guides; nav2_collision_monitor (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from collections.abc import Mapping

import yaml

from controllers.collision_monitor import ACTION_TYPES, POLYGON_TYPES, SOURCE_TYPES
from controllers.nav2_params.file.yaml_edits import Entry, as_yaml, entries
from controllers.nav2_params.migration.work import Work, listed, value_of
from controllers.nav2_params.sections.monitor import as_flat, as_text, write_corners
from gym_mapbench.releases import Release

NODE = "collision_monitor"
Given = Mapping[str, Entry]
Known = Mapping[Release, tuple[str, ...]]


def migrate_monitor(work: Work, full: str, group: yaml.MappingNode) -> None:
    """Migrate what is more than a key without a counterpart."""
    given = {entry.name: entry for entry in entries(group)}
    _keep_known(work, full, given, "polygons", {"type": POLYGON_TYPES, "action_type": ACTION_TYPES})
    _keep_known(work, full, given, "observation_sources", {"type": SOURCE_TYPES})
    if work.crosses("humble"):
        for name, entry in given.items():
            if name.endswith(".points"):
                _rewrite_points(work, full, entry)
            elif name.endswith(".max_points" if work.source == "humble" else ".min_points"):
                _recount(work, full, entry, given)
    if "limit" in ACTION_TYPES[work.source] and work.enters("lyrical"):
        _tell_limits(work, full, given)


def _keep_known(work: Work, full: str, given: Given, key: str, known: Mapping[str, Known]) -> None:
    """Take out the polygons, or the sources, with which the target does not start."""
    names = listed(given.get(key))
    kept = []
    for name in names:
        why = _why_not(work, given, name, known)
        if why is None or name not in given:
            kept.append(name)
        else:
            work.take_out(full, given[name], f"{work.target.capitalize()} has no {why}")
    if kept != names:
        work.edits.replace(given[key], as_yaml(kept))


def _why_not(work: Work, given: Given, name: str, known: Mapping[str, Known]) -> str | None:
    """Say what the target does not have of a polygon or source; None if it has all."""
    for option, values in known.items():
        entry = given.get(f"{name}.{option}")
        if entry is not None and value_of(entry) not in values[work.target]:
            return f"{option} {value_of(entry)!r}"
    by_topic = f"{name}.polygon_sub_topic" in given and not given.keys() & {f"{name}.points", f"{name}.radius"}
    return "shapes by a topic" if by_topic and work.target == "humble" else None


def _rewrite_points(work: Work, full: str, entry: Entry) -> None:
    """Write corners in the form of the target."""
    if work.source == "humble":
        corners = as_flat([yaml.safe_load(text) for text in listed(entry)])
    else:
        corners = as_text(entry.value.value)
    if corners is None:
        work.lose(full, entry, "no corners in the form of the source; left as they are")
        return
    work.edits.replace(entry, as_yaml(write_corners(corners, work.target)))
    work.say(f"{full}.{entry.name}", entry.line, f"written as {work.target.capitalize()} wants corners")


def _recount(work: Work, full: str, entry: Entry, given: Given) -> None:
    """Replace the largest number of points without an action by the least with one, or back; ``max_points`` counts."""
    polygon, _, old = entry.name.rpartition(".")
    new, by = ("min_points", 1) if old == "max_points" else ("max_points", -1)
    count = value_of(entry)
    if not isinstance(count, int) or (old == "min_points" and f"{polygon}.{new}" in given):
        work.take_out(full, entry, f"{new} is given as well, and counts")
        return
    other = given.get(f"{polygon}.{new}")
    if other is not None:
        work.take_out(full, other, f"{work.source.capitalize()} does not read it")
    work.edits.rename(entry.key, f"{entry.key.value.removesuffix(old)}{new}")
    work.edits.replace(entry, as_yaml(count + by))
    work.say(f"{full}.{entry.name}", entry.line, f"now {new}: {count + by}, which acts at the same number")


def _tell_limits(work: Work, full: str, given: Given) -> None:
    for name in listed(given.get("polygons")):
        action = given.get(f"{name}.action_type")
        if action is not None and value_of(action) == "limit":
            work.tell(f"{full}.{name}", "Lyrical limits both velocities by one ratio, and so keeps the curvature")
