"""A user's own ``nav2_params.yaml``, with a preset behind it for what it leaves out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from controllers.nav2_params.parsing import Nav2Params, parse_nav2_params
from controllers.nav2_params.presets import load_preset
from gym_mapbench.errors import ConfigError
from gym_mapbench.settings import read_yaml


def read_nav2_params(path: str | Path, preset: str = "thesis", velocity_smoother: bool = True) -> Nav2Params:
    """Read a ``nav2_params.yaml``.

    A parameter that a section does not give has the default of Nav2's code, as in ROS. A section that is
    missing as a whole, and a kind of controller that the file does not configure, is taken from the preset.

    The velocity smoother stands between controller and base in Humble's default launch, so a file that
    configures it turns it on, also for the controllers of the preset; one that does not leaves it off.

    Args:
        path: The file.
        preset: Name of the preset.
        velocity_smoother: False leaves the smoother out although the file configures it.

    Raises:
        ConfigError: In one line: the file cannot be read, parameters are unknown (all of them, with the nearest
            names) or one has a wrong value, or a plugin is not built here.
    """
    document = read_yaml(path)
    behind = load_preset(preset)
    try:
        read = parse_nav2_params(document, behind)
    except ConfigError as error:
        # Keys are free text, and may hold line breaks.
        raise ConfigError(f"{path}: {' '.join(str(error).split())}") from None
    if velocity_smoother:
        return read
    return replace(read, navigation=read.navigation.replace(velocity_smoother=None))
