"""Code that options name: a directory of results is continued with the code that it was begun with."""

from __future__ import annotations

import importlib
from dataclasses import replace

import pytest

from evolution.files import DirectoryKind
from evolution.files.code import code_of
from evolution.search.experiments import read_document
from gym_mapbench.errors import ConfigError
from gym_mapbench.trust import allow_code

KIND = DirectoryKind("benchmark", "benchmark.json", format_version=1)
DOCUMENT = {"benchmark": {"controllers": {"mine": {"kind": "tools.own:careful"}}, "metrics": ["shape:width"]}}


@pytest.fixture
def modules(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tools").mkdir()
    (tmp_path / "tools" / "__init__.py").write_text("raise SystemExit('was imported')\n")
    (tmp_path / "tools" / "own.py").write_text("speed = 0.4\n")
    (tmp_path / "shape.py").write_text("width = 1\n")
    importlib.invalidate_caches()
    return tmp_path


def begun(path):
    KIND.begin(path, DOCUMENT)
    return path


def resume(path):
    with allow_code():
        return KIND.begin_or_resume(path, DOCUMENT, resume=True)


def test_the_same_code_continues_also_elsewhere(modules, tmp_path, monkeypatch):
    assert list(resume(begun(tmp_path / "results"))["code"]) == ["tools.own", "shape"]
    (tmp_path / "below").mkdir()
    monkeypatch.chdir(tmp_path / "below")
    monkeypatch.syspath_prepend(tmp_path)
    resume(tmp_path / "results")


@pytest.mark.parametrize(("file", "module"), [("tools/own.py", "tools.own"), ("shape.py", "shape")])
def test_other_code_in_the_same_module_is_refused(modules, tmp_path, file, module):
    path = begun(tmp_path / "results")
    (modules / file).write_text("speed = 0.5\n")
    with pytest.raises(ConfigError, match=rf"results: expected the code of {module} as it was .* got other code"):
        resume(path)


def test_results_that_are_remade_from_their_runs_continue_with_other_code(modules, tmp_path, caplog):
    kind = replace(KIND, remade=True)
    kind.begin(tmp_path / "results", DOCUMENT)
    assert not kind.take_code(tmp_path / "results")
    (modules / "shape.py").write_text("width = 2\n")
    with allow_code():
        kind.begin_or_resume(tmp_path / "results", DOCUMENT, resume=True)
    assert kind.take_code(tmp_path / "results")
    assert "results: the code of shape has changed: its runs" in caplog.text
    assert not kind.take_code(tmp_path / "results")


def test_a_refusal_has_the_command_that_begins_again(modules, tmp_path):
    path = begun(tmp_path / "the results")
    (modules / "shape.py").write_text("width = 2\n")
    with allow_code(), pytest.raises(ConfigError, match=r"\(mapbench evolve --config '.*/the results' --out NEW\)$"):
        replace(KIND, again="evolve --config {path} --out NEW").begin_or_resume(path, DOCUMENT, resume=True)


def test_modules_without_a_file_are_left_out(modules):
    assert code_of({"kind": "sys:path", "planner": "missing.module:attribute", "noise": "tools.missing:one"}) == {}


def test_options_that_name_no_code_have_the_bytes_that_they_had(modules, tmp_path):
    assert "code" not in KIND.begin(tmp_path / "results", {"benchmark": {"controllers": {"rpp": {"kind": "rpp"}}}})


def test_a_damaged_record_of_code_is_no_traceback(modules, tmp_path):
    path = begun(tmp_path / "results")
    text = (path / KIND.mark).read_text()
    (path / KIND.mark).write_text(text[: text.index('"code"')] + '"code": ["tools.own"]}\n')
    resume(path)


def test_the_options_of_a_run_that_names_code_are_those_of_another_search(modules, tmp_path):
    document = {"search": {}, "controllers": ["mine=shape:width"], "run": {}}
    kind = DirectoryKind("run", "config.json", format_version=1)
    kind.begin(tmp_path / "run", document)
    with allow_code():
        assert "code" in read_document(tmp_path / "run" / "config.json")
