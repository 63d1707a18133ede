"""Single values of the navigation by name: look them up, replace them, and write them into the text of a file.

A name is that of a parameter of a controller (``PathAlign.scale``), or of a costmap with the costmap in front
(``local_costmap.inflation_layer.inflation_radius``).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import yaml

from controllers.dwb.plugin import critic_class
from controllers.nav2_params.file.document import parameter_groups
from controllers.nav2_params.file.nodes import all_nodes
from controllers.nav2_params.file.wildcards import giving_sections
from controllers.nav2_params.file.yaml_edits import Edits, Entry, SharedValueError, as_yaml, entries
from controllers.nav2_params.navigation import NavigationParams
from controllers.nav2_params.plugin_settings import ControllerPlugin
from controllers.nav2_params.plugins import CONTROLLERS, COSTMAP_LAYERS
from controllers.nav2_params.sections.costmaps import LEGACY_LAYERS
from controllers.parameters import SettingsWithCritics
from controllers.rotation_shim.plugin import OWN_OF_SHIM, PRIMARY
from controllers.rpp.params import RENAMED_KEYS
from gym_mapbench.costmap import COSTMAPS, CostmapParams
from gym_mapbench.errors import ConfigError
from gym_mapbench.files.documents import parse_yaml
from gym_mapbench.ros_params import known_class, leaves, nest_dotted, overlay

Value = float | int | bool | str
Values = Mapping[str, Value]


def values_of(navigation: NavigationParams, controller: str) -> dict[str, Any]:
    """Return every value of a controller and of both costmaps by name, the layers that do not write left out.

    Args:
        navigation: The parameters.
        controller: The controller, by its name or kind.
    """
    found = dict(leaves(navigation.controller(controller).params))
    for name, costmap in navigation.costmaps.items():
        off = [layer for layer in costmap.layers if not costmap.writes(layer)]
        values = costmap.model_dump(mode="json", exclude_none=True)
        kept = {key: value for key, value in values.items() if key not in off}
        found |= {f"{name}.{key}": value for key, value in leaves(kept)}
    return found


def unused_critics(navigation: NavigationParams, controller: str) -> frozenset[str]:
    """Return the names of the critics that a controller does not list; their parameters have no effect."""
    plugin = navigation.controller(controller)
    params = CONTROLLERS[plugin.kind].params
    names = params.critic_names() if issubclass(params, SettingsWithCritics) else ()
    return frozenset(names) - frozenset(plugin.params.get("critics", ()))


def with_values(navigation: NavigationParams, controller: str, values: Values) -> NavigationParams:
    """Return the parameters with some values replaced.

    Args:
        navigation: The parameters.
        controller: The controller, by its name or kind.
        values: The new values by name.

    Raises:
        ConfigError: If a name or a value is wrong.
    """
    nested = nest_dotted(values)
    changed = {name: _costmap(one, nested.pop(name)) for name, one in navigation.costmaps.items() if name in nested}
    plugin = navigation.controller(controller)
    name = next((key for key, one in navigation.controllers.items() if one is plugin), controller)
    own = ControllerPlugin(kind=plugin.kind, params=overlay(plugin.params, nested))
    return navigation.replace(**changed, controllers={**navigation.controllers, name: own})


def in_type(value: Value, present: Any) -> Value:
    """Return a value as a number of the type that its parameter has in Nav2, which starts with no other type.

    Args:
        value: The value, which may be a whole number where the parameter is a double, or the other way round.
        present: A value of the parameter as :func:`values_of` returns it.
    """
    if isinstance(present, float) and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if isinstance(present, int) and isinstance(value, float) and value.is_integer():
        return int(value)
    return value


def write_values(text: str, controller: str, values: Values, known: Values) -> str:
    """Return the text of a parameter file with some values replaced; everything else stays, comments included.

    Args:
        text: The text of the file.
        controller: Name of the controller in the file.
        values: The new values by name. A parameter that the file does not give is inserted into its group.
        known: The present values by name, from :func:`values_of`, whose types the new values get.

    Raises:
        ConfigError: If the file has no group for a value.
        SharedValueError: If a value of the file counts for other parameters as well, such as an alias of YAML.
    """
    document, root = parse_yaml(text, "parameter file")
    groups = {full: group for full, _, group in parameter_groups(root, "")} if root else {}
    nodes, edits = all_nodes(document), Edits(text)
    giving_of = {node: giving_sections(nodes, node) for node in ("controller_server", *COSTMAPS)}
    for name, value in values.items():
        node, _, key = name.partition(".") if name.partition(".")[0] in COSTMAPS else ("controller_server", "", name)
        giving = {full: alone for full, alone in giving_of[node].items() if full in groups}
        if not giving:
            raise ConfigError(f"{name}: the file has no section {node}")
        named = _named_as_in if node in COSTMAPS else partial(_placed_as_in, controller)
        places = [_place(groups[full], named(groups[full], key), alone) for full, alone in giving.items()]
        _write(edits, places, in_type(value, known.get(name)))
    return edits.apply()


def _costmap(costmap: CostmapParams, values: Mapping[str, Any]) -> CostmapParams:
    return CostmapParams(**overlay(costmap.model_dump(mode="json", exclude_none=True), values))


def _named_as_in(group: yaml.MappingNode, name: str) -> str:
    """Return a name with the layer in front as the file names it: the first group of the layer's class."""
    layer, _, rest = name.partition(".")
    classes = {layer: COSTMAP_LAYERS[layer].names} if layer in COSTMAP_LAYERS else {}
    further = {layer: LEGACY_LAYERS[layer]} if layer in LEGACY_LAYERS else {}
    for entry in entries(group):
        if entry.key.value == "plugin" and any(known_class(entry.value.value, each) for each in (classes, further)):
            return f"{entry.name.rpartition('.')[0]}.{rest}"
    return name


