"""Types of numbers: a parameter of ROS has one of them, and a node does not start with a number of the other.

Doubles are floats in the settings, and integers are ints.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args, get_origin

from gym_mapbench.settings import Settings


def mistyped(settings: type[Settings], name: str, value: object) -> str:
    """Say which type a number in a parameter file should have, and how it is written then; empty if it has that type.

    Args:
        settings: The class of the parameters.
        name: Dotted name of a parameter; other names have no type here.
        value: The value as the file gives it: a number, or a list of numbers.
    """
    kinds = _kinds(_annotation(settings, name))
    if isinstance(value, list) and kinds == {tuple} and any(_is_int(one) for one in value):
        return f"expected a list of doubles; write {[_as_double(one) for one in value]}"
    if kinds == {float} and _is_int(value):
        return f"expected a double; write {_as_double(value)}"
    if kinds == {int} and isinstance(value, float):
        return f"expected an integer; write {value:.0f}"
    return ""


def _annotation(settings: type[Settings], name: str) -> Any:
    """Return the annotation of a parameter; None if the settings have no parameter of this name."""
    first, _, rest = name.partition(".")
    field = settings.model_fields.get(first)
    annotation = None if field is None else field.annotation
    if not rest:
        return annotation
    if isinstance(annotation, type) and issubclass(annotation, Settings):
        return _annotation(annotation, rest)
    return None


def _kinds(annotation: Any) -> set[type]:
    """Return the kinds of values of an annotation apart from None: int, float, tuple for floats, or another type."""
    arguments = get_args(annotation)
    if get_origin(annotation) is Annotated:
        return _kinds(arguments[0])
    if get_origin(annotation) is Literal:
        return {type(one) for one in arguments}
    if get_origin(annotation) is tuple:
        return {tuple} if set(arguments) <= {float, ...} else {object}
    if arguments:
        return set().union(*(_kinds(one) for one in arguments if one is not type(None)))
    return {annotation} if isinstance(annotation, type) else set()


def _is_int(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _as_double(value: object) -> object:
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value
