"""Plans: from what the page shows to runs, parameter files and the command that repeats them.

A variant with changed parameters takes them from the text of a parameter file, which is the file that "save" gives, so
that ``mapbench bench`` with this file drives in the same world.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property, lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import yaml

from controllers.nav2_params import (
    PRESETS,
    Nav2Params,
    NavigationParams,
    load_preset,
    read_nav2_params,
    write_nav2_params,
)
from controllers.nav2_params.plugins import CONTROLLERS
from controllers.nav2_params.values import values_of, write_values
from controllers.registry import FOLLOWERS
from evolution.driving import (
    ControllerSpec,
    DriveSettings,
    JobPlan,
    ParameterFile,
    take_shape_of_robot,
    try_controllers,
    with_parameters,
    with_robot,
)
from evolution.files import temporary_directory, write_text
from evolution.play.messages.requests import AskParameters, Session, Variant, WorldSettings
from gym_mapbench.costmap import COSTMAPS
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError, MapBenchError, refuse_unknown, unknown_name
from gym_mapbench.files.documents import read_document_text
from gym_mapbench.releases import Release
from gym_mapbench.world.noise import NOISES
from gym_mapbench.world.robot import ROBOTS, RobotSpec, make_robot

FILE = "file"
"""Name of the parameter file of the command line among the presets."""


@dataclass(frozen=True)
class Given:
    """What the command line gives: the page can choose among it.

    Args:
        controllers: All controllers that the page may name; trained policies are only here.
        file: The parameter file; None if there is none.
        environment: Fields of the env that the page does not change, such as the time limit.
    """

    controllers: tuple[ControllerSpec, ...]
    file: ParameterFile | None = None
    environment: EnvConfig = field(default_factory=EnvConfig)

    @property
    def presets(self) -> tuple[str, ...]:
        """Names of the sets of parameters, the file first."""
        return ((FILE,) if self.file else ()) + PRESETS

    @cached_property
    def release(self) -> Release | None:
        """Release of the parameter file, whichever of its controllers are not built here; None without a file."""
        if (file := self.file) is None:
            return None
        return read_nav2_params(
            file.params, release=file.nav2, defines=file.define, only=file.only, anyone=True
        ).navigation.release

    def controller(self, name: str) -> ControllerSpec:
        """Return a controller by its name.

        Raises:
            ConfigError: If the command line does not give it.
        """
        for spec in self.controllers:
            if spec.name == name:
                return spec
        raise unknown_name("controller", name, [spec.name for spec in self.controllers])


@dataclass(frozen=True)
class PlannedVariant:
    """A variant, ready to run.

    Args:
        variant: As the page gave it.
        plan: Its runs.
        source: The file or the preset that ``--params`` names.
        text: The text of that file; None for a preset.
    """

    variant: Variant
    plan: JobPlan
    source: str
    text: str | None


def planned(session: Session, given: Given) -> list[PlannedVariant]:
    """Return the variants of a session, ready to run.

    Raises:
        ConfigError: If a name, a parameter or a value is wrong, or two variants have the same name.
    """
    names = [variant.name for variant in session.variants]
    if len(set(names)) < len(names):
        raise ConfigError(f"variants: expected different names, got {', '.join(names)}")
    return [_plan(variant, session.settings, given) for variant in session.variants]


def settings_of(world: WorldSettings, given: Given, text: str | None = None) -> DriveSettings:
    """Return world and navigation as ``mapbench bench`` makes them of the same options.

    Args:
        world: The world of the page.
        given: What the command line gives.
        text: The text of the parameter file; None for a preset.

    Raises:
        ConfigError: If there is no such preset, robot or noise level.
    """
    settings = DriveSettings(navigation="thesis", environment=given.environment)
    if text is None:
        settings = settings.replace(navigation=_checked_preset(world.preset, given))
    else:
        settings = with_parameters(settings, _read(text, _reading(world, given)))
    refuse_unknown("noise level", world.noise, NOISES.names())
    settings = settings.replace(environment=settings.environment.replace(noise=world.noise))
    robot = _robot(world, settings.robot, text)
    return settings if robot is None else _with_robot(settings, robot, world.robot_radius)


def own_settings(world: WorldSettings, given: Given) -> DriveSettings:
    """Return world and navigation with a preset, or the file, as it is."""
    return settings_of(world, given, base_text(world, given) if world.preset == FILE else None)


def base_text(world: WorldSettings, given: Given) -> str:
    """Return the text of the parameter file that changes are written into."""
    name = _checked_preset(world.preset, given)
    if name == FILE and given.file is not None:
        return read_document_text(given.file.params)
    return _text_of_preset(name)


def command_lines(variants: Sequence[PlannedVariant], session: Session, given: Given) -> list[str]:
    """Return the commands that repeat the runs of some variants; variants of the same file share a command."""
    groups = {source: [one for one in variants if one.source == source] for source in (one.source for one in variants)}
    return [shlex.join(_arguments(group, session, given)) for group in groups.values()]


def parameter_files(variants: Sequence[PlannedVariant]) -> dict[str, str]:
    """Return the texts of the parameter files that the commands read, by name."""
    return {one.source: one.text for one in variants if one.text is not None}


def changed_file(asked: AskParameters, given: Given) -> str:
    """Return the parameter file of one variant of a session; without changes, that of the preset or of the user.

    Raises:
        ConfigError: If there is no such variant, or a value cannot be used.
    """
    for one in planned(asked, given):
        if one.variant.name == asked.variant:
            return base_text(asked.settings, given) if one.text is None else one.text
    raise unknown_name("variant", asked.variant, [one.name for one in asked.variants])


def _plan(variant: Variant, world: WorldSettings, given: Given) -> PlannedVariant:
    spec, text, source = given.controller(variant.controller), None, _checked_preset(world.preset, given)
    try:
        if _differs(variant, world):
            text, source = _changed_text(spec, variant, world, given), f"{variant.name.replace(' ', '_')}.yaml"
        elif source == FILE and given.file is not None:
            text, source = base_text(world, given), Path(given.file.params).name
        plan = JobPlan((spec,), settings_of(world, given, text), world.seed, world.repeats)
        try_controllers(plan.controllers, plan.settings)
    except MapBenchError as error:
        raise ConfigError(f"{variant.name}: {error}") from None
    return PlannedVariant(variant, plan, source, text)


def _differs(variant: Variant, world: WorldSettings) -> bool:
    """Whether a variant needs a file of its own.

    With another radius, all variants of a preset do: the robot then has the limits of the file in all of them.
    """
    return bool(variant.parameters or world.shared or (world.preset != FILE and world.robot_radius is not None))


def _changed_text(spec: ControllerSpec, variant: Variant, world: WorldSettings, given: Given) -> str:
    """Return the parameter file of a variant: everything but the changed values stays, comments included."""
    values = {**world.shared, **variant.parameters}
    own = base_text(world, given)
    known = known_values(_read(own, _reading(world, given)).navigation, spec)
    for key, value in values.items():
        refuse_unknown("parameter", key, known)
        if isinstance(known[key], list):
            if not isinstance(value, list):
                raise ConfigError(f"{key}: expected a list, got {value!r:.80}")
        elif not isinstance(value, str | bool | int | float):
            raise ConfigError(f"{key}: expected a number, a text, true or false, got {value!r:.80}")
    return _written(own, spec.registered_name, json.dumps(values), json.dumps({key: known[key] for key in values}))


def known_values(navigation: NavigationParams, spec: ControllerSpec) -> dict[str, Any]:
    """Return the values of one of Nav2's controllers and of the costmaps by name; of the costmaps only for others."""
    of_nav2 = spec.registered_name in FOLLOWERS or spec.registered_name in navigation.controllers
    found = values_of(navigation, spec.registered_name if of_nav2 else next(iter(navigation.controllers)))
    ours = CONTROLLERS[navigation.controller(spec.registered_name).kind].our_keys if of_nav2 else frozenset()
    written = {key: value for key, value in found.items() if key not in ours and not key.endswith(".release")}
    return {key: value for key, value in written.items() if of_nav2 or key.startswith(COSTMAPS)}


