"""The error tree.

::

    MapBenchError                  everything a caller may want to catch; its text is one clear line
    |-- ConfigError (ValueError)   a key, a value or a combination of options
    |-- MapFormatError (ValueError)    a file that is not what it claims to be
    |-- PlanningError              a global planner could not answer
    |   `-- NoPathError            start and goal are not connected
    `-- RunError                   a run directory, a store or a worker
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class MapBenchError(Exception):
    """Base of every error this project raises on purpose."""


class ConfigError(MapBenchError, ValueError):
    """A key, a value, or a combination of options that cannot be used."""


class MapFormatError(MapBenchError, ValueError):
    """A file that is missing, truncated, oversized, or not in the format it claims."""


class PlanningError(MapBenchError):
    """A global planner could not answer."""


class NoPathError(PlanningError):
    """Start and goal are not connected on this costmap."""


class RunError(MapBenchError):
    """A run directory, a result store or a worker that cannot be used."""


def unknown_name(what: str, name: object, valid: Iterable[str]) -> ConfigError:
    """Build the error for a name that is not in ``valid``, with the nearest valid one.

    Args:
        what: What the name stands for, e.g. ``"controller"``.
        name: What came.
        valid: What would have been accepted.
    """
    names = sorted(valid)
    near = difflib.get_close_matches(str(name), names, n=1, cutoff=0.5)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    return ConfigError(f"unknown {what} {str(name)!r}{hint} (expected one of: {', '.join(names)})")
