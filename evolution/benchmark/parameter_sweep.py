"""Sweeps: configurations that differ in the values of a few parameters, on a grid or at Sobol points."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from controllers.nav2_params.values import unused_critics, values_of, with_values
from evolution.benchmark.configurations import Configuration
from evolution.driving import JobPlan
from gym_mapbench.costmap import COSTMAPS
from gym_mapbench.errors import ConfigError, unknown_name

OWN = "own"
"""Label of the values that are not swept."""
MOST_CONFIGURATIONS = 400


@dataclass(frozen=True)
class SweptParameter:
    """A parameter with the values of its sweep.

    Args:
        name: As the user wrote it: ``CONTROLLER.PARAMETER``, or ``local_costmap.…`` or ``global_costmap.…``.
        values: The values; for Sobol points the lowest and the highest.
    """

    name: str
    values: tuple[float, ...]


def read_sweep(text: str) -> SweptParameter:
    """Read ``NAME=VALUE,VALUE,...``.

    Raises:
        ConfigError: If it is something else.
    """
    name, sign, rest = text.partition("=")
    try:
        values = tuple(float(part) for part in rest.split(","))
    except ValueError:
        values = ()
    if not (sign and "." in name and values and all(map(math.isfinite, values))):
        raise ConfigError(f"--sweep: expected CONTROLLER.PARAMETER=VALUE,VALUE,..., got {text!r}")
    return SweptParameter(name.strip(), tuple(dict.fromkeys(values)))


def swept_controllers(swept: Sequence[SweptParameter]) -> list[str]:
    """Return the controllers whose parameters are swept; empty if only those of costmaps are."""
    owners = dict.fromkeys(one.name.partition(".")[0] for one in swept)
    return [name for name in owners if name not in COSTMAPS]


def sweep(plan: JobPlan, swept: Sequence[SweptParameter], samples: int | None = None) -> list[Configuration]:
    """Return the user's own values, then a configuration for each point.

    Args:
        plan: Controllers, world, seed and repeats with the user's own values.
        swept: The parameters.
        samples: Number of Sobol points between the lowest and the highest values, sampled with the plan's seed; the
            whole grid if None.

    Raises:
        ConfigError: If a parameter or a value is refused, a parameter is given twice, controllers share parameters, a
            range is empty, or there are too many points.
    """
    _check_twice(swept)
    own = {one.name: _own_value(plan, one.name) for one in swept}
    _check_shared(plan, swept)
    points = _grid(swept) if samples is None else _sobol(swept, samples, plan.root_seed, own)
    if len(points) > MOST_CONFIGURATIONS:
        raise ConfigError(f"--sweep: expected at most {MOST_CONFIGURATIONS} points, got {len(points)}; --sweep-samples")
    others = [point for point in dict.fromkeys(points) if dict(zip(own, point, strict=True)) != own]
    names = list(own)
    return [Configuration(OWN, plan, own), *(_configuration(plan, names, point) for point in others)]


def _check_twice(swept: Sequence[SweptParameter]) -> None:
    """Refuse a parameter that is swept twice."""
    names = [one.name for one in swept]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ConfigError(f"--sweep: expected all values of {twice} in one option, {twice}=A,B,.., got two")


def _check_shared(plan: JobPlan, swept: Sequence[SweptParameter]) -> None:
    """Refuse to sweep a controller whose parameters another one has, too, as the sweep would change both."""
    sections = {one.name: _section(plan, one.registered_name) for one in plan.controllers}
    for name in swept_controllers(swept):
        same = [other for other, section in sections.items() if section == sections[name]]
        if len(same) > 1:
            raise ConfigError(f"--sweep: expected one controller with the parameters of {name}, got {', '.join(same)}")


def _section(plan: JobPlan, name: str) -> str:
    """Return the name of the parameters that a controller, given by its name or kind, drives with."""
    plugins = plan.settings.navigation.controllers
    return name if name in plugins else next((key for key, one in plugins.items() if one.kind == name), name)


def _grid(swept: Sequence[SweptParameter]) -> list[tuple[float, ...]]:
    return list(itertools.product(*(one.values for one in swept)))


def _sobol(
    swept: Sequence[SweptParameter], samples: int, seed: int, own: Mapping[str, float]
) -> list[tuple[float, ...]]:
    """Return scrambled Sobol points; parameters that are whole numbers get whole numbers."""
    from scipy.stats import qmc

    lows, highs = ([end(one.values) for one in swept] for end in (min, max))
    empty = [one.name for one, low, high in zip(swept, lows, highs, strict=True) if low == high]
    if empty:
        raise ConfigError(f"--sweep-samples: expected the lowest and the highest value of {empty[0]}, got one value")
    sampler = qmc.Sobol(len(swept), rng=seed)
    points = qmc.scale(sampler.random_base2(math.ceil(math.log2(samples)))[:samples], lows, highs)
    whole = [isinstance(value, int) for value in own.values()]
    return [tuple(float(round(x) if one else f"{x:.4g}") for x, one in zip(row, whole, strict=True)) for row in points]


def _own_value(plan: JobPlan, name: str) -> float:
    """Return the user's value of a parameter.

    Raises:
        ConfigError: If there is no such parameter, or it has no effect, or is no number.
    """
    controller, key = _split(plan, name)
    known = values_of(plan.settings.navigation, controller)
    if key not in known:
        raise ConfigError(f"--sweep: {unknown_name('parameter', key, known)}")
    critic = key.partition(".")[0]
    if critic in unused_critics(plan.settings.navigation, controller):
        raise ConfigError(f"--sweep: {name}: expected a critic that the controller lists, got {critic}")
    value = known[key]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfigError(f"--sweep: expected a parameter that is a number, got {name} = {value!r}")
    return value


def _split(plan: JobPlan, name: str) -> tuple[str, str]:
    """Return the controller of a parameter and the parameter's name."""
    owner, _, key = name.partition(".")
    if owner in COSTMAPS:
        return plan.controllers[0].registered_name, name
    spec = next((one for one in plan.controllers if one.name == owner), None)
    if spec is None:
        raise ConfigError(f"--sweep: {unknown_name('controller', owner, (*plan.names, *COSTMAPS))}")
    return spec.registered_name, key


def _configuration(plan: JobPlan, names: Sequence[str], point: Sequence[float]) -> Configuration:
    navigation = plan.settings.navigation
    for name, value in zip(names, point, strict=True):
        controller, key = _split(plan, name)
        whole = isinstance(_own_value(plan, name), int) and value.is_integer()
        navigation = with_values(navigation, controller, {key: int(value) if whole else value})
    values = dict(zip(names, point, strict=True))
    label = ",".join(f"{name.rpartition('.')[2]}={_text(value)}" for name, value in values.items())
    return Configuration(label, replace(plan, settings=plan.settings.replace(navigation=navigation)), values)


def _text(value: float) -> str:
    """Write a value with six digits, or with all if these are not the value."""
    short = f"{value:g}"
    return short if float(short) == value else repr(value)
