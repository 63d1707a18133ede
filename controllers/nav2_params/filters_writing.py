"""Writes costmap filters: their groups in a costmap's section, the servers of their masks, and the masks' files."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from itertools import chain, count
from typing import Any

from controllers.nav2_params.navigation import NavigationParams
from controllers.nav2_params.sections.filters import (
    ABSOLUTE,
    CLASSES,
    INFLATION_LAYER,
    LIMIT_TOPIC,
    PERCENT,
    USUAL_LIMIT_TOPIC,
)
from gym_mapbench.costmap import INFO_SERVERS, MASK_SERVERS, CostmapParams, FilterMask, KeepoutFilter, SpeedFilter
from gym_mapbench.mapio import Occupancy, occupancy_files
from gym_mapbench.releases import Release

FOLDER = "maps/masks"
"""Folder of the masks beside a parameter file; ROS 2 packages install ``maps``."""

Filter = KeepoutFilter | SpeedFilter


def filter_groups(costmap: CostmapParams, where: str) -> dict[str, Any]:
    """Return the list of a costmap's filters behind the layers and the groups of all; nothing where there are none."""
    ros_names = _ros_names(where, costmap)
    groups = {name: _group(each, ros_names[name], costmap.release) for name, each in _filters(costmap)}
    groups |= _inflations(costmap)
    return {**_listed(costmap, groups), **groups}


def filter_values(costmap: CostmapParams) -> dict[str, Any]:
    """Return what distinguishes a costmap's filters, by filter: class, options, numbers of its info server, and mask.

    The mask is a text of size, resolution, origin and digest. Topics and files, which only connect the nodes, are left
    out; without filters there is nothing.
    """
    groups = {name: {**_group(each, "", costmap.release), **_effect(each)} for name, each in _filters(costmap)}
    kept = {name: {key: group[key] for key in group if not key.endswith("_topic")} for name, group in groups.items()}
    kept |= _inflations(costmap)
    among = {"plugins": list(costmap.plugins)} if costmap.filters_among_layers else {}
    return {**among, **_listed(costmap, kept), **kept}


def _listed(costmap: CostmapParams, names: Iterable[str]) -> dict[str, list[str]]:
    """Return the list of the filters behind the layers; nothing where there are none, as ROS takes no empty list."""
    behind = [name for name in names if name not in costmap.filters_among_layers]
    return {"filters": behind} if behind else {}


def _inflations(costmap: CostmapParams) -> dict[str, dict[str, Any]]:
    """Return the groups of the inflation layers behind the filters."""
    layers = costmap.inflation_filters.items()
    return {name: INFLATION_LAYER.write(each.model_dump(mode="json"), costmap.release) for name, each in layers}


def filter_nodes(navigation: NavigationParams) -> dict[str, dict[str, Any]]:
    """Return the servers of all masks by name; the files of the masks are those of :func:`mask_files`."""
    nodes: dict[str, dict[str, Any]] = {}
    for name, each in _named(navigation):
        mask = f"{name}_mask"
        nodes[f"{name}_{INFO_SERVERS}"] = {"filter_info_topic": f"{name}_info", "mask_topic": mask, **_info(each)}
        nodes[f"{name}_{MASK_SERVERS}"] = {"topic_name": mask, "yaml_filename": f"{FOLDER}/{name}.yaml"}
    return nodes


def mask_files(navigation: NavigationParams) -> dict[str, str | bytes]:
    """Return the map files of all masks, by their names beside the parameter file."""
    files: dict[str, str | bytes] = {}
    for name, each in _named(navigation):
        files |= {f"{FOLDER}/{file}": content for file, content in occupancy_files(name, _occupancy(each.mask)).items()}
    return files


def _named(navigation: NavigationParams) -> Iterator[tuple[str, Filter]]:
    """Yield all filters, each with a name that no other has."""
    for where, costmap in navigation.costmaps.items():
        ros_names = _ros_names(where, costmap)
        for name, each in _filters(costmap):
            yield ros_names[name], each


def _ros_names(where: str, costmap: CostmapParams) -> dict[str, str]:
    """Return each filter's name for nodes and topics, which have letters, digits and underscores only in ROS.

    Where two filters would share a name, the later one gets a number.
    """
    ros_names: dict[str, str] = {}
    for name, _ in _filters(costmap):
        plain = f"{where}_{re.sub('[^A-Za-z0-9_]', '_', name)}"
        candidates = chain([plain], (f"{plain}_{number}" for number in count(2)))
        ros_names[name] = next(one for one in candidates if one not in ros_names.values())
    return ros_names


def _filters(costmap: CostmapParams) -> list[tuple[str, Filter]]:
    """Return all filters."""
    return [*costmap.keepout_filters.items(), *costmap.speed_filters.items()]


def _group(each: Filter, name: str, release: Release) -> dict[str, Any]:
    kind = "keepout_filters" if isinstance(each, KeepoutFilter) else "speed_filters"
    group = {"plugin": CLASSES[kind][release], "enabled": True, "filter_info_topic": f"{name}_info"}
    if isinstance(each, SpeedFilter):
        return {**group, LIMIT_TOPIC: USUAL_LIMIT_TOPIC}
    return group if release == "humble" else {**group, **each.model_dump(exclude={"mask"})}


def _info(each: Filter) -> Mapping[str, float]:
    """Return what an info server says of a filter."""
    if isinstance(each, KeepoutFilter):
        return {"type": 0, "base": 0.0, "multiplier": 1.0}
    return {"type": PERCENT if each.percentage else ABSOLUTE, "base": each.base, "multiplier": each.multiplier}


def _effect(each: Filter) -> dict[str, Any]:
    """Return the mask of a filter, and the numbers of its info server if the filter reads them."""
    read = _info(each) if isinstance(each, SpeedFilter) else {}
    return {**read, "mask": _short(each.mask)}


def _short(mask: FilterMask) -> str:
    """Describe a mask: size, resolution, origin and digest."""
    resolution, x, y = mask.geometry
    digest = sha256(mask.values.tobytes()).hexdigest()[:8]
    return f"{mask.rows} x {mask.cols} cells of {resolution:g} m from ({x:g}, {y:g}), {digest}"


def _occupancy(mask: FilterMask) -> Occupancy:
    return Occupancy(mask.values, mask.resolution, mask.origin)
