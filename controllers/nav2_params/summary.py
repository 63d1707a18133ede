"""Summarises a parameter file in a few lines for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from controllers.collision_monitor import CollisionMonitor, MonitorPolygon
from controllers.nav2_params.navigation import NavigationParams
from controllers.nav2_params.parsing import Nav2Params
from controllers.nav2_params.plugins import CONTROLLERS, PLANNERS, SMOOTHERS
from controllers.tree_xml.reading import read_tree
from gym_mapbench.costmap import KeepoutFilter, SpeedFilter
from gym_mapbench.costmap.filter_mask import HIGHEST
from gym_mapbench.ros_params import KINDS, Finding, Kind
from gym_mapbench.world.robot import RobotSpec

MOST = 6
"""How many reasons, and how many findings for each reason, the short summary names of one kind."""
TOLD: tuple[tuple[Kind, str], ...] = (
    ("mistyped", "Nav2 does not start with"),
    ("missing", "the behaviour tree needs"),
    ("misplaced", "ROS gives to no node (read here all the same)"),
    ("aliased", "ROS reads no alias"),
    ("template", "left to the robot"),
    ("replaced", "replaced"),
    ("left_out", "left out"),
    ("renamed", "renamed since"),
)
COUNTED: tuple[Kind, ...] = ("ros_only", "unused", "other_release", "repeated", "detail")


def summarise(read: Nav2Params, robot: RobotSpec | None = None, verbose: bool = False) -> list[str]:
    """Return the lines: release, controllers, planner, robot, and the keys that are left out, with reasons.

    Args:
        read: The file.
        robot: The robot that drives, if that is known.
        verbose: Whether to name every key instead of counting keys.
    """
    lines = [_release(read), _drivers(read), *([] if robot is None else [f"robot: {describe_robot(robot)}"])]
    monitor = read.navigation.collision_monitor
    lines += [] if monitor is None else [f"collision monitor: {describe_monitor(monitor)}"]
    lines += [f"behaviour tree: {line}" for line in describe_tree(read.navigation)]
    lines += [f"costmap filter: {line}" for line in describe_filters(read.navigation)]
    for kind, title in TOLD:
        lines += _told(read, kind, title, None if verbose else MOST)
    lines += _unknown(read, None if verbose else MOST)
    if read.defaulted:
        names = ", ".join(name.removeprefix("controllers.") for name in read.defaulted)
        lines.append(f"not in the file, so from a preset: {names}")
    if verbose:
        return [*lines, *(line for kind in COUNTED for line in _told(read, kind, f"keys that {KINDS[kind]}", None))]
    counts = [f"{len(read.named(kind))} that {KINDS[kind]}" for kind in COUNTED if read.named(kind)]
    return [*lines, *([f"other keys: {'; '.join(counts)} (--verbose names them)"] if counts else [])]


def advise(read: Nav2Params) -> list[str]:
    """Return a line for each controller of the file that is known to get slow or to stop with its parameters."""
    plugins = {name: read.navigation.controllers[name] for name in read.own_controllers}
    said = {name: CONTROLLERS[plugin.kind].advice(plugin.params) for name, plugin in plugins.items()}
    return [f"{name}: {text}" for name, text in said.items() if text]


def describe_robot(robot: RobotSpec) -> str:
    """Describe the shape and limits of a robot in one line."""
    return (
        f"{robot.shape}, {robot.max_linear_velocity:g} m/s forwards, {robot.max_reverse_velocity:g} m/s backwards, "
        f"{robot.max_angular_velocity:g} rad/s, {robot.max_linear_acceleration:g} m/s^2, "
        f"{robot.max_angular_acceleration:g} rad/s^2"
    )


def describe_monitor(monitor: CollisionMonitor) -> str:
    """Describe in one line what a collision monitor does with the commands."""
    acting = {name: each for name, each in monitor.polygons.items() if each.enabled and monitor.sees(each)}
    active = [f"{name} {_act(polygon)}" for name, polygon in acting.items()]
    if not monitor.enabled or not active:
        return "changes no command, as it has no enabled polygon or source"
    return "; ".join(active)


def _act(polygon: MonitorPolygon) -> str:
    """Say what one polygon does, and at how many points."""
    action = {
        "stop": "stops the robot",
        "slowdown": f"slows commands to {100 * polygon.slowdown_ratio:g} %",
        "limit": f"limits commands to {polygon.linear_limit:g} m/s and {polygon.angular_limit:g} rad/s",
        "approach": f"slows commands that collide within {polygon.time_before_collision:g} s",
        "none": "changes no command",
    }[polygon.action_type]
    shape = f"circle of {polygon.radius:g} m" if polygon.type == "circle" else polygon.type.replace("_", " ")
    return f"{action} ({shape}, from {polygon.min_points} points on)"


def describe_tree(navigation: NavigationParams) -> Iterator[str]:
    """Describe a tree of the file's own in one line."""
    if navigation.bt.xml:
        count = len(list(read_tree(navigation.bt.xml, navigation.release).walk()))
        yield f"the file's own, of {count} nodes"


