"""The one way a kernel is compiled: cached on disk, IEEE arithmetic, no Python errors.

No fast-math: the same inputs give the same bits on every machine of one architecture. A constant argument is a type of
its own to numba; where a kernel is called with constants and variables, ``np.int64(0)`` saves compiling it twice. To
assign an array to a part of another takes three seconds to compile, because its error message is compiled, too; a loop
takes nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any, NoReturn, cast

import numba

OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True}
NOT_FROM_C: dict[str, Any] = {"no_cfunc_wrapper": True}
"""Leaves out the entry for callers in C."""


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile ``function`` when it is first called, for the types of its arguments.

    With ``NUMBA_DISABLE_JIT`` the call raises ``OSError``: kernels read records in a way that only numba can.

    Raises:
        OSError: If numba finds no folder for compiled kernels.
    """
    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        return _refusing(function)
    try:
        compiled = numba.njit(cache=True, **OPTIONS, **NOT_FROM_C)(function)
    except RuntimeError as error:
        expected = "expected a folder for compiled kernels; set NUMBA_CACHE_DIR to a writable one"
        raise OSError(f"{expected} ({error})") from None
    _keep_if_possible(compiled._cache)
    return cast(Callable[..., Any], compiled)


def _keep_if_possible(cache: Any) -> None:
    """Let numba go on with a kernel that it cannot write to the disk, for example because the disk is full."""
    write = cache.save_overload

    def save_overload(*overload: Any) -> None:
        with suppress(OSError):
            write(*overload)

    cache.save_overload = save_overload


def _refusing(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a kernel that is not compiled, and cannot be called."""

    def refuse(*_: Any) -> NoReturn:
        raise OSError("expected NUMBA_DISABLE_JIT not to be set, as kernels run only if they are compiled")

    refuse.py_func = function  # type: ignore[attr-defined]
    return refuse


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile ``function`` into its callers; for scalar arithmetic inside loops that have to be vectorised."""
    compiled = numba.njit(inline="always", **OPTIONS)(function)
    return cast(Callable[..., Any], compiled)


def plain(compiled: Callable[..., Any]) -> Callable[..., Any]:
    """Return the Python function that a kernel was compiled from: the same formula and bits, for single calls."""
    return cast(Callable[..., Any], compiled.py_func)  # type: ignore[attr-defined]
