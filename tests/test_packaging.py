"""The package as it is published: what it holds, and that it works where nothing is known of the repository."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib.metadata import PackageNotFoundError, requires
from importlib.util import find_spec
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("gym_mapbench", "controllers", "evolution")
COPIED = (*PACKAGES, "tests", "examples", "docs", "benchmarks")
MADE_BY_RUNNING = shutil.ignore_patterns("__pycache__", "*.pyc", "*.nbi", "*.nbc")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
USES_ITS_FILES = """
import sys
import gym_mapbench, controllers, evolution
from controllers.nav2_params import PRESETS, load_preset
from evolution.report.page import Report, render_page
from evolution.search import load_preset as load_search, preset_names
from evolution.studies import load_definition, study_names
assert all(sys.argv[1] in module.__file__ for module in (gym_mapbench, controllers, evolution))
assert all(map(load_preset, PRESETS))
assert all(map(load_search, preset_names()))
assert all(map(load_definition, study_names()))
print(len(render_page(Report("title", "subtitle", ["verdict"], "command", "options"))))
"""

needs_build = pytest.mark.skipif(find_spec("build") is None, reason="build is not installed (pip install '.[test]')")


def python(*arguments: str, cwd: Path, **environment: str) -> str:
    """Run Python in another process; returns what it prints."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Build sdist and, from it, the wheel, of a copy of the repository."""
    source = tmp_path_factory.mktemp("package") / "source"
    for folder in COPIED:
        shutil.copytree(ROOT / folder, source / folder, ignore=MADE_BY_RUNNING)
    for file in filter(Path.is_file, ROOT.iterdir()):
        shutil.copy(file, source)
    python("-m", "build", "--no-isolation", "--outdir", "dist", cwd=source)
    return source / "dist"


@pytest.fixture(scope="module")
def installed(built, tmp_path_factory):
    """The wheel unpacked where nothing else is."""
    site = tmp_path_factory.mktemp("site")
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    return site


def kept_files(*folders: str) -> set[str]:
    """All files of the repository below some folders that are not made by running."""
    found = [path for folder in folders for path in (ROOT / folder).rglob("*") if path.is_file()]
    return {
        path.relative_to(ROOT).as_posix()
        for path in found
        if "__pycache__" not in path.parts and path.suffix not in (".pyc", ".nbi", ".nbc")
    }


@pytest.mark.slow
@needs_build
def test_the_wheel_holds_every_file_of_the_packages_and_nothing_else(installed):
    held = {path.relative_to(installed).as_posix() for path in installed.rglob("*") if path.is_file()}
    own = {name for name in held if ".dist-info/" not in name}
    assert own == kept_files(*PACKAGES)
    assert any(name.endswith("licenses/LICENSE") for name in held - own)


@pytest.mark.slow
@needs_build
def test_the_sdist_holds_what_a_reader_and_a_tester_need(built):
    (sdist,) = built.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    papers = {"README.md", "CHANGELOG.md", "LICENSE", "CITATION.cff", "CONTRIBUTING.md", "constraints.txt"}
    assert papers | kept_files(*COPIED) <= held


@pytest.mark.slow
@needs_build
@pytest.mark.skipif(find_spec("twine") is None, reason="twine is not installed (pip install '.[test]')")
def test_the_index_would_take_them(built):
    python("-m", "twine", "check", "--strict", *map(str, built.iterdir()), cwd=built)


@pytest.mark.slow
@needs_build
def test_the_wheel_works_in_an_empty_directory(installed, tmp_path):
    where = {"PYTHONPATH": str(installed), "COLUMNS": "200"}
    assert int(python("-c", USES_ITS_FILES, str(installed), cwd=tmp_path, **where)) > 10_000
    assert "evolve" in python("-m", "evolution", "--help", cwd=tmp_path, **where)
    assert not list(tmp_path.iterdir())


def test_every_requirement_is_pinned():
    """Follow the requirements of every extra through what is installed here."""
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pins = [Requirement(line) for line in lines if not line.startswith("#")]
    assert all(re.fullmatch(r"==[\w.]+", str(pin.specifier)) for pin in pins)
    pinned = {canonicalize_name(pin.name) for pin in pins}
    extras = PROJECT["optional-dependencies"].values()
    waiting = [Requirement(line) for line in [*PROJECT["dependencies"], *[line for extra in extras for line in extra]]]
    needed: set[str] = set()
    while waiting:
        one = waiting.pop()
        if canonicalize_name(one.name) not in needed and _applies(one):
            needed.add(canonicalize_name(one.name))
            waiting += [Requirement(line) for line in _requirements(one.name)]
    accelerators = {name for name in needed if name.startswith(("nvidia-", "cuda-", "triton"))}
    assert needed - pinned - accelerators == set()


def _applies(requirement: Requirement) -> bool:
    return requirement.marker is None or requirement.marker.evaluate({"extra": ""})


def _requirements(name: str) -> list[str]:
    """What an installed package requires; nothing of one that is not installed, which must be pinned all the same."""
    try:
        return requires(name) or []
    except PackageNotFoundError:
        return []
