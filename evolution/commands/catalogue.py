"""The catalogue of names: registries and presets, and the content of settings."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from importlib.resources import files
from itertools import takewhile
from typing import Any, NamedTuple

from controllers.nav2_params import PRESETS, plugins
from controllers.nav2_params.presets import read_preset
from controllers.registry import CONTROLLERS
from evolution.driving import EXECUTORS
from evolution.files import counted
from evolution.report import SECTIONS
from evolution.search import ALGORITHMS, FAILURES, FITNESSES, GENE_OPERATORS, OPERATORS, load_preset, preset_names
from evolution.studies import load_definition, study_names
from evolution.training import algorithm_names, load_algorithm
from evolution.tuning import shipped_document, shipped_space, space_names
from gym_mapbench.costmap import LAYERS
from gym_mapbench.generator import FAMILIES, MOTIFS
from gym_mapbench.mapio.formats import FORMATS
from gym_mapbench.metrics import METRICS
from gym_mapbench.planners import PLANNERS, PlannerEntry
from gym_mapbench.registry import Registry
from gym_mapbench.smoothers import SMOOTHERS, SmootherEntry
from gym_mapbench.world.motions import MOTIONS
from gym_mapbench.world.noise import NOISES
from gym_mapbench.world.robot import ROBOTS

MARKUP = re.compile(r":\w+:`~?(?:[\w.]+\.)?(\w+)`|``([^`]+)``")
"""References, of which the last name is shown, and literals in a docstring."""


class Kind(NamedTuple):
    """Things of one kind.

    Args:
        option: The option that takes such a name.
        names: All names there are.
        about: Returns the description of a name, in a few words.
        content: Returns the content of a name as settings; None where there is nothing but code.
    """

    option: str
    names: Callable[[], tuple[str, ...]]
    about: Callable[[str], str]
    content: Callable[[str], Mapping[str, Any]] | None = None


def _of_registry(
    registry: Registry[Any], option: str, content: Callable[[str], Mapping[str, Any]] | None = None
) -> Kind:
    """Return the kind of a registry; entries of installed packages are named but not imported."""

    def about(name: str) -> str:
        return _first_line(registry[name]) if name in registry.built_in else "added by a package"

    return Kind(option, lambda: (*registry.built_in, *registry.added()), about, content)


def _first_line(entry: Any) -> str:
    """Return the first line of the docstring of an entry, or of its function or class."""
    if isinstance(entry, (PlannerEntry, SmootherEntry)):
        entry = entry.make
    elif not isinstance(entry, type) and not inspect.isroutine(entry):
        entry = next(part for part in (*_fields(entry), type(entry)) if callable(part))
    return MARKUP.sub(lambda found: found[1] or found[2], (inspect.getdoc(entry) or "").partition("\n")[0])


def _fields(entry: Any) -> tuple[Any, ...]:
    """Return the values of an entry that is a dataclass or a named tuple."""
    return tuple(entry) if isinstance(entry, tuple) else tuple(vars(entry).values())


def _settings_in(registry: Registry[Any]) -> Callable[[str], Mapping[str, Any]]:
    return lambda name: dict(registry.get(name).model_dump(mode="json"))


def _controllers() -> Kind:
    """Return the kind of controllers; Nav2's have their titles, and the classes that parameter files name."""
    kind = _of_registry(CONTROLLERS, "--controllers")

    def about(name: str) -> str:
        if (described := plugins.CONTROLLERS.get(name)) is None:
            return kind.about(name)
        return f"{described.title[0].upper()}{described.title[1:]} ({described.names['humble']})"

    return kind._replace(about=about)


def _robot(name: str) -> str:
    robot = ROBOTS.get(name)
    return f"{robot.shape}, {robot.max_linear_velocity:g} m/s, {robot.max_angular_velocity:g} rad/s"


def _noise(name: str) -> str:
    noise = NOISES.get(name)
    late = f"commands late by {100 * noise.latency:g} % of a control period"
    return f"scans {noise.scan:g} m, localisation {noise.pose_xy:g} m, {late}, and more"


def _study(name: str) -> Mapping[str, Any]:
    return dict(load_definition(name).model_dump(mode="json"))


def _space(name: str) -> str:
    return f"{counted(len(shipped_space(name).parameters), 'parameter')} that a tuning changes"


def _heading(package: str, folder: str) -> Callable[[str], str]:
    """Return a function that returns the first sentence of the comment at the head of a YAML file of the package."""

    def about(name: str) -> str:
        lines = files(package).joinpath(folder, f"{name}.yaml").read_text(encoding="utf-8").splitlines()
        text = " ".join(line.lstrip("# ") for line in takewhile(lambda line: line.startswith("#"), lines))
        return re.split(r"(?<=[.?]) ", text.removeprefix(f'Preset "{name}": '), maxsplit=1)[0]

    return about


KINDS: dict[str, Kind] = {
    "controllers": _controllers(),
    "planners": _of_registry(PLANNERS, "--planner"),
    "smoothers": _of_registry(SMOOTHERS, "navigation: {smoothers: ...}"),
    "layers": _of_registry(LAYERS, "costmap plugins:"),
    "robots": _of_registry(ROBOTS, "--robot", _settings_in(ROBOTS))._replace(about=_robot),
    "params": Kind("--params", lambda: PRESETS, _heading("controllers", "presets"), read_preset),
    "spaces": Kind("tune CONTROLLER", space_names, _space, shipped_document),
    "presets": Kind("evolve --preset", preset_names, _heading("evolution.search", "presets"), load_preset),
    "studies": Kind("study", study_names, _heading("evolution.studies", "definitions"), _study),
    "algorithms": Kind("train --algo", algorithm_names, _heading("evolution.training", "algorithms"), load_algorithm),
    "metrics": _of_registry(METRICS, "--metric"),
    "noise": _of_registry(NOISES, "--noise", _settings_in(NOISES))._replace(about=_noise),
    "families": _of_registry(FAMILIES, "--family"),
    "motifs": _of_registry(MOTIFS, "sequences: {motifs: ...}"),
    "motions": _of_registry(MOTIONS, "bodies: motion:"),
    "fitnesses": _of_registry(FITNESSES, "--fitness"),
    "failure_policies": _of_registry(FAILURES, "--failures"),
    "search_algorithms": _of_registry(ALGORITHMS, "ga: {algorithm: ...}"),
    "operators": _of_registry(OPERATORS, "ga: {mutation: {operators: ...}}"),
    "gene_operators": _of_registry(GENE_OPERATORS, "ga: {mutation: {genes: {operators: ...}}}"),
    "formats": _of_registry(FORMATS, "NAME:PATH"),
    "executors": _of_registry(EXECUTORS, "--executor"),
    "sections": _of_registry(SECTIONS, "report --section"),
}
"""All kinds, in the order of ``mapbench list``."""
