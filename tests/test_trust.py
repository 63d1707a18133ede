"""Files that name code are refused, unless the user named the same or allows it."""

from __future__ import annotations

import json

import pytest

from controllers.registry import make_controller
from evolution.cli import main
from evolution.files import DirectoryKind
from evolution.search import read_document
from evolution.studies.settings import read_definition
from evolution.training import train_settings
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError, UntrustedError
from gym_mapbench.registry import Registry
from gym_mapbench.trust import allow_code, only_code_named_in, refuse_code


@pytest.fixture(autouse=True)
def _nothing_was_asked_for(monkeypatch):
    monkeypatch.setattr("gym_mapbench.trust._ran", set())


CODE = [
    "module:attribute",
    "a.b:c.d",
    "name=my_module:Thing",
    "my_formats:read:maps/a.room",
    "model.zip",
    "sac = models/sac.zip",
    " module:attribute ",
    "a = b=model.zip ",
]
HARMLESS = [
    *("dwb", "thesis", "name=dwb", "nav2_mppi_controller::MPPIController", "barn:FOLDER/1", "12:30", "a: b", "x.yaml"),
    *("maps/office.yaml", "-1,2,0", "", ":", "=", "zip"),
]


@pytest.mark.parametrize("text", CODE)
def test_code_is_found_as_value_and_as_key(text):
    for document in ({"a": {"b": [1, text]}}, {"operators": {text: 0.5}}):
        with pytest.raises(ConfigError, match=r"^file: (a\.b|operators\..*): .* would run code; .*--allow-code"):
            refuse_code(document, "file")
        with allow_code():
            refuse_code(document, "file")


@pytest.mark.parametrize("text", HARMLESS)
def test_other_texts_are_free(text):
    refuse_code({"a": [text], text: 1}, "file")


def test_what_the_user_asked_for_may_stand_in_files():
    with pytest.raises(UntrustedError, match="would run code"):
        refuse_code(["collections:OrderedDict"], "file")
    Registry("thing", "things", {}).get("collections:OrderedDict")
    refuse_code(["a=collections:OrderedDict"], "file")


def test_a_command_loads_only_what_its_arguments_name():
    things = Registry("thing", "things", {})
    with only_code_named_in(["bench", "--controllers=dwb, a=collections:OrderedDict", "collections:deque:maps/a"]):
        things.get("collections:OrderedDict")
        things.get("collections:deque")
        for name in ("collections:Counter", "a=collections:OrderedDict"):
            with pytest.raises(ConfigError):
                things.get(name)
        with pytest.raises(UntrustedError, match=r"'b\.zip' would run code, and no argument names it"):
            make_controller("a=b.zip")
        with allow_code():
            things.get("collections:Counter")


@pytest.fixture
def bait(tmp_path, monkeypatch):
    """A module that leaves a mark when it is imported."""
    (tmp_path / "bait.py").write_text("open('mark', 'w').close()\nraise SystemExit\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "mark"


EXPERIMENTS = [
    "search: {fitness: 'bait:x'}",
    "search: {metric: 'bait:x'}",
    "search: {judging: {failures: 'bait:x'}}",
    "search: {ga: {algorithm: 'bait:x'}}",
    "search: {families: ['bait:x']}",
    "search: {families: [{name: 'bait:x'}]}",
    "search: {mutation: {operators: {'bait:x': 0.0}}}",
    "controllers: [dwb, 'a=bait:x']",
    "controllers: [dwb, {name: a, kind: 'bait:x'}]",
    "controllers: [dwb, 'a=bait.zip']",
    "run: {environment: {noise: 'bait:x'}}",
    "run: {environment: {robot: 'bait:x'}}",
    "run: {navigation: {planner: {name: 'bait:x'}}}",
]


@pytest.mark.parametrize("text", EXPERIMENTS)
def test_an_experiment_runs_no_code(bait, capsys, text):
    (bait.parent / "e.yaml").write_text(text)
    assert main(["evolve", "--config", "e.yaml", "--out", "run"]) == 2
    assert "would run code" in capsys.readouterr().err
    assert not bait.exists()


def test_it_runs_with_leave(bait, capsys):
    (bait.parent / "e.yaml").write_text(EXPERIMENTS[0])
    assert main(["evolve", "--config", "e.yaml", "--out", "run", "--allow-code"]) == 2
    assert "cannot be loaded (SystemExit" in capsys.readouterr().err
    assert bait.exists()


def test_every_reader_of_files_refuses(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("{search: 'bait:x'}")
    for read in (read_document, read_definition, EnvConfig.build, lambda path: train_settings(config=path)):
        with pytest.raises(ConfigError, match=r"a\.yaml: .*would run code"):
            read(path)
    kind = DirectoryKind("thing", "thing.json", 1)
    (tmp_path / "thing.json").write_text(json.dumps({"format": kind.format, "format_version": 1, "a": "bait:x"}))
    with pytest.raises(ConfigError, match=r"thing\.json: a: .*would run code"):
        kind.open(tmp_path)