def describe_filters(navigation: NavigationParams) -> list[str]:
    """Describe in a line each what the costmap filters do to a run."""
    lines = []
    for where, costmap in navigation.costmaps.items():
        lines += [f"{name} ({where}) {_keep_out(each)}" for name, each in costmap.keepout_filters.items()]
        lines += [f"{name} ({where}) {_slow_down(each)}" for name, each in costmap.speed_filters.items()]
        lines += [
            f"{name} ({where}) inflates the zones by {each.inflation_radius:g} m"
            for name, each in costmap.inflation_filters.items()
        ]
    return lines


def _keep_out(keepout: KeepoutFilter) -> str:
    values, cell = keepout.mask.values, keepout.mask.resolution**2
    lethal, raised = (values == HIGHEST).sum() * cell, ((values > 0) & (values < HIGHEST)).sum() * cell
    override = f"; a robot inside sees cost {keepout.lethal_override_cost}" if keepout.override_lethal_cost else ""
    return f"closes {lethal:.1f} m^2 and raises the cost of {raised:.1f} m^2{override}"


def _slow_down(speed: SpeedFilter) -> str:
    """Say on which area a filter limits the speed, and how far."""
    values, counts = np.unique(speed.mask.values, return_counts=True)
    limits = [speed.limit_of(int(value)) for value in values]
    area = sum(int(count) for limit, count in zip(limits, counts, strict=True) if limit) * speed.mask.resolution**2
    limited = sorted({limit for limit in limits if limit})
    if not limited:
        return "limits no speed, as no value of its mask gives a limit"
    unit = "%" if speed.percentage else "m/s"
    span = f"{limited[0]:g}" if len(limited) == 1 else f"{limited[0]:g} to {limited[-1]:g}"
    return f"limits the speed to {span} {unit} on {area:.1f} m^2"


def _release(read: Nav2Params) -> str:
    recognition = read.recognition
    name = recognition.release.capitalize()
    if recognition.given:
        told = "as --nav2 says"
    elif recognition.told_by:
        more = len(recognition.told_by) - 1
        told = f"as {_at(read, recognition.told_by[0])} tells" + _more(more)
    else:
        told = "as no key tells otherwise"
    against = recognition.against
    mixed = f"; {_at(read, against[0])} speaks against it" + _more(len(against) - 1) if against else ""
    return f"read as Nav2 {name}, {told}{mixed}"


def _more(number: int) -> str:
    return f", and {number} more keys" if number > 1 else ", and one more key" if number else ""


def _drivers(read: Nav2Params) -> str:
    controllers = read.navigation.controllers
    own = [f"{name} ({CONTROLLERS[controllers[name].kind].title})" for name in read.own_controllers]
    others = [name for name in controllers if name not in read.own_controllers]
    driving = ", ".join(own) or f"{', '.join(others)} (of a preset)"
    foreign = f"; not built here: {', '.join(read.foreign)}" if read.foreign else ""
    used = dict.fromkeys(SMOOTHERS[one.kind].title for one in read.navigation.used_smoothers.values())
    smooths = f"; smooths: {', '.join(used)}" if used else ""
    return f"drives: {driving}; plans: {PLANNERS[read.navigation.planner.name].title}{smooths}{foreign}"


def _told(read: Nav2Params, kind: Kind, title: str, most: int | None) -> Iterator[str]:
    """Yield a line for each reason of the findings of a kind; findings with the same reason share a line."""
    by_reason: dict[str, list[Finding]] = {}
    for finding in read.findings:
        if finding.kind == kind:
            by_reason.setdefault(finding.why, []).append(finding)
    for number, (why, found) in enumerate(by_reason.items()):
        if number == most:
            yield f"{title}: {len(by_reason) - number} more (--verbose names them)"
            return
        yield f"{title}: {_names(read, found, most)}" + (f": {why}" if why else "")


def _names(read: Nav2Params, found: Sequence[Finding], most: int | None) -> str:
    shown = ", ".join(_at(read, finding.name) for finding in found[:most])
    more = 0 if most is None else len(found) - most
    return shown + (f" and {more} more" if more > 0 else "")


def _unknown(read: Nav2Params, most: int | None) -> list[str]:
    """Return a line for each key that looks misspelt, and one for all other keys that are no parameters."""
    found = [finding for finding in read.findings if finding.kind == "unknown"]
    misspelt = [f"not a parameter: {_at(read, finding.name)}; {finding.why}" for finding in found if finding.why]
    others = [finding for finding in found if not finding.why]
    return [*misspelt, *([f"not a parameter: {_names(read, others, most)}"] if others else [])]


def _at(read: Nav2Params, name: str) -> str:
    """Return a name with the number of its line."""
    line = read.document.line_of(name)
    return name if line is None else f"{name} (line {line})"
