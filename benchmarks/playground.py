"""Time from an edit of the map to the first way, to the end of each controller, and to the answer, for a page."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

import numpy as np
from websockets.sync.client import ClientConnection, connect

from evolution.driving import available_cores
from evolution.play.scenes import scene_of
from gym_mapbench import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenario

FIRST, ANSWER = "first way", "answer"


@contextmanager
def playground(workers: int) -> Iterator[str]:
    """Yield the address of a playground."""
    command = [sys.executable, "-m", "evolution", "play", "--no-browser", "--workers", str(workers)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()


def drive(page: ClientConnection, number: int, scene: dict[str, object], controllers: list[str]) -> dict[str, float]:
    """Send an edit; return the seconds to each event."""
    variants = [{"name": name, "controller": name} for name in controllers]
    request = {"type": "drive", "id": number, "scene": scene, "settings": {"preset": "thesis"}, "variants": variants}
    began, events = time.perf_counter(), {}
    page.send(json.dumps(request))
    while ANSWER not in events:
        reply = json.loads(page.recv())
        name = {"way": FIRST, "run": reply.get("variant"), "answer": ANSWER}[reply["type"]]
        events.setdefault(name, time.perf_counter() - began)
    return events


def main() -> None:
    """Drive random maps one after another, and print the median and the 90th percentile of each time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", type=int, default=30)
    parser.add_argument("--obstacles", type=int, default=15)
    parser.add_argument("--controllers", default="dwb,mppi,rpp")
    parser.add_argument("--workers", type=int, default=available_cores())
    args = parser.parse_args()
    rng, controllers = np.random.default_rng(1), args.controllers.split(",")
    env = EnvConfig(shapes={"n_obstacles": (args.obstacles, args.obstacles)})
    scenes = [scene_of(draw_scenario(env, rng)).model_dump(mode="json") for _ in range(args.maps + 1)]
    with playground(args.workers) as address:
        parts = urlsplit(address)
        origin = f"http://{parts.netloc}"
        with connect(f"ws://{parts.netloc}{parts.path}socket", origin=origin, max_size=None) as page:
            rows = [drive(page, number, scene, controllers) for number, scene in enumerate(scenes)][1:]
    print(
        f"{args.maps} maps of 7.5 m with {args.obstacles} obstacles, no noise, {args.workers} workers; s after the edit"
    )
    print(f"{'':12s}{'median':>8s}{'90 %':>8s}")
    for name in (FIRST, *controllers, ANSWER):
        times = [row[name] for row in rows]
        print(f"{name:12s}{np.median(times):8.2f}{np.percentile(times, 90):8.2f}")


if __name__ == "__main__":
    main()
