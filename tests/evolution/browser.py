"""Headless Chromium (Debian: chromium, chromium-driver) for the tests of pages; they are skipped without it."""

from __future__ import annotations

import shutil
from contextlib import contextmanager

import pytest

from tests.evolution.processes import PATIENCE

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
NEEDS_CHROMIUM = pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="chromium or chromedriver is not installed")


@contextmanager
def open_chromium(height):
    """A browser without a window, of this height in pixels: it keeps what pages write to the console, and no file."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(argument)
    options.add_argument(f"--window-size=1280,{height}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    try:
        driver.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "deny"})
        yield driver
    finally:
        driver.quit()


def until(driver, holds):
    """Wait until something holds on a page."""
    from selenium.webdriver.support.ui import WebDriverWait

    WebDriverWait(driver, PATIENCE, poll_frequency=0.05).until(lambda _: holds())


@contextmanager
def sized(driver, width, height=900):
    """A page of this size in pixels: it has it when the block begins, and its former one when the block has ended."""

    def size():
        return driver.execute_script("return [innerWidth, innerHeight]")

    before = size()
    given = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", given)
    try:
        until(driver, lambda: size() == [width, height])
        yield
    finally:
        driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        until(driver, lambda: size() == before)
