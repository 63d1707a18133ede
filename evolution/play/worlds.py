"""Worlds: a preset or the parameter file of the command line, and the robot and noise of the page laid over it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache, cached_property, lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import yaml

from controllers.nav2_params import PRESETS, Nav2Params, load_preset, read_nav2_params, write_nav2_params
from evolution.driving import (
    ControllerSpec,
    DriveSettings,
    ParameterFile,
    chosen_robot,
    take_shape_of_robot,
    with_parameters,
    with_robot,
)
from evolution.files import temporary_directory, write_text
from evolution.play.messages.requests import WorldSettings
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError, MapBenchError, refuse_unknown, unknown_name
from gym_mapbench.files.documents import read_document_text
from gym_mapbench.releases import Release
from gym_mapbench.world.noise import NOISES
from gym_mapbench.world.robot import ROBOTS

FILE = "file"
"""Name of the parameter file of the command line among the presets."""


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
    def reading(self) -> Reading | None:
        """How the parameter file is read, whichever of its controllers are not built here; None without a file."""
        if (file := self.file) is None:
            return None
        read = read_nav2_params(file.params, release=file.nav2, defines=file.define, only=file.only, anyone=True)
        folder = str(Path(file.params).parent)
        return Reading(read.navigation.release, tuple(file.define.items()), file.only, folder)

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
class PageWorld:
    """The world that the page shows, with what the command line gives.

    Args:
        shown: The world of the page.
        given: What the command line gives.

    Raises:
        ConfigError: If there is no such preset.
    """

    shown: WorldSettings
    given: Given

    def __post_init__(self) -> None:
        refuse_unknown("preset", self.shown.preset, self.given.presets)

    @property
    def file(self) -> ParameterFile | None:
        """The parameter file of the command line, if the page shows it; None for a preset."""
        return self.given.file if self.shown.preset == FILE else None

    @property
    def source(self) -> str:
        """The file or the preset, as ``--params`` names it."""
        return self.shown.preset if self.file is None else Path(self.file.params).name

    @property
    def text(self) -> str:
        """The text of the file or of the preset, which changes are written into."""
        return _text_of_preset(self.shown.preset) if self.file is None else read_document_text(self.file.params)

    @property
    def file_text(self) -> str | None:
        """The text of the file; None for a preset."""
        return None if self.file is None else self.text

    @property
    def reading(self) -> Reading:
        """How the text is read."""
        of_file = None if self.file is None else self.given.reading
        return of_file or Reading(load_preset(self.shown.preset).release)

    @property
    def own_settings(self) -> DriveSettings:
        """World and navigation with the preset or the file as it is."""
        return self.settings(self.file_text)

    def read(self, text: str) -> Nav2Params:
        """Read the text, or the text with changes."""
        return _read(text, self.reading)

    def settings(self, text: str | None) -> DriveSettings:
        """Return world and navigation as ``mapbench bench`` makes them of the same options.

        Args:
            text: The text of the parameter file; None for a preset.

        Raises:
            ConfigError: If there is no such robot or noise level.
        """
        settings = DriveSettings(navigation="thesis", environment=self.given.environment)
        if text is None:
            settings = settings.replace(navigation=self.shown.preset)
        else:
            settings = with_parameters(settings, self.read(text))
        refuse_unknown("noise level", self.shown.noise, NOISES.names())
        settings = settings.replace(environment=settings.environment.replace(noise=self.shown.noise))
        name, radius = self.robot_name(text), self.shown.robot_radius
        if name is None and radius is None:
            return settings
        if radius is None:
            refuse_unknown("robot", name, ROBOTS.names())
        robot = chosen_robot(settings.robot, name, radius, "robot and robot_radius")
        return settings.replace(
            environment=with_robot(settings.environment, robot),
            navigation=take_shape_of_robot(settings.navigation, radius),
        )

    def robot_name(self, text: str | None) -> str | None:
        """Return the name of the robot that replaces the one of the parameters; None if none does.

        A changed preset keeps the robot of the preset, which a file does not name.
        """
        if not self.shown.robot and self.shown.robot_radius is None and text is not None and self.file is None:
            return EnvConfig().robot.name
        return self.shown.robot or None


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
