"""Presets: named parameter files of this project, in the format of ``nav2_params.yaml``."""

from __future__ import annotations

import functools
from typing import Any

from controllers.nav2_params.navigation import NavigationParams
from controllers.nav2_params.parsing import parse_nav2_params
from gym_mapbench.errors import refuse_unknown
from gym_mapbench.files.bundled import read_bundled
from gym_mapbench.releases import RELEASES, Release
from gym_mapbench.ros_params import overlay

PRESETS = ("thesis", "fair", "jazzy", "jazzy_fair", "lyrical", "lyrical_fair")
COUNTERPARTS = (("thesis", "jazzy", "lyrical"), ("fair", "jazzy_fair", "lyrical_fair"))
"""Presets that have the same limits, one for each release, in the order of ``RELEASES``."""


@functools.cache
def load_preset(name: str) -> NavigationParams:
    """Load a preset by name; its file is read once.

    Raises:
        ConfigError: If there is no such preset.
    """
    refuse_unknown("preset", name, PRESETS)
    document = read_preset(name)
    release: Release = document.pop("release", "humble")
    return parse_nav2_params(document, release=release).navigation


def counterpart(navigation: NavigationParams, release: Release) -> NavigationParams | None:
    """Return the preset of a release with the limits that a preset of any release has; None for other parameters."""
    presets = next((presets for presets in COUNTERPARTS if navigation in map(load_preset, presets)), None)
    return None if presets is None else load_preset(presets[RELEASES.index(release)])


def read_preset(name: str) -> dict[str, Any]:
    """Return a preset as in a ``nav2_params.yaml``; ``release`` at its top names its release.

    In its file, ``extends: other`` at the top lays it over that one.
    """
    document: dict[str, Any] = read_bundled("controllers", "presets", f"{name}.yaml")
    base = document.pop("extends", None)
    return overlay(read_preset(base), document) if base else document
