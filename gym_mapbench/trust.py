"""Which code may run: what the user names, and nothing that only a file names.

A name of the form ``module:attribute``, and the file of a learned policy, run code when they are used. Everybody
expects that of a name on the command line or in a script, and nobody of an experiment, a study or a directory of
results that came from somebody else. There are two doors, which the user opens with ``--allow-code``, and in Python
with :func:`allow_code`:

* A file that names code is refused when what it says is to be driven (:func:`refuse_code`), unless it names only what
  this process ran before.
* While a command runs, no code is loaded that its arguments do not name (:func:`only_code_named_in`), whichever way the
  name came.

Names without a colon, which are registered or belong to an installed package, are always free.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from gym_mapbench.errors import UntrustedError

MODULE_ATTRIBUTE = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_][\w.]*")
"""``module:attribute``, both may contain dots."""

RUNS_CODE = re.compile(rf"(?:[^=]*=)?\s*({MODULE_ATTRIBUTE.pattern}|.*\.zip)\s*(?::.*)?", re.DOTALL)
"""``module:attribute`` or ``model.zip``, perhaps with ``NAME=`` before it, or the path that a reader gets after it."""

HINT = "add --allow-code (in Python: with gym_mapbench.trust.allow_code())"

CONTAINERS = (str, Mapping, list, tuple)
"""What texts are found in."""

_allowed: ContextVar[bool] = ContextVar("allowed", default=False)
_named: ContextVar[frozenset[str] | None] = ContextVar("named", default=None)
_ran: set[str] = set()


@contextmanager
def allow_code(allowed: bool = True) -> Iterator[None]:
    """Let files name code while the ``with`` block lasts; or not, if ``allowed`` is False."""
    token = _allowed.set(allowed)
    try:
        yield
    finally:
        _allowed.reset(token)


@contextmanager
def only_code_named_in(arguments: Iterable[str]) -> Iterator[None]:
    """Load no code while the ``with`` block lasts but what these arguments of a command name."""
    texts = [text.strip() for argument in arguments for text in argument.split(",")]
    parts = [part.strip() for text in texts for part in text.split("=")]
    found = [found[1] for part in parts if (found := RUNS_CODE.fullmatch(part))]
    models = [one for text in texts for one in (text, text.partition("=")[2].strip()) if one.endswith(".zip")]
    token = _named.set(frozenset([*found, *models]))
    try:
        yield
    finally:
        _named.reset(token)


def about_to_run(name: str) -> None:
    """Let code be loaded, and remember that it was.

    Args:
        name: ``module:attribute`` or the file of a model.

    Raises:
        UntrustedError: If a command runs whose arguments do not name it, and that is not allowed.
    """
    named = _named.get()
    if named is not None and name not in named and not _allowed.get():
        raise UntrustedError(f"{name!r:.80} would run code, and no argument names it; if you trust it, {HINT}")
    _ran.add(name)


def refuse_code(document: object, where: object, to_drive: Collection[str] = ()) -> None:
    """Refuse the content of a file that names code.

    Args:
        document: What was read from it.
        where: The file.
        to_drive: Places, keys joined by dots, that matter only where something is driven: they may name code, which
            whoever drives must refuse.

    Raises:
        UntrustedError: Naming the code and its place in the file, unless that is allowed or ran before.
    """
    if _allowed.get():
        return
    left_out = tuple(f"{place}." for place in to_drive)
    for place, text in _candidates(document, ""):
        found = None if f"{place}.".startswith(left_out) else RUNS_CODE.fullmatch(text)
        if found is not None and found[1] not in _ran | (_named.get() or frozenset()):
            raise UntrustedError(f"{where}: {place}: {text!r:.80} would run code; if you trust this file, {HINT}")


def modules_in(document: object) -> list[str]:
    """Return the modules that a document names as ``module:attribute``, each once, in order."""
    found = (RUNS_CODE.fullmatch(text) for _, text in _candidates(document, ""))
    names = (match[1] for match in found if match is not None and MODULE_ATTRIBUTE.fullmatch(match[1]))
    return list(dict.fromkeys(name.partition(":")[0] for name in names))


def _candidates(document: Any, place: str) -> Iterator[tuple[str, str]]:
    """Yield every text in a document that may match ``RUNS_CODE``, keys included, with its place."""
    if isinstance(document, str):
        if ":" in document or ".zip" in document:
            yield place, document
    elif isinstance(document, Mapping):
        for key, value in document.items():
            inner = f"{place}.{key}" if place else str(key)
            yield from _candidates(key, inner)
            if isinstance(value, CONTAINERS):
                yield from _candidates(value, inner)
    elif isinstance(document, list | tuple):
        for value in document:
            if isinstance(value, CONTAINERS):
                yield from _candidates(value, place)