def _placed_as_in(controller: str, group: yaml.MappingNode, name: str) -> str:
    """Return the full name of a controller's parameter where the file has it, or would have it in Lyrical."""
    found = {entry.name: entry for entry in entries(group)}
    has_block = f"{controller}.{PRIMARY}.plugin" in found
    head = f"{controller}.{PRIMARY}" if has_block and name.partition(".")[0] not in OWN_OF_SHIM else controller
    lyrical = next((new for new, older in RENAMED_KEYS.items() if older == name), name)
    return f"{head}.{lyrical if f'{head}.{lyrical}' in found else _critic_as_in(head, found, name)}"


def _critic_as_in(head: str, found: Mapping[str, Entry], name: str) -> str:
    """Return a name with DWB's critic in front as the file names it, which may give the class apart."""
    critic, _, rest = name.partition(".")
    listed = found.get(f"{head}.critics")
    for node in listed.value.value if rest and listed is not None else ():
        given = found.get(f"{head}.{node.value}.class")
        if critic_class(node.value if given is None else given.value.value) == critic:
            return f"{node.value}.{rest}"
    return name


class _Place(NamedTuple):
    """A section in which a value may stand.

    Args:
        entries: All parameters of the section by name.
        name: The name that the parameter has there.
        alone: Whether a change there changes nothing else.
    """

    entries: Mapping[str, Entry]
    name: str
    alone: bool


def _place(group: yaml.MappingNode, name: str, alone: bool) -> _Place:
    return _Place({entry.name: entry for entry in entries(group)}, name, alone)


def _write(edits: Edits, places: Sequence[_Place], value: Value) -> None:
    """Replace the last of the values that several sections give, or insert it into the innermost group around it."""
    given = [place for place in places if place.name in place.entries]
    if given and not given[-1].alone:
        raise SharedValueError(f"{given[-1].name}: a section gives it to both costmaps")
    if given:
        edits.replace(given[-1].entries[given[-1].name], as_yaml(value))
        return
    holders = [holder for place in places if place.alone for holder in _holders(place.entries, place.name)]
    if not holders:
        name = places[-1].name
        raise ConfigError(f"{name}: the file has no group {name.partition('.')[0]}")
    holder, rest = min(holders, key=lambda one: one[1].count("."))
    edits.insert(holder, rest, value)


def _holders(found: Mapping[str, Entry], name: str) -> Iterator[tuple[yaml.MappingNode, str]]:
    """Yield the groups around a name, innermost first, each with the rest of the name."""
    parts = name.split(".")
    for length in range(len(parts) - 1, 0, -1):
        entry = found.get(".".join(parts[:length]))
        if entry is not None and isinstance(entry.value, yaml.MappingNode) and entry.value.value:
            yield entry.value, ".".join(parts[length:])
