"""Migration of sections for several nodes, such as ``/**``: which nodes they are for, and what cannot be converted."""

from __future__ import annotations

from collections.abc import Sequence

import yaml

from controllers.nav2_params.controllers_section import HANDLER_LIST
from controllers.nav2_params.migration_work import Work, children, controllers_in
from controllers.nav2_params.nodes import is_wildcard
from controllers.nav2_params.wildcards import told_sections
from controllers.nav2_params.yaml_edits import Entry
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


def refuse_split_controllers(groups: Groups, work: Work) -> None:
    """Refuse controllers whose parameters, or whose server's, a section for several nodes shares with another section.

    Raises:
        ConfigError: Naming the controller and the other section.
    """
    found = ((full, group) for full, _, group in groups)
    servers = [one for one in found if SERVER in nodes_of(*one) or is_wildcard(_name(one[0]))]
    for full, group in servers:
        wild, own = is_wildcard(full), _first_names(group)
        rivals = ((place, other) for place, other in servers if place != full and (wild or is_wildcard(place)))
        others = {place: _first_names(other) for place, other in rivals}
        for name in controllers_in(full, group):
            for place, names in others.items():
                if name in names:
                    raise ConfigError(f"{full}.{name}: expected all parameters in one section, got others in {place}")
                if work.crosses("lyrical") and names & HANDLING:
                    raise ConfigError(f"{full}.{name}: expected beside {CONTROLLERS}, which is in {place}")
            if work.crosses("lyrical") and wild and CONTROLLERS not in own:
                raise ConfigError(f"{full}.{name}: expected beside {CONTROLLERS}, or under {SERVER}")


def _first_names(group: yaml.MappingNode) -> set[str]:
    """Return the names of the parameters and groups of a section, without what follows a dot."""
    return {entry.name.partition(".")[0] for entry in children(group)}


def _name(full: str) -> str:
    return full.rpartition(".")[2].rpartition("/")[2]
