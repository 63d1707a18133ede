"""The page in headless Chromium (Debian: chromium, chromium-driver): it opens, plays, sorts, enlarges and prints."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from PIL import Image

from evolution.report.page import Attachment, Section, Table, render_page
from evolution.report.study_page import report_of_study
from evolution.studies import load_results
from evolution.studies.analysis.comparisons import analyse
from evolution.studies.analysis.figures import drive_best_sets

pytest.importorskip("selenium.webdriver", reason="selenium is not installed")

from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

from tests.evolution.browser import NEEDS_CHROMIUM, open_chromium, sized, until

pytestmark = [pytest.mark.slow, NEEDS_CHROMIUM]


@pytest.fixture(scope="module")
def page(study_path, tmp_path_factory, fake_driving):
    """The report of a study as a file."""
    results = load_results(study_path)
    report = report_of_study(analyse(results), drive_best_sets(results))
    picture = io.BytesIO()
    Image.new("RGB", (400, 300), "#0072b2").save(picture, "png")
    figures = [Attachment("A figure", "image/png", picture.getvalue())]
    path = tmp_path_factory.mktemp("page") / "report.html"
    sections = [report.sections[0], Section("Figures", figures=figures, id="figures")]
    path.write_text(render_page(replace(report, sections=sections)), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def chromium():
    with open_chromium(height=1600) as driver:
        yield driver


@pytest.fixture
def opened(chromium, page):
    """The page, freshly loaded; whatever a test does there, the console must stay empty."""
    chromium.get(page.as_uri())
    yield chromium
    assert chromium.get_log("browser") == []


def clock(browser):
    return float(browser.find_element(By.ID, "clock").text.split()[0])


def canvas(browser):
    """What all maps show; the runs on one of them may have ended before the others."""
    return browser.execute_script("return [...document.querySelectorAll('canvas')].map((one) => one.toDataURL())")


def column(browser, number):
    rows = browser.find_element(By.CSS_SELECTOR, "table.sortable").find_elements(By.CSS_SELECTOR, "tbody tr")
    return [float(row.find_elements(By.TAG_NAME, "td")[number].get_dom_attribute("data-sort")) for row in rows]


def test_it_opens_in_light_and_dark(opened):
    assert opened.title == "Study: small"
    assert len(opened.find_elements(By.TAG_NAME, "canvas")) == 3
    papers = []
    for scheme in ("light", "dark"):
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        papers.append(opened.find_element(By.TAG_NAME, "body").value_of_css_property("background-color"))
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    assert papers == ["rgba(255, 255, 255, 1)", "rgba(20, 24, 29, 1)"]


FRAMES = """
performance.now = () => 0;
window.requestAnimationFrame = (draw) => { window.frameAt = draw; };
"""
"""Frames come when a test asks for them: the page would otherwise reach the end while the test is held up."""


def test_the_replay_plays_and_pauses(opened):
    play = opened.find_element(By.ID, "play")
    end = clock(opened)
    assert end > 5.0
    shown = canvas(opened)
    opened.execute_script(FRAMES)
    play.click()
    assert play.text == "Pause"
    opened.execute_script("frameAt(200)")
    now = clock(opened)
    assert 0.2 <= now < end
    assert canvas(opened) != shown
    play.click()
    opened.execute_script("frameAt(400)")
    assert play.text == "Play"
    assert clock(opened) == now


def into_view(browser, selector):
    found = browser.find_element(By.CSS_SELECTOR, selector)
    browser.execute_script("arguments[0].scrollIntoView({block: 'start'})", found)
    return found


def press(browser, key, target="document.body", **modifiers):
    """Press a key on an element; whether the page took it."""
    event = {"key": key, "bubbles": True, "cancelable": True, **modifiers}
    script = f"return !{target}.dispatchEvent(new KeyboardEvent('keydown', arguments[0]))"
    return browser.execute_script(script, event)


def test_the_replay_obeys_the_keyboard(opened):
    into_view(opened, "#maps")
    body = opened.find_element(By.TAG_NAME, "body")
    end = clock(opened)
    body.send_keys(Keys.ARROW_LEFT, Keys.ARROW_LEFT)
    assert clock(opened) == pytest.approx(end - 1.0, abs=0.11)
    body.send_keys(Keys.ARROW_RIGHT)
    assert clock(opened) == pytest.approx(end - 0.5, abs=0.11)
    Select(opened.find_element(By.ID, "speed")).select_by_visible_text("30x")
    body.send_keys(" ")
    until(opened, lambda: clock(opened) == pytest.approx(end, abs=0.11))
    until(opened, lambda: opened.find_element(By.ID, "play").text == "Play")
    opened.find_element(By.ID, "scrub").send_keys(Keys.HOME)
    assert clock(opened) == 0.0


def test_keys_that_are_meant_for_others_are_left_alone(opened):
    into_view(opened, "#maps")
    end = clock(opened)
    for modifier in ("altKey", "ctrlKey", "metaKey"):
        assert not press(opened, "ArrowLeft", **{modifier: True})
    for target in (".scroll", "nav a", "details summary"):
        assert not press(opened, "ArrowLeft", f"document.querySelector('{target}')")
        assert not press(opened, " ", f"document.querySelector('{target}')")
    assert clock(opened) == end
    assert press(opened, "ArrowLeft")
    assert press(opened, "ArrowLeft", "document.querySelector('#boards canvas')")
    assert clock(opened) == pytest.approx(end - 1.0, abs=0.11)
    into_view(opened, "#repeat")
    assert not press(opened, " ")
    assert not press(opened, "ArrowRight")
    assert opened.find_element(By.ID, "play").get_property("textContent") == "Play"


def test_map_sets_and_views_can_be_chosen(opened):
    choice = Select(opened.find_element(By.ID, "group"))
    assert len(choice.options) == 7
    before = canvas(opened)
    choice.select_by_index(3)
    assert "best_of_random" in choice.first_selected_option.text
    assert canvas(opened) != before
    Select(opened.find_element(By.ID, "view")).select_by_value("side")
    assert len(opened.find_elements(By.TAG_NAME, "canvas")) == 9


@pytest.mark.parametrize("how", ["click", "key"])
def test_tables_sort(opened, how):
    heading = opened.find_elements(By.CSS_SELECTOR, "table.sortable th")[2]
    assert heading.text == "mean"
    opened.execute_script("arguments[0].scrollIntoView({block: 'center'})", heading)
    for order in ("descending", "ascending"):
        if how == "click":
            heading.click()
        else:
            heading.send_keys(Keys.ENTER)
        until(opened, lambda order=order: column(opened, 2) == sorted(column(opened, 2), reverse=order == "descending"))
        assert heading.get_dom_attribute("aria-sort") == order


def test_figures_enlarge_and_close_by_keyboard(opened):
    figure = opened.find_element(By.CSS_SELECTOR, "img.zoom")
    opened.execute_script("arguments[0].scrollIntoView({block: 'center'})", figure)
    figure.send_keys(Keys.ENTER)
    until(opened, lambda: opened.find_elements(By.CSS_SELECTOR, ".medium-zoom--opened"))

    def closes():  # not before the picture has come to rest
        opened.find_element(By.TAG_NAME, "body").send_keys(Keys.ESCAPE)
        return not opened.find_elements(By.CSS_SELECTOR, ".medium-zoom--opened")

    until(opened, closes)


def test_it_prints_without_its_controls(opened):
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert not opened.find_element(By.ID, "play").is_displayed()
    assert opened.find_element(By.CSS_SELECTOR, "table.sortable").is_displayed()
    assert len(opened.execute_cdp_cmd("Page.printToPDF", {})["data"]) > 10_000
    assert opened.find_element(By.CSS_SELECTOR, "caption .hint").is_displayed()
    assert not opened.find_element(By.CSS_SELECTOR, "#tables > .hint").is_displayed()
    assert opened.find_element(By.CSS_SELECTOR, ".scroll").value_of_css_property("overflow-x") == "visible"
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


def test_the_configuration_is_printed_although_it_is_folded(opened):
    details = opened.find_element(By.TAG_NAME, "details")
    for event, is_open in (("beforeprint", True), ("afterprint", False)):
        opened.execute_script(f"window.dispatchEvent(new Event('{event}'))")
        assert details.get_property("open") is is_open


def test_nothing_scrolls_sideways_on_a_phone(opened):
    with sized(opened, 390):
        for selector in ("html", ".scroll"):
            found = opened.find_element(By.CSS_SELECTOR, selector)
            assert found.get_property("scrollWidth") == found.get_property("clientWidth")
        note = opened.find_element(By.CSS_SELECTOR, "caption .hint")
        assert note.rect["x"] + note.rect["width"] < 390


LONG = "warehouse_north_wing_floor_2_scanned_2025_11_03_final_version_corrected_by_hand"


@pytest.fixture
def long_names(chromium, study_path, tmp_path):
    """A page whose title, controllers and maps have long names without spaces, and with a wide table."""
    results = load_results(study_path)
    report = report_of_study(analyse(results), drive_best_sets(results))
    maps = [replace(one, title=f"{LONG}: {one.title}", sample=LONG) for one in report.maps[:2]]
    runs = [[replace(episode, controller=LONG) for episode in one.episodes] for one in maps]
    maps = [replace(one, episodes=episodes) for one, episodes in zip(maps, runs, strict=True)]
    columns = ["map", *(f"mean_{number}" for number in range(14))]
    table = Table("Runs", columns, [[LONG, *range(1_000_000, 1_000_014)]])
    page = tmp_path / "page.html"
    report = replace(report, title=LONG, maps=maps, sections=[Section("Wide", tables=[table], id="wide")])
    page.write_text(render_page(report), encoding="utf-8")
    chromium.get(page.as_uri())
    yield chromium
    chromium.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


@pytest.mark.parametrize("width", [390, 640, 1280])
def test_long_names_do_not_scroll_the_page(long_names, width):
    with sized(long_names, width):
        page = long_names.find_element(By.TAG_NAME, "html")
        assert page.get_property("scrollWidth") == page.get_property("clientWidth")
        sorting = long_names.find_element(By.CSS_SELECTOR, "#wide > .sorting")
        assert sorting.is_displayed() is long_names.find_element(By.TAG_NAME, "thead").is_displayed() is (width > 640)


def test_a_wide_table_is_printed_whole(long_names):
    with sized(long_names, 1020):
        long_names.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
        wide = long_names.find_element(By.ID, "wide")
        assert wide.value_of_css_property("page") == "tables"
        box = wide.find_element(By.CLASS_NAME, "scroll")
        assert box.get_property("scrollWidth") == box.get_property("clientWidth")


def test_rows_are_cards_on_a_phone(opened):
    script = "return getComputedStyle(document.querySelectorAll('table.sortable td')[1], '::before').content"
    assert opened.execute_script(script) == "none"
    with sized(opened, 390):
        assert opened.execute_script(script) == '"n: "'
        assert not opened.find_element(By.CSS_SELECTOR, "table.sortable thead").is_displayed()


@pytest.mark.parametrize("width", [1100, 1600])
def test_the_explanation_of_a_wide_table_is_whole(opened, width):
    script = """return [...document.querySelectorAll('.scroll')].map(box =>
        [box.clientWidth, box.querySelector('caption div').getBoundingClientRect().width])"""
    with sized(opened, width):
        assert all(caption <= box for box, caption in opened.execute_script(script))
