"""Sections of ROS parameter files: read key by key, so that no key goes unnoticed, and written back.

A :class:`Section` is one group of a file. :class:`Keys` describes the keys that are no parameters, and
:class:`Findings` collects them. A :class:`RosPlugin` describes a plugin of Nav2, beside the plugin's own code.
"""

from gym_mapbench.ros_params.findings import KINDS, Finding, Findings, Kind
from gym_mapbench.ros_params.keys import Keys
from gym_mapbench.ros_params.nested import leaves, nest_dotted, overlay, value_at
from gym_mapbench.ros_params.plugin import (
    RosNames,
    RosPlugin,
    in_every_release,
    known_class,
    nearest_class,
    refuse_missing,
    refuse_slash,
    since,
    slashed_in_humble,
    take_class,
    written,
)
from gym_mapbench.ros_params.release_settings import ReleaseSettings
from gym_mapbench.ros_params.section import RELEASE, Section, parameter_names
from gym_mapbench.ros_params.templates import (
    PLACEHOLDER,
    fill_templates,
    first_unreadable,
    no_value,
    parse_defines,
    template_names,
)

__all__ = [
    "KINDS",
    "PLACEHOLDER",
    "RELEASE",
    "Finding",
    "Findings",
    "Keys",
    "Kind",
    "ReleaseSettings",
    "RosNames",
    "RosPlugin",
    "Section",
    "fill_templates",
    "first_unreadable",
    "in_every_release",
    "known_class",
    "leaves",
    "nearest_class",
    "nest_dotted",
    "no_value",
    "overlay",
    "parameter_names",
    "parse_defines",
    "refuse_missing",
    "refuse_slash",
    "since",
    "slashed_in_humble",
    "take_class",
    "template_names",
    "value_at",
    "written",
]
