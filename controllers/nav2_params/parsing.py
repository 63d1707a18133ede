"""The content of a ``nav2_params.yaml`` becomes :class:`~controllers.nav2_params.navigation.NavigationParams`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from controllers.behaviors import (
    DRIVE_ON_HEADING,
    BehaviorServer,
    BehaviorTree,
    DriveLimits,
    default_limits,
    default_tree,
)
from controllers.nav2_params.file import keys
from controllers.nav2_params.file.document import Document, refuse_bomb
from controllers.nav2_params.file.nodes import SECTIONS, all_nodes, find_sections
from controllers.nav2_params.file.recognition import Recognition, recognise
from controllers.nav2_params.file.tree import NAVIGATOR, take_tree
from controllers.nav2_params.file.tree_ids import CONTROLLER, PLANNER, TreeIds
from controllers.nav2_params.file.wildcards import share
from controllers.nav2_params.navigation import NavigationParams, VelocitySmoother
from controllers.nav2_params.plugin_settings import PlannerPlugin
from controllers.nav2_params.plugins import BEHAVIORS, DRIVES, PLANNERS, names_in_ros, stand_in
from controllers.nav2_params.sections.controllers import TREES_CHOICE, ControllersFound, read_controllers
from controllers.nav2_params.sections.costmaps import read_costmap
from controllers.nav2_params.sections.filter_servers import FilterServers
from controllers.nav2_params.sections.filters import read_filters
from controllers.nav2_params.sections.monitor import read_monitor
from controllers.nav2_params.sections.smoothers import read_smoothers
from controllers.tree_xml.needs import asked_behaviors
from gym_mapbench.costmap import COSTMAPS
from gym_mapbench.errors import ConfigError, nearest_name
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import (
    Finding,
    Findings,
    Kind,
    RosNames,
    Section,
    known_class,
    leaves,
    nest_dotted,
    overlay,
    parameter_names,
    refuse_slash,
)

BEHIND_CONTROLLER = ("velocity_smoother", "collision_monitor")
"""Sections that stand between controller and base, and that are off if the file does not configure them."""
IN_NO_PRESET = (*BEHIND_CONTROLLER, "smoother_server")
"""Sections that a file without them does not take from a preset."""
TREES_PLANNER = "GridBased"
"""The planner that Nav2's default tree asks for."""
USUAL_PLANNER = "navfn"
"""Nav2's default planner; it stands in for planners that are not built here."""

MISSPELT_PLUGIN = 0.8
"""Similarity from which on an unknown plugin is probably a misspelt one of the tree."""


@dataclass(frozen=True)
class Nav2Params:
    """The content of a parameter file.

    Args:
        navigation: The parameters.
        recognition: As which distribution the file is read, and why.
        findings: All that the file holds besides the parameters that count here.
        defaulted: Sections and controllers that the file does not configure, but the preset does.
        foreign: Controllers of the file that are not built here -> why they cannot drive.
        asked_for: The controller of the file that Nav2's default tree asks for; empty if it has none.
        document: The file itself, which knows its lines.
        ros_only: Numbers and switches that mean nothing without ROS, such as ``odom_duration``, and the libraries that
            Humble loads for the file's own tree; nested, by node, in the groups in which
            :func:`~controllers.nav2_params.writing.write_nav2_params` writes them back.
    """

    navigation: NavigationParams
    recognition: Recognition
    findings: tuple[Finding, ...]
    defaulted: tuple[str, ...]
    foreign: Mapping[str, str]
    asked_for: str
    document: Document
    ros_only: Mapping[str, Any]

    def named(self, kind: Kind) -> tuple[str, ...]:
        """Return the full names of all findings of one kind."""
        return tuple(finding.name for finding in self.findings if finding.kind == kind)

    @property
    def own_controllers(self) -> tuple[str, ...]:
        """Names of the controllers that are built here and that the file itself configures."""
        return tuple(name for name in self.navigation.controllers if f"controllers.{name}" not in self.defaulted)


def parse_nav2_params(
    document: object, preset: NavigationParams | None = None, release: Release | None = None
) -> Nav2Params:
    """Read the content of a ``nav2_params.yaml``.

    A parameter that a section does not give has the default of Nav2's code, as in ROS. What Nav2 itself ignores is
    listed, not refused.

    Args:
        document: The content of the YAML file, or the whole :class:`~controllers.nav2_params.file.document.Document`.
        preset: Provides the sections that are missing as a whole, except ``IN_NO_PRESET``, and the kinds of
            controllers that are not configured; None for the defaults of Nav2's code and no further controllers.
        release: The distribution; None to recognise it.

    Raises:
        ConfigError: If a value is wrong, a plugin that the run cannot do without is not built here, or the file mixes
            the distributions.
    """
    given = document if isinstance(document, Document) else Document(document)
    refuse_bomb(given.values)
    nodes = all_nodes(given.values)
    recognition = recognise(nodes, release)
    findings = Findings(recognition.release)
    _tell_repeated(given, findings)
    shared = share(nodes)
    sections = find_sections(shared.nodes, findings)
    _tell_empty_lists(sections)
    servers = FilterServers(shared.nodes, given.folder, findings)
    found, controllers = _read_sections(sections, servers)
    navigation, defaulted = _complete(found, controllers, preset or NavigationParams(release=recognition.release))
    told = shared.told(findings.found, [section.name for section in sections.values()])
    left_out = [name for name in SECTIONS if name not in sections and name not in IN_NO_PRESET]
    return Nav2Params(
        navigation,
        recognition=recognition,
        findings=tuple(dict.fromkeys(finding for finding in told if finding.name not in servers.used)),
        defaulted=(*(left_out if preset else ()), *defaulted),
        foreign=controllers.foreign,
        asked_for=controllers.asked_for,
        document=given,
        ros_only=nest_dotted(findings.kept),
    )


