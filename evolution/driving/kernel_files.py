"""Compiled kernels as files: where numba keeps them."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Any

import controllers
import gym_mapbench
from evolution.files import counted
from gym_mapbench.errors import ConfigError, RunError

LOG = logging.getLogger(__name__)
COMPILED = ("*.nbi", "*.nbc")
"""Files of a compiled kernel: its index, and its machine code for some types of arguments."""
MARK = b"@kernel\n"
"""What stands before a kernel in its module."""


def is_compiling_off() -> bool:
    """Whether ``NUMBA_DISABLE_JIT`` tells numba to compile nothing; it then names no folder."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") != "0"


@cache
def kernels() -> tuple[Any, ...]:
    """Return all functions of this project that numba compiles and keeps on disk."""
    return tuple(kernel for name, source in sources() if MARK in source for kernel in _kernels_of(name))


def _kernels_of(name: str) -> Iterator[Any]:
    """Yield the kernels that a module defines."""
    for entry in vars(import_module(name)).values():
        if hasattr(entry, "py_func") and entry.stats.cache_path and entry.__module__ == name:
            yield entry


def sources() -> Iterator[tuple[str, bytes]]:
    """Yield the names and sources of all modules that may have kernels."""
    for package in (gym_mapbench, controllers):
        root = Path(str(files(package)))
        for path in sorted(root.rglob("*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            yield ".".join([package.__name__, *parts]).removesuffix(".__init__"), path.read_bytes()


def files_of(kernel: Any) -> list[Path]:
    """Return the files that numba keeps for a kernel: its index, and machine code for each types of its arguments."""
    function = kernel.py_func
    pattern = f"*.{function.__qualname__}-{function.__code__.co_firstlineno}.*.nb[ic]"
    return sorted(Path(kernel.stats.cache_path).glob(pattern))


def compiled_kernels() -> tuple[int, int]:
    """Return how many kernels of this project are compiled on this machine, and how many there are.

    Raises:
        ConfigError: If ``NUMBA_DISABLE_JIT`` is set, with which numba compiles nothing.
    """
    found = enabled_kernels()
    for folder in sorted({kernel.stats.cache_path for kernel in found}):
        LOG.info("%s: numba keeps compiled kernels here", folder)
    return sum(bool(files_of(kernel)) for kernel in found), len(found)


def clear_kernels() -> str:
    """Delete all compiled kernels of this machine, and return how many there were in words.

    The folders are those in which numba keeps them, ``NUMBA_CACHE_DIR`` included.

    Raises:
        ConfigError: If ``NUMBA_DISABLE_JIT`` is set, with which numba names no folder.
        RunError: If a file cannot be deleted.
    """
    folders = {Path(kernel.stats.cache_path) for kernel in enabled_kernels()}
    found = [path for folder in sorted(folders) for kind in COMPILED for path in sorted(folder.glob(kind))]
    size = sum(path.stat().st_size for path in found)
    for path in found:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise RunError(f"{path}: could not be deleted ({error.strerror})") from error
    count = sum(path.suffix == ".nbi" for path in found)
    return f"deleted {counted(count, 'compiled kernel')} ({size / 1e6:.1f} MB in {counted(len(found), 'file')})"


def enabled_kernels() -> tuple[Any, ...]:
    """Return all kernels.

    Raises:
        ConfigError: If ``NUMBA_DISABLE_JIT`` is set, with which numba compiles nothing and names no folder.
    """
    if is_compiling_off():
        raise ConfigError("expected NUMBA_DISABLE_JIT not to be set, as numba then names no folder")
    return kernels()
