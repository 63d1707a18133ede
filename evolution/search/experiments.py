"""Experiments from files: the presets of the package, the YAML of a user, and recorded runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from evolution.driving import ControllerSpec, check_room, try_controllers
from evolution.files import warn_of_versions
from evolution.search.experiment import Experiment
from evolution.search.operators import scenario_on
from evolution.search.option_names import nested_document
from gym_mapbench.errors import ConfigError, refuse_unknown, unknown_name
from gym_mapbench.files.bundled import bundled_names, read_bundled
from gym_mapbench.files.documents import read_yaml
from gym_mapbench.generator import ShapeSettings, clear_and_border, draw_from
from gym_mapbench.ros_params import overlay
from gym_mapbench.trust import refuse_code
from gym_mapbench.world.scenario import Scenario

SECTIONS = ("search", "controllers", "run")
RECORDED = ("format", "format_version", "version", "libraries", "code")
"""Keys that the ``config.json`` of a run has besides the sections."""
DEFAULT_PRESET = "robust"
"""The default preset."""

DEFAULT_CONTROLLERS = ("dwb", "mppi", "rpp")


def preset_names() -> tuple[str, ...]:
    """Names of the presets that come with the package."""
    return bundled_names("evolution.search", "presets")


def load_preset(name: str) -> dict[str, Any]:
    """Return the document of a preset, laid over the preset that it names as its ``base``.

    Raises:
        ConfigError: If there is no such preset.
    """
    refuse_unknown("preset", name, preset_names())
    document = read_bundled("evolution.search", "presets", f"{name}.yaml")
    base = document.pop("base", None)
    return dict(document) if base is None else overlay(load_preset(base), document)


def read_document(path: str | Path) -> dict[str, Any]:
    """Return an experiment read from YAML: sections ``search``, ``controllers``, ``run``, each of them optional.

    The ``config.json`` of a run is such a file, too, and keeps its further keys (:data:`RECORDED`). A warning names
    versions of the run that differ from those in use, as the same options may then give other results.

    Raises:
        ConfigError: If the file or a section cannot be used, or it names code.
        RunError: If it is a damaged ``config.json``.
    """
    document = read_yaml(path)
    if not isinstance(document, Mapping):
        raise ConfigError(f"{path}: expected the sections {', '.join(SECTIONS)}, got {type(document).__name__}")
    if "format" in document:
        warn_of_versions(document, path)
    refuse_code(document, path)
    check_sections(document, str(path))
    return nested_document(document, str(path))


def check_sections(document: Mapping[str, Any], where: str) -> None:
    """Refuse unknown sections of an experiment, and options that are no mapping.

    Raises:
        ConfigError: Naming the section.
    """
    known = (*SECTIONS, *RECORDED) if "format" in document else SECTIONS
    for name in document:
        if name not in known:
            raise ConfigError(f"{where}: {unknown_name('section', str(name), SECTIONS)}")
    for name in ("search", "run"):
        _section(document, name, where)


def experiment_of(document: Mapping[str, Any], where: str = "experiment") -> Experiment:
    """Build an experiment from a document, as in a file or as :meth:`Experiment.document` returns it.

    Args:
        document: Sections ``search``, ``controllers`` and ``run``, each of them optional.
        where: Beginning of every error message.

    Raises:
        ConfigError: Naming the section and key that cannot be used.
    """
    controllers = [spec.model_dump() for spec in controllers_from(document.get("controllers", DEFAULT_CONTROLLERS))]
    whole = {
        "search": document.get("search", {}),
        "controllers": controllers,
        "run": {"navigation": "thesis", **_section(document, "run", where)},
    }
    return Experiment.from_document(whole, where)


def _section(document: Mapping[str, Any], name: str, where: str) -> Mapping[str, Any]:
    section = document.get(name, {})
    if not isinstance(section, Mapping):
        kind = "nothing" if section is None else type(section).__name__
        raise ConfigError(f"{where}: {name}: expected a mapping of options, got {kind}")
    return section


def controllers_from(entries: object) -> tuple[ControllerSpec, ...]:
    """Read a list of controllers: names, ``name=kind``, or mappings with ``name``, ``kind``, ``params``."""
    if not isinstance(entries, list | tuple):
        raise ConfigError(f"controllers: expected a list of names or mappings, got {type(entries).__name__}")
    return tuple(_controller(entry) for entry in entries)


def _controller(entry: object) -> ControllerSpec:
    if isinstance(entry, str):
        name, assigned, kind = (part.strip() for part in entry.partition("="))
        if not name or (assigned and not kind):
            raise ConfigError(f"controllers: expected NAME or NAME=KIND, got {entry!r}")
        return ControllerSpec(name=name, kind=kind)
    if not isinstance(entry, Mapping):
        raise ConfigError(f"controllers: expected names, module:attribute or mappings of options, got {entry!r:.80}")
    return ControllerSpec.from_mapping(entry, "controllers")


def check_experiment(experiment: Experiment) -> None:
    """Refuse an experiment that could only fail, before the first run.

    Raises:
        ConfigError: If there are fewer than two controllers, one cannot drive in this world, the robot does not
            fit on a map without obstacles, or a family has no map for it.
    """
    check_several(experiment)
    try_controllers(experiment.controllers, experiment.run)
    check_room([_emptiest(experiment.search.shapes)], experiment.run)
    for family in experiment.search.families:
        draw_from(np.random.default_rng(0), [family], experiment.search.shapes, experiment.run.robot)


def check_several(experiment: Experiment) -> None:
    """Refuse a single controller.

    Raises:
        ConfigError: Naming it.
    """
    names = experiment.plan.names
    if len(names) < 2:
        raise ConfigError(f"controllers: expected two or more to compare, got {names[0]} alone")


def _emptiest(shapes: ShapeSettings) -> Scenario:
    """Return the generated map without obstacles: if a robot does not fit there, it fits on no map."""
    cells = clear_and_border(np.zeros((shapes.size, shapes.size), dtype=np.bool_), shapes)
    return replace(scenario_on(cells, shapes), name="generated maps")