def _tell_repeated(document: Document, findings: Findings) -> None:
    """List what the file gives twice, and what it gives by an alias."""
    for name in document.repeated:
        if name in document.regrouped:
            why = "an earlier group of this name, as with nav2_bringup's launch files; ROS alone merges both"
            findings.add("left_out", name, why)
        else:
            findings.add("repeated", name)
    for name, is_single in document.aliased.items():
        findings.add("aliased", name, "nav2_bringup's launch files write the value out" if is_single else "")


def _tell_empty_lists(sections: Mapping[str, Section]) -> None:
    """List the empty lists: they have no type, and a node of ROS does not start with a parameter without a type."""
    for section in sections.values():
        for key in (key for key, value in leaves(section.values) if isinstance(value, list) and not value):
            section.findings.add("mistyped", f"{section.name}.{key}", "expected a list of one value or more")


def _complete(
    found: Mapping[str, Any], controllers: ControllersFound, base: NavigationParams
) -> tuple[NavigationParams, list[str]]:
    """Fill in the sections and controllers that the file does not configure, and name these controllers."""
    own = controllers.controllers
    kinds = {plugin.kind for plugin in own.values()}
    known = {*own, *controllers.foreign}
    extra = {name: p for name, p in base.controllers.items() if p.kind not in kinds and name not in known}
    navigation = base.replace(**{**dict.fromkeys(BEHIND_CONTROLLER), **found, "controllers": {**own, **extra}})
    return navigation, [f"controllers.{name}" for name in extra]


def _read_sections(sections: Mapping[str, Section], servers: FilterServers) -> tuple[dict[str, Any], ControllersFound]:
    """Read every section of the file into options of :class:`NavigationParams`, and the controllers."""
    costmaps = [name for name in COSTMAPS if name in sections]
    filters = {name: read_filters(sections[name], servers, sections.get("controller_server")) for name in costmaps}
    file = take_tree(sections.get(NAVIGATOR), servers.folder)
    ids = TreeIds.take(sections.get(NAVIGATOR), file)
    asked = tuple(BEHAVIORS) if file.tree is None else asked_behaviors(file.tree)
    if file.is_default or file.tree:
        _tell_missing(sections, ids, asked)
    read_behaviors = partial(_read_behaviors, drives=DRIVE_ON_HEADING in asked)
    readers = {"behavior_server": ("behavior_server", read_behaviors), **READERS}
    found = {field: read(sections[name]) for name, (field, read) in readers.items() if name in sections}
    if "planner_server" in sections:
        found["planner"] = _read_planner(sections["planner_server"], ids)
    if "smoother_server" in sections:
        found["smoothers"] = read_smoothers(sections["smoother_server"], file.tree)
    found |= {"bt": found["bt"].replace(xml=file.xml)} if file.xml else {}
    found |= {name: read_costmap(sections[name], filters[name]) for name in costmaps}
    found["release"] = next(iter(sections.values())).findings.release
    if "controller_server" not in sections:
        return found, ControllersFound()
    controllers = read_controllers(sections["controller_server"], ids)
    return {**found, "controller_server": controllers.server}, controllers


def _read_planner(server: Section, ids: TreeIds) -> PlannerPlugin:
    """Read the planner that the tree names, or else the first; NavFn or Smac 2D stand in for others.

    Raises:
        ConfigError: If a value is wrong, or a planner has no class; Nav2 has one for ``GridBased`` alone in its list.
    """
    names = server.take_names("planner_plugins", (TREES_PLANNER,), least=1)
    for name in names if names != (TREES_PLANNER,) else ():
        group = server.values.get(name)
        if not isinstance(group, Mapping) or "plugin" not in group:
            raise ConfigError(f"{server.name}.{name}.plugin: expected the class of this planner, got none")
    usual = TREES_PLANNER if TREES_PLANNER in names else names[0]
    group = server.take_group(ids.named(PLANNER, names, f"{server.name}.planner_plugins") or usual, TREES_PLANNER)
    ros_class = group.values.pop("plugin", PLANNERS[USUAL_PLANNER].names[group.findings.release])
    refuse_slash(ros_class, group.findings.release, f"{group.name}.plugin")
    kind = known_class(ros_class, names_in_ros(PLANNERS))
    if kind is None:
        kind = stand_in(ros_class, PLANNERS) or USUAL_PLANNER
        group.stand_in = True
        group.findings.add("replaced", group.name, f"{ros_class} is not built; {PLANNERS[kind].title} plans here")
    server.leave_groups()
    own = server.read(keys.PLANNER_SERVER, ("costmap_update_timeout",))
    return server.make(PlannerPlugin, {"name": kind, "params": PLANNERS[kind].read(group), **own})