@lru_cache(maxsize=64)
def _written(text: str, controller: str, values: str, known: str) -> str:
    """Return a parameter file with values replaced; these, and the present ones, are given as JSON."""
    return write_values(text, controller, json.loads(values), json.loads(known))


def _checked_preset(name: str, given: Given) -> str:
    refuse_unknown("preset", name, given.presets)
    return name


class Reading(NamedTuple):
    """How the text of a parameter file is read.

    Args:
        release: Its release.
        defines: The values of its placeholders.
        only: Its controller.
        folder: To which the names of other files in it are relative.
    """

    release: Release
    defines: tuple[tuple[str, str], ...] = ()
    only: str | None = None
    folder: str | None = None


def _reading(world: WorldSettings, given: Given) -> Reading:
    """Return how the text of the parameter file or of a preset is read."""
    if world.preset != FILE or given.file is None or given.release is None:
        return Reading(load_preset(world.preset).release)
    file = given.file
    return Reading(given.release, tuple(file.define.items()), file.only, str(Path(file.params).parent))


@lru_cache(maxsize=64)
def _read(text: str, how: Reading) -> Nav2Params:
    """Read the text of a parameter file."""
    release, defines, only, beside = how
    with TemporaryDirectory(dir=temporary_directory()) as folder:
        path = Path(folder) / "nav2_params.yaml"
        write_text(path, text)
        try:
            return read_nav2_params(path, release=release, defines=dict(defines), only=only, anyone=True, folder=beside)
        except MapBenchError as error:
            raise ConfigError(str(error).replace(f"{path}: ", "")) from None


