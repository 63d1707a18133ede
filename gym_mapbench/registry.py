"""Registry: things of one kind by name, the project's own and those of third parties.

A name is looked for in this order:

1. what the project brings, and what a script or notebook added with :meth:`Registry.register`;
2. ``module:attribute``: that attribute of that module, which is imported; the current directory is searched too;
3. entry points of installed packages, in the group ``gym_mapbench.<plural>``.

The second form needs no packaging, is plain text in every configuration file, and means the same in every worker
process. It runs the code of the module, so a file that names one is refused unless the user allows it
(:mod:`gym_mapbench.trust`).
"""

from __future__ import annotations

import importlib
import inspect
import logging
import os
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, chdir, contextmanager, nullcontext
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Generic, TypeVar

from gym_mapbench.errors import ConfigError, MapBenchError, PluginError, nearest_name, unknown_name, visible
from gym_mapbench.trust import MODULE_ATTRIBUTE, about_to_run

T = TypeVar("T")

LOG = logging.getLogger(__name__)
"""Gets the traceback of every error of a third party's code, at level ``INFO``."""
ROOMS = (Path(__file__).parents[1] / name for name in ("gym_mapbench", "controllers", "evolution"))
LIBRARIES = (*(f"{room}{os.sep}" for room in ROOMS), *(sysconfig.get_path(kind) for kind in ("stdlib", "purelib")))
"""Beginnings of the file names of code that a third party calls."""
BY_NAME = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
"""Kinds of parameters that are given by keyword."""
MAIN = "__main__:"
"""Beginning of the name of what a script or notebook defines."""
UNBLAMED = nullcontext()
"""Where the entry is the project's own."""


def as_it_is(entry: Any) -> Any:
    """Accept whatever a third party registers."""
    return entry


def must_be_callable(entry: Any) -> Any:
    """Accept what can be called; raises ``ConfigError`` otherwise."""
    if not callable(entry):
        raise ConfigError(f"expected something that can be called, got {type(entry).__name__}")
    return entry


def must_be(kind: type[T]) -> Callable[[Any], T]:
    """Return a check that accepts values of one type and raises ``ConfigError`` on others."""

    def check(entry: Any) -> T:
        if not isinstance(entry, kind):
            raise ConfigError(f"expected {kind.__name__}, got {type(entry).__name__}")
        return entry

    return check


def must_be_subclass(kind: type[T]) -> Callable[[Any], type[T]]:
    """Return a check that accepts subclasses of a class and raises ``ConfigError`` on others."""

    def check(entry: Any) -> type[T]:
        if not (isinstance(entry, type) and issubclass(entry, kind)):
            raise ConfigError(f"expected a subclass of {kind.__module__}.{kind.__name__}, got {entry!r:.80}")
        return entry

    return check


class Registry(Generic[T]):
    """Things of one kind by name.

    Args:
        what: The kind, e.g. ``"noise level"``; opens error messages.
        plural: Its plural, in one word: ``noise_levels`` gives the entry point group ``gym_mapbench.noise_levels``.
        built_in: What the project brings, in order.
        check: Makes an entry of what a third party registered; raises ``ConfigError`` if that cannot be one.

    Attributes:
        built_in: Names of what the project brings, in order.
    """

    def __init__(
        self, what: str, plural: str, built_in: Mapping[str, T], *, check: Callable[[Any], T] = as_it_is
    ) -> None:
        self.what = what
        self.group = f"gym_mapbench.{plural}"
        self.built_in = tuple(built_in)
        self._entries = dict(built_in)
        self._check = check

    def register(self, name: str, entry: Any = None) -> Any:
        """Add an entry for as long as this process lives; without ``entry``, return a decorator that does.

        Worker processes know nothing of it: what they need is named ``module:attribute``.

        Args:
            name: Its name; one that was registered before is replaced, so that a cell can be run twice.
            entry: The entry.

        Returns:
            What was registered, as it came.

        Raises:
            ConfigError: If the name is no text, the project itself has an entry of it, or the entry cannot be one.
        """
        if not isinstance(name, str):
            raise ConfigError(f"{self.what}: expected register(NAME, ENTRY) or @register(NAME), got {name!r:.80}")
        if entry is None:
            return lambda decorated: self.register(name, decorated)
        if name in self.built_in or ":" in name:
            raise ConfigError(f"{self.what} {name!r}: expected a new name without ':'")
        self._entries[name] = self._checked(name, entry)
        return entry

    def for_workers(self, name: str) -> str:
        """Return a name that worker processes will have to find.

        Raises:
            ConfigError: If it was registered, or is defined in the script or notebook, of which workers know nothing.
        """
        registered = name in self._entries and name not in self.built_in
        if registered or name.startswith(MAIN):
            known = "registered in this process" if registered else "defined in this script or notebook"
            raise ConfigError(
                f"{self.what} {name!r}: is {known} alone; for worker processes write it into a file and name it "
                "module:attribute, or give it an entry point"
            )
        return name

    def names(self) -> tuple[str, ...]:
        """All names there are, sorted, those of installed packages included; nothing is imported."""
        return tuple(sorted({*self._entries, *self._points()}))

    def __iter__(self) -> Iterator[str]:
        return iter(self.names())

    def __contains__(self, name: object) -> bool:
        return name in self._entries or name in self._points()

    def added(self) -> tuple[str, ...]:
        """Names of everything but what the project brings, sorted; nothing is imported."""
        return tuple(name for name in self.names() if name not in self.built_in)

    def get(self, name: str, others: Iterable[str] = ()) -> T:
        """Return an entry by name.

        Args:
            name: Its name, or ``module:attribute``.
            others: Names that would have been accepted besides; they stand in the error message.

        Raises:
            ConfigError: If there is none, with the nearest valid name, or several packages have it, or it cannot be
                loaded.
        """
        if name in self._entries:
            return self._entries[name]
        if MODULE_ATTRIBUTE.fullmatch(name):
            return self._checked(name, self._load(name, name))
        points = self._points()
        if name in points:
            return self._checked(name, self._load(name, self._only(name, points[name])))
        raise unknown_name(self.what, name, {*self._entries, *points, *others})

    def __getitem__(self, name: str) -> T:
        return self.get(name)

    def blamed(self, name: str, passing: type[Exception] = MapBenchError) -> AbstractContextManager[None]:
        """Say in one line that a third party's entry failed, why, and in which line of it.

        Errors of this project pass as they are, and so does whatever its own entries raise.

        Args:
            name: Name of the entry.
            passing: Errors that pass as well.

        Raises:
            PluginError: Instead of whatever else is raised inside.
        """
        return UNBLAMED if name in self.built_in else self._blamed(name, passing)

    @contextmanager
    def _blamed(self, name: str, passing: type[Exception]) -> Iterator[None]:
        try:
            yield
        except (MapBenchError, passing):
            raise
        except (Exception, SystemExit) as error:
            raise PluginError(f"{self.what} {name!r}: {describe(error)}") from error

    def _points(self) -> dict[str, list[str]]:
        """Return ``module:attribute`` of all entry points by name; packages may have given one name to several."""
        points: dict[str, list[str]] = {}
        for point in entry_points(group=self.group):
            points.setdefault(point.name, []).append(point.value)
        return points

    def _only(self, name: str, values: list[str]) -> str:
        """Return the only one of some entry points; which one was meant by the name of several is not known."""
        different = sorted(set(values))
        if len(different) > 1:
            got = " and ".join(different)
            raise ConfigError(
                f"{self.what} {name!r}: expected one installed package with this name, got {got}; use these"
            )
        return different[0]

    def _load(self, name: str, value: str) -> Any:
        """Import what ``module:attribute`` stands for."""
        if name == value:
            about_to_run(name)
        try:
            return load_attribute(value)
        except ConfigError as error:
            where = "" if name == value else f": {value}"
            raise ConfigError(f"{self.what} {name!r}{where} cannot be loaded ({error})") from error

    def _checked(self, name: str, entry: Any) -> T:
        try:
            return self._check(entry)
        except ConfigError as error:
            raise ConfigError(f"{self.what} {name!r}: {error}") from None


