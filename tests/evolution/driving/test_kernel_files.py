"""Compiled kernels as an archive: taken over to the bit, and refused where they are not this machine's."""

import errno
import io
import json
import os
import re
import subprocess
import sys
import tarfile

import pytest

from evolution.cli import main
from evolution.commands import kernels as command
from evolution.driving import kernel_archive, kernel_files
from evolution.files.plain import WriteError
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.kernels.jit import kernel

CALL = """
import sys
import numpy as np
from pathlib import Path
from evolution.driving import export_kernels, import_kernels
from gym_mapbench.kernels.geometry import wrap_angle
action, path = sys.argv[1], Path(sys.argv[2])
if action == "import":
    print(import_kernels(path))
print(wrap_angle(10.0).hex(), sum(wrap_angle.stats.cache_hits.values()), sum(wrap_angle.stats.cache_misses.values()))
if action == "export":
    print(export_kernels(path))
"""


def call(action, path, folder):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
    command = [sys.executable, "-c", CALL, action, str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout.splitlines()


def test_kernels_of_an_archive_are_used_without_compiling(tmp_path):
    archive = tmp_path / "kernels.tar.xz"
    fresh, wrote = call("export", archive, tmp_path / "one")
    took, used = call("import", archive, tmp_path / "two")
    value, hits, misses = fresh.split()
    assert (hits, misses) == ("0", "1")
    assert used.split() == [value, "1", "0"]
    assert re.match(r"wrote 2 files of compiled kernels to .* \(0\.0 MB\)", wrote)
    assert took == f"took 2 files of compiled kernels from {archive}"


@pytest.fixture
def archive(tmp_path, monkeypatch):
    """Return a function that writes an archive with some files, and with what its kernels depend on changed."""
    folder = tmp_path / "cache"
    folder.mkdir()
    monkeypatch.setattr(kernel_files, "kernels", lambda: (Kernel(folder),))

    def write(entries=(), **changes):
        path = tmp_path / "kernels.tar.xz"
        with tarfile.open(path, "w:xz") as packed:
            stated = json.dumps({**kernel_archive.statement(), **changes}).encode()
            for name, content in [(kernel_archive.STATEMENT, stated), *entries]:
                entry = tarfile.TarInfo(name)
                entry.size = len(content)
                packed.addfile(entry, io.BytesIO(content))
        return path

    return write


class Kernel:
    __module__ = "gym_mapbench.kernels.geometry"

    def __init__(self, folder):
        self.stats = type("Stats", (), {"cache_path": str(folder)})
        self.py_func = wrap


def wrap():
    """Stand in for a kernel."""


def test_shipped_kernels_are_taken_if_they_are_this_machines(archive, tmp_path, monkeypatch):
    monkeypatch.setattr(kernel_archive, "files", lambda package: tmp_path)
    assert not kernel_archive.import_shipped_kernels()
    shipped = tmp_path / kernel_archive.SHIPPED
    shipped.mkdir()
    name = "gym_mapbench.kernels.geometry/geometry.wrap-1.py311.nbi"
    archive([(name, b"index")], processor="another").rename(shipped / "a.tar.xz")
    assert not kernel_archive.import_shipped_kernels()
    archive([(name, b"index")]).rename(shipped / "b.tar.xz")
    assert kernel_archive.import_shipped_kernels()
    assert (tmp_path / "cache/geometry.wrap-1.py311.nbi").read_bytes() == b"index"


def test_an_import_that_is_interrupted_leaves_no_index_of_other_machine_code(archive, tmp_path, monkeypatch):
    """Numba would run the new machine code with the types of arguments that the old index states."""
    names = [f"gym_mapbench.kernels.geometry/geometry.wrap-1.py311.{kind}" for kind in ("1.nbc", "2.nbc", "nbi")]
    path = archive([(name, b"new") for name in names])
    kernel_archive.import_kernels(path)
    folder = tmp_path / "cache"
    assert {file.read_bytes() for file in folder.iterdir()} == {b"new"}
    assert len(list(folder.iterdir())) == 3

    def full(file, content):
        if file.name.endswith("2.nbc"):
            raise WriteError(f"{file}: cannot be written (No space left on device)")
        file.write_bytes(content)

    monkeypatch.setattr(kernel_archive, "write_bytes", full)
    with pytest.raises(WriteError, match="No space left"):
        kernel_archive.import_kernels(path)
    assert not list(folder.glob("*.nbi"))


@pytest.mark.parametrize("changed", ["numba", "python", "processor", "features", "sources", "format"])
def test_kernels_for_something_else_are_refused(archive, tmp_path, changed):
    path = archive([("gym_mapbench.kernels.geometry/a.nbi", b"index")], **{changed: "another"})
    with pytest.raises(ConfigError, match=rf"expected kernels for {changed} .*, got another$"):
        kernel_archive.import_kernels(path)
    assert not list((tmp_path / "cache").iterdir())


@pytest.mark.parametrize(
    "name",
    ["../geometry.nbi", "/etc/passwd", "gym_mapbench.kernels.geometry/../../a.nbi", "a/b.py", "other.module/a.nbi"],
)
def test_other_files_in_an_archive_are_refused(archive, tmp_path, name):
    with pytest.raises(ConfigError, match=r"expected (files of compiled kernels|kernels of this version), got"):
        kernel_archive.import_kernels(archive([(name, b"")]))
    assert not list((tmp_path / "cache").iterdir())


@pytest.mark.parametrize("content", [b"", b"no archive", bytes.fromhex("fd377a585a000004e6d6b446")])
def test_a_file_that_is_no_archive_is_one_line(tmp_path, content):
    path = tmp_path / "kernels.tar.xz"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match="expected an archive of 'mapbench kernels export'"):
        kernel_archive.import_kernels(path)


