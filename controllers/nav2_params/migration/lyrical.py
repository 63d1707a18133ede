"""Moves parameters to the places that they have in Lyrical, or back.

In Lyrical one path handler of the controller server cuts the plan for all controllers, MPPI's motion model is a block
with a class, and the Rotation Shim's primary controller has a block of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import yaml

from controllers.mppi.motion_model import BLOCKS, CLASSES, CONSTRAINTS, KEY, MODELS, RADIUS
from controllers.mppi.release_tables import HANDLED as HANDLED_OF_MPPI
from controllers.nav2_params.file.yaml_edits import Entry, entries
from controllers.nav2_params.migration.work import ControllerGroup, Work, children, listed, placed, value_of
from controllers.nav2_params.plugins import CONTROLLERS, SHIMS
from controllers.nav2_params.sections.controllers import HANDLER_LIST, TREES_CHOICE
from controllers.path_handler import PATH_HANDLER_ID, PATH_HANDLERS, PathHandler
from controllers.rotation_shim.plugin import OWN_OF_SHIM, PRIMARY
from controllers.rpp.plugin import TURNING

_SEARCH = "max_robot_pose_search_dist"
HANDLED: Mapping[str, Mapping[str, str]] = {
    "mppi": {name: name for name in HANDLED_OF_MPPI},
    "rpp": {_SEARCH: _SEARCH},
    "graceful": {_SEARCH: _SEARCH},
    "dwb": {"forward_prune_distance": "prune_distance"},
}
"""Kind of a controller -> its parameter -> that of the path handler which does the same."""
HALF = "half the local costmap"
ENDS: Mapping[str, str] = {"rpp": HALF, "graceful": HALF}
"""Kind of a controller -> where its local plan ends in Humble and Jazzy, if no parameter says that."""

Controllers = Mapping[str, ControllerGroup]


def move_path_handling(work: Work, full: str, server: yaml.MappingNode, controllers: Controllers) -> frozenset[str]:
    """Move the parameters of the local plan to Lyrical's path handler, or back to the controllers.

    Returns:
        The full names that the parameters have, or had, in the groups of the controllers.
    """
    given = {entry.name: entry for entry in entries(server)}
    if "controller_plugins" not in given or not work.crosses("lyrical"):
        return frozenset()
    if work.target != "lyrical":
        return _return_handling(work, full, server, controllers, given)
    if HANDLER_LIST in given:
        return frozenset()
    handler: dict[str, Any] = {"plugin": PATH_HANDLERS["feasible"]["lyrical"]}
    chosen = controllers.get(TREES_CHOICE) or next(iter(controllers.values()), None)
    moved = frozenset() if chosen is None else _gather_handling(work, chosen, handler)
    work.edits.insert(server, PATH_HANDLER_ID, handler)
    work.edits.insert(server, HANDLER_LIST, [PATH_HANDLER_ID])
    work.tell(f"{full}.{HANDLER_LIST}", f"{PATH_HANDLER_ID} inserted; it cuts the plan for all controllers")
    return moved


def _gather_handling(work: Work, chosen: ControllerGroup, handler: dict[str, Any]) -> frozenset[str]:
    """Give a path handler the parameters of the controller that the default tree asks for; return their full names."""
    given, names = chosen.given, HANDLED[chosen.primary]
    for name, new in names.items():
        default = CONTROLLERS[chosen.primary].default(name, work.source)
        if name in given:
            handler[new] = value_of(given[name])
            work.edits.remove(given[name])
            work.say(f"{chosen.full}.{name}", given[name].line, f"moved to {PATH_HANDLER_ID}.{new}")
        elif default not in (None, getattr(PathHandler(), new)):
            handler[new] = default
            why = f"{work.source.capitalize()}'s default of {chosen.full}.{name}"
            work.tell(f"{PATH_HANDLER_ID}.{new}", f"written out as {default}, {why}")
    if chosen.primary in ENDS:
        new_end = f"prune_distance {PathHandler().prune_distance} along the path, no longer after"
        work.tell(chosen.full, f"the local plan ends after {new_end} {ENDS[chosen.primary]}")
    return frozenset(f"{chosen.full}.{name}" for name in names)


def _return_handling(
    work: Work, full: str, server: yaml.MappingNode, controllers: Controllers, given: Mapping[str, Entry]
) -> frozenset[str]:
    """Give the path handler's parameters to the controllers, and take the path handler out; return their full names."""
    name = (listed(given.get(HANDLER_LIST)) or [PATH_HANDLER_ID])[0]
    own = {entry.name.removeprefix(f"{name}."): entry for key, entry in given.items() if key.startswith(f"{name}.")}
    values = PathHandler().model_dump() | {key: value_of(entry) for key, entry in own.items()}
    written = set()
    for controller in controllers.values():
        for old, new in HANDLED[controller.primary].items():
            value = values[new]
            if value not in (None, controller.plugin.default(old, work.target)):
                work.write_out(controller.full, controller.group, old, value, f"the path handler's {new}")
                written.add(f"{controller.full}.{old}")
    returned = {new for controller in controllers.values() for new in HANDLED[controller.primary].values()}
    for key, entry in own.items():
        if key not in returned and key != "plugin":
            work.lose(full, entry, "taken out: only Lyrical has a path handler")
    for entry in children(server):
        if entry.name in (HANDLER_LIST, name) or entry.name.startswith(f"{name}."):
            work.edits.remove(entry)
    return frozenset(written)


