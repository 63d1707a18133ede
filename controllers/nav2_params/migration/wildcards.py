"""Migration of sections for several nodes, such as ``/**``: which nodes they are for, and what cannot be converted."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

import yaml

from controllers.nav2_params.file.nodes import is_wildcard
from controllers.nav2_params.file.wildcards import told_sections
from controllers.nav2_params.file.yaml_edits import Entry
from controllers.nav2_params.migration.work import ControllerGroup, Part, Work, children, controllers_in
from controllers.nav2_params.sections.controllers import HANDLER_LIST
from gym_mapbench.errors import ConfigError

Nodes = tuple[str, ...]
"""Names of nodes whose rules count for a section."""
Groups = Sequence[tuple[str, yaml.ScalarNode, yaml.MappingNode]]
"""Full name, key and parameters of each section."""
SERVER = "controller_server"
CONTROLLERS = "controller_plugins"
HANDLING = frozenset({CONTROLLERS, HANDLER_LIST})
"""Parameters of the server that tell where Lyrical's path handler belongs."""


def nodes_of(full: str, group: yaml.MappingNode) -> Nodes:
    """Return the name of a section's node, or the wildcard and the sections for which its parameters are."""
    name = _name(full)
    if not is_wildcard(name):
        return (name,)
    told = told_sections(_first_names(group))
    served = told if SERVER in told or not controllers_in(full, group) else (*told, SERVER)
    return (name, *served)


def refuse_shared_name(full: str, node: str, entry: Entry) -> None:
    """Refuse a parameter of the behaviour server that other nodes have, too, in a section for several nodes.

    Raises:
        ConfigError: If the parameter would have to be renamed for the behaviour server alone.
    """
    if is_wildcard(_name(full)) and node == "behavior_server":
        where = "a section for several nodes, of which other nodes keep the name"
        raise ConfigError(f"{full}.{entry.name}: expected under {node}, got {where}")


def split_controllers(groups: Groups, giving: Collection[str], work: Work) -> dict[str, list[Part]]:
    """Return what other sections give of controllers, by the controllers' full names.

    Args:
        groups: The sections.
        giving: Full names of the sections that give the parameters of the controller server that is read.
        work: The migration.

    Raises:
        ConfigError: If two sections give one parameter, or a section that is not among these gives a part; or if
            Lyrical's path handler would not stand beside the controllers.
    """
    found = ((full, group) for full, _, group in groups)
    servers = [one for one in found if SERVER in nodes_of(*one) or is_wildcard(_name(one[0]))]
    crosses = work.crosses("lyrical")
    parts: dict[str, list[Part]] = {}
    for full, group in servers:
        wild = is_wildcard(full)
        rivals = {place: other for place, other in servers if place != full and (wild or is_wildcard(place))}
        for name, controller in controllers_in(full, group).items():
            for place, other in rivals.items():
                if name in _first_names(other):
                    usable = {full, place} <= set(giving)
                    parts.setdefault(controller.full, []).append(_part(controller, name, place, other, usable))
                if crosses and _first_names(other) & HANDLING:
                    raise ConfigError(f"{full}.{name}: expected beside {CONTROLLERS}, which is in {place}")
            if crosses and wild and CONTROLLERS not in _first_names(group):
                raise ConfigError(f"{full}.{name}: expected beside {CONTROLLERS}, or under {SERVER}")
            _refuse_twice(controller, parts.get(controller.full, ()))
    return parts


def _part(controller: ControllerGroup, name: str, place: str, section: yaml.MappingNode, usable: bool) -> Part:
    """Return what a section gives of a controller whose class stands in another section."""
    inner = next((entry.value for entry in children(section) if entry.name == name), None)
    if not usable or not isinstance(inner, yaml.MappingNode):
        raise ConfigError(f"{controller.full}: expected all parameters in one section, got others in {place}")
    return Part(place, f"{place}.{name}", inner)


def _refuse_twice(controller: ControllerGroup, parts: Iterable[Part]) -> None:
    """Refuse a controller of which two sections give one parameter, or parts of one group."""
    seen = _first_names(controller.group)
    for part in parts:
        twice = seen & _first_names(part.group)
        if twice:
            raise ConfigError(
                f"{controller.full}.{min(twice)}: expected in one section, got it in {part.section} as well"
            )
        seen |= _first_names(part.group)


def _first_names(group: yaml.MappingNode) -> set[str]:
    """Return the names of the parameters and groups of a section, without what follows a dot."""
    return {entry.name.partition(".")[0] for entry in children(group)}


def _name(full: str) -> str:
    return full.rpartition(".")[2].rpartition("/")[2]
