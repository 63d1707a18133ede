"""Arguments of a caller in Python: each has the type that is asked for, or an error names it."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Iterable, Mapping
from numbers import Real
from pathlib import Path
from typing import Any, TypeVar

from gym_mapbench.errors import ConfigError

T = TypeVar("T")


def instance_of(kind: type[T], name: str, value: object) -> T:
    """Return a value of one class.

    Raises:
        ConfigError: If it is of another class.
    """
    if not isinstance(value, kind):
        raise _unexpected(name, f"an instance of {kind.__name__}", value)
    return value


def path_from(name: str, value: object) -> Path:
    """Return a path.

    Raises:
        ConfigError: If it is neither a text nor a path.
    """
    if not isinstance(value, str | os.PathLike):
        raise _unexpected(name, "a path", value)
    return Path(value)


def whole_number(name: str, value: Any, least: int, most: float = math.inf) -> int:
    """Return a whole number of Python for one of Python or of numpy.

    Raises:
        ConfigError: If it is something else, such as a bool or 2.0, or out of the range.
    """
    try:
        number = None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = None
    if number is None or not least <= number <= most:
        ends = f"{least} or greater" if most == math.inf else f"{least} to {most}"
        raise _unexpected(name, f"a whole number, {ends}", value)
    return number


def positive_number(name: str, value: Any) -> float:
    """Return a finite number above 0, of Python or of numpy.

    Raises:
        ConfigError: If it is something else, such as a bool.
    """
    number = float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    if not 0 < number < math.inf:
        raise _unexpected(name, "a finite number above 0", value)
    return number


def refuse_beside_resume(given: Mapping[str, object]) -> None:
    """Refuse other arguments beside a directory that is continued: it has its own options.

    Raises:
        ConfigError: Naming the first argument that is not None.
    """
    name = next((name for name, value in given.items() if value is not None), None)
    if name is not None:
        raise ConfigError(f"resume: expected no other option, got {name}")


def names_from(name: str, value: object) -> tuple[str, ...]:
    """Return one or several names as a tuple.

    Raises:
        ConfigError: If they are something else.
    """
    names = (value,) if isinstance(value, str) else _items(value)
    if names is None or not all(isinstance(one, str) for one in names):
        raise _unexpected(name, "a name or a list of names", value)
    return names


def _items(value: object) -> tuple[Any, ...] | None:
    return tuple(value) if isinstance(value, Iterable) and not isinstance(value, Mapping | bytes) else None


def _unexpected(name: str, expected: str, value: object) -> ConfigError:
    return ConfigError(f"{name}: expected {expected}, got {value!r:.80}")
