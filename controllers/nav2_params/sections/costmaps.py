"""Reads the costmap sections of a parameter file: the layers by their class, each with its observation sources."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from controllers.nav2_params.file.keys import COSTMAP
from controllers.nav2_params.plugins import COSTMAP_LAYERS, names_in_ros, stand_in
from controllers.nav2_params.sections.filters import FiltersFound
from gym_mapbench.costmap import FILTERS, LAYERS, OBSERVATION_SOURCE, CostmapParams
from gym_mapbench.costmap.inflation_layer import LEGACY, adapt_legacy
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import Section, known_class, parameter_names, refuse_missing

DEFAULT_LAYERS = ("static_layer", "obstacle_layer", "inflation_layer")
"""Nav2's own list of layers; only where ``plugins`` is this list, a file may leave out their classes."""
LEGACY_LAYERS = {"inflation_layer": LEGACY}
"""Further classes of layers."""
SOURCES = ("LaserScan", "PointCloud2")
"""Types of the sources that the lidar stands for, the preferred one first."""
COLLECTED = ("plugins", "layers", "release", *FILTERS)
"""Options that do not stand in a file as they are here."""


@dataclass
class Layer:
    """One layer of the file, before it is read.

    Args:
        name: Its name in the file.
        group: Its parameters.
        kind: Our name of its class.
        sources: Its observation sources by name.
    """

    name: str
    group: Section
    kind: str
    sources: dict[str, Section] = field(default_factory=dict)

    @property
    def is_enabled(self) -> bool:
        """Whether the file leaves it on."""
        return self.group.values.get("enabled", True) is not False

    def use(self, data_type: str) -> tuple[bool, bool]:
        """Return the order in which layers of one kind are chosen: whether it is on, and sees by this type."""
        return self.is_enabled, bool(self.sees(data_type))

    def sees(self, data_type: str) -> list[Section]:
        """Return the sources of one type; a source without a type is a laser, as in Nav2."""
        return [source for source in self.sources.values() if source.values.get("data_type", "LaserScan") == data_type]


def read_costmap(section: Section, filters: FiltersFound) -> CostmapParams:
    """Read a costmap's section, out of which the filters have been taken.

    Where neither ``robot_radius`` nor ``footprint`` is given, the robot's own shape counts (Nav2: 0.1 m). The robots
    here have one lidar, so of several layers of one class the first with a lidar is built; if no layer has a lidar,
    the lidar stands for the first point cloud. Layers that the file switches off come last in both. Third parties'
    layers without a stand-in are left out and listed.

    Raises:
        ConfigError: If a value is wrong, or a layer has no class.
    """
    names = section.take_names("plugins", DEFAULT_LAYERS)
    layers = _find_layers(section, names, filters.among_layers)
    data_type = _data_type(layers)
    built: dict[str, dict[str, Any]] = {}
    for layer in _one_of_each(layers, data_type):
        built[layer.kind] = _read_layer(layer, data_type)
    section.leave_groups()
    _bound_map_values(section)
    _tell_footprint(section)
    scalars = [name for name in parameter_names(CostmapParams) if "." not in name and name not in COLLECTED]
    kinds = {layer.name: layer.kind for layer in layers}
    plugins = (kinds.get(name, name) for name in names if name in kinds or filters.work_among_layers(name))
    own = {"plugins": tuple(dict.fromkeys(plugins)), "release": section.findings.release}
    return section.make(CostmapParams, {**section.read(COSTMAP, scalars), **built, **filters.options, **own})


def _data_type(layers: list[Layer]) -> str:
    """Return the type of the sources that are read: point clouds, if a layer that is on has one and none a lidar."""
    best = {kind: max(((bool(x.sees(kind)), x.is_enabled) for x in layers), default=(False, False)) for kind in SOURCES}
    return max(SOURCES, key=lambda kind: best[kind])


def _bound_map_values(section: Section) -> None:
    """Bring the map values that mean an obstacle and unknown into Nav2's bounds (static_layer.cpp, getParameters)."""
    section.cap("lethal_cost_threshold", 100, "Nav2 takes none that is higher")
    unknown = section.values.get("unknown_cost_value")
    if isinstance(unknown, int) and not isinstance(unknown, bool) and unknown != unknown % 256:
        section.values["unknown_cost_value"] = unknown % 256
        why = f"taken as {unknown % 256}: Nav2 keeps an unsigned byte"
        section.findings.add("replaced", f"{section.name}.unknown_cost_value", why)


def _tell_footprint(section: Section) -> None:
    """List a footprint that is a list: the parameter is a text."""
    corners = section.values.get("footprint")
    if isinstance(corners, list) and corners:
        section.findings.add("mistyped", f"{section.name}.footprint", f'expected a text; write "{corners}"')


def _find_layers(section: Section, names: tuple[str, ...], filters: Collection[str]) -> list[Layer]:
    """Return the layers that are built here or have a stand-in; the others become findings, filters do not."""
    shared = section.values.get("observation_sources")
    layers = []
    for name in (name for name in names if name not in filters):
        kind, replaced = _layer_kind(section, name, names == DEFAULT_LAYERS)
        if kind is None:
            _leave_out(section, name)
            continue
        group = section.take_group(name, kind)
        group.stand_in = replaced
        if replaced:
            section.findings.add("replaced", group.name, f"approximated by the {kind.replace('_', ' ')}")
        sources = _take_sources(section, group, shared) if LAYERS.get(kind).observes else {}
        layers.append(Layer(name, group, kind, sources))
    return layers


