"""The playground in headless Chromium (Debian: chromium, chromium-driver): draw, read, change, save, and keys."""

from __future__ import annotations

import csv
import io
import re
import subprocess
import sys
import zipfile
from itertools import combinations
from pathlib import Path

import pytest

pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
pytest.importorskip("uvicorn", reason="uvicorn is not installed")

from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

from tests.evolution.browser import NEEDS_CHROMIUM, open_chromium, sized, until

pytestmark = [pytest.mark.slow, NEEDS_CHROMIUM]
OFFICE = Path(__file__).parents[4] / "examples" / "office.yaml"


@pytest.fixture(scope="module")
def address():
    """The address of a playground with the office map, on which DWB stands still before the time limit."""
    command = [sys.executable, "-m", "evolution", "play", str(OFFICE), "--no-browser", "--time-limit", "40"]
    with subprocess.Popen([*command, "--controllers", "dwb,rpp"], stdout=subprocess.PIPE, text=True) as process:
        yield process.stdout.readline().split()[0]
        process.terminate()


@pytest.fixture(scope="module")
def chromium():
    with open_chromium(height=1000) as driver:
        yield driver


@pytest.fixture
def page(chromium, address):
    """The page, freshly loaded, after its first answer; the console stays empty."""
    chromium.get("about:blank")
    chromium.get(address)
    wait_for_answer(chromium)
    yield chromium
    assert [entry["message"] for entry in chromium.get_log("browser")] == []


def wait_for_answer(page):
    until(page, lambda: " runs in " in text(page, "status"))


def text(page, name):
    return page.find_element(By.ID, name).text


def click(page, name):
    page.execute_script("document.getElementById(arguments[0]).click()", name)


def times(page):
    """Text of the column of times, by controller."""
    rows = [row.find_elements(By.TAG_NAME, "td") for row in page.find_elements(By.CSS_SELECTOR, "#table tr")]
    return {cells[0].text: cells[2].text for cells in rows if cells}


def tool(page, name):
    page.find_element(By.XPATH, f"//div[@id='tools']/button[text()='{name}']").click()


def drag(page, start, move):
    canvas = page.find_element(By.ID, "map")
    ActionChains(page, duration=50).move_to_element_with_offset(canvas, *start).click_and_hold().move_by_offset(
        *move
    ).release().perform()


def changes(page, act):
    """Act, and wait for the answer to what that changed."""
    page.execute_script("document.getElementById('status').textContent = ''")
    act()
    wait_for_answer(page)


def test_a_failure_is_explained_where_it_happened(page):
    assert times(page)["dwb"] == "–"
    assert float(times(page)["rpp"]) == pytest.approx(25.0, abs=1.0)
    assert text(page, "verdict").startswith("One run of each cannot tell")
    assert re.search(r"dwb: the time limit was reached; it stood at \(7\.6", text(page, "verdict"))


def test_a_wall_changes_the_way_and_undo_brings_it_back(page):
    before = times(page)
    tool(page, "Wall")
    changes(page, lambda: drag(page, (20, -60), (0, 60)))
    assert times(page) != before
    assert (
        page.find_element(By.ID, "command").get_property("textContent").startswith("mapbench bench office_edited.yaml")
    )
    changes(page, lambda: tool(page, "Undo"))
    assert times(page) == before
    assert page.find_element(By.ID, "command").get_property("textContent").startswith("mapbench bench office.yaml")
    changes(page, lambda: tool(page, "Redo"))
    assert times(page) != before


def test_the_inflation_radius_changes_the_way_and_is_listed(page):
    before = times(page)
    Select(page.find_element(By.ID, "parameter-owner")).select_by_value("costmaps")
    page.find_element(By.ID, "parameter-search").send_keys("global_costmap.inflation_layer.inflation_radius")
    field = page.find_element(By.CSS_SELECTOR, "#parameter-list input")
    field.send_keys(Keys.CONTROL, "a")
    changes(page, lambda: field.send_keys("0.3", Keys.TAB))
    assert times(page)["rpp"] != before["rpp"]
    assert "global_costmap.inflation_layer.inflation_radius: 0.55 becomes 0.3" in text(page, "differs")
    assert page.find_elements(By.CSS_SELECTOR, ".parameter.changed")
    changes(page, lambda: click(page, "reset"))
    assert times(page) == before
    assert text(page, "differs") == "Nothing is changed."


