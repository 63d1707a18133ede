"""The search over env configs: driving, evolution, benchmarks, studies and the command ``mapbench``.

::

    from evolution import atlas, bench, compare, configuration_of, evolve, load, minimize, study, train, tune
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from evolution.api import atlas, bench, compare, configuration_of, evolve, load, minimize, study, train, tune

__all__ = ["atlas", "bench", "compare", "configuration_of", "evolve", "load", "minimize", "study", "train", "tune"]


def __getattr__(name: str) -> Any:
    """Load the functions at first use, so that importing one module does not load the whole package."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from evolution import api

    return getattr(api, name)
