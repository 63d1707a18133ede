"""Which files may run code: none, unless the user says so.

A name of the form ``module:attribute``, and the file of a learned policy, run code when they are used. Everybody
expects that of a name on the command line or in a script, and nobody of an experiment, a study or a directory of
results that came from somebody else. Such a file is therefore refused, unless it names only what this process was asked
for before, or the user has allowed it: with ``--allow-code``, and in Python with :func:`allow_code`. Names without a
colon, which are registered or belong to an installed package, are always free.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from gym_mapbench.errors import ConfigError

MODULE_ATTRIBUTE = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_][\w.]*")
"""``module:attribute``, both may contain dots."""

RUNS_CODE = re.compile(rf"(?:[^=]*=)?\s*({MODULE_ATTRIBUTE.pattern}|.*\.zip\s*)(?::.*)?", re.DOTALL)
"""``module:attribute`` or ``model.zip``, perhaps with ``NAME=`` before it, or the path that a reader gets after it."""

_allowed: ContextVar[bool] = ContextVar("allowed", default=False)
_asked_for: set[str] = set()


@contextmanager
def allow_code(allowed: bool = True) -> Iterator[None]:
    """Let files name code while the ``with`` block lasts; or not, if ``allowed`` is False."""
    token = _allowed.set(allowed)
    try:
        yield
    finally:
        _allowed.reset(token)


def was_asked_for(name: str) -> None:
    """Remember code that this process was asked to run, so that files may name it, too."""
    _asked_for.add(name)


def refuse_code(document: object, where: object) -> None:
    """Refuse the content of a file that names code.

    Args:
        document: What was read from it.
        where: The file.

    Raises:
        ConfigError: Naming the code and its place in the file, unless that is allowed or was asked for before.
    """
    for place, text in () if _allowed.get() else _texts(document, ""):
        found = RUNS_CODE.fullmatch(text)
        if found is not None and found[1].strip() not in _asked_for:
            raise ConfigError(
                f"{where}: {place}: {text!r:.80} would run code; if you trust this file, add --allow-code "
                "(in Python: with gym_mapbench.trust.allow_code())"
            )


def _texts(document: Any, place: str) -> Iterator[tuple[str, str]]:
    """Yield every text in a document, keys included, with its place."""
    if isinstance(document, str):
        yield place, document
    elif isinstance(document, Mapping):
        for key, value in document.items():
            inner = f"{place}.{key}" if place else str(key)
            yield from _texts(key, inner)
            yield from _texts(value, inner)
    elif isinstance(document, list | tuple):
        for value in document:
            yield from _texts(value, place)