def migrate_forms(work: Work, controllers: Controllers) -> None:
    """Bring motion models and Rotation Shims into the form that the target starts with."""
    if not work.crosses("lyrical"):
        return
    for controller in controllers.values():
        lyrical = work.target == "lyrical"
        if controller.primary == "mppi":
            (_fold_motion_model if lyrical else _unfold_motion_model)(work, controller)
        if controller.kind in SHIMS:
            (_fold_primary if lyrical else _unfold_primary)(work, controller)


def _fold_motion_model(work: Work, controller: ControllerGroup) -> None:
    """Replace the name of a motion model by a block with its class."""
    given, group = controller.given, controller.group
    model = str(value_of(given[KEY])) if KEY in given else "DiffDrive"
    if model not in BLOCKS:
        return
    block = BLOCKS[model]
    radius = given.get(f"{CONSTRAINTS}.{RADIUS}")
    limits = {RADIUS: value_of(radius)} if radius is not None and model == "Ackermann" else {}
    for entry in controller.children():
        if entry.name.partition(".")[0] == CONSTRAINTS:
            work.edits.remove(entry)
    if radius is not None and not limits:
        work.lose(controller.full, radius, f"taken out: Lyrical's {model} has no turning radius")
    if KEY in given:
        work.edits.replace(given[KEY], block)
    else:
        work.edits.insert(group, placed(work, controller, KEY), block)
    work.edits.insert(group, placed(work, controller, block), {"plugin": CLASSES[model], **limits})
    work.tell(f"{controller.full}.{KEY}", f"now {block}, a block with the class {CLASSES[model]}")


def _unfold_motion_model(work: Work, controller: ControllerGroup) -> None:
    """Replace the block of a motion model by its name."""
    given = controller.given
    block = str(value_of(given[KEY])) if KEY in given else BLOCKS["DiffDrive"]
    ros_class, radius = given.get(f"{block}.plugin"), given.get(f"{block}.{RADIUS}")
    if ros_class is None:
        return
    model = MODELS.get(str(value_of(ros_class)), "DiffDrive")
    for name, entry in given.items():
        if name.partition(".")[0] == block:
            work.edits.remove(entry)
    if KEY in given:
        work.edits.replace(given[KEY], model)
    if radius is not None:
        work.edits.insert(controller.group, CONSTRAINTS, {RADIUS: value_of(radius)})
    work.say(f"{controller.full}.{KEY}", ros_class.line, f"now {model}, a name without a block")


def _fold_primary(work: Work, controller: ControllerGroup) -> None:
    """Give the primary controller of a Rotation Shim, and its parameters, dotted names that make up its own block."""
    moved = 0
    for entry in controller.children():
        name = work.edits.name_of(entry.key)
        if entry.name == PRIMARY:
            work.edits.rename(entry.key, f"{PRIMARY}.plugin")
            work.say(f"{controller.full}.{PRIMARY}", entry.line, "now a block with the class as its plugin")
        elif entry.name.partition(".")[0] not in OWN_OF_SHIM:
            work.edits.rename(entry.key, f"{PRIMARY}.{name}")
            moved += 1
    work.tell(controller.full, f"{moved} parameters and groups of {CONTROLLERS[controller.primary].title} moved there")
    for name, entry in _shared(controller):
        work.write_out(controller.full, controller.group, f"{PRIMARY}.{name}", value_of(entry), "the shim's value")


def _shared(controller: ControllerGroup) -> Iterator[tuple[str, Entry]]:
    """Yield the given parameters that the shim and its primary controller both read in Humble and Jazzy."""
    known = CONTROLLERS[controller.primary].parameters
    return ((name, entry) for name, entry in controller.given.items() if name in TURNING.values() and name in known)


def _unfold_primary(work: Work, controller: ControllerGroup) -> None:
    """Put the parameters of the primary controller of a Rotation Shim beside the shim's own."""
    full = controller.full
    for entry in controller.children():
        block = isinstance(entry.value, yaml.MappingNode) and not (entry.group.flow_style or entry.value.flow_style)
        if entry.name == PRIMARY and block:
            work.edits.dissolve(entry)
            work.edits.rename(controller.given[f"{PRIMARY}.plugin"].key, PRIMARY)
            work.say(f"{full}.{PRIMARY}", entry.line, "its parameters stand beside the shim's")
        elif entry.name.startswith(f"{PRIMARY}."):
            rest = work.edits.name_of(entry.key).removeprefix(f"{PRIMARY}.")
            work.edits.rename(entry.key, PRIMARY if rest == "plugin" else rest)
        elif entry.name == PRIMARY:
            work.lose(full, entry, "written in braces: its parameters must be moved beside the shim's by hand")
