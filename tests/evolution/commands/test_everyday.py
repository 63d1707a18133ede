"""Everyday comfort: what there is, what it holds, versions, completion, quiet, and the doctor."""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from evolution.cli import build_parser, main
from evolution.commands import COMMANDS, console, doctor
from evolution.commands.catalogue import KINDS
from evolution.commands.console import be_quiet, note, say
from evolution.commands.driving_options import drive_settings, repeatable
from evolution.driving import DriveSettings, kernel_files
from evolution.files import readable
from evolution.search import experiment_of, load_preset, preset_names, read_document
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.world.noise import NOISES
from gym_mapbench.world.robot import ROBOTS
from tests.evolution.processes import PATIENCE

OFFICE = Path(__file__).resolve().parents[3] / "examples" / "office.yaml"


@pytest.fixture(scope="module")
def bash_script():
    import io
    from contextlib import redirect_stdout

    with redirect_stdout(io.StringIO()) as text:
        assert main(["completion", "bash"]) == 0
    return text.getvalue()


def test_list_names_everything_and_says_what_it_is(capsys):
    assert main(["list", "--format", "json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert list(dict.fromkeys(row["kind"] for row in rows)) == list(KINDS)
    about = {(row["kind"], row["name"]): row["what it is"] for row in rows}
    assert about["robots", "jackal"] == (
        "footprint (0.21, 0.165) (-0.21, 0.165) (-0.21, -0.165) (0.21, -0.165), 2 m/s, 4 rad/s"
    )
    assert about["controllers", "dwb"] == "DWB (dwb_core::DWBLocalPlanner)"
    assert about["controllers", "shim_mppi"].startswith(
        "The Rotation Shim around MPPI (nav2_rotation_shim_controller::"
    )
    assert [key for key, text in about.items() if not text or ":`" in text] == []


def test_the_latency_of_a_noise_level_is_a_share_of_the_control_period(capsys):
    assert main(["list", "noise", "--format", "json"]) == 0
    (about,) = [row["what it is"] for row in json.loads(capsys.readouterr().out) if row["name"] == "nominal"]
    assert NOISES.get("nominal").latency == 0.2
    assert "commands late by 20 % of a control period" in about


def test_show_prints_the_whole_of_everything_with_that_name(capsys):
    assert main(["show", "quick"]) == 0
    search, study = yaml.safe_load_all(capsys.readouterr().out)
    assert search["search"]["judging"]["fitness"] == "gini"  # from robust, which quick builds on
    assert "configurations" in study
    assert main(["show", "nominal"]) == 0
    assert yaml.safe_load(capsys.readouterr().out) == NOISES["nominal"].model_dump(mode="json")
    assert main(["show", "jackal"]) == 0
    assert yaml.safe_load(capsys.readouterr().out) == ROBOTS["jackal"].model_dump(mode="json")


@pytest.mark.parametrize("preset", preset_names())
def test_a_preset_of_a_search_that_is_shown_is_a_file_for_evolve(preset, capsys, tmp_path):
    assert main(["show", preset, "--kind", "presets"]) == 0
    (tmp_path / "shown.yaml").write_text(capsys.readouterr().out, encoding="utf-8")
    assert experiment_of(read_document(tmp_path / "shown.yaml")) == experiment_of(load_preset(preset))


@pytest.mark.parametrize(
    ("argv", "expected"),
    [
        (["show", "quik"], "did you mean 'quick'"),
        (["show", "jackal", "--kind", "params"], "unknown params 'jackal'"),
        (["list", "robot"], "did you mean 'robots'"),
    ],
)
def test_unknown_names_cost_one_line(argv, expected, capsys):
    assert main(argv) == 2
    line = capsys.readouterr().err
    assert expected in line
    assert line.count("\n") == 1


def test_the_versions_that_matter(capsys):
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    names = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert names[:2] == ["mapbench", "python"]
    assert {"numpy", "numba", "Box2D", "pymoo", "gymnasium"} <= set(names)


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["be"], ["bench"]),
        (["bench", "--robot", "turtle"], ["turtlebot3_burger", "turtlebot3_waffle", "turtlebot3_waffle_gz"]),
        (["bench", "--fail"], ["--fail-if"]),
        (["bench", "--contact", ""], ["ends", "slides"]),
        (["maps", "dr"], ["draw"]),
        (["maps", "draw", "--cou"], ["--count"]),
        (["evolve", "--preset", "rob"], ["robust"]),
        (["completion", "z"], ["zsh"]),
        (["maps", "draw", "--format", ""], ["image", "map_server", "mapset", "movingai"]),
        (["maps", "info", "--format", ""], ["json", "table"]),
        (["export", "runs/a", "--format", "ga"], ["gazebo"]),
        (["evolve", "--metric", "ti"], ["time"]),
        (["evolve", "--failures", ""], ["censor", "exclude", "par2"]),
        (["train", "--algo", ""], ["ppo", "sac", "td3"]),
        (["study", "qu"], ["quick"]),
        (["show", "jack"], ["jackal"]),
        (["list", "no"], ["noise"]),
        (["bench", ""], []),
        (["bench", "--html", ""], []),
    ],
    ids=" ".join,
)
def test_completion(words, expected, bash_script):
    typed = " ".join(f"'{word}'" for word in ["mapbench", *words])
    ask = f'COMP_WORDS=({typed}); COMP_CWORD={len(words)}; _mapbench; echo "${{COMPREPLY[@]}}"'
    done = subprocess.run(["bash", "-c", bash_script + ask], capture_output=True, text=True, check=True)
    assert sorted(done.stdout.split()) == expected