def _layer_kind(section: Section, name: str, has_default: bool) -> tuple[str | None, bool]:
    """Return our name of a layer, None if nothing here stands for it, and whether that is only a stand-in.

    Raises:
        ConfigError: If it has no class.
    """
    group = section.values.get(name)
    group = group if isinstance(group, Mapping) else {}
    release, where = section.findings.release, f"{section.name}.{name}.plugin"
    ros_class = group.get("plugin", COSTMAP_LAYERS[name].names[release] if has_default else None)
    if ros_class is None:
        only = f"; Nav2 has one only if plugins are {', '.join(DEFAULT_LAYERS)}" if name in DEFAULT_LAYERS else ""
        raise ConfigError(f"{where}: expected the class of this layer, got none{only}")
    for classes in (names_in_ros(COSTMAP_LAYERS), LEGACY_LAYERS):
        kind = known_class(ros_class, classes)
        if kind is not None:
            refuse_missing(classes[kind], release, where)
            return kind, False
    return stand_in(ros_class, COSTMAP_LAYERS), True


def _take_sources(section: Section, group: Section, shared: object) -> dict[str, Section]:
    """Take out the observation sources of a layer, or else, as in Dashing, those of the whole costmap.

    A source without a block sees nothing: Nav2 listens to a topic of its name, and drops every point above height 0.
    """
    lister = group if "observation_sources" in group.values else section
    own = group.values.pop("observation_sources", shared)
    names = [str(name) for name in own] if isinstance(own, (list, tuple)) else str(own or "").split()
    holder = group if any(name in group.values for name in names) else section
    blind = [name for name in names if name not in holder.values]
    if blind:
        blocks = ", ".join(key for key, value in group.values.items() if isinstance(value, Mapping)) or "none"
        why = f"{', '.join(blind)} has no block in {group.name} (it has {blocks}), so Nav2 sees nothing by it"
        group.findings.add("left_out", f"{lister.name}.observation_sources", why)
    sources = {name: holder.take_group(name, "scan") for name in names if name not in blind}
    group.leave_groups()
    return sources


def _leave_out(section: Section, name: str) -> None:
    """Leave out a layer that is not built here."""
    ros_class = section.values.pop(name)["plugin"]
    section.findings.add("left_out", f"{section.name}.{name}", f"{ros_class}: this layer is not built")


def _one_of_each(layers: list[Layer], data_type: str) -> list[Layer]:
    """Choose of each kind the first layer that is on and has such a source, or else is on; leave out the others."""
    chosen: dict[str, Layer] = {}
    for layer in layers:
        before = chosen.get(layer.kind)
        if before is None or layer.use(data_type) > before.use(data_type):
            chosen[layer.kind] = layer
    for layer in layers:
        if chosen[layer.kind] is not layer:
            which = "and the robots here have one lidar" if LAYERS.get(layer.kind).observes else "and one is built"
            why = f"a second {layer.kind.replace('_', ' ')}, {which}"
            layer.group.findings.add("left_out", layer.group.name, why)
    return list(chosen.values())


def _read_layer(layer: Layer, data_type: str) -> dict[str, Any]:
    """Read a layer, with its lidar if it has sources."""
    group, plugin = layer.group, COSTMAP_LAYERS[layer.kind]
    if known_class(group.values.pop("plugin", None), LEGACY_LAYERS):
        adapt_legacy(group)
    values = plugin.read(group)
    return {**values, "scan": _read_sources(layer, data_type)} if LAYERS.get(layer.kind).observes else values


def _read_sources(layer: Layer, data_type: str) -> dict[str, Any]:
    """Read the lidar among the sources; a layer without one neither marks nor clears.

    If one lidar source marks and another clears, they are read as one.
    """
    add = layer.group.findings.add
    lidars = layer.sees(data_type)
    marking = [source for source in lidars if source.values.get("marking", True) is not False]
    first = next(iter([*marking, *lidars]), None)
    for source in layer.sources.values():
        if source is not first:
            add("left_out", source.name, "the robots here have one lidar")
    if first is None:
        return {"marking": False, "clearing": False}
    if data_type != "LaserScan":
        add("replaced", first.name, "a point cloud; the robot's lidar stands for it")
        if first.values.pop("inf_is_valid", False):
            add("left_out", f"{first.name}.inf_is_valid", "Nav2 does not apply it to point clouds")
    if "max_obstacle_height" not in first.values:
        why = "0 by default, so Nav2 sees no point above the floor; the lidar here is at height 0"
        add("left_out", f"{first.name}.max_obstacle_height", why)
    if first.values.get("observation_persistence") == 0:
        del first.values["observation_persistence"]
    clears = layer.group.stand_in or any(source.values.get("clearing") is True for source in lidars)
    return {**OBSERVATION_SOURCE.read(first), **({"clearing": True} if clears else {})}
