"""The page of an atlas: cells, downloads, and a click in headless Chromium."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from evolution.driving import Evaluator
from evolution.quality_diversity import Atlas, search_atlas
from evolution.quality_diversity.search import AtlasSearch, GridFigures
from evolution.report import write_atlas_report
from gym_mapbench.metrics.episode import Episode
from tests.evolution import fake_runs
from tests.evolution.browser import NEEDS_CHROMIUM, open_chromium, sized
from tests.evolution.quality_diversity.test_search import EXPERIMENT, SETTINGS


def recorded(job):
    """Stand at the start."""
    states = np.array([[*job.scenario.start, 0.0, 0.0]] * 3)
    return Episode(job.scenario, job.controller.name, 0, "goal", "", 1.0, 0.1, states, None)


@pytest.fixture(scope="module")
def atlas():
    with Evaluator(fake_runs.drive, executor=fake_runs.IN_PROCESS) as evaluator:
        return Atlas(EXPERIMENT, SETTINGS, search_atlas(EXPERIMENT, SETTINGS, evaluator))


@pytest.fixture(scope="module")
def page(atlas, tmp_path_factory):
    path = tmp_path_factory.mktemp("atlas") / "report.html"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("evolution.report.atlas_page.drive", recorded)
        write_atlas_report(atlas, path, ["atlas", "--out", "a b"])
    return path


def test_every_elite_has_a_cell_and_a_row(atlas, page):
    text = page.read_text(encoding="utf-8")
    for one in atlas.elites:
        assert text.count(f'data-group="{one.scenario.name}"') == 1
    assert "mapbench atlas --out &#39;a b&#39;" in text
    assert f"{atlas.found.held_out.cells} cells are filled" in text
    assert '"sample":"Medians of 3 held-out seeds. Replay: the first of them."' in text
    assert "https://" not in text.split("<script>")[0].replace("https://www.w3.org", "")


def test_the_grid_has_a_name(page):
    assert '<table class="cells" aria-label="Atlas: time ratio mppi/dwb and time ratio rpp/dwb">' in page.read_text()


def test_one_seed_has_no_medians(atlas, tmp_path, monkeypatch):
    monkeypatch.setattr("evolution.report.atlas_page.drive", recorded)
    one = replace(atlas, settings=atlas.settings.replace(held_out_seeds=1))
    write_atlas_report(one, tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert '"sample":"Times and replay: the held-out seed."' in text
    assert "Medians of" not in text


@pytest.mark.parametrize(
    ("runs", "expected"),
    [
        (2, ["After 2 of 7 runs, 1 cell is filled (2 % of all cells), with a QD", "Another map may need 6"]),
        (7, ["After 7 of 7 runs, 1 cell is filled", "After 1 run on held-out seeds, 2 cells are filled"]),
        (0, ["After 0 of 7 runs, 1 cell is filled", "No further new map was found."]),
    ],
)
def test_the_sentences_say_why_runs_are_left(runs, expected):
    figures = GridFigures(1, 1 / 49, 0.5), GridFigures(2, 2 / 49, 0.5)
    found = AtlasSearch((), *figures, dropped=0, displaced=0, runs=runs, held_out_runs=1, history=())
    said = Atlas(EXPERIMENT, SETTINGS.replace(runs=7), found).sentences()
    assert [line.startswith(text) for line, text in zip(said, expected, strict=False)] == [True, True]


@pytest.mark.slow
@NEEDS_CHROMIUM
def test_a_click_on_a_cell_shows_its_map(atlas, page):
    with open_chromium(height=1000) as driver:
        driver.get(page.as_uri())
        for one in atlas.elites[:3]:
            cell = driver.find_element("css selector", f'[data-group="{one.scenario.name}"]')
            driver.execute_script("arguments[0].click()", cell)
            (heading,) = driver.find_elements("css selector", "#boards h3")
            assert heading.text.startswith(f"{one.scenario.name}: mppi/dwb {one.ratios[0]:.2f}")
            assert cell.get_attribute("aria-pressed") == "true"
            assert len(driver.find_elements("css selector", '[aria-pressed="true"]')) == 1
        assert driver.get_log("browser") == []


@pytest.mark.slow
@NEEDS_CHROMIUM
def test_a_click_scrolls_without_motion_for_readers_who_want_none(atlas, page):
    with open_chromium(height=1000) as driver:
        found = []
        for value in ("reduce", "no-preference"):
            features = [{"name": "prefers-reduced-motion", "value": value}]
            driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
            driver.get(page.as_uri())
            script = """Element.prototype.scrollIntoView = (how) => { window.how = how.behavior; };
                document.querySelector('[data-group]').click();
                return window.how;"""
            found.append(driver.execute_script(script))
        assert found == ["auto", "smooth"]


@NEEDS_CHROMIUM
def test_cells_show_their_maps_and_nothing_else_on_a_phone_and_on_paper(page):
    with open_chromium(height=1000) as driver:
        driver.get(page.as_uri())
        script = """return [...document.querySelectorAll('.cells td')].map(one =>
            getComputedStyle(one, '::before').content)"""
        with sized(driver, 390):
            assert set(driver.execute_script(script)) == {"none"}
        cell = driver.find_element("css selector", "[data-group]")
        assert cell.value_of_css_property("print-color-adjust") == "exact"
