"""The costmap sections of a parameter file: layers by their class, observation sources into their layer."""

from __future__ import annotations

from typing import Any

from controllers.nav2_params.keys import COSTMAP, LAYERS, SOURCE
from controllers.nav2_params.plugins import COSTMAP_LAYERS, name_of_class
from controllers.nav2_params.section import Section, parameter_names
from gym_mapbench.costmap import CostmapParams, ObservationSource
from gym_mapbench.errors import ConfigError

DEFAULT_LAYERS = ("static_layer", "obstacle_layer", "inflation_layer")


def read_costmap(section: Section) -> CostmapParams:
    """Read a costmap's section.

    Where neither ``robot_radius`` nor ``footprint`` is given, the robot's own shape counts (Nav2: 0.1 m).

    Raises:
        ConfigError: If a layer's class is not built here, or two layers are of one class.
    """
    names = section.take_names("plugins", DEFAULT_LAYERS)
    filters = section.take_names("filters", ())
    if filters:
        raise ConfigError(f"{section.name}.filters: costmap filters are not built, got {', '.join(filters)}")
    layers: dict[str, dict[str, Any]] = {}
    for name in names:
        group = section.take_group(name)
        kind = _layer_kind(group, name)
        if kind in layers:
            raise ConfigError(f"{section.name}.plugins: expected one {kind} at most, got another: {name!r}")
        layers[kind] = _read_layer(group, kind)
    section.leave_groups()
    scalars = [name for name in parameter_names(CostmapParams) if "." not in name and name != "nav2"]
    own = {"plugins": tuple(layers), "nav2": section.findings.release}
    return section.make(CostmapParams, {**section.read(COSTMAP, scalars), **layers, **own})


def _layer_kind(group: Section, name: str) -> str:
    ros_class = group.values.get("plugin", COSTMAP_LAYERS.get(name))
    if ros_class is None:
        raise ConfigError(f"{group.name}.plugin: expected the class of this layer, got none")
    return name_of_class(ros_class, COSTMAP_LAYERS, f"{group.name}.plugin", "costmap layer")


def _read_layer(group: Section, kind: str) -> dict[str, Any]:
    group.values.pop("plugin", None)
    names = type(CostmapParams.model_fields[kind].default).model_fields
    if "scan" not in names:
        return group.read(LAYERS[kind], [*names])
    source = _take_source(group)
    return {**group.read(LAYERS[kind], names.keys() - {"scan"}), "scan": source}


def _take_source(group: Section) -> dict[str, Any]:
    """Read the lidar among the observation sources; a layer without one neither marks nor clears."""
    names = group.take_name("observation_sources", "").split()
    sources = [group.take_group(name) for name in names]
    lidars = [source for source in sources if source.values.get("data_type", "LaserScan") == "LaserScan"]
    for source in sources:
        if source not in lidars[:1]:
            group.findings.unmodelled.append(source.name)
    group.leave_groups()
    if not lidars:
        return {"marking": False, "clearing": False}
    persistence = lidars[0].values.pop("observation_persistence", 0.0)
    if persistence != 0:
        raise ConfigError(
            f"{lidars[0].name}.observation_persistence: expected 0 (only the latest scan counts), got {persistence!r}"
        )
    return lidars[0].read(SOURCE, ObservationSource.model_fields)
