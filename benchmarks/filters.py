"""What keepout and speed zones do to controllers: runs on examples/hall.yaml with and without costmap filters.

``python benchmarks/filters.py [--runs R] [--plot FILE]`` closes a part of the shortest way with a keepout zone, limits
the speed to 40 % in a strip behind it, and runs DWB, MPPI and RPP of Jazzy's example file under nominal noise. It
prints means with bootstrap intervals.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
from matplotlib.colors import ListedColormap

from controllers.nav2_params import NavigationParams, load_preset
from controllers.registry import make_controller
from evolution.driving.one_run import environment_for, run_episode
from evolution.pictures import colour_of, draw_map, new_figure
from evolution.statistics import bootstrap_interval
from gym_mapbench.costmap import FilterMask, KeepoutFilter, SpeedFilter
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.scenario import Scenario

CONTROLLERS = ("dwb", "mppi", "rpp")
KEEPOUT = (4.5, 5.5, 3.2, 4.4)
STRIP = (7.0, 8.2, 0.0, 7.0)
TITLES = ("no filters", "zones with a border")
BORDER = 0.5
"""Width of the band of falling values around the keepout zone, m."""


def zone(scenario: Scenario, place: Sequence[float], value: int, border: float = 0.0) -> FilterMask:
    """Return a mask of a map with a zone ``(x0, x1, y0, y1)``, and a band of falling values around it."""
    (rows, cols), cell = scenario.map.shape, scenario.map.resolution
    x, y = (np.arange(cols) + 0.5) * cell, (np.arange(rows)[:, None] + 0.5) * cell
    x0, x1, y0, y1 = place
    away = np.hypot(np.maximum(np.maximum(x0 - x, x - x1), 0.0), np.maximum(np.maximum(y0 - y, y - y1), 0.0))
    around = np.where(away < border, 0.9 * value * (1.0 - away / max(border, cell)), 0.0)
    return FilterMask.from_values(np.where(away == 0.0, value, around).astype(np.int8), cell, scenario.map.origin)


def filtered(navigation: NavigationParams, scenario: Scenario, border: float) -> NavigationParams:
    """Return parameters with a keepout filter in both costmaps and a speed filter in the global costmap."""
    keepout = {"keepout_filter": KeepoutFilter(mask=zone(scenario, KEEPOUT, 100, border))}
    slow = SpeedFilter(mask=zone(scenario, STRIP, 60), base=100.0, multiplier=-1.0, percentage=True)
    local, whole = navigation.local_costmap, navigation.global_costmap
    return navigation.replace(
        local_costmap=local.replace(keepout_filters=keepout),
        global_costmap=whole.replace(keepout_filters=keepout, speed_filters={"speed_filter": slow}),
    )


def drive(name: str, navigation: NavigationParams, scenario: Scenario, runs: int) -> list[Episode]:
    """Return the runs of a controller, with seeds 0 to ``runs`` - 1."""
    controller = make_controller(name, navigation=navigation)
    env = environment_for(EnvConfig.build(noise="nominal"), controller)
    return [run_episode(env, controller, scenario, name=name, seed=seed) for seed in range(runs)]


def row(what: str, episodes: Sequence[Episode], mask: FilterMask) -> str:
    """Return a line of the table: runs at the goal, time, speed in the strip, time in the keepout zone."""
    reached = [episode for episode in episodes if episode.outcome == "goal"]
    times = interval([episode.time for episode in reached])
    speeds = interval([in_strip(episode) for episode in episodes])
    entered = sum(bool(inside(mask, episode)) for episode in episodes)
    return f"| {what} | {len(reached)} of {len(episodes)} | {times} | {speeds} | {entered} |"


def in_strip(episode: Episode) -> float:
    """Return the mean speed in the second half of the strip, m/s."""
    x, v = episode.trajectory[:, 0], episode.trajectory[:, 3]
    there = (x > 0.5 * (STRIP[0] + STRIP[1])) & (x < STRIP[1])
    return float(v[there].mean()) if there.any() else np.nan


def inside(mask: FilterMask, episode: Episode) -> int:
    """Return the number of steps with the robot's centre in a cell of value 100."""
    mine, (resolution, x, y) = mask.values, mask.geometry
    cols, rows = ((episode.trajectory[:, :2] - (x, y)) / resolution).astype(int).T
    return int((mine[rows, cols] == 100).sum())


def interval(values: Sequence[float]) -> str:
    """Return a mean with its 95 % bootstrap interval, without missing values."""
    known = np.array([value for value in values if np.isfinite(value)])
    if not len(known):
        return "-"
    low, high = bootstrap_interval(known, np.random.default_rng(0))
    return f"{known.mean():.2f} ({low:.2f} to {high:.2f})"


def main() -> None:
    """Run, print and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--plot", help="file of the picture")
    args = parser.parse_args()
    scenario, plain = load_scenarios("examples/hall.yaml")[0], load_preset("jazzy")
    hard, soft = filtered(plain, scenario, 0.0), filtered(plain, scenario, BORDER)
    mask = zone(scenario, KEEPOUT, 100)
    drawn = []
    print("| controller, filters | at the goal | time, s | speed in the strip, m/s | runs in the keepout zone |")
    print("|---|---|---|---|---|")
    for name in CONTROLLERS:
        for what, navigation in ((TITLES[0], plain), ("zones", hard), (TITLES[1], soft)):
            episodes = drive(name, navigation, scenario, args.runs)
            drawn.append((what, episodes[0]))
            print(row(f"{name}, {what}", episodes, mask), flush=True)
    if args.plot:
        draw(scenario, [[one for what, one in drawn if what == title] for title in TITLES], args.plot)


def draw(scenario: Scenario, both: Sequence[Sequence[Episode]], file: str) -> None:
    """Draw the trajectories without and with filters, and the zones."""
    figure, places = new_figure(2, width=9.6, height=3.6)
    x0, y0, x1, y1 = scenario.map.bounds
    for axes, episodes, title in zip(places.flat, both, TITLES, strict=True):
        draw_map(axes, scenario)
        axes.set_title(title, fontsize=11)
        for episode in episodes:
            name = episode.controller
            axes.plot(*episode.trajectory[:, :2].T, color=colour_of(CONTROLLERS, name), label=name)
    for place, colour in ((KEEPOUT, "#d1495b"), (STRIP, "#edae49")):
        values = np.ma.masked_equal(zone(scenario, place, 1).values, 0)
        places.flat[1].imshow(values, ListedColormap([colour]), origin="lower", extent=(x0, x1, y0, y1), alpha=0.45)
    places.flat[0].legend(loc="upper left", fontsize=8)
    figure.savefig(file, dpi=90)


if __name__ == "__main__":
    main()
