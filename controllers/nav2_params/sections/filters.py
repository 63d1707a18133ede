"""Reads the costmap filters of a parameter file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from controllers.nav2_params.file.keys import KEEPOUT_FILTER, SPEED_FILTER
from controllers.nav2_params.plugins import COSTMAP_LAYERS
from controllers.nav2_params.sections.filter_servers import FilterServers, InfoServer, LeftOutError, same_topic
from gym_mapbench.costmap import CostmapParams, KeepoutFilter, SpeedFilter
from gym_mapbench.costmap.keepout_filter import HIGHEST_OVERRIDE
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import PLACEHOLDER, Findings, Section, in_every_release, known_class

CLASSES = {
    "keepout_filters": in_every_release("nav2_costmap_2d::KeepoutFilter"),
    "speed_filters": in_every_release("nav2_costmap_2d::SpeedFilter"),
}
"""Options of a costmap -> the class of the filters that they hold."""
BINARY = {"binary": in_every_release("nav2_costmap_2d::BinaryFilter")}
INFLATION_LAYER = COSTMAP_LAYERS["inflation_layer"]
INFLATION = {"inflation_filters": INFLATION_LAYER.names}
"""The option for inflation layers behind the filters -> their class."""
PERCENT, ABSOLUTE = 1, 2
"""Types of an info server for a speed filter."""
LIMIT_TOPIC = "speed_limit_topic"
USUAL_LIMIT_TOPIC = "speed_limit"


@dataclass(frozen=True)
class FiltersFound:
    """The filters of a costmap's section.

    Args:
        options: Those that have an effect here, by option and name.
        among_layers: Names of all that ``plugins`` lists, where layers see what they write.
    """

    options: Mapping[str, dict[str, Any]]
    among_layers: tuple[str, ...]

    def work_among_layers(self, name: str) -> bool:
        """Whether a filter that ``plugins`` lists has an effect here."""
        return name in self.among_layers and any(name in filters for filters in self.options.values())


def read_filters(costmap: Section, servers: FilterServers, server: Section | None) -> FiltersFound:
    """Take the filters out of a costmap's section, those that stand among its layers as well.

    Args:
        costmap: The section.
        servers: The servers of the masks.
        server: The section of the controller server, which listens to speed limits; None if the file has none.

    Raises:
        ConfigError: If a value is wrong, a filter has no class, or a mask's file cannot be read.
    """
    filters: dict[str, dict[str, Any]] = {kind: {} for kind in CLASSES | INFLATION}
    among_layers, behind = _among_layers(costmap), costmap.take_names("filters", ())
    layers, early = {*_plugins(costmap)} - {*among_layers}, _before_keepouts(costmap, behind)
    topic = USUAL_LIMIT_TOPIC if server is None else server.values.get(LIMIT_TOPIC, USUAL_LIMIT_TOPIC)
    for name in (*among_layers, *behind):
        group = _copy(costmap, name) if name in layers else costmap.take_group(name)
        kind = _kind(group)
        if kind is None or not _is_enabled(group):
            continue
        try:
            if kind in INFLATION:
                read: Any = _read_inflation(group, is_layer=name in layers, is_early=name in early)
            else:
                keeps_out = kind == "keepout_filters"
                read = _read_keepout(group, servers) if keeps_out else _read_speed(group, servers, topic)
        except LeftOutError as error:
            group.findings.add("left_out", group.name, str(error))
        else:
            filters[kind][name] = read
    return FiltersFound(filters, among_layers)


def _among_layers(costmap: Section) -> tuple[str, ...]:
    """Return the names in ``plugins`` whose class is one of Nav2's filters."""
    return tuple(name for name in _plugins(costmap) if known_class(_class_of(costmap, name), CLASSES | BINARY))


def _plugins(costmap: Section) -> list[str]:
    """Return the names in ``plugins``, each once."""
    listed = costmap.values.get("plugins", CostmapParams.model_fields["plugins"].default)
    names = [name for name in listed if isinstance(name, str)] if isinstance(listed, list | tuple) else []
    return list(dict.fromkeys(names))


def _class_of(costmap: Section, name: str) -> object:
    """Return the class that the section of a layer or filter names; None if there is none."""
    group = costmap.values.get(name)
    return group.get("plugin") if isinstance(group, Mapping) else None


