"""Migrates the path smoothers of the smoother server, by what their own tables say about the releases."""

from __future__ import annotations

import yaml

from controllers.nav2_params.file.yaml_edits import entries
from controllers.nav2_params.migration.work import Work, children, tell_awakened, values_in
from controllers.nav2_params.navigation import DEFAULT_SMOOTHER
from controllers.nav2_params.plugins import SMOOTHERS, names_in_ros
from gym_mapbench.ros_params import known_class
from gym_mapbench.smoothers.simple import HUMBLES_REFINEMENTS

NODE = "smoother_server"
REFINEMENTS = "refinement_num"


def migrate_smoothers(work: Work, full: str, server: yaml.MappingNode) -> None:
    """Migrate all smoothers that are built here."""
    for entry in children(server):
        default = SMOOTHERS["simple"].names[work.source] if entry.name == DEFAULT_SMOOTHER else ""
        kind = known_class(values_in(entry.value).get("plugin", default), names_in_ros(SMOOTHERS))
        if kind is not None and isinstance(entry.value, yaml.MappingNode):
            _migrate(work, f"{full}.{entry.name}", kind, entry.value)


def _migrate(work: Work, full: str, kind: str, group: yaml.MappingNode) -> None:
    """Migrate one smoother."""
    given, plugin = {entry.name: entry for entry in entries(group)}, SMOOTHERS[kind]
    for name, why in plugin.keys.missing.get(work.target, {}).items():
        if name in given:
            work.take_out(full, given[name], why)
    tell_awakened(work, full, given, plugin)
    refines = work.leaves("humble") and REFINEMENTS in plugin.keys.missing["humble"]
    if refines and REFINEMENTS not in given:
        work.write_out(full, group, REFINEMENTS, HUMBLES_REFINEMENTS, "as often as Humble refines")
