"""Plans: from what the page shows to runs, parameter files and the command that repeats them.

A variant with changed parameters takes them from the text of a parameter file, which is the file that "save" gives, so
that ``mapbench bench`` with this file drives in the same world.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from controllers.nav2_params import NavigationParams
from controllers.nav2_params.plugins import CONTROLLERS
from controllers.nav2_params.values import values_of, write_values
from controllers.registry import FOLLOWERS
from evolution.driving import ControllerSpec, JobPlan, try_controllers
from evolution.play.messages.requests import AskParameters, Session, Variant
from evolution.play.worlds import Given, PageWorld
from gym_mapbench.costmap import COSTMAPS
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError, MapBenchError, refuse_unknown, unknown_name


@dataclass(frozen=True)
class PlannedVariant:
    """A variant, ready to run.

    Args:
        variant: As the page gave it.
        world: The world of all variants.
        plan: Its runs.
        source: The file or the preset that ``--params`` names.
        text: The text of that file; None for a preset.
    """

    variant: Variant
    world: PageWorld
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
    world = PageWorld(session.settings, given)
    return [_plan(variant, world) for variant in session.variants]


def command_lines(variants: Sequence[PlannedVariant], scene: str) -> list[str]:
    """Return the commands that repeat the runs of some variants on a map; variants of the same file share a command."""
    groups = {source: [one for one in variants if one.source == source] for source in (one.source for one in variants)}
    return [shlex.join(_arguments(group, scene)) for group in groups.values()]


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
            return PageWorld(asked.settings, given).text if one.text is None else one.text
    raise unknown_name("variant", asked.variant, [one.name for one in asked.variants])


def _plan(variant: Variant, world: PageWorld) -> PlannedVariant:
    spec, source = world.given.controller(variant.controller), world.source
    try:
        text = world.file_text
        if _differs(variant, world):
            text, source = _changed_text(spec, variant, world), f"{variant.name.replace(' ', '_')}.yaml"
        plan = JobPlan((spec,), world.settings(text), world.shown.seed, world.shown.repeats)
        try_controllers(plan.controllers, plan.settings)
    except MapBenchError as error:
        raise ConfigError(f"{variant.name}: {error}") from None
    return PlannedVariant(variant, world, plan, source, text)


def _differs(variant: Variant, world: PageWorld) -> bool:
    """Whether a variant needs a file of its own.

    With another radius, all variants of a preset do: the robot then has the limits of the file in all of them.
    """
    shown = world.shown
    return bool(variant.parameters or shown.shared or (world.file is None and shown.robot_radius is not None))


def _changed_text(spec: ControllerSpec, variant: Variant, world: PageWorld) -> str:
    """Return the parameter file of a variant: everything but the changed values stays, comments included."""
    values = {**world.shown.shared, **variant.parameters}
    own = world.text
    known = known_values(world.read(own).navigation, spec)
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


def _arguments(group: Sequence[PlannedVariant], scene: str) -> Iterator[str]:
    """Yield the words of the command that repeats the runs of variants of one file on a map."""
    first = group[0]
    world, shown, time_limit = first.world, first.world.shown, first.world.given.environment.time_limit
    controllers = dict.fromkeys(_as_argument(spec) for one in group for spec in one.plan.controllers)
    yield from ("mapbench", "bench", f"{scene}.yaml", "--controllers", ",".join(controllers))
    yield from ("--params", first.source)
    if first.text is not None:
        release, defines, only, _ = world.reading
        yield from ("--nav2", release)
        yield from (word for name, value in defines for word in ("--define", f"{name}={value}"))
        yield from ("--only", only) if only else ()
    if shown.robot_radius is not None:
        yield from ("--robot-radius", repr(shown.robot_radius))
    elif name := world.robot_name(first.text):
        yield from ("--robot", name)
    yield from ("--noise", shown.noise, "--seed", str(shown.seed), "--repeats", str(shown.repeats))
    if time_limit != EnvConfig().time_limit:
        yield from ("--time-limit", repr(time_limit))


def _as_argument(spec: ControllerSpec) -> str:
    return spec.name if spec.registered_name == spec.name else f"{spec.name}={spec.registered_name}"