@cache
def _text_of_preset(name: str) -> str:
    text: str = yaml.safe_dump(write_nav2_params(load_preset(name)), sort_keys=False)
    return text


def _robot(world: WorldSettings, robot: RobotSpec, text: str | None) -> RobotSpec | None:
    """Return the robot that replaces the one of the parameters; None if none does.

    A changed preset keeps the robot of the preset, which a file does not name.
    """
    if world.robot and world.robot_radius is not None:
        raise ConfigError("robot and robot_radius: expected one of them, got both")
    if world.robot_radius is not None:
        return robot.replace(name="custom", radius=world.robot_radius, footprint=None)
    name = world.robot or (EnvConfig().robot.name if text is not None and world.preset != FILE else "")
    if name and name not in ROBOTS.names():
        raise unknown_name("robot", name, ROBOTS.names())
    return make_robot(name) if name else None


def _with_robot(settings: DriveSettings, robot: RobotSpec, radius: float | None) -> DriveSettings:
    """Put a robot into the world, and its shape into the costmaps."""
    return settings.replace(
        environment=with_robot(settings.environment, robot),
        navigation=take_shape_of_robot(settings.navigation, radius),
    )


def _arguments(group: Sequence[PlannedVariant], session: Session, given: Given) -> Iterator[str]:
    """Yield the words of the command that repeats the runs of variants of one file."""
    world, first = session.settings, group[0]
    controllers = dict.fromkeys(_as_argument(given.controller(one.variant.controller)) for one in group)
    yield from ("mapbench", "bench", f"{session.scene.name}.yaml", "--controllers", ",".join(controllers))
    yield from ("--params", first.source)
    if first.text is not None:
        release, defines, only, _ = _reading(world, given)
        yield from ("--nav2", release)
        yield from (word for name, value in defines for word in ("--define", f"{name}={value}"))
        yield from ("--only", only) if only else ()
    if world.robot_radius is not None:
        yield from ("--robot-radius", repr(world.robot_radius))
    elif world.robot or (first.text is not None and world.preset != FILE):
        yield from ("--robot", world.robot or first.plan.settings.robot.name)
    yield from ("--noise", world.noise, "--seed", str(world.seed), "--repeats", str(world.repeats))
    if given.environment.time_limit != EnvConfig().time_limit:
        yield from ("--time-limit", repr(given.environment.time_limit))


def _as_argument(spec: ControllerSpec) -> str:
    return spec.name if spec.registered_name == spec.name else f"{spec.name}={spec.registered_name}"
