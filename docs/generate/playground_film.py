"""The film ``docs/playground.gif``: DWB stops before the goal, and two parameter changes bring DWB there.

Run from the root of the project, with Chromium and its driver (Debian: chromium, chromium-driver)::

    python -m docs.generate.playground_film
"""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from selenium import webdriver
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select, WebDriverWait

OUT = Path("docs/playground.gif")
SIZE, WIDTH = (1280, 860), 900
COLOURS = 256
KEY = "global_costmap.inflation_layer."
CHANGES = (("inflation_radius", "0.8"), ("cost_scaling_factor", "1.5"))


class Film:
    """Pictures of the page, each with the time for which it is shown, ms."""

    def __init__(self, page: webdriver.Chrome) -> None:
        self.page = page
        self.frames: list[tuple[Image.Image, int]] = []

    def take(self, duration: int) -> None:
        """Add a picture of the page."""
        picture = Image.open(io.BytesIO(self.page.get_screenshot_as_png())).convert("RGB")
        self.frames.append((picture.resize((WIDTH, round(WIDTH * picture.height / picture.width))), duration))

    def save(self, path: Path) -> None:
        """Write the film, all pictures with the colours of the first; octrees keep colours of few pixels."""
        palette = self.frames[0][0].quantize(COLOURS, method=Image.Quantize.FASTOCTREE)
        pictures = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture, _ in self.frames]
        durations = [duration for _, duration in self.frames]
        pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=durations, loop=0, optimize=True)


@contextmanager
def opened() -> Iterator[webdriver.Chrome]:
    """Yield a browser with the playground of the office."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or "chromium"
    for argument in ("--headless=new", "--no-sandbox", "--hide-scrollbars"):
        options.add_argument(argument)
    command = [sys.executable, "-m", "evolution", "play", "examples/office.yaml", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        page = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
        try:
            width, height = SIZE
            metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
            page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
            page.get(server.stdout.readline().split()[0])
            yield page
        finally:
            page.quit()
            server.terminate()


def answered(film: Film) -> None:
    """Take pictures until the answer has come."""
    status = film.page.find_element(By.ID, "status")
    WebDriverWait(film.page, 60, 0.05).until(lambda _: film.take(80) or " runs in " in status.text)


def draw_wall(film: Film) -> None:
    """Draw a wall across the corridor."""
    canvas = film.page.find_element(By.ID, "map")
    actions = ActionChains(film.page, duration=0)
    actions.move_to_element_with_offset(canvas, 20, -70).click_and_hold().perform()
    for _ in range(8):
        ActionChains(film.page, duration=0).move_by_offset(0, 8).perform()
        film.take(60)
    ActionChains(film.page, duration=0).release().perform()


def change(film: Film, name: str, value: str) -> None:
    """Change a parameter of the global costmap."""
    search = film.page.find_element(By.ID, "parameter-search")
    search.clear()
    search.send_keys(KEY + name)
    field = film.page.find_element(By.CSS_SELECTOR, "#parameter-list input")
    film.take(700)
    field.send_keys(Keys.CONTROL, "a")
    field.send_keys(value)
    film.take(700)
    field.send_keys(Keys.TAB)
    answered(film)


def main() -> None:
    """Play, and write the film."""
    with opened() as page:
        film = Film(page)
        answered(film)
        film.frames.clear()
        film.take(2500)
        draw_wall(film)
        answered(film)
        film.take(2500)
        page.find_element(By.XPATH, "//div[@id='tools']/button[text()='Undo']").click()
        answered(film)
        Select(page.find_element(By.ID, "parameter-owner")).select_by_value("costmaps")
        page.execute_script("document.getElementById('parameters').scrollIntoView({block: 'end'})")
        film.take(800)
        for name, value in CHANGES:
            change(film, name, value)
        page.execute_script("scrollTo(0, 0)")
        film.take(3500)
    film.save(OUT)
    print(f"{OUT}: {len(film.frames)} pictures, {OUT.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
