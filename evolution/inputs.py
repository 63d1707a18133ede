"""Inputs of a caller: maps, controllers and worlds from names, files, loaded results, or as they are."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

from controllers.nav2_params import PRESETS, Nav2Params, read_nav2_params
from evolution.arguments import instance_of
from evolution.benchmark import PREFIX as BARN
from evolution.benchmark import load_barn
from evolution.driving import (
    ControllerSpec,
    DriveSettings,
    ParameterFile,
    check_room,
    take_shape_of_robot,
    with_parameters,
)
from evolution.results import run_with_maps
from evolution.runs import LoadedRun, experiment_in, reached_maps
from evolution.search import DEFAULT_CONTROLLERS, controllers_from
from evolution.tuning import (
    ParameterText,
    TuneSettings,
    TuningPlan,
    space_for,
    text_of_file,
    text_of_settings,
    writable_space,
)
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ArgumentError, ConfigError, unknown_name
from gym_mapbench.mapio import PoseLike, files_beside, load_scenarios
from gym_mapbench.world.scenario import MapSet, Scenario

LOG = logging.getLogger(__name__)

Maps = str | Path | Scenario | MapSet | LoadedRun
"""A file or directory of any kind that ``mapbench bench`` reads, or maps that are loaded already."""

MAP_KINDS = (str, Path, Scenario, MapSet, LoadedRun)

Controllers = str | Sequence[str | Mapping[str, Any] | ControllerSpec]
"""Names, ``NAME=KIND``, ``NAME=model.zip``, or mappings with ``name``, ``kind`` and ``params``."""


def barn_source(maps: Iterable[object]) -> str | None:
    """Return the ``barn:DIR`` among some maps, if there is one; it has rules of its own and must be the only map.

    Raises:
        ConfigError: If there are other maps beside it.
    """
    items = list(maps)
    found = [item for item in items if isinstance(item, str) and item.startswith(BARN)]
    if found and len(items) > 1:
        raise ConfigError(f"{found[0]}: BARN's task has rules of its own; expected no other map beside it")
    return found[0] if found else None


def load_all(maps: Sequence[Maps], start: PoseLike | None = None, goal: PoseLike | None = None) -> list[Scenario]:
    """Return the scenarios of some maps, in order, with different names.

    The worlds of ``barn:DIR`` are refined to Nav2's resolution. Files with the task or the people of another map in the
    list, such as those that a shell finds for ``maps/*.yaml``, are no maps.

    Raises:
        ConfigError: If maps that have their own start and goal are given others.
        MapFormatError: If a file is no map.
    """
    if barn := barn_source(maps):
        _refuse_task(barn, start, goal)
        return load_barn(barn)
    return numbered([scenario for item in _without_others_files(maps) for scenario in _scenarios(item, start, goal)])


def _without_others_files(maps: Sequence[Maps]) -> list[Maps]:
    """Leave out the files with the task or the people of another of the maps."""
    beside = {file for item in maps if isinstance(item, str | Path) for file in files_beside(Path(item))}
    return [item for item in maps if not (isinstance(item, str | Path) and Path(item) in beside)]


def numbered(scenarios: Sequence[Scenario]) -> list[Scenario]:
    """Return scenarios with different names, by which tables and tests tell them apart.

    A scenario whose name an earlier one has gets a number: ``office``, ``office_2``.
    """
    taken, found = {one.name for one in scenarios}, dict[str, Scenario]()
    for one in scenarios:
        numbers = (f"{one.name}_{number}" for number in count(2))
        name = one.name if one.name not in found else next(name for name in numbers if name not in taken)
        taken.add(name)
        found[name] = replace(one, name=name)
    return list(found.values())


def each_once(scenarios: Sequence[Scenario]) -> list[Scenario]:
    """Return scenarios without those whose map, task and people equal an earlier one's; a warning names the first."""
    first: dict[str, Scenario] = {}
    again = [one for one in scenarios if first.setdefault(one.digest, one) is not one]
    if again:
        LOG.warning(
            "left out, as the same map and task is given before: %s (%s)%s",
            again[0].name,
            first[again[0].digest].name,
            f" and {len(again) - 1} more" if len(again) > 1 else "",
        )
    return list(first.values())


def listed(maps: Maps | Sequence[Maps] | None) -> list[Scenario]:
    """Return the scenarios of some maps, each once; none for None, one or more otherwise.

    Raises:
        ConfigError: If maps are given, but none of them.
        MapFormatError: If a file is no map.
    """
    return [] if maps is None else each_once(load_all(items_of(maps)))


def items_of(maps: Maps | Sequence[Maps], name: str = "maps") -> list[Maps]:
    """Return one or several maps as a list.

    Args:
        maps: The maps.
        name: Name of the argument, for errors.

    Raises:
        ConfigError: If there is none, or something else is among them.
    """
    items = [maps] if isinstance(maps, MAP_KINDS) or not isinstance(maps, Iterable) else list(maps)
    for item in items:
        if not isinstance(item, MAP_KINDS):
            raise ConfigError(f"{name}: expected files, scenarios, map sets or runs, got {item!r:.80}")
    if not items:
        raise ConfigError(f"{name}: expected at least one map, got none")
    return items


def chosen(scenarios: Sequence[Scenario], name: str | None) -> Scenario:
    """Return the map of a name, or the only map.

    Raises:
        ConfigError: If there is no such map, or there are several and no name is given.
    """
    names = [one.name for one in scenarios]
    if name is None and len(names) > 1:
        got = f"{len(names)} maps: {', '.join(names[:5])}"
        raise ArgumentError("map_name", f"expected the name of one of {got}", "map")
    if name is not None and name not in names:
        raise ArgumentError("map_name", str(unknown_name("map", name, names)), "map")
    return scenarios[0 if name is None else names.index(name)]


def levels_of(curriculum: Maps | Sequence[Maps] | None) -> list[Scenario]:
    """Return the levels of a curriculum: of a run, all maps on which one of its controllers reached the goal.

    Args:
        curriculum: Maps, or a run; None for no levels.

    Raises:
        ConfigError: If there is a curriculum, but no level.
        MapFormatError: If a file is no map.
    """
    items = None if curriculum is None else items_of(curriculum, "curriculum")
    run = None if items is None else run_of(items)
    if run is None:
        return listed(items)
    levels = reached_maps(run)
    if not levels:
        raise ConfigError(f"{run.path}: expected a run with a map on which a controller reached the goal, got none")
    return levels


def run_of(maps: Sequence[Maps]) -> LoadedRun | None:
    """Return the run whose best maps are meant, if the maps are those of a single run; else None.

    Raises:
        RunError: If a single directory holds results of another kind, or is damaged.
    """
    only = maps[0] if len(maps) == 1 else None
    if isinstance(only, LoadedRun):
        return only
    return run_with_maps(only) if isinstance(only, str | Path) else None


def read_parameters(params: str | Path | Nav2Params | None, controllers: object = None) -> Nav2Params | None:
    """Read a parameter file; None for a preset.

    Args:
        params: The file, the name of a preset, or what was read.
        controllers: The controllers that are named; None if the file's own are used, which must then be built here.
    """
    if params is None or isinstance(params, Nav2Params):
        return params
    return None if params in PRESETS else read_nav2_params(params, anyone=controllers is not None)


def own_controllers(read: Nav2Params | None, run: LoadedRun | None) -> Controllers:
    """Return the default controllers: those of the file, else those of the run, else DWB, MPPI and RPP."""
    if read is not None:
        return read.own_controllers
    return DEFAULT_CONTROLLERS if run is None else experiment_in(run).controllers


def check_alone(settings: DriveSettings | None, given: Mapping[str, Any]) -> None:
    """Refuse other options of the world beside one value that holds all of them.

    Raises:
        ConfigError: If there is such a value, and any of the others is not None, or it is something else.
    """
    if settings is not None:
        instance_of(DriveSettings, "settings", settings)
    for name, value in given.items():
        if settings is not None and value is not None:
            raise ConfigError(f"{name}: expected nothing beside settings, which hold it, got {value!r:.80}")


def world_from(
    params: str | Path | Nav2Params | None,
    read: Nav2Params | None,
    environment: Mapping[str, Any],
    run: LoadedRun | None,
) -> DriveSettings:
    """Return the world that some parameters, fields of the env and a run describe together.

    Args:
        params: A preset's name, a file, or the parameters read from a file; None for those of the run.
        read: The result of :func:`read_parameters` for ``params``.
        environment: Fields of :class:`gym_mapbench.env.config.EnvConfig` that replace those of the run and of the file;
            the costmaps then have the shape of a ``robot`` among them.
        run: The run whose maps are used.
    """
    base = world_of(run)
    base = base.replace(environment=base.environment.replace(**environment))
    if read is not None:
        base = with_parameters(base.replace(navigation=read.navigation), read)
        base = base.replace(environment=base.environment.replace(**environment))
    elif params is not None:
        base = base.replace(navigation=params)
    if "robot" in environment:
        base = base.replace(navigation=take_shape_of_robot(base.navigation))
    return base


def world_of(run: LoadedRun | None) -> DriveSettings:
    """Return the world of a run; the world of the thesis if there is no run."""
    if run is None:
        return DriveSettings(navigation="thesis", environment=EnvConfig.build())
    return experiment_in(run).run


def seed_of(seed: int | None, run: LoadedRun | None) -> int:
    """Return the seed of a benchmark: a given one, else 0, or for the maps of a run the seed of its search plus 1."""
    if seed is not None:
        return seed
    return 0 if run is None else int(run.config["search"]["seed"]) + 1


def _scenarios(item: Maps, start: PoseLike | None, goal: PoseLike | None) -> Iterable[Scenario]:
    if isinstance(item, str | Path):
        return load_scenarios(item, start=start, goal=goal)
    _refuse_task("maps that are loaded already", start, goal)
    if isinstance(item, Scenario):
        return [item]
    return item.best if isinstance(item, LoadedRun) else item


def _refuse_task(maps: str, start: PoseLike | None, goal: PoseLike | None) -> None:
    """Refuse another start or goal for maps that have their own."""
    for name, pose in (("start", start), ("goal", goal)):
        if pose is not None:
            raise ConfigError(f"{name}: expected none for {maps}, which have their own, got {pose!r}")


def specs_of(controllers: Controllers) -> tuple[ControllerSpec, ...]:
    """Return the controllers.

    Raises:
        ConfigError: If they are something else.
    """
    if isinstance(controllers, Mapping) or not isinstance(controllers, Iterable):
        raise ConfigError(f"controllers: expected a name or a list of names or mappings, got {controllers!r:.80}")
    entries = [controllers] if isinstance(controllers, str) else list(controllers)
    return controllers_from([one.model_dump() if isinstance(one, ControllerSpec) else one for one in entries])


def tuning_of(
    controller: str,
    train: Maps | Sequence[Maps],
    test: Maps | Sequence[Maps],
    params: str | Path | ParameterFile | None,
    space: str | Path | None,
    settings: DriveSettings | None,
    environment: Mapping[str, Any],
    tuned: TuneSettings,
) -> tuple[TuningPlan, ParameterText]:
    """Return the plan of a tuning, and the parameter file that gets the tuned values.

    Args:
        controller: The controller, by its name or kind.
        train: Maps of the search.
        test: Maps of the comparison.
        params: A preset's name, a file, or a file with the options for reading it; None for the preset ``thesis``.
        space: File of a search space; None for the shipped space, without parameters that have no place in the file.
        settings: World and navigation; None for those of ``params`` and ``environment``.
        environment: Fields of :class:`gym_mapbench.env.config.EnvConfig`.
        tuned: Options of the tuning.

    Raises:
        ConfigError: If any of these cannot be used.
        MapFormatError: If a file is no map.
    """
    named = isinstance(params, str | Path) and params not in PRESETS
    file = ParameterFile(params=str(params)) if named else params
    if isinstance(file, ParameterFile):
        read = partial(read_nav2_params, file.params, release=file.nav2, defines=file.define)
        world = settings or world_from(None, read(only=file.only, anyone=True), environment, None)
        text = text_of_file(file, read(only=file.only or controller), controller)
    else:
        world = settings or world_from(file, None, environment, None)
        text = text_of_settings(world, controller)
    wanted = space_for(world, text.controller, space)
    maps, held_out = (tuple(each_once(load_all(items_of(*one)))) for one in ((train, "train"), (test, "test")))
    check_room([*maps, *held_out], world)
    plan = TuningPlan(text.controller, world, wanted, maps, held_out, tuned)
    if space is None:
        plan = replace(plan, space=writable_space(wanted, text))
    return plan, text