def test_the_focus_goes_on_to_the_next_field_after_a_change(page):
    Select(page.find_element(By.ID, "parameter-owner")).select_by_value("dwb")
    page.find_element(By.ID, "parameter-search").send_keys("min_speed")
    field, following = page.find_elements(By.CSS_SELECTOR, "#parameter-list input")[:2]
    field.send_keys(Keys.CONTROL, "a")
    changes(page, lambda: field.send_keys("0.05", Keys.ENTER))
    assert page.switch_to.active_element == field
    changes(page, lambda: field.send_keys(Keys.CONTROL, "a", Keys.NULL, "0.1", Keys.TAB))
    assert page.switch_to.active_element == following
    assert len(page.find_elements(By.CSS_SELECTOR, ".parameter.changed")) == 1
    hint = page.find_element(By.CSS_SELECTOR, ".parameter .hint").text
    assert re.search(r"\. Default -?[\d.]+ m/s\.", hint)
    hints = page.execute_script("return document.getElementById('parameter-list').textContent")
    assert "``" not in hints
    changes(page, lambda: click(page, "reset"))


def test_a_frozen_variant_stands_beside_the_changed_one(page):
    Select(page.find_element(By.ID, "parameter-owner")).select_by_value("rpp")
    changes(page, lambda: click(page, "compare"))
    page.find_element(By.ID, "parameter-search").send_keys("desired_linear_vel")
    field = page.find_element(By.CSS_SELECTOR, "#parameter-list input")
    field.send_keys(Keys.CONTROL, "a")
    changes(page, lambda: field.send_keys("0.3", Keys.TAB))
    found = times(page)
    assert float(found["rpp 2"]) > float(found["rpp"]) + 5


def test_the_command_gives_the_numbers_of_the_page(page, tmp_path):
    changes(page, lambda: drag(page, (20, -60), (0, 40)))
    found = times(page)
    archive = page.execute_async_script(
        "const done = arguments[0], make = URL.createObjectURL;"
        "URL.createObjectURL = (blob) => {"
        "  blob.arrayBuffer().then((bytes) => done([...new Uint8Array(bytes)]));"
        "  return make(blob); };"
        "document.getElementById('save-session').click();"
    )
    zipfile.ZipFile(io.BytesIO(bytes(archive))).extractall(tmp_path)
    words = (tmp_path / "command.txt").read_text().split()
    assert " ".join(words) == " ".join(
        page.execute_script("return document.getElementById('command').textContent").split()
    )
    run = [sys.executable, "-m", "evolution", *words[1:], "--format", "csv"]
    output = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    rows = {row["controller"]: row for row in csv.DictReader(io.StringIO(output))}
    assert set(rows) == set(found)
    for name, row in rows.items():
        assert (f"{float(row['time_s']):.2f}" if row["outcome"] == "goal" else "–") == found[name]


def test_what_a_controller_considers_is_shown_at_any_time(page):
    page.execute_script("const s = document.getElementById('scrub'); s.value = 20; s.dispatchEvent(new Event('input'))")
    until(page, lambda: "dwb at 20.00 s" in text(page, "hover"))
    assert "419 candidates" in text(page, "hover")


def test_everything_by_the_keyboard(page):
    before = times(page)
    body = page.find_element(By.TAG_NAME, "body")
    body.send_keys("m")
    assert page.switch_to.active_element.get_attribute("id") == "map"
    canvas = page.switch_to.active_element
    canvas.send_keys("l", Keys.ARROW_RIGHT, Keys.ENTER, *[Keys.ARROW_DOWN] * 12)
    changes(page, lambda: canvas.send_keys(Keys.ENTER))
    assert times(page) != before
    changes(page, lambda: canvas.send_keys(Keys.CONTROL, "z"))
    assert times(page) == before
    changes(page, lambda: canvas.send_keys("u"))
    assert times(page) != before
    changes(page, lambda: canvas.send_keys(Keys.CONTROL, "z"))
    canvas.send_keys("?")
    assert page.find_element(By.ID, "help").is_displayed()


