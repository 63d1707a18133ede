"""The search of the built site, opened from disk in headless Chromium, with the script that the site has for it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.evolution.browser import NEEDS_CHROMIUM, open_chromium, until

pytest.importorskip("material", reason="the extra docs is not installed")
pytest.importorskip("selenium.webdriver", reason="selenium is not installed")

ROOT = Path(__file__).parents[1]
SMALL = """
site_name: Small
use_directory_urls: false
theme: {name: material, font: false}
plugins: [search, offline]
extra: {generator: false, polyfills: [iframe-worker.js]}
"""


def test_the_site_makes_its_search_for_pages_on_disk():
    site = (ROOT / "mkdocs.yml").read_text()
    assert "\n  - offline\n" in site
    assert "\n  polyfills: [iframe-worker.js]" in site


@pytest.mark.slow
@NEEDS_CHROMIUM
@pytest.mark.parametrize("page", ["index", "howto/slow"])
def test_words_are_found_without_a_server(tmp_path, page):
    pages = {"index": "# Home\n\nwords\n", "howto/slow": "# Slow\n\ninflation\n"}
    for name, content in pages.items():
        (tmp_path / "docs" / f"{name}.md").parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "docs" / f"{name}.md").write_text(content)
    (tmp_path / "docs/iframe-worker.js").write_bytes((ROOT / "docs/iframe-worker.js").read_bytes())
    (tmp_path / "mkdocs.yml").write_text(SMALL)
    subprocess.run([sys.executable, "-m", "mkdocs", "build", "-q"], cwd=tmp_path, check=True)
    shown = tmp_path / "site" / f"{page}.html"
    assert not re.search(r'src="https?:', shown.read_text())
    with open_chromium(height=900) as browser:
        browser.get(shown.as_uri())
        field = browser.find_element("css selector", ".md-search__input")
        browser.execute_script("arguments[0].focus()", field)
        field.send_keys("inflation")
        result = browser.find_element("css selector", ".md-search-result")
        until(browser, lambda: "1 matching document" in result.get_property("innerText"))
        assert "Slow" in result.get_property("innerText")
        assert browser.get_log("browser") == []
