"""Reads a user's own ``nav2_params.yaml``, with a preset for missing sections."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from controllers.nav2_params.file.document import Document, read_document
from controllers.nav2_params.file.nodes import all_nodes
from controllers.nav2_params.file.recognition import recognise
from controllers.nav2_params.file.wildcards import share
from controllers.nav2_params.parsing import Nav2Params, parse_nav2_params
from controllers.nav2_params.presets import PRESETS, load_preset
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import Release


def read_nav2_params(
    path: str | Path,
    preset: str | None = None,
    velocity_smoother: bool = True,
    *,
    release: Release | None = None,
    defines: Mapping[str, str] | None = None,
    only: str | None = None,
    anyone: bool = False,
    collision_monitor: bool = True,
    folder: str | Path | None = None,
) -> Nav2Params:
    """Read a ``nav2_params.yaml``.

    A parameter that a section does not give has the default of Nav2's code, as in ROS. A section that is missing as a
    whole, and a kind of controller that the file does not configure, are taken from the preset.

    The velocity smoother stands between controller and base in Nav2's default launch. So a file that configures it
    turns it on, also for the controllers of the preset; a file that does not configure it leaves it off. The same holds
    for the collision monitor behind it.

    Args:
        path: The file.
        preset: Name of the preset; None for the one of the file's release.
        velocity_smoother: False leaves the smoother out although the file configures it.
        release: The distribution; None to recognise it by the file's keys.
        defines: Values of the file's templates, as ``{"min_x": "-0.2"}``.
        only: The controller that is to drive, by its name or kind, for a file whose own is not built here.
        anyone: Whether to accept a file whose own controller is not built here.
        collision_monitor: False leaves the collision monitor out although the file configures it.
        folder: To which the names of other files in it are relative: a behaviour tree, masks; None for its own.

    Raises:
        ConfigError: If the file cannot be read, a value is wrong, a template has no value, the file's own controller
            is not built here, or it mixes the distributions. The message is one line and gives the line of the file.
    """
    document = Document(None)
    try:
        document = read_document(path, defines)
        if folder is not None:
            document = replace(document, folder=Path(folder))
        nodes = all_nodes(document.values)
        document = document.with_origins(share(nodes).origins)
        known = release or recognise(nodes).release
        read = parse_nav2_params(document, load_preset(preset or preset_of(known)), release)
        if not anyone or only is not None:
            read = _choose(read, only)
    except ConfigError as error:
        raise ConfigError(_in_one_line(path, document, error)) from None
    wanted = {"velocity_smoother": velocity_smoother, "collision_monitor": collision_monitor}
    left = {name: None for name, is_wanted in wanted.items() if not is_wanted}
    return replace(read, navigation=read.navigation.replace(**left)) if left else read


def preset_of(release: Release) -> str:
    """Return the name of the preset for files of a release: the release's own if there is one, else the first."""
    return release if release in PRESETS else PRESETS[0]


def _choose(read: Nav2Params, only: str | None) -> Nav2Params:
    """Keep the controller that is to drive alone, or refuse a file whose own is not built here.

    Raises:
        ConfigError: If ``only`` is unknown, or is None and the tree asks for a controller that is not built here.
    """
    if only is None:
        if read.asked_for in read.foreign:
            choices = "|".join(read.navigation.controllers)
            raise ConfigError(f"{read.foreign[read.asked_for]}; --only {choices} drives one that is")
        return read
    if only in read.foreign:
        raise ConfigError(read.foreign[only])
    chosen = read.navigation.controller(only)
    kept = {name: plugin for name, plugin in read.navigation.controllers.items() if plugin is chosen}
    left = {f"controllers.{name}" for name in read.navigation.controllers if name not in kept}
    defaulted = tuple(name for name in read.defaulted if name not in left)
    return replace(read, navigation=read.navigation.replace(controllers=kept), defaulted=defaulted)


def _in_one_line(path: str | Path, document: Document, error: ConfigError) -> str:
    """Join the file, the line and the reason in one line; keys are free text and may hold line breaks."""
    reason = " ".join(document.located(str(error)).split())
    return reason if reason.startswith(str(path)) else f"{path}: {reason}"