def test_a_random_map_and_a_link_to_it(page, address):
    Select(page.find_element(By.ID, "family")).select_by_value("doors")
    changes(page, lambda: click(page, "draw-random"))
    assert text(page, "map-name") == "doors"
    found = times(page)
    click(page, "copy-link")
    until(page, lambda: "#map=" in page.current_url)
    link = page.current_url
    page.get("about:blank")
    page.get(link)
    wait_for_answer(page)
    assert times(page) == found


def test_a_narrow_window_needs_no_sideways_scrolling(page):
    with sized(page, 390):
        assert page.execute_script("return document.documentElement.scrollWidth <= innerWidth")


WRITTEN = """
window.texts = {};
const draw = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
  window.texts[text] = [x, y - 12, x + this.measureText(text).width, y, this.canvas.width];
  draw.call(this, text, x, y);
};
document.getElementById("map").dispatchEvent(new PointerEvent("pointermove", {clientX: 100, clientY: 300}));
"""


# Whether all three texts stand where the canvas has the width that it has on the page.
DRAWN = """
const across = document.getElementById("map").clientWidth, widths = Object.values(window.texts).map((text) => text[4]);
return widths.length === 3 && widths.every((width) => width === across);
"""


@pytest.mark.parametrize("width", [390, 1200])
def test_labels_and_columns_are_whole(page, width):
    with sized(page, width):
        page.execute_script(WRITTEN)
        until(page, lambda: page.execute_script(DRAWN))
        texts = page.execute_script("return window.texts")
        assert set(texts) == {"start", "goal", "dwb: timeout"}
        assert all(left >= 0 and right <= across for left, _, right, _, across in texts.values())
        for (_, a), (_, b) in combinations(texts.items(), 2):
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
        table = page.find_element(By.CSS_SELECTOR, ".scroll")
        assert table.get_property("scrollWidth") == table.get_property("clientWidth")


def test_edits_in_a_row_answer_the_last_one(page):
    before = times(page)
    tool(page, "Brush")
    for _ in range(10):
        drag(page, (20, -60), (0, 5))
        tool(page, "Undo")
    changes(page, lambda: tool(page, "Redo"))
    changes(page, lambda: tool(page, "Undo"))
    assert times(page) == before


def test_the_page_says_what_it_waits_for(page):
    page.execute_script("WebSocket.prototype.send = () => {}")
    tool(page, "Brush")
    drag(page, (20, -60), (0, 5))
    until(page, lambda: re.search(r"^Driving for \d+ s, waiting for dwb, rpp\.", text(page, "status")))


def owner(page, name):
    Select(page.find_element(By.ID, "parameter-owner")).select_by_value(name)


def test_no_more_variants_than_the_server_takes_and_none_of_the_costmaps(page):
    body, most = page.find_element(By.TAG_NAME, "body"), 12
    owner(page, "costmaps")
    body.send_keys("k")
    assert len(page.find_elements(By.CLASS_NAME, "variant")) == 2
    owner(page, "rpp")
    changes(page, lambda: body.send_keys(most * "k"))
    assert len(page.find_elements(By.CLASS_NAME, "variant")) == most
    assert not page.find_element(By.ID, "add-variant").is_enabled()
    assert not page.find_element(By.ID, "compare").is_enabled()
    changes(page, lambda: page.find_element(By.XPATH, "//div[@class='variant']/button[text()='Remove']").click())
    assert page.find_element(By.ID, "add-variant").is_enabled()


def test_the_keyboard_says_where_the_cursor_is_and_draws_nothing_with_the_tool_move(page):
    canvas = page.find_element(By.ID, "map")
    canvas.send_keys("b", Keys.ARROW_LEFT)
    assert text(page, "hover").startswith("x 4.98 m, y 3.53 m")
    canvas.send_keys(Keys.ARROW_DOWN)
    assert text(page, "hover").startswith("x 4.98 m, y 3.48 m")
    canvas.send_keys("v", Keys.ENTER, Keys.ENTER)
    assert text(page, "map-name") == "office"