def load_attribute(value: str) -> Any:
    """Import ``module:attribute``; the current directory is searched as well, as by ``python -m``.

    Raises:
        ConfigError: If the module cannot be imported, whatever it raises, or has no such attribute.
    """
    module_name, _, path = value.partition(":")
    if not {"", os.getcwd()} & set(sys.path):
        sys.path.append(os.getcwd())
    try:
        with chdir(os.getcwd()):  # a module may change the directory, in which the caller's paths begin
            found: Any = importlib.import_module(module_name)
    except (Exception, SystemExit) as error:
        raise ConfigError(describe(error)) from error
    for part in path.split("."):
        if not hasattr(found, part):
            near = nearest_name(part, dir(found))
            hint = f"; did you mean {near!r}?" if near else ""
            raise ConfigError(f"{module_name} has no {part!r}{hint}")
        found = getattr(found, part)
    return found


def parameters_of(function: Callable[..., Any]) -> list[inspect.Parameter]:
    """Return the parameters of ``function`` in order; none where it has no signature."""
    try:
        return list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):
        return []


def accepted_keywords(function: Callable[..., Any]) -> frozenset[str]:
    """Return the names that ``function`` takes by keyword; none where it has no signature."""
    return frozenset(one.name for one in parameters_of(function) if one.kind in BY_NAME)


def takes_any_keyword(function: Callable[..., Any]) -> bool:
    """Whether ``function`` has ``**keywords``."""
    return any(one.kind is inspect.Parameter.VAR_KEYWORD for one in parameters_of(function))


def required_keywords(function: Callable[..., Any]) -> frozenset[str]:
    """Return the names that ``function`` cannot be called without; none where it has no signature."""
    given = (one for one in parameters_of(function) if one.kind in BY_NAME)
    return frozenset(one.name for one in given if one.default is inspect.Parameter.empty)


def type_and_text(error: BaseException) -> str:
    """Return type and text of an error in one line; the type alone if it has no text, or fails to give it."""
    try:
        text = " ".join(str(error).split())
    except Exception:
        text = ""
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def describe(error: BaseException) -> str:
    """Say type, text and place of an error in one line: the last place outside this project and installed packages.

    The log gets the traceback, as the author of the code needs it.
    """
    LOG.info("%s", visible("".join(traceback.format_exception(error)).rstrip(), "\n"))
    text = type_and_text(error)
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if not _is_machinery(frame.filename)]
    own = [frame for frame in frames if not frame.filename.startswith(LIBRARIES)]
    return f"{text}, {Path((own or frames)[-1].filename).name} line {(own or frames)[-1].lineno}" if frames else text


def _is_machinery(file: str) -> bool:
    """Whether a line of this file says nothing about where a third party's code failed."""
    return file in (__file__, importlib.__file__) or file.startswith("<frozen")