def test_a_damaged_archive_is_one_line(archive):
    path = archive([("gym_mapbench.kernels.geometry/a.nbi", os.urandom(100_000))])
    path.write_bytes(path.read_bytes()[:50_000])
    with pytest.raises(ConfigError, match="expected an archive of 'mapbench kernels export'"):
        kernel_archive.import_kernels(path)


def test_an_export_overwrites_nothing_and_needs_kernels(archive, tmp_path, monkeypatch):
    with pytest.raises(RunError, match="no kernel is compiled; 'mapbench doctor' compiles"):
        kernel_archive.export_kernels(tmp_path / "new.tar.xz")
    with pytest.raises(ConfigError, match="--out: expected a new file"):
        kernel_archive.export_kernels(archive())
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    with pytest.raises(ConfigError, match="expected NUMBA_DISABLE_JIT not to be set"):
        kernel_archive.export_kernels(tmp_path / "new.tar.xz")


def test_the_command(monkeypatch, capsys, tmp_path):
    from evolution.cli import main

    monkeypatch.setattr(command, "export_kernels", lambda path: f"wrote {path.name}")
    monkeypatch.setattr(command, "import_kernels", lambda path: f"took {path.name}")
    assert main(["kernels", "export", "--out", "a.tar.xz"]) == 0
    assert main(["kernels", "import", "a.tar.xz"]) == 0
    assert capsys.readouterr().out == "wrote a.tar.xz\ntook a.tar.xz\n"


def test_a_kernel_that_cannot_be_written_to_the_disk_runs_all_the_same(monkeypatch):
    """A full disk would otherwise end a run in an error, which a search takes for the controller's."""

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    @kernel
    def twice(number):
        return 2 * number

    monkeypatch.setattr(twice._cache._cache_file, "save", full)
    assert twice(3) == 6


def test_without_a_folder_for_kernels_the_error_says_what_to_set():
    namespace = {}
    exec("def twice(number): return 2 * number", namespace)
    with pytest.raises(OSError, match="expected a folder for compiled kernels; set NUMBA_CACHE_DIR to a writable one"):
        kernel(namespace["twice"])


def test_kernels_that_cannot_be_imported_are_one_line_of_any_command(monkeypatch, capsys):
    def unwritable():
        raise OSError("expected a folder for compiled kernels")

    monkeypatch.setattr("evolution.files.version_lines", unwritable)
    assert main(["--version"]) == 2
    assert capsys.readouterr().err == "mapbench: expected a folder for compiled kernels\n"
