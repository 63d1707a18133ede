"""Parameters as records, the form in which kernels take many named values."""

from __future__ import annotations

import types
from typing import Annotated, Any, Literal, Union, cast, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.settings import Settings

NUMBERS: dict[Any, type[np.generic]] = {bool: np.bool_, int: np.int64, float: np.float64}


def record_of(settings: type[Settings], *more: tuple[Any, ...]) -> np.dtype[np.void]:
    """Build the type of a record of all numbers, switches and groups of some settings; texts are left out.

    A number or a switch that is None is 0 or false in the record.

    Args:
        settings: The parameters.
        *more: Further fields, as NumPy takes them.
    """
    fields: list[tuple[Any, ...]] = []
    for name, field in settings.model_fields.items():
        kind = _without_none(field.annotation)
        if isinstance(kind, type) and not isinstance(kind, types.GenericAlias) and issubclass(kind, Settings):
            fields.append((name, record_of(kind)))
        elif kind in NUMBERS:
            fields.append((name, np.dtype(cast(Any, kind))))
        elif get_origin(kind) is tuple and set(get_args(kind)) == {float}:
            fields.append((name, np.float64, (len(get_args(kind)),)))
    return np.dtype([*fields, *more], align=True)


def _without_none(kind: Any) -> Any:
    """Return the type of an option without None; a choice has the type of its values."""
    if get_origin(kind) in (Union, types.UnionType):
        kind = next(one for one in get_args(kind) if one is not types.NoneType)
    if get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    return type(get_args(kind)[0]) if get_origin(kind) is Literal else kind


def fill_groups(record: NDArray[np.void], settings: Settings) -> None:
    """Copy those settings for which the record has a field."""
    for name in record.dtype.names or ():
        value = getattr(settings, name, None)
        if isinstance(value, Settings):
            fill_groups(record[name], value)
        elif value is not None:
            record[name] = value
