"""Parameters: what the page says of each of Nav2's parameters, from the options that read it.

Texts and units come from the docstrings of the options, ranges from the search spaces of ``mapbench tune``.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Mapping
from typing import Any, Literal, get_args, get_origin

from controllers.nav2_params import NavigationParams
from controllers.nav2_params.plugins import CONTROLLERS
from controllers.nav2_params.values import unused_critics
from evolution.driving import ControllerSpec
from evolution.play.messages.start import Parameter
from evolution.play.plans import known_values
from evolution.tuning import ParameterRange, shipped_space, space_names
from gym_mapbench.costmap import COSTMAPS, CostmapParams
from gym_mapbench.settings import Settings

ARGUMENT = re.compile(r"^    (\w+(?:, \w+)*): (.+(?:\n      .+)*)", re.MULTILINE)
"""One or several arguments in a docstring, with the indented lines that follow."""
UNIT = re.compile(r", (m/s\^2|rad/s\^2|m/s|rad/s|1/m|Hz|rad|m|s)(?=[.;,:]|$)")
KINDS: dict[type, Literal["float", "int", "bool", "str", "list"]] = {
    bool: "bool",
    int: "int",
    float: "float",
    str: "str",
    list: "list",
}
SPACE_OF_COSTMAPS = "rpp"
"""The search space that also bounds parameters of the costmaps."""


def controller_parameters(navigation: NavigationParams, spec: ControllerSpec) -> list[Parameter]:
    """Return the parameters of one of Nav2's controllers; those of critics that it does not list are left out."""
    values = {key: value for key, value in known_values(navigation, spec).items() if not key.startswith(COSTMAPS)}
    if not values:
        return []
    kind = navigation.controller(spec.registered_name).kind
    options = CONTROLLERS[kind].params
    ranges = shipped_space(kind).parameters if kind in space_names() else {}
    off = unused_critics(navigation, spec.registered_name)
    used = {key: value for key, value in values.items() if key.partition(".")[0] not in off}
    return [_parameter(key, value, options, key, ranges) for key, value in used.items()]


def costmap_parameters(navigation: NavigationParams, spec: ControllerSpec) -> list[Parameter]:
    """Return the parameters of the costmaps; of any controller, as all have the same."""
    ranges = shipped_space(SPACE_OF_COSTMAPS).parameters
    values = {key: value for key, value in known_values(navigation, spec).items() if key.startswith(COSTMAPS)}
    return [
        _parameter(key, value, getattr(navigation, key.partition(".")[0]), key.partition(".")[2], ranges)
        for key, value in values.items()
    ]


def _parameter(key: str, value: Any, options: Any, place: str, ranges: Mapping[str, ParameterRange]) -> Parameter:
    """Return one parameter.

    Args:
        key: Its name.
        value: Its default.
        options: The options that hold it, or their class.
        place: Its dotted name in the options.
        ranges: Sensible ranges by name.
    """
    text, choices = _described(options, place)
    unit = UNIT.search(text)
    bounds = ranges.get(key)
    return Parameter(
        key=key,
        default=value,
        kind=KINDS[type(value)],
        unit=unit[1] if unit else "",
        low=bounds.low if bounds else None,
        high=bounds.high if bounds else None,
        choices=choices,
        text=text,
    )


def _described(options: Any, place: str) -> tuple[str, list[str]]:
    """Return the text of a parameter, and its choices; empty where nothing is known."""
    name, _, rest = place.partition(".")
    kind = options if isinstance(options, type) else type(options)
    if rest:
        inner = options.layers.get(name) if isinstance(options, CostmapParams) else _group(kind, name)
        return ("", []) if inner is None else _described(inner, rest)
    field = kind.model_fields.get(name) if issubclass(kind, Settings) else None
    annotation = None if field is None else field.annotation
    choices = [str(one) for one in get_args(annotation)] if get_origin(annotation) is Literal else []
    return next((texts[name] for texts in _texts(kind) if name in texts), ""), choices


def _group(kind: type, name: str) -> Any:
    """Return the class of a group of parameters, such as a critic; None if there is none."""
    field = kind.model_fields.get(name) if issubclass(kind, Settings) else None
    return None if field is None or not isinstance(field.default, Settings) else type(field.default)


def _texts(kind: type) -> Iterator[dict[str, str]]:
    """Yield the texts of the arguments in the docstrings of a class and of its bases."""
    for base in kind.__mro__:
        found = ARGUMENT.findall(inspect.cleandoc(base.__doc__ or ""))
        yield {name: " ".join(text.split()) for names, text in found for name in names.split(", ")}