def test_the_completion_knows_every_command(bash_script):
    assert all(f'"{name} "*)' in bash_script for name in COMMANDS)


def commands_of(parser):
    """The parser of every command and of every action of one."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for one in action.choices.values():
                yield one
                yield from commands_of(one)


def test_help_fits_a_narrow_terminal_and_its_examples_are_those_of_a_wide_one(monkeypatch):
    parser = build_parser()
    examples = {}
    for columns in ("80", "200"):
        monkeypatch.setenv("COLUMNS", columns)
        texts = [one.format_help() for one in (parser, *commands_of(parser))]
        assert max(len(line) for text in texts for line in text.splitlines()) <= int(columns)
        joined = re.sub(r" \\\n +", " ", "\n".join(texts))
        examples[columns] = [line.partition("  ")[0] for line in re.findall(r"^  (mapbench .*)", joined, re.MULTILINE)]
    assert len(examples["80"]) > 40
    assert examples["80"] == examples["200"]


def test_the_poses_of_examples_are_free_on_the_map_that_is_shipped_under_the_name():
    parser = build_parser()
    joined = re.sub(r" \\\n +", " ", "\n".join(one.format_help() for one in (parser, *commands_of(parser))))
    tasks = re.findall(r"office\.yaml.*? --start (\S+) --goal (\S+)", joined)
    assert len(tasks) == 3
    for task in tasks:
        start, goal = (tuple(map(float, pose.split(","))) for pose in task)
        assert load_scenarios(OFFICE, start=start, goal=goal)


def test_the_doctor_writes_no_exponents(monkeypatch):
    monkeypatch.setattr(doctor, "drive", lambda job: None)
    monkeypatch.setattr(doctor, "_processor_seconds", lambda job: 0.019)
    monkeypatch.setattr(doctor, "calibration_loop", lambda: 5e-8)
    first, *_ = doctor._speed()
    assert first.startswith("dwb: a run of 2 s takes 19 ms of the processor (105.3 times real time), or 0.38 million")


def test_quiet_leaves_out_notes_and_progress(capsys):
    be_quiet()
    try:
        note("a note")
        say("generation 0")
        assert capsys.readouterr() == ("", "")
    finally:
        be_quiet(False)
    say("generation 0")
    assert capsys.readouterr().out == "generation 0\n"
    assert not console.notes.quiet


def test_the_doctor(capsys, monkeypatch):
    driven = []

    def drive(job):
        driven.append(job)
        began = time.process_time()
        while time.process_time() == began:  # the clock may stand still for a while
            pass

    monkeypatch.setattr(doctor, "drive", drive)
    assert main(["doctor"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("mapbench 0.1.0, python ")
    assert "kernels: " in text
    assert {job.controller.name for job in driven} == {"dwb", "mppi", "rpp"}
    assert text.count("turns of the calibration loop") == 3
    assert "extra test: " in text
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert "nothing is compiled" in next(doctor._kernels())


def test_runs_without_compiling_are_refused_in_one_line():
    command = [sys.executable, "-m", "evolution", "bench", "examples/hall.yaml", "--controllers", "rpp"]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE, env=environment)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "expected NUMBA_DISABLE_JIT not to be set, as kernels run only if they are compiled" in done.stderr


def test_the_doctor_clears_kernels(tmp_path, capsys, monkeypatch):
    for name, size in (("a.f-1.py311.nbi", 1000), ("a.f-1.py311.1.nbc", 30_000), ("a.f-1.py311.2.nbc", 69_000)):
        (tmp_path / name).write_bytes(bytes(size))
    (tmp_path / "a.cpython-311.pyc").write_bytes(b"kept")
    found = 2 * [SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path)))]
    monkeypatch.setattr(kernel_files, "kernels", lambda: found)
    for line in (
        "deleted 1 compiled kernel (0.1 MB in 3 files)\n",
        "deleted 0 compiled kernels (0.0 MB in 0 files)\n",
    ):
        assert main(["doctor", "--clear-kernels"]) == 0
        assert capsys.readouterr().out == line
    assert [path.name for path in tmp_path.iterdir()] == ["a.cpython-311.pyc"]
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert main(["doctor", "--clear-kernels"]) == 2
    assert "expected NUMBA_DISABLE_JIT not to be set" in capsys.readouterr().err


IN_A_FOLDER = """
import sys
from pathlib import Path
from evolution.driving.kernel_files import clear_kernels, kernels
folders = {Path(kernel.stats.cache_path) for kernel in kernels()}
for folder in folders:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "kernel.nbi").touch()
assert all(folder.is_relative_to(sys.argv[1]) for folder in folders), folders
assert clear_kernels() == f"deleted {len(folders)} compiled kernels (0.0 MB in {len(folders)} files)"
"""


def test_only_kernels_in_the_folder_of_numba_are_cleared(tmp_path):
    before = set(Path("gym_mapbench/kernels/__pycache__").glob("*.nb?"))
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", IN_A_FOLDER, str(tmp_path)], env=environment, check=True)
    assert list(tmp_path.rglob("*.nbi")) == []
    assert before <= set(Path("gym_mapbench/kernels/__pycache__").glob("*.nb?"))


def test_the_doctor_notices_that_others_use_the_machine(monkeypatch):
    monkeypatch.setattr(doctor, "drive", lambda _: time.sleep(0.01))
    monkeypatch.setattr(doctor, "_processor_seconds", lambda _: 0.1)
    *drives, last = doctor._speed()
    assert all("a run of 2 s takes 100 ms of the processor (20 times real time)" in line for line in drives)
    assert last.startswith("the machine is busy: this process got ")


def test_the_doctor_names_what_is_missing(monkeypatch):
    monkeypatch.setattr(doctor, "_installed", lambda name: name != "stable-baselines3")
    assert "extra rl: not installed: stable-baselines3 (pip install 'gym-mapbench[rl]')" in list(doctor._missing())


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        ([0.0, 2.0, None], ["0", "2", "-"]),
        ([0.0, 1 / 3, 1.0], ["0", "0.333", "1.000"]),
        ([23.456, 150.0], ["23.5", "150.0"]),
        ([8.25, float("nan")], ["8.25", "-"]),
        ([0.00012, 0.5, 3e7], ["0.00012", "0.5", "3e+07"]),
        ([12345.6], ["12346"]),
        (["a", 1, 0.5], ["a", "1", "0.5"]),
        ([150.25, 0.04], ["150.2", "0.04"]),
        ([300.0, 14.0, 3.81, 0.05], ["300.0", "14.0", "3.8", "0.05"]),
        ([-6.262, -5.285, -4.965, 19999.0], ["-6.262", "-5.285", "-4.965", "19999"]),
        ([0.0, 0.0, 150.0], ["0", "0", "150"]),
        ([], []),
    ],
)
def test_digits(values, texts):
    assert readable(values) == texts


def test_the_costmaps_of_a_run_without_the_map_stay_so():
    """``bench`` and ``drive`` take the world of a run as it is, unless an option says otherwise."""
    parser = build_parser("drive")
    base = DriveSettings(navigation="thesis")
    for given, asked, expected in [(False, [], False), (True, [], True), (False, ["--unknown-map"], True)]:
        args = parser.parse_args(["drive", "map.yaml", "--controller", "rpp", *asked])
        assert drive_settings(args, base.replace(unknown_map=given)).unknown_map == expected


MAP = str(Path(__file__).resolve().parents[3] / "examples" / "office.yaml")


@pytest.mark.parametrize("redirected", [">&-", "2>&-", ">&- 2>&-"])
def test_closed_output_is_no_error(redirected):
    command = f"exec {sys.executable} -m evolution maps info {MAP} {redirected}"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False)


def test_a_reader_that_goes_away_is_no_success():
    """The exit code of ``--fail-if`` and of a search that was cut off must not say that all is well."""
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "evolution", "maps", "info", MAP]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")


def test_names_that_the_output_cannot_encode_are_escaped(tmp_path):
    for file in Path(MAP).parent.glob("office*.*"):
        shutil.copy(
            file, tmp_path / file.name.replace("office.yaml", "b\u00fcro.yaml").replace("office_p", "b\u00fcro_p")
        )
    command = [sys.executable, "-m", "evolution", "maps", "info", str(tmp_path / "b\u00fcro.yaml")]
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "b\\xfcro" in done.stdout


def test_a_page_names_the_arguments_that_change_the_result():
    given = ["minimize", "m.yaml", "--workers", "2", "--keep", "order", "--wait=3", "--resume", "--seeds", "3"]
    assert repeatable(given) == ["minimize", "m.yaml", "--keep", "order", "--seeds", "3"]


def test_code_that_exits_or_changes_the_directory_is_told(tmp_path, monkeypatch, capsys):
    (tmp_path / "odd.py").write_text(
        "import os\nos.chdir('/')\ndef leave(**_): raise SystemExit(0)\ndef make(**_): raise ValueError('no')\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    for name, message in (("leave", "SystemExit: 0, odd.py line 3"), ("make", "ValueError: no, odd.py line 4")):
        assert main(["bench", MAP, "--controllers", f"rpp,x=odd:{name}", "--workers", "1"]) == 2
        assert message in capsys.readouterr().err
    assert Path.cwd() == tmp_path


@pytest.mark.parametrize("kind", KINDS)
def test_lists_have_no_markup(kind, capsys):
    assert main(["list", kind]) == 0
    assert "`" not in capsys.readouterr().out


AFTER_PREPARING = """
import os
from evolution.cli import _prepare_output
_prepare_output()
os._exit(os.open(os.devnull, os.O_RDONLY))
"""


@pytest.mark.parametrize("closed", [(0, 1, 2), (0, 2), (1,)])
def test_no_file_gets_the_number_of_a_closed_input_or_output(closed):
    """Workers print to file 2, which else might be a table of results, or their own connection."""
    command = [sys.executable, "-c", AFTER_PREPARING]
    done = subprocess.run(command, check=False, preexec_fn=lambda: [os.close(number) for number in closed])
    assert done.returncode > 2
