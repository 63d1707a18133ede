"""The house holds: imports run one way, and nobody pays for what they do not use."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from pkgutil import resolve_name

import pytest

from gym_mapbench import MapBenchEnv

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("gym_mapbench", "controllers", "evolution")
HEAVY = ("torch", "stable_baselines3", "matplotlib", "pymoo", "pandas", "jinja2", "distributed", "optuna", "ribs")


def run(code: str) -> str:
    """Run a line of Python in a fresh interpreter and return what it prints."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    return done.stdout


def test_import_contracts_hold():
    command = "from importlinter.cli import lint_imports_command; lint_imports_command()"
    done = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("module", ["gym_mapbench.env.single", "controllers.registry"])
def test_heavy_modules_stay_out(module):
    loaded = run(f"import sys, {module}; print(*sys.modules)").split()
    assert not set(HEAVY) & set(loaded)


def test_large_libraries_are_loaded_by_those_who_use_them():
    loaded = run("import sys, evolution.api, evolution.cli; print(*sys.modules)").split()
    assert not {"torch", "stable_baselines3", "optuna", "ribs", "scipy.stats", "scipy.ndimage", "matplotlib"} & set(
        loaded
    )


@pytest.mark.slow
def test_models_are_loaded_without_the_compiler_of_torch(tmp_path):
    sb3 = pytest.importorskip("stable_baselines3")
    sb3.SAC("MultiInputPolicy", MapBenchEnv(lidar={"beams": 2}), buffer_size=1).save(tmp_path / "sac.zip")
    files = ["examples/policies/ppo.zip", str(tmp_path / "sac.zip")]
    code = f"import sys; from controllers.rl import load_sb3; [load_sb3(file, 'x') for file in {files}]"
    loaded = run(f"{code}; print(*sys.modules)").split()
    assert "torch" in loaded
    assert "torch._dynamo" not in loaded


@pytest.mark.slow
@pytest.mark.parametrize(("controllers", "shared"), [("rpp,m=m.zip", True), ("rpp", False)])
def test_workers_share_the_torch_of_a_command_that_names_a_model(controllers, shared):
    pytest.importorskip("stable_baselines3")
    code = "import sys, evolution.driving as driving, evolution.cli as cli; "
    code += "driving.copy_for_workers = lambda: print(*sys.modules); "
    loaded = run(f"{code}cli._import(['bench', 'map.yaml', '--controllers', {controllers!r}])").split()
    assert ("torch" in loaded) == shared


@pytest.mark.parametrize("arguments", [["--help"], [], ["bnch"]])
def test_the_help_waits_for_no_imports(arguments):
    code = "import atexit, sys; atexit.register(lambda: print(*sys.modules)); import evolution.cli; evolution.cli.main("
    code += f"{arguments})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == (0 if arguments == ["--help"] else 2)
    assert not {"numpy", "gymnasium", "numba"} & set(done.stdout.split())


def test_no_pygame_anywhere():
    code = (
        "import sys, gymnasium, gym_mapbench; env = gymnasium.make('MapBench-v0', render_mode='rgb_array'); "
        "env.reset(seed=0); env.render(); print(*sys.modules)"
    )
    assert "pygame" not in run(code).split()
    sources = [path for folder in PACKAGES for path in (ROOT / folder).rglob("*.py")]
    assert not [path for path in sources if "import pygame" in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize(
    ("package", "only_in"),
    [("Box2D", "gym_mapbench/world/box2d.py"), ("pymoo", "evolution/"), ("distributed", "evolution/driving/")],
)
def test_each_engine_lives_in_one_place(package, only_in):
    for folder in PACKAGES:
        for path in (ROOT / folder).rglob("*.py"):
            if f"import {package}" in (text := path.read_text(encoding="utf-8")) or f"from {package}" in text:
                assert path.relative_to(ROOT).as_posix().startswith(only_in)


def rooms() -> list[str]:
    """Names of the packages in ``evolution/``."""
    return [path.parent.name for path in (ROOT / "evolution").glob("*/__init__.py")]


@pytest.mark.parametrize("room", rooms())
def test_rooms_are_entered_by_their_face(room):
    """Outside of a room, its names come from its ``__init__``, which lists all of them."""
    deep = re.compile(rf"(from|import) evolution\.{room}\.")
    outside = [path for path in (ROOT / "evolution").rglob("*.py") if path.relative_to(ROOT).parts[1] != room]
    assert not [path for path in outside if deep.search(path.read_text(encoding="utf-8"))]


@pytest.mark.parametrize("room", ["evolution.driving.pool"])
def test_inner_rooms_are_entered_by_their_face(room):
    """Outside of an inner room and its own tests, also in other tests, its names come from its ``__init__``."""
    inside = [ROOT / room.replace(".", "/"), ROOT / "tests" / room.replace(".", "/")]
    deep = re.compile(rf"(from|import) {re.escape(room)}\.")
    sources = [path for folder in (*PACKAGES, "tests", "benchmarks") for path in (ROOT / folder).rglob("*.py")]
    outside = [path for path in sources if not set(inside) & set(path.parents)]
    assert not [path for path in outside if deep.search(path.read_text(encoding="utf-8"))]


def names_in(path: Path) -> set[str]:
    """Return the full names that the docstrings of a file refer to."""
    return set(re.findall(rf":\w+:`~?((?:{'|'.join(PACKAGES)})\.[\w.]+)`", path.read_text(encoding="utf-8")))


def found(name: str) -> object:
    """Return what has a full name; None if nothing has it."""
    try:
        return resolve_name(name)
    except (AttributeError, ImportError):
        return None


def is_there(name: str) -> bool:
    """Whether a full name is one of a module, or of something in it; a field of a class counts as well."""
    owner, _, field = name.rpartition(".")
    return found(name) is not None or field in getattr(found(owner), "__annotations__", {})


def test_docstrings_refer_to_what_is_there():
    names = set().union(*(names_in(path) for package in PACKAGES for path in (ROOT / package).rglob("*.py")))
    assert len(names) > 100
    assert [name for name in sorted(names) if not is_there(name)] == []
