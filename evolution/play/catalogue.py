"""Catalogue: all that the page starts with."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from controllers.nav2_params.plugins import CONTROLLERS
from evolution.driving import ControllerSpec, DriveSettings
from evolution.files import PACKAGE_VERSION
from evolution.play.messages.requests import MAX_FILE, Scene, Variant, WorldSettings
from evolution.play.messages.start import (
    ControllerState,
    FamilyState,
    Gene,
    Limits,
    MapEntry,
    PresetState,
    RobotState,
    State,
)
from evolution.play.parameters import controller_parameters, costmap_parameters
from evolution.play.worlds import FILE, Given, PageWorld
from gym_mapbench.errors import MapBenchError
from gym_mapbench.generator import FAMILIES, make_family
from gym_mapbench.registry import Registry
from gym_mapbench.world.noise import NOISES
from gym_mapbench.world.robot import ROBOTS, RobotSpec

LOG = logging.getLogger(__name__)

T = TypeVar("T")

LABELS = {"dwb": "DWB", "mppi": "MPPI", "rpp": "RPP", "graceful": "Graceful"}
PRESET_LABELS = {
    "thesis": "Nav2's examples (Humble)",
    "fair": "the same limits for all (Humble)",
    "jazzy": "Nav2's examples (Jazzy)",
    "jazzy_fair": "the same limits for all (Jazzy)",
    "lyrical": "Nav2's examples (Lyrical)",
    "lyrical_fair": "the same limits for all (Lyrical)",
}


def state_of(given: Given, scenes: Sequence[Scene], settings: WorldSettings, chosen: Sequence[ControllerSpec]) -> State:
    """Return what the page starts with.

    Args:
        given: What the command line gives.
        scenes: The maps of the command line; the page begins with the first.
        settings: The world to begin with.
        chosen: The controllers to begin with.
    """
    worlds = {name: PageWorld(settings.replace(preset=name), given).own_settings for name in given.presets}
    return State(
        version=PACKAGE_VERSION,
        scene=scenes[0],
        settings=settings,
        variants=[Variant(name=spec.name, controller=spec.name) for spec in chosen],
        controllers=[_controller(spec, worlds) for spec in given.controllers],
        presets=[_preset(name, world, given) for name, world in worlds.items()],
        robots=_each(ROBOTS, lambda name: _robot(name, ROBOTS.get(name))),
        noise_levels=list(NOISES.names()),
        families=_each(FAMILIES, lambda name: FamilyState(name=name, genes=_genes(name))),
        maps=[MapEntry(name=scene.name, scene=scene) for scene in scenes],
        limits=Limits(file_bytes=MAX_FILE),
    )


def _each(registry: Registry[Any], state: Callable[[str], T]) -> list[T]:
    """Return the state of every entry of a registry; an entry that cannot be used is left out, with a warning."""
    found = []
    for name in registry.names():
        try:
            found.append(state(name))
        except MapBenchError as error:
            LOG.warning("not on the page: %s", error)
    return found


def _controller(spec: ControllerSpec, worlds: Mapping[str, DriveSettings]) -> ControllerState:
    parameters = {name: controller_parameters(world.navigation, spec) for name, world in worlds.items()}
    first = next(iter(worlds.values())).navigation
    kind = spec.registered_name
    if parameters[next(iter(worlds))]:
        kind = first.controller(spec.registered_name).kind
    return ControllerState(
        name=spec.name,
        kind=kind if kind in CONTROLLERS else "",
        label=LABELS.get(spec.name, spec.name),
        parameters=parameters,
    )


def _preset(name: str, world: DriveSettings, given: Given) -> PresetState:
    label = Path(given.file.params).name if name == FILE and given.file is not None else PRESET_LABELS[name]
    navigation = world.navigation
    return PresetState(
        name=name,
        release=navigation.release,
        label=label,
        shared=costmap_parameters(navigation, given.controllers[0]),
        robot=_robot(world.robot.name, world.robot),
    )


def _robot(name: str, robot: RobotSpec) -> RobotState:
    return RobotState(
        name=name,
        radius=robot.radius,
        footprint=None if robot.footprint is None else list(robot.footprint),
        max_linear_velocity=robot.max_linear_velocity,
        max_angular_velocity=robot.max_angular_velocity,
    )


def _genes(name: str) -> list[Gene]:
    """Return the genes of a family that are sampled from a range."""
    family = make_family(name)
    ranges = ((key, getattr(family, key)) for key in getattr(type(family), "model_fields", {}))
    return [
        Gene(
            name=key,
            low=value[0],
            high=value[1],
            default=(value[0] + value[1]) / 2,
            whole=all(isinstance(one, int) for one in value),
        )
        for key, value in ranges
        if isinstance(value, tuple) and len(value) == 2 and all(isinstance(one, int | float) for one in value)
    ]