def _before_keepouts(costmap: Section, behind: Sequence[str]) -> Sequence[str]:
    """Return the names in ``filters`` that stand before the last keepout filter; all without a keepout filter."""
    kinds = [known_class(_class_of(costmap, name), CLASSES) for name in behind]
    last = max((place for place, kind in enumerate(kinds) if kind == "keepout_filters"), default=len(behind))
    return behind[:last]


def _copy(costmap: Section, name: str) -> Section:
    """Return the section of a filter that is a layer as well, which keeps it."""
    return Section(f"{costmap.name}.{name}", costmap.values.get(name), costmap.findings)


def _kind(group: Section) -> str | None:
    """Return the option that holds filters of this class; None, and a finding, if nothing here does what it does."""
    ros_class = group.values.pop("plugin", None)
    if ros_class is None:
        raise ConfigError(f"{group.name}.plugin: expected the class of this filter, got none")
    kind = known_class(ros_class, CLASSES | INFLATION)
    if kind is None:
        binary = known_class(ros_class, BINARY) is not None
        why = "nobody here listens to its switch" if binary else f"{ros_class}: this filter is not built"
        group.findings.add("ros_only" if binary else "left_out", group.name, why)
    return kind


def _is_enabled(group: Section) -> bool:
    """Whether a filter is enabled; a word that a launch file replaces stands for false."""
    enabled = group.values.pop("enabled", True)
    if isinstance(enabled, str) and PLACEHOLDER.fullmatch(enabled):
        why = f"the launch file enables it; --define {enabled}=true"
        group.findings.add("left_out", group.name, why)
        return False
    if not isinstance(enabled, bool):
        raise ConfigError(f"{group.name}.enabled: expected true or false, got {enabled!r}")
    if not enabled:
        group.findings.add("unused", group.name, "it is not enabled")
    return enabled


def _info_of(group: Section, servers: FilterServers) -> tuple[InfoServer, Section]:
    if "filter_info_topic" not in group.values:
        raise ConfigError(f"{group.name}.filter_info_topic: expected the topic of an info server, got none")
    return servers.info(group.take_name("filter_info_topic", ""))


def _read_keepout(group: Section, servers: FilterServers) -> KeepoutFilter:
    """Read a keepout filter; Nav2 logs an error for another base or multiplier, but does not read them."""
    info, where = _info_of(group, servers)
    for key, usual in (("base", info.base == 0.0), ("multiplier", info.multiplier == 1.0)):
        if not usual:
            group.findings.add("unused", f"{where.name}.{key}", "keepout filters do not read it")
    group.cap("lethal_override_cost", HIGHEST_OVERRIDE, "Nav2 does likewise")
    return group.build(KeepoutFilter, KEEPOUT_FILTER, mask=servers.mask(info.mask_topic))


def _read_inflation(group: Section, *, is_layer: bool, is_early: bool) -> dict[str, Any]:
    """Read an inflation layer behind the filters; of a section that a layer has as well, the layer tells the findings.

    Raises:
        LeftOutError: If a keepout filter follows, or there is none.
    """
    if is_early:
        raise LeftOutError("an inflation layer has an effect here only behind all keepout filters")
    findings = Findings(group.findings.release) if is_layer else group.findings
    return INFLATION_LAYER.read(Section(group.name, group.values, findings))


def _read_speed(group: Section, servers: FilterServers, topic: object) -> SpeedFilter:
    """Read a speed filter, whose limits reach the controller server on ``topic``."""
    info, where = _info_of(group, servers)
    if info.type not in (PERCENT, ABSOLUTE):
        raise ConfigError(f"{where.name}.type: expected {PERCENT} (per cent) or {ABSOLUTE} (m/s), got {info.type}")
    published = group.take_name(LIMIT_TOPIC, USUAL_LIMIT_TOPIC)
    if not same_topic(published, topic):
        raise LeftOutError(f"it publishes on {published}, but the controller server listens to {topic}")
    mask = servers.mask(info.mask_topic)
    given: Mapping[str, Any] = {"base": info.base, "multiplier": info.multiplier, "percentage": info.type == PERCENT}
    return group.build(SpeedFilter, SPEED_FILTER, mask=mask, **given)
