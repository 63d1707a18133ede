"""Migrates the parameters of one controller, by what its own tables say about the releases."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import yaml

from controllers.descriptor import Nav2Controller
from controllers.nav2_params.file.yaml_edits import Entry, as_yaml
from controllers.nav2_params.migration.work import ControllerGroup, Work, asks, critic_of, listed, placed, tell_awakened
from controllers.rotation_shim.plugin import PRIMARY


def migrate_controller(
    work: Work, controller: ControllerGroup, inflation: Mapping[str, Any], moved: Collection[str]
) -> None:
    """Migrate a controller.

    Args:
        work: The migration.
        controller: Its group.
        inflation: Parameters that Humble's critic has to be told about the inflation layer.
        moved: Full names of the parameters that moved to another group, or from there, already.
    """
    given, plugin, full = controller.given, controller.plugin, controller.full
    missing = plugin.keys.missing.get(work.target, {})
    for name in [name for name in missing if name in given and f"{full}.{name}" not in moved]:
        if not _exchange(work, full, given[name], plugin):
            work.take_out(full, given[name], missing[name])
    tell_awakened(work, full, given, plugin)
    _replace_critics(work, full, given, plugin)
    for name, value in plugin.changed_defaults(work.source, work.target).items():
        _write_out(work, controller, name, value, f"{work.source.capitalize()}'s default")
    layer = inflation if work.enters("humble") and controller.primary == "mppi" else {}
    for name, value in layer.items():
        _write_out(work, controller, name, value, "the local costmap's")
    here = {name.removeprefix(f"{full}.") for name in moved}
    _tell_new(work, full, {*given, *layer, *here}, given, plugin)


def _write_out(work: Work, controller: ControllerGroup, name: str, value: Any, why: str) -> None:
    """Write out a parameter that is not given, unless it belongs to a critic that the controller does not list."""
    given, critic = controller.given, critic_of(controller.plugin, name)
    if name in given or not asks(given, critic):
        return
    holder = _group_of(given.get(name.partition(".")[0])) if critic else None
    inserted = name.partition(".")[2] if holder else placed(work, controller, name)
    work.edits.insert(holder or controller.group, inserted, value)
    work.tell(f"{controller.full}.{name}", f"written out as {value}, {why}")


def _tell_new(work: Work, full: str, known: set[str], given: Mapping[str, Entry], plugin: Nav2Controller) -> None:
    """Say which parameters are new in the target and not yet ``known``, and what their defaults are."""
    new = plugin.keys.missing.get(work.source, {}).keys() - plugin.keys.missing.get(work.target, {}).keys()
    exchanged = {f"{old.rpartition('.')[0]}.{name}" for old, (name, _) in plugin.exchanged.items() if old in given}
    named = [name for name in plugin.parameters if name in new - exchanged - plugin.our_keys - known]
    asked = [name for name in named if asks(given, critic_of(plugin, name)) and not name.startswith(PRIMARY)]
    if asked:
        said = ", ".join(f"{name} {plugin.default(name, work.target)}" for name in asked)
        work.tell(full, f"new in {work.target.capitalize()} and at its default: {said}")


def _exchange(work: Work, full: str, entry: Entry, plugin: Nav2Controller) -> bool:
    """Exchange a parameter for the other release's, if the plugin knows one; return whether it does."""
    new, values = plugin.exchanged.get(entry.name, ("", {}))
    value = values.get(str(entry.value.value).lower())
    if value is None:
        return False
    head = entry.key.value.rpartition(".")[0]
    work.edits.rename(entry.key, f"{head}.{new}" if head else new)
    work.edits.replace(entry, value)
    work.say(f"{full}.{entry.name}", entry.line, f"now {new}: {value}")
    return True


def _replace_critics(work: Work, full: str, given: Mapping[str, Entry], plugin: Nav2Controller) -> None:
    """Replace critics that only the source has."""
    critics = given.get("critics")
    names = listed(critics)
    only = plugin.old_critics.get(work.source, {}) if work.source != work.target else {}
    for old, new in only.items():
        if critics is not None and old in names and new not in names:
            work.edits.replace(critics, as_yaml([new if name == old else name for name in names]))
            if old in given:
                work.edits.rename(given[old].key, new)
            work.say(f"{full}.{old}", critics.line, f"replaced by {new}")


def _group_of(entry: Entry | None) -> yaml.MappingNode | None:
    """Return the mapping under a key, None if there is none or it is empty."""
    value = None if entry is None else entry.value
    return value if isinstance(value, yaml.MappingNode) and value.value else None