def _read_behaviors(server: Section, *, drives: bool) -> BehaviorServer:
    """Read the behaviours without those whose class the tree does not expect; those that drive have their own settings.

    Args:
        server: The section.
        drives: Whether the tree asks for a drive on the heading.

    Raises:
        ConfigError: If a value is wrong, or the release does not start with the class of a behaviour.
    """
    names = server.take_names("behavior_plugins", ("spin", "backup", "drive_on_heading", "wait"))
    built = BEHAVIORS | (DRIVES if drives else {})
    enabled = [name for name in names if _read_behavior(server, name, built)]
    for key in [key for key, value in server.values.items() if isinstance(value, Mapping) and key not in enabled]:
        server.leave(key)
    straight = ("backup", *(DRIVES if drives else ()))
    usual = {name: default_limits(server.findings.release).model_dump() for name in straight}
    limits = [f"{name}.{limit}" for name in straight for limit in DriveLimits.model_fields]
    values = overlay(usual, server.read(keys.BEHAVIOR_SERVER, {*parameter_names(BehaviorServer), *limits}))
    plugins = tuple(name for name in enabled if name in BEHAVIORS)
    return server.make(BehaviorServer, {**values, "behavior_plugins": plugins})


def _tell_missing(sections: Mapping[str, Section], ids: TreeIds, behaviors: Iterable[str]) -> None:
    """List the plugins for which the tree asks and which the file's lists lack.

    Without a behaviour's action server the tree does not load; without the planner no plan is made, and without the
    controller no path is followed.
    """
    asked_for = {
        "planner_server": ("planner_plugins", (ids.names.get(PLANNER) or TREES_PLANNER,)),
        "controller_server": ("controller_plugins", _trees_controller(ids, sections.get("controller_server"))),
        "behavior_server": ("behavior_plugins", tuple(behaviors)),
    }
    for name, (key, wanted) in asked_for.items():
        given = sections[name].values.get(key) if name in sections else None
        if isinstance(given, list):
            _tell_unlisted(sections[name], key, wanted, [str(one) for one in given])


def _trees_controller(ids: TreeIds, server: Section | None) -> tuple[str, ...]:
    """Return the controller for which the tree asks; none if a file compares several and its tree is the default."""
    listed = None if server is None else server.values.get("controller_plugins")
    compares = isinstance(listed, list) and len(listed) > 1
    return (ids.names[CONTROLLER],) if CONTROLLER in ids.names else () if compares else (TREES_CHOICE,)


def _tell_unlisted(server: Section, key: str, wanted: Iterable[str], names: list[str]) -> None:
    """List the wanted plugins that a list does not name, each with the name that may be meant."""
    others = [name for name in names if name not in wanted]
    for name in (name for name in wanted if name not in names):
        near = nearest_name(name, others, MISSPELT_PLUGIN)
        server.findings.add(
            "missing", f"{server.name}.{name}", f"expected in {key}" + (f", got {near!r}" if near else "")
        )


def _read_behavior(server: Section, name: str, built: Mapping[str, RosNames]) -> bool:
    """Read one behaviour; returns whether it is among those that are built here."""
    if name not in built:
        server.leave(name)
        return False
    group = server.take_group(name)
    ros_class = str(group.values.pop("plugin", built[name][group.findings.release]))
    refuse_slash(ros_class, group.findings.release, f"{group.name}.plugin")
    if _last_part(ros_class) != _last_part(built[name][group.findings.release]):
        server.findings.add("left_out", group.name, f"{ros_class}: this behaviour is not built")
        return False
    own = group.values if name in ("backup", *DRIVES) else {}
    for key in [key for key in group.values if key not in own]:
        of_all = key in BehaviorServer.model_fields
        why = f"all behaviours read {server.name}.{key}" if of_all else "this behaviour has no parameters of its own"
        server.findings.add("unused", f"{group.name}.{key}", why)
    server.values |= {name: own} if own else {}
    return True


def _last_part(ros_class: str) -> str:
    """Return the name of a class without its package."""
    return ros_class.replace("::", "/").rpartition("/")[2]


def _read_tree(section: Section) -> BehaviorTree:
    values = section.read(keys.BT_NAVIGATOR, parameter_names(BehaviorTree))
    defaults = default_tree(section.findings.release).model_dump(exclude_defaults=True)
    return section.make(BehaviorTree, {**defaults, **values})


def _read_smoother(section: Section) -> VelocitySmoother:
    return section.build(VelocitySmoother, keys.VELOCITY_SMOOTHER)


READERS: dict[str, tuple[str, Any]] = {
    "bt_navigator": ("bt", _read_tree),
    "velocity_smoother": ("velocity_smoother", _read_smoother),
    "collision_monitor": ("collision_monitor", read_monitor),
}
