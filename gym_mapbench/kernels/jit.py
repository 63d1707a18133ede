"""The one way a kernel is compiled: cached on disk, IEEE arithmetic, no Python errors.

No fast-math: the same inputs give the same bits on every machine of one architecture.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numba


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile ``function`` when it is first called, for the types of its arguments."""
    compiled = numba.njit(cache=True, error_model="numpy", nogil=True)(function)
    return cast(Callable[..., Any], compiled)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile ``function`` into its callers; for scalar arithmetic inside loops that have to be vectorised."""
    compiled = numba.njit(inline="always", error_model="numpy", nogil=True)(function)
    return cast(Callable[..., Any], compiled)


def plain(compiled: Callable[..., Any]) -> Callable[..., Any]:
    """Return the Python function that a kernel was compiled from: the same formula and bits, for single calls."""
    return cast(Callable[..., Any], compiled.py_func)  # type: ignore[attr-defined]
