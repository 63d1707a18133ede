"""The reference of all options that a file can hold, from the models that check them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from docs.generate.docstrings import arguments, summary
from docs.generate.markdown import name, table
from evolution.driving import ControllerSpec, DriveSettings
from evolution.search import EvolveSettings
from evolution.studies import StudySettings, SweepSettings
from evolution.training import TrainSettings
from evolution.tuning import SearchSpace, TuneSettings
from gym_mapbench.costmap import LAYERS
from gym_mapbench.generator import FAMILIES
from gym_mapbench.planners import PLANNERS
from gym_mapbench.settings import Settings
from gym_mapbench.smoothers import SMOOTHERS
from gym_mapbench.world.motions import MOTIONS

ROOTS: dict[str, tuple[str, type[Settings]]] = {
    "search": ("`search:` of an experiment", EvolveSettings),
    "controllers": ("`controllers:` of an experiment, one entry", ControllerSpec),
    "run": ("`run:` of an experiment", DriveSettings),
    "study": ("a study", StudySettings),
    "sweep": ("a study of worlds (a sweep)", SweepSettings),
    "space": ("the file of `mapbench tune --space`", SearchSpace),
    "tuning": ("`evolution.tune`", TuneSettings),
    "training": ("a training", TrainSettings),
}
"""Kinds of files: the name of each kind, and the model that reads it."""

SIMPLE = {
    int: "whole number",
    float: "number",
    str: "text",
    bool: "true or false",
    NoneType: "nothing",
    Any: "anything",
}
LIMITS = (("ge", "≥"), ("gt", ">"), ("le", "≤"), ("lt", "<"))


def option_reference(root: str) -> str:
    """Return a table for a model, and one for each model inside it that no earlier root contains."""
    earlier = [model for key in list(ROOTS)[: list(ROOTS).index(root)] for _, model in _models("", ROOTS[key][1])]
    shown = [(where, model) for where, model in _models("", ROOTS[root][1]) if model not in earlier]
    return "\n\n".join(_section(where, model) for where, model in shown)


def family_reference() -> str:
    """Return a table of the options of every family."""
    return "\n\n".join(_section(key, FAMILIES[key]) for key in FAMILIES.built_in)


def motion_reference() -> str:
    """Return a table of the options of every motion of a body."""
    return "\n\n".join(_section(key, MOTIONS[key]) for key in MOTIONS.built_in)


def planner_reference() -> str:
    """Return a table of the options of every planner."""
    return "\n\n".join(_section(key, PLANNERS[key].params) for key in PLANNERS.built_in)


def smoother_reference() -> str:
    """Return a table of the options of every path smoother."""
    return "\n\n".join(_section(key, SMOOTHERS[key].params) for key in SMOOTHERS.built_in)


def layer_reference() -> str:
    """Return a table of the options of every costmap layer, and one for each model inside them."""
    shown = {model: where for key in LAYERS.built_in for where, model in _models(key, LAYERS[key].params)}
    return "\n\n".join(_section(where, model) for model, where in shown.items())


def _models(where: str, model: type[Settings]) -> Iterator[tuple[str, type[Settings]]]:
    """Return a model and all models inside it, each once, with the keys that lead to it."""
    found: dict[type[Settings], str] = {}
    waiting = [(where, model)]
    while waiting:
        path, one = waiting.pop(0)
        if one not in found:
            found[one] = path
            waiting += [(f"{path}.{key}".lstrip("."), part) for key, field in _fields(one) for part in _inner(field)]
    return iter((path, one) for one, path in found.items())


def _fields(model: type[Settings]) -> list[tuple[str, FieldInfo]]:
    return list(model.model_fields.items())


def _inner(field: FieldInfo) -> list[type[Settings]]:
    """Return the models in the type of a field, at any depth."""
    waiting, found = [field.annotation], []
    while waiting:
        one: Any = waiting.pop()
        waiting += get_args(one)
        found += [one] if isinstance(one, type) and issubclass(one, Settings) else []
    return found


def _section(where: str, model: type[Settings]) -> str:
    texts = arguments(model)
    rows = [[name(key), texts.get(key, ""), _type(field), _default(field)] for key, field in _fields(model)]
    title = f"### `{where}`\n\n" if where else ""
    return f"{title}{summary(model)}\n\n{table(['option', 'what it is', 'value', 'default'], rows)}"


def _type(field: FieldInfo) -> str:
    """Return the type of a field in words, with its limits."""
    return ", ".join([_words(field.annotation), *_limits(field.metadata)])


def _words(kind: Any) -> str:
    """Return a type in words."""
    origin, parts = get_origin(kind), get_args(kind)
    if kind in SIMPLE:
        return SIMPLE[kind]
    if origin in COMPOSED:
        return COMPOSED[origin](parts)
    return "mapping (see below)" if isinstance(kind, type) and issubclass(kind, Settings) else name(kind.__name__)


def _choices(parts: Sequence[Any]) -> str:
    return "one of " + ", ".join(name(str(part)) for part in parts)


def _alternatives(parts: Sequence[Any]) -> str:
    return " or ".join(dict.fromkeys(map(_words, parts)))


def _list(parts: Sequence[Any]) -> str:
    return f"list of {_words(parts[0])}" if parts[-1] is ... else f"list of {len(parts)}: {_words(parts[0])}"


def _limited(parts: Sequence[Any]) -> str:
    return ", ".join([_words(parts[0]), *_limits(parts[1:])])


COMPOSED: dict[Any, Callable[[Sequence[Any]], str]] = {
    Literal: _choices,
    Union: _alternatives,
    UnionType: _alternatives,
    tuple: _list,
    dict: lambda _: "mapping",
    Annotated: _limited,
}
"""Functions that return a composed type in words, from its parts."""


def _limits(metadata: Iterable[Any]) -> list[str]:
    """Limits among the metadata of a field or of an annotated type."""
    marks = [mark for one in metadata for mark in (one.metadata if isinstance(one, FieldInfo) else [one])]
    return [f"{sign} {getattr(one, key):g}" for one in marks for key, sign in LIMITS if hasattr(one, key)]


def _default(field: FieldInfo) -> str:
    if field.default is PydanticUndefined and field.default_factory is None:
        return "required"
    value = field.get_default(call_default_factory=True, validated_data={})
    return "its defaults" if isinstance(value, Settings) else name(json.dumps(value, default=str, ensure_ascii=False))
