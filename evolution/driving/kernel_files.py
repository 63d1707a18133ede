"""Compiled kernels as files: where numba keeps them, and an archive with which an equal machine need not compile.

Machine code depends on the processor, on the versions of Python and numba, and on the source of every kernel that a
kernel calls. The archive states all of them, and another machine takes it only if all are equal; else it compiles.
"""

from __future__ import annotations

import hashlib
import io
import json
import logging
import lzma
import os
import re
import sys
import tarfile
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Any

import llvmlite
import numba
from llvmlite import binding

import controllers
import gym_mapbench
from evolution.files import counted, write_bytes
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.files.documents import parse_json

LOG = logging.getLogger(__name__)
STATEMENT = "kernels.json"
"""First file of an archive: what its kernels were compiled from and for."""
COMPILED = ("*.nbi", "*.nbc")
"""Files of a compiled kernel: its index, and its machine code for some types of arguments."""
KERNEL_FILE = re.compile(r"[\w.]+/[\w.<>-]+\.nb[ic]")
"""A file of an archive: a module's name and the name that numba gives to an index (``.nbi``) or machine code."""
MACHINE_CODE = re.compile(r"\.\d+\.nbc$")
"""Ending of a file of machine code; that of the kernel's index is in its place ``.nbi``."""
MAX_BYTES = 500_000_000
"""Largest size of all unpacked files of an archive; that of one machine has 21 MB."""
MARK = b"@kernel\n"
"""What stands before a kernel in its module."""
SHIPPED = "shipped_kernels"
"""Folder of the package ``gym_mapbench`` in which a wheel may have archives."""


def is_compiling_off() -> bool:
    """Whether ``NUMBA_DISABLE_JIT`` tells numba to compile nothing; it then names no folder."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") != "0"


@cache
def kernels() -> tuple[Any, ...]:
    """Return all functions of this project that numba compiles and keeps on disk."""
    return tuple(kernel for name, source in _sources() if MARK in source for kernel in _kernels_of(name))


def _kernels_of(name: str) -> Iterator[Any]:
    """Yield the kernels that a module defines."""
    for entry in vars(import_module(name)).values():
        if hasattr(entry, "py_func") and entry.stats.cache_path and entry.__module__ == name:
            yield entry


def _sources() -> Iterator[tuple[str, bytes]]:
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
    found = _enabled_kernels()
    for folder in sorted({kernel.stats.cache_path for kernel in found}):
        LOG.info("%s: numba keeps compiled kernels here", folder)
    return sum(bool(files_of(kernel)) for kernel in found), len(found)


def export_kernels(path: Path) -> str:
    """Write all compiled kernels of this machine into an archive (``.tar.xz``), and return what was written in words.

    Args:
        path: The file; it must not exist.

    Raises:
        ConfigError: If the file exists, or numba compiles nothing.
        RunError: If no kernel is compiled, or the file cannot be written.
    """
    if path.exists():
        raise ConfigError(f"--out: expected a new file, got {str(path)!r}, which exists")
    found = [(kernel.__module__, file) for kernel in _enabled_kernels() for file in files_of(kernel)]
    if not found:
        raise RunError("no kernel is compiled; 'mapbench doctor' compiles those of the default controllers")
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w:xz") as archive:
        _add(archive, STATEMENT, json.dumps(statement(), indent=1).encode())
        for module, file in found:
            _add(archive, f"{module}/{file.name}", file.read_bytes())
    write_bytes(path, packed.getvalue())
    return f"wrote {counted(len(found), 'file')} of compiled kernels to {path} ({len(packed.getvalue()) / 1e6:.1f} MB)"


def clear_kernels() -> str:
    """Delete all compiled kernels of this machine, and return how many there were in words.

    The folders are those in which numba keeps them, ``NUMBA_CACHE_DIR`` included.

    Raises:
        ConfigError: If ``NUMBA_DISABLE_JIT`` is set, with which numba names no folder.
        RunError: If a file cannot be deleted.
    """
    folders = {Path(kernel.stats.cache_path) for kernel in _enabled_kernels()}
    found = [path for folder in sorted(folders) for kind in COMPILED for path in sorted(folder.glob(kind))]
    size = sum(path.stat().st_size for path in found)
    for path in found:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise RunError(f"{path}: could not be deleted ({error.strerror})") from error
    count = sum(path.suffix == ".nbi" for path in found)
    return f"deleted {counted(count, 'compiled kernel')} ({size / 1e6:.1f} MB in {counted(len(found), 'file')})"


def import_kernels(path: Path) -> str:
    """Take the compiled kernels of an archive, and return what was taken in words.

    Machine code is a program: take archives only from people whom you trust. The index of a kernel is deleted before
    its machine code is replaced, and comes last: an index of other machine code would call it with wrong types.

    Raises:
        ConfigError: If the file is no archive of kernels, or its kernels are of another processor, version or source.
        RunError: If a file cannot be written.
    """
    folders = {kernel.__module__: Path(kernel.stats.cache_path) for kernel in _enabled_kernels()}
    taken = 0
    for name, content in _contents(path):
        module, _, file = name.partition("/")
        if module not in folders:
            raise ConfigError(f"{path}: expected kernels of this version, got a kernel of the module {module}")
        (folders[module] / MACHINE_CODE.sub(".nbi", file)).unlink(missing_ok=True)
        write_bytes(folders[module] / file, content)
        taken += 1
    return f"took {counted(taken, 'file')} of compiled kernels from {path}"


def import_shipped_kernels() -> bool:
    """Take the kernels that came with the package, if they are this machine's; return whether there were any."""
    folder = files("gym_mapbench") / SHIPPED
    for entry in sorted(folder.iterdir(), key=lambda one: one.name) if folder.is_dir() else ():
        if isinstance(entry, Path) and _stated(entry) == statement():
            import_kernels(entry)
            return True
    return False


