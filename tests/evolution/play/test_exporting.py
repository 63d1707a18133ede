"""The export: one file that holds the page and all it needs."""

from __future__ import annotations

import base64
import json
import re

import pytest

from evolution.driving import Resources
from evolution.play import Beginning, WorldSettings, export_session, scene_of
from evolution.play.exporting import INSTANTS, PAGE, page_with
from gym_mapbench.errors import ConfigError


@pytest.fixture(scope="module")
def exported(given, room, tmp_path_factory):
    """The text of an exported session of RPP."""
    beginning = Beginning(
        given, [scene_of(room)], WorldSettings(preset="thesis"), given.controllers[2:], Resources(workers=1)
    )
    folder = tmp_path_factory.mktemp("export") / "page"
    return export_session(beginning, folder).read_text()


def test_it_holds_the_ways_the_answer_and_the_overlays(exported):
    recorded = json.loads(re.search(r'id="recorded">(.*?)</script>', exported)[1])
    assert recorded["replies"][-1]["type"] == "answer"
    assert {one["type"] for one in recorded["replies"]} == {"way", "run", "answer"}
    assert len(recorded["instants"]) == INSTANTS
    assert [one["time"] for one in recorded["instants"]] == sorted(one["time"] for one in recorded["instants"])


def test_it_asks_for_nothing_else(exported):
    assert "static/" not in exported
    assert re.findall(r'(?:src|href)="(?!data:|#)', exported) == []


def test_every_module_imports_only_modules_of_the_file(exported):
    imports = json.loads(re.search(r'type="importmap">(.*?)</script>', exported)[1])["imports"]
    assert set(imports) == {path.stem for path in PAGE.glob("*.js")}
    for url in imports.values():
        module = base64.b64decode(url.partition("base64,")[2]).decode()
        assert set(re.findall(r'^import .* from "(.*)";', module, re.MULTILINE)) <= set(imports)
    assert "exported session" in base64.b64decode(imports["server"].partition("base64,")[2]).decode()


def test_data_cannot_end_the_script_that_holds_them():
    assert "</script><b>" not in page_with({"state": "</script><b>"})


def test_a_folder_that_holds_something_is_refused_before_anything_runs(given, room, tmp_path):
    (tmp_path / "file").touch()
    beginning = Beginning(given, [scene_of(room)], WorldSettings(preset="thesis"), given.controllers, Resources())
    with pytest.raises(ConfigError, match="new or empty folder"):
        export_session(beginning, tmp_path)
