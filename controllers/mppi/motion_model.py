"""MPPI's motion model in parameter files: a name in Humble and Jazzy, a block with a class in Lyrical.

Source: nav2_mppi_controller (Lyrical) src/optimizer.cpp, ``setMotionModel``; motion_models.hpp.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import Section

MODELS = {
    "mppi::DiffDriveMotionModel": "DiffDrive",
    "mppi::AckermannMotionModel": "Ackermann",
    "mppi::OmniMotionModel": "Omni",
}
"""Lyrical's classes of the motion models -> their names in Humble and Jazzy."""
BLOCKS = {"DiffDrive": "diff_drive", "Ackermann": "ackermann", "Omni": "omni"}
"""Name of a motion model in Humble and Jazzy -> name of its block in files of Lyrical that are written here."""
CLASSES = {name: ros_class for ros_class, name in MODELS.items()}
KEY, CONSTRAINTS, RADIUS = "motion_model", "AckermannConstraints", "min_turning_r"


def take_motion_model(section: Section) -> None:
    """Replace the block of a motion model by the model's name, and its turning radius by the constraint.

    Raises:
        ConfigError: If the section is Lyrical's and has no such block.
    """
    lyrical = section.findings.release == "lyrical"
    name = section.values.get(KEY, BLOCKS["DiffDrive"] if lyrical else None)
    block = section.values.get(name) if isinstance(name, str) else None
    if isinstance(name, str) and isinstance(block, Mapping) and "plugin" in block:
        section.values[KEY] = MODELS.get(str(block["plugin"]), block["plugin"])
        if RADIUS in block:
            section.values[CONSTRAINTS] = {RADIUS: block[RADIUS]}
        del section.values[name]
        if not lyrical:
            section.findings.add("renamed", f"{section.name}.{name}", KEY)
    elif lyrical:
        raise ConfigError(
            f"{section.name}.{KEY}: Nav2 Lyrical does not start without the class of the motion model: expected "
            f"{name}.plugin, for instance {CLASSES['DiffDrive']}, got none; 'mapbench params convert' writes it into a "
            "file of an earlier release"
        )


def arrange(values: dict[str, Any], release: Release) -> dict[str, Any]:
    """Put the motion model of parameters into the form that a release reads."""
    if release != "lyrical":
        return values
    model = values[KEY]
    limits = values[CONSTRAINTS] if model == "Ackermann" else {}
    others = {name: value for name, value in values.items() if name != CONSTRAINTS}
    return {**others, KEY: BLOCKS[model], BLOCKS[model]: {"plugin": CLASSES[model], **limits}}


def forms(group: Mapping[str, Any]) -> Mapping[str, tuple[Release, ...]]:
    """Return the motion model of a section -> the releases that start with this form of it."""
    name = group.get(KEY)
    block = group.get(name) if isinstance(name, str) else None
    if isinstance(block, Mapping) and "plugin" in block:
        return {KEY: ("lyrical",)}
    return {KEY: ("humble", "jazzy")} if isinstance(name, str) and name in BLOCKS else {}