@cache
def statement() -> dict[str, str]:
    """Return what the machine code of this installation depends on."""
    return {
        "format": "mapbench-kernels-1",
        "python": f"{sys.implementation.name} {sys.version_info.major}.{sys.version_info.minor}",
        "numba": numba.__version__,
        "llvmlite": llvmlite.__version__,
        "processor": f"{binding.get_default_triple()} {binding.get_host_cpu_name()}",
        "features": binding.get_host_cpu_features().flatten(),
        "sources": _digest_of_sources(),
    }


def _digest_of_sources() -> str:
    """Return a digest of all modules that may have kernels; numba itself compares only a kernel's own module."""
    digest = hashlib.sha256()
    for name, source in _sources():
        digest.update(name.encode() + b"\0" + source + b"\0")
    return digest.hexdigest()


def _enabled_kernels() -> tuple[Any, ...]:
    if is_compiling_off():
        raise ConfigError("expected NUMBA_DISABLE_JIT not to be set, as numba then names no folder")
    return kernels()


def _add(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    """Add a file to an archive, without its time and owner."""
    entry = tarfile.TarInfo(name)
    entry.size = len(content)
    archive.addfile(entry, io.BytesIO(content))


def _contents(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the names and contents of an archive's kernels, after a comparison of what they depend on."""
    _refuse_other(path, _stated(path))
    for name, content in _members(path):
        if name != STATEMENT:
            if not KERNEL_FILE.fullmatch(name):
                raise ConfigError(f"{path}: expected files of compiled kernels, got {name!r}")
            yield name, content


def _stated(path: Path) -> dict[str, str]:
    """Return what an archive says that its kernels depend on."""
    name, content = next(_members(path), ("", b""))
    if name != STATEMENT:
        raise ConfigError(f"{path}: expected an archive of 'mapbench kernels export', got another archive")
    stated = parse_json(content.decode(errors="replace"), f"{path}: {STATEMENT}", ConfigError)
    if not isinstance(stated, dict):
        raise ConfigError(f"{path}: {STATEMENT}: expected a mapping, got {type(stated).__name__}")
    return stated


def _members(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the names and contents of all files in an archive."""
    left = MAX_BYTES
    try:
        with tarfile.open(path, "r:xz") as archive:
            for entry in archive:
                left -= entry.size
                content = archive.extractfile(entry) if entry.isreg() else None
                if content is None or left < 0:
                    raise ConfigError(f"{path}: expected files of {MAX_BYTES} bytes at most, got {entry.name!r}")
                yield entry.name, content.read()
    except OSError as error:
        raise ConfigError(f"{path}: could not be read ({error.strerror or error})") from error
    except (tarfile.TarError, EOFError, lzma.LZMAError) as error:
        raise ConfigError(f"{path}: expected an archive of 'mapbench kernels export' ({error})") from error


def _refuse_other(path: Path, stated: dict[str, str]) -> None:
    for name, expected in statement().items():
        if stated.get(name) != expected:
            raise ConfigError(f"{path}: expected kernels for {name} {_short(expected)}, got {_short(stated.get(name))}")


def _short(value: object) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
