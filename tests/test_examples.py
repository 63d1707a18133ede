"""Every example runs in its small form, from an empty directory, and leaves what it says."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from evolution import bench
from evolution.driving import ControllerSpec
from evolution.studies.settings import load_study
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.trust import allow_code

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
NOTEBOOK = EXAMPLES / "first_look.ipynb"
SMALL = {"MAPBENCH_SMALL": "1", "MPLBACKEND": "agg", "PYTHONPATH": str(EXAMPLES.parent)}
needs_rl = pytest.mark.skipif(find_spec("stable_baselines3") is None, reason="the extra rl is not installed")


def run(name, folder, *arguments):
    """Run an example, deprecated things in it being errors; returns what it prints."""
    done = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:__main__", str(EXAMPLES / name), *map(str, arguments)],
        cwd=folder,
        env={**os.environ, **SMALL},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_an_env_is_driven_to_the_goal(tmp_path):
    output = run("drive_an_env.py", tmp_path)
    assert re.search(r"seed 1: goal after \d+\.\d s, reward \d", output)
    assert (tmp_path / "drive_an_env.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_own_controller_reaches_the_goals(tmp_path):
    output = run("own_controller.py", tmp_path)
    assert "mine reaches the goal in 2 of 2 runs" in output
    assert re.search(r"office +dwb +1/1", output)


@pytest.mark.slow
def test_parameter_files_are_compared(tmp_path):
    output = run("compare_parameters.py", tmp_path)
    assert output.count("drives: FollowPath (DWB), Pursuit (Regulated Pure Pursuit)") == 2
    assert "Pursuit: 1 and 1 goals, of 1 runs with either file" in output
    files = EXAMPLES / "office.yaml", tmp_path / "nav2_params_narrow.yaml", EXAMPLES / "nav2_params.yaml"
    assert "FollowPath: " in run("compare_parameters.py", tmp_path, *files)


@pytest.mark.slow
@needs_rl
def test_a_policy_is_trained_and_judged(tmp_path):
    output = run("train_and_judge.py", tmp_path)
    assert "Success on held-out maps, ppo" in output
    assert re.search(r"learned reaches the goal in \d of 2 runs", output)
    assert (tmp_path / "runs/train_and_judge/best_model.zip").is_file()


@pytest.mark.slow
def test_a_set_is_evolved_validated_and_exported(tmp_path):
    output = run("evolve_validate_export.py", tmp_path)
    assert re.search(r"Held-out fitness -?\d.* \(2 seeds; 95 % of trials between", output)
    assert "As a map set: median fitness" in output
    assert (tmp_path / "runs/two_controllers_bundle/package.xml").is_file()


@pytest.mark.slow
@pytest.mark.skipif(find_spec("nbclient") is None, reason="nbclient is not installed (pip install '.[test]')")
@pytest.mark.filterwarnings("default")
def test_the_notebook_runs_and_shows_its_pictures(monkeypatch):
    import nbformat
    from nbclient import NotebookClient

    for name, value in SMALL.items():
        monkeypatch.setenv(name, value)
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(EXAMPLES)}}).execute()
    shown = [output.data for cell in notebook.cells for output in cell.get("outputs", []) if "data" in output]
    assert sum("image/png" in data for data in shown) == 3
    assert any("<td>office</td>" in data.get("text/html", "") for data in shown)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "time_limit", "controller", "change"),
    [
        ("gates", 40.0, "mppi", {"vx_std": 0.4}),
        ("bends", 150.0, "rpp", {"lookahead_dist": 0.3}),
        ("baffles", 150.0, "dwb", {"forward_prune_distance": 1.0}),
    ],
)
def test_a_parameter_mends_what_the_slow_maps_show(place, time_limit, controller, change):
    (scenario,) = [one for one in load_scenarios(EXAMPLES / "slow.mapset.json") if one.name == place]
    mended = ControllerSpec(name="mended", kind=controller, params=change)
    world = {"params": "fair", "noise": "nominal", "time_limit": time_limit}
    rows = bench([scenario], [controller, mended], repeats=3, seed=11, workers=1, **world).rows
    ends = {name: [row["outcome"] for row in rows if row["controller"] == name] for name in (controller, "mended")}
    assert ends["mended"] == ["goal"] * 3
    assert ends[controller] != ["goal"] * 3


def test_the_study_of_a_policy_differs_from_evolve_by_its_controllers():
    with allow_code():
        own, evolve = (load_study(name) for name in (EXAMPLES / "policies/evolve.study.yaml", "evolve"))
    assert own.experiment == {**evolve.experiment, "controllers": ["ppo=examples/policies/ppo.zip", "mppi"]}
    assert own.reevaluation == evolve.reevaluation
    assert own.seeds == range(420, 428)
    assert own.configurations == tuple(one.replace(runs=None) for one in evolve.configurations[:2])


def test_the_list_is_complete():
    listed = re.findall(r"^\| \[(\S+)\]\(\1\)", (EXAMPLES / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(path.name for path in EXAMPLES.iterdir() if path.suffix in (".py", ".ipynb"))


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.name)
def test_an_example_begins_with_what_it_is(path):
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    assert all(f"\n{word}: " in text for word in ("Shows", "Takes", "Comes out"))
