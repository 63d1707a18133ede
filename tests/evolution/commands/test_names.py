"""Names are texts: square brackets are no markup, and what a terminal would obey is written out."""

from __future__ import annotations

import io
import json

import pytest
from rich.console import Console
from rich.progress import Progress

from evolution.cli import main
from evolution.commands.console import console, print_table
from evolution.commands.progress import PlainColumn
from evolution.driving import ControllerSpec
from evolution.files import Table
from gym_mapbench.mapio import save_map_set
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Pose, Scenario

NASTY = "[/x]\x1b[31m"
SHOWN = "[/x]\\x1b[31m"


@pytest.fixture
def maps(tmp_path, monkeypatch):
    """A map-set file with a map of that name, made by hand."""
    monkeypatch.chdir(tmp_path)
    grid = GridMap.from_rows(["#" * 30, *["#" + "." * 28 + "#"] * 28, "#" * 30])
    save_map_set(MapSet((Scenario(grid, Pose(0.5, 0.5), Pose(1.0, 1.0), "name"),)), tmp_path / "set.json")
    text = (tmp_path / "set.json").read_text()
    (tmp_path / "set.json").write_text(text.replace('"name": "name"', f'"name": {json.dumps(NASTY)}'))
    return tmp_path


def test_tables_and_lines_show_names_as_they_are(capsys):
    print_table(Table([{NASTY: NASTY, "office[v2]": "a[bold]b"}], title=NASTY))
    console.print(f"wrote {NASTY} :smile: [red]x[/red]")
    said = capsys.readouterr().out
    assert "\x1b" not in said
    assert said.count(SHOWN) == 4
    for text in ("office[v2]", "a[bold]b", ":smile: [red]x[/red]"):
        assert text in said


def test_bars_show_names_as_they_are():
    screen = io.StringIO()
    with Progress(PlainColumn("{task.fields[state]}"), console=Console(file=screen, color_system=None)) as bar:
        bar.add_task("", state=f"{NASTY}: goal")
    assert f"{SHOWN}: goal" in screen.getvalue()


@pytest.mark.parametrize(
    "command",
    [
        "maps info set.json",
        f"drive set.json --controller {NASTY}=rpp --time-limit 0.2",
        "import-results results.csv --ours bench.json",
    ],
)
def test_commands_show_names_as_they_are(maps, capsys, command):
    row = {"map": NASTY, "controller": NASTY, "outcome": "goal", "time_s": 2.0}
    (maps / "bench.json").write_text(json.dumps({"runs": [row]}))
    columns = "map,controller,repeat,outcome,time_s,path_length_m,contacts"
    (maps / "results.csv").write_text(f"{columns}\n{NASTY},{NASTY},0,goal,1.0,1.0,1\n")
    assert main(command.split()) == 0
    said = "".join(capsys.readouterr())
    assert "\x1b" not in said
    assert SHOWN in said


@pytest.mark.parametrize(
    "command",
    ["list X", "show X", "train --algo X", "bench X.yaml", "bench set.json --controllers X", "evolve --fitness X"],
)
def test_errors_show_names_as_they_are(maps, capsys, command):
    assert main(command.replace("X", NASTY).split()) == 2
    said = capsys.readouterr().err
    assert "\x1b" not in said
    assert len(said.splitlines()) == 1


def test_controllers_have_names_that_can_be_printed():
    assert ControllerSpec(name=NASTY).name == SHOWN
