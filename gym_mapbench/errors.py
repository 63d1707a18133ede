"""The error tree.

::

    MapBenchError                  everything a caller may want to catch; its text is one clear line
    |-- ConfigError (ValueError)   a key, a value or a combination of options
    |   |-- ArgumentError          an argument of a function, which an option of a command gives
    |   `-- UntrustedError         code that a file names and the user does not
    |-- MapFormatError (ValueError)    a file that is not in the format that its name states
    |-- PlanningError              a global planner could not answer
    |   `-- NoPathError            start and goal are not connected
    |       |-- EndpointError      start or goal is off the map or in an obstacle
    |       `-- UnsafeEndpointError  start or goal is too near an obstacle
    |-- SmoothingError             a path smoother could not smooth a path
    |-- RunError                   a run directory, a store or a worker
    `-- PluginError                code that a user added and that failed
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable

NEAR = 0.6
"""Similarity, 0 to 1, from which on a name counts as a misspelling of another."""

MOST_NAMES = 40
"""Beside the nearest name, an error lists all accepted names if they are at most so many."""

MAX_LENGTH = 2000
"""Longest text of an error; the middle of a longer one is left out."""


class MapBenchError(Exception):
    """Base of every error this project raises on purpose; its text is one line, whatever came from a file."""

    def __str__(self) -> str:
        text = visible(super().__str__())
        return text if len(text) <= MAX_LENGTH else f"{text[: MAX_LENGTH - 500]} ... {text[-400:]}"


def visible(text: str, but: str = "") -> str:
    r"""Write everything in a text that a terminal would not show, or would obey, as ``\x1b`` and the like.

    Args:
        text: The text.
        but: Characters to leave as they are.
    """
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() or one in but else one.encode("unicode_escape").decode() for one in text)


class ConfigError(MapBenchError, ValueError):
    """A key, a value, or a combination of options that cannot be used."""


class ArgumentError(ConfigError):
    """A problem with an argument of a function that an option of a command gives as well.

    Args:
        argument: Name of the argument.
        problem: What was expected, and what came.
        option: Name of the option without ``--``; as the argument if empty.
    """

    def __init__(self, argument: str, problem: str, option: str = "") -> None:
        super().__init__(f"{argument}: {problem}")
        self._option = option or argument
        self._problem = problem

    def of_option(self) -> ConfigError:
        """Return the error as a user of the command knows it, with the name of the option."""
        return ConfigError(f"--{self._option}: {self._problem}")


class UntrustedError(ConfigError):
    """A file names code that would run, and nobody has asked for it."""


class MapFormatError(MapBenchError, ValueError):
    """A file that is missing, truncated, oversized, or not in the format that its name states."""


class PlanningError(MapBenchError):
    """A global planner could not answer."""


class NoPathError(PlanningError):
    """Start and goal are not connected on this costmap."""


class EndpointError(NoPathError):
    """Start or goal is off the map or in an obstacle; Nav2 Jazzy tries no recovery for this."""


class UnsafeEndpointError(NoPathError):
    """Start or goal is too near an obstacle or unknown, and Nav2's planner does not say which: recoveries are tried."""


class SmoothingError(MapBenchError):
    """A path smoother could not smooth a path (Nav2's ``FailedToSmoothPath``)."""


class RunError(MapBenchError):
    """A run directory, a result store or a worker that cannot be used."""


class PluginError(MapBenchError):
    """Something a user added (a metric, a fitness, a reader of maps...) that failed or returned nonsense."""


def nearest_name(name: str, valid: Iterable[str], cutoff: float = NEAR) -> str | None:
    """Return the valid name most similar to ``name``, None if none is similar; the order of words does not count.

    A name all of whose words occur in a valid one is similar to it, as ``burger`` is to ``turtlebot3_burger``.

    Args:
        name: The name that was given.
        valid: The names that are accepted.
        cutoff: Least similarity, 0 to 1.
    """

    def likeness(other: str) -> float:
        words, others = _words(name), _words(other)
        pairs = ((name, other), ("_".join(words), "_".join(others)))
        contained = NEAR if set(words) <= set(others) else 0.0
        return max(contained, *(difflib.SequenceMatcher(None, *pair).ratio() for pair in pairs))

    best = max(sorted(valid), key=likeness, default=None)
    return best if best is not None and likeness(best) >= cutoff else None


def _words(name: str) -> list[str]:
    return sorted(name.lower().replace(".", "_").split("_"))


def unknown_name(what: str, name: object, valid: Iterable[str]) -> ConfigError:
    """Build the error for a name that is not in ``valid``, with the nearest valid one, and all if they are few.

    Args:
        what: What the name stands for, e.g. ``"controller"``.
        name: The name that was given.
        valid: The names that are accepted.
    """
    names = sorted(valid)
    near = nearest_name(str(name), names)
    hint = f"; did you mean {near!r}?" if near else ""
    listed = "" if near and len(names) > MOST_NAMES else f" (expected one of: {', '.join(names)})"
    return ConfigError(f"unknown {what} {str(name)!r}{hint}{listed}")


def refuse_unknown(what: str, name: object, valid: Collection[str]) -> None:
    """Refuse a name that is not in ``valid``; the arguments are those of :func:`unknown_name`.

    Raises:
        ConfigError: With the nearest valid name.
    """
    if name not in valid:
        raise unknown_name(what, name, valid)