def test_a_radius_in_millimetres_and_a_share_between_0_and_1_can_be_set(page):
    radius = page.find_element(By.XPATH, "//div[@id='world-list']/label[contains(., 'radius')]/input")
    changes(page, lambda: radius.send_keys("0.105", Keys.TAB))
    assert radius.get_property("validity")["valid"]
    Select(page.find_element(By.ID, "family")).select_by_value("doors")
    place = page.find_element(By.XPATH, "//div[@id='genes']/label[starts-with(., 'at')]/input")
    assert float(place.get_property("value")) == pytest.approx(0.5)


@pytest.mark.parametrize("clipboard", ["undefined", "{writeText: () => Promise.reject(new Error('denied'))}"])
def test_a_link_is_not_called_copied_where_the_browser_lets_no_page_copy(page, clipboard):
    page.execute_script(f"Object.defineProperty(navigator, 'clipboard', {{value: {clipboard}}})")
    click(page, "copy-link")
    until(page, lambda: text(page, "status").startswith("The address of this page now holds the map; copy it"))


def test_a_map_with_a_long_name_can_be_changed_and_fits_the_page(page, address):
    script = """const [name, done] = given, {fragmentOf} = await import(location.pathname + 'static/link.js');
        const {scene} = await (await fetch(location.pathname + 'state')).json();
        done(await fragmentOf({...scene, name}));"""
    fragment = page.execute_async_script(f"(async (...given) => {{{script}}})(...arguments)", 60 * "m")
    page.get("about:blank")
    page.get(f"{address}#{fragment}")
    wait_for_answer(page)
    changes(page, lambda: drag(page, (20, -60), (0, 5)))
    assert text(page, "map-name") == 53 * "m" + "_edited"
    page.execute_script("document.querySelector('#map-list span').textContent = 'm'.repeat(60)")
    assert page.execute_script("return document.documentElement.scrollWidth <= innerWidth")


def choose_preset(page, name):
    Select(page.find_elements(By.CSS_SELECTOR, "#world-list select")[0]).select_by_value(name)


def test_a_session_that_cannot_run_shows_no_earlier_answer_and_names_the_parameter(page):
    script = """const rows = [...document.querySelectorAll('#parameter-list .parameter')];
        const input = rows.find((row) => row.innerText.startsWith('shorten_transformed_plan')).querySelector('input');
        input.click();"""
    changes(page, lambda: page.execute_script(script))
    choose_preset(page, "lyrical")
    until(page, lambda: "unknown parameter 'shorten_transformed_plan'" in text(page, "status"))
    assert page.find_element(By.ID, "answer").get_attribute("aria-busy") == "false"
    assert [text(page, name) for name in ("verdict", "table")] == ["", ""]
    assert page.execute_script("return document.getElementById('command').textContent") == ""
    assert "shorten_transformed_plan is no parameter of these, Reset removes it" in text(page, "differs")
    changes(page, lambda: click(page, "reset"))
    assert set(times(page)) == {"dwb", "rpp"}


def test_the_thoughts_of_rpp_are_said_below_the_map(page):
    Select(page.find_element(By.CSS_SELECTOR, "#overlays select")).select_by_value("rpp")
    until(page, lambda: "rpp at 25." in text(page, "hover"))
    assert re.search(r"carrot \d\.\d\d m ahead, curvature -?\d\.\d\d 1/m; at most 0\.50 m/s", text(page, "hover"))


@pytest.mark.parametrize("change", [{"cells": "!!"}, {"width": 10**9}, {"start": None}])
def test_a_link_that_cannot_be_read_leaves_the_map_of_the_command_line(page, address, change):
    script = """const [change, done] = given, {fragmentOf} = await import(location.pathname + 'static/link.js');
        const {scene} = await (await fetch(location.pathname + 'state')).json();
        done(await fragmentOf({...scene, ...change}));"""
    fragment = page.execute_async_script(f"(async (...given) => {{{script}}})(...arguments)", change)
    page.get("about:blank")
    page.get(f"{address}#{fragment}")
    wait_for_answer(page)
    assert text(page, "map-name") == "office"
