"""Archives of compiled kernels, with which an equal machine need not compile.

Machine code depends on the processor, on the versions of Python and numba, and on the source of every kernel that a
kernel calls. The archive states all of them, and another machine takes it only if all are equal; else it compiles.
"""

from __future__ import annotations

import hashlib
import io
import json
import lzma
import re
import sys
import tarfile
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from pathlib import Path

import llvmlite
import numba
from llvmlite import binding

from evolution.driving.kernel_files import enabled_kernels, files_of, sources
from evolution.files import counted, write_bytes
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.files.documents import parse_json

STATEMENT = "kernels.json"
"""First file of an archive: what its kernels were compiled from and for."""
KERNEL_FILE = re.compile(r"[\w.]+/[\w.<>-]+\.nb[ic]")
"""A file of an archive: a module's name and the name that numba gives to an index (``.nbi``) or machine code."""
MACHINE_CODE = re.compile(r"\.\d+\.nbc$")
"""Ending of a file of machine code; that of the kernel's index is in its place ``.nbi``."""
MAX_BYTES = 500_000_000
"""Largest size of all unpacked files of an archive; that of one machine has 21 MB."""
SHIPPED = "shipped_kernels"
"""Folder of the package ``gym_mapbench`` in which a wheel may have archives."""


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
    found = [(kernel.__module__, file) for kernel in enabled_kernels() for file in files_of(kernel)]
    if not found:
        raise RunError("no kernel is compiled; 'mapbench doctor' compiles those of the default controllers")
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w:xz") as archive:
        _add(archive, STATEMENT, json.dumps(statement(), indent=1).encode())
        for module, file in found:
            _add(archive, f"{module}/{file.name}", file.read_bytes())
    write_bytes(path, packed.getvalue())
    return f"wrote {counted(len(found), 'file')} of compiled kernels to {path} ({len(packed.getvalue()) / 1e6:.1f} MB)"


def import_kernels(path: Path) -> str:
    """Take the compiled kernels of an archive, and return what was taken in words.

    Machine code is a program: take archives only from people whom you trust. The index of a kernel is deleted before
    its machine code is replaced, and comes last: an index of other machine code would call it with wrong types.

    Raises:
        ConfigError: If the file is no archive of kernels, or its kernels are of another processor, version or source.
        RunError: If a file cannot be written.
    """
    folders = {kernel.__module__: Path(kernel.stats.cache_path) for kernel in enabled_kernels()}
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
    for name, source in sources():
        digest.update(name.encode() + b"\0" + source + b"\0")
    return digest.hexdigest()


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
