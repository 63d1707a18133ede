"""Pictures of the concepts, drawn by the code that they explain."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from controllers.nav2_params import NavigationParams, load_preset
from docs.generate.evolve_figures import budgets_figure, comparisons_figure
from docs.generate.gallery import KEPT
from docs.generate.thesis_figures import cluster_figure, sizes_figure
from evolution.driving import ControllerSpec, DriveSettings, Job, JobPlan, drive
from evolution.pictures import (
    colour_of,
    draw_map,
    lorenz_figure,
    maps_figure,
    new_figure,
    solved_lorenz_figure,
)
from evolution.runs import load_run, results_in
from evolution.search import gini
from evolution.search.judging import MapResults, singles_of
from gym_mapbench.costmap import build_static_costmap, inflation_costs
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.render import SeenCostmap, Snapshot, draw
from gym_mapbench.generator import FAMILIES, MOTIFS, AlongRoute, draw_from, make_family
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.planners import make_planner
from gym_mapbench.world.frames import IDENTITY
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import Pose, Scenario

ROOT = Path(__file__).parents[2]
ROBOT = make_robot("turtlebot3_waffle")
LEVELS = ("none", "nominal", "rough")
MOMENT = 9.0
"""Seconds after the start at which a local costmap is shown."""
GINIS = ((20.0, 20.0, 20.0), (20.0, 25.0, 30.0), (20.0, 20.0, 70.0), (10.0, 10.0, 130.0))
"""Times of three controllers, s, with Gini coefficients from 0 to 0.5."""
PIXELS = 600
DARK = 0.6
"""Rank correlation from which on a cell of the matrix is too dark for black digits."""
LEAST_FOR_A_BOX = 5
"""Searches of a method from which on quartiles say something."""
OTHER_SCALES = ("change:", "robust with the fitness")
"""How searches begin that the box plot leaves out: changes that were tried, and a fitness with other values."""


def _office() -> Scenario:
    return load_scenarios(ROOT / "examples" / "office.yaml")[0]


def _job(scenario: Scenario, noise: str, repeat: int = 0) -> Job:
    world = {"noise": noise, "time_limit": 150.0, "collision_ends_episode": False}
    settings = DriveSettings.from_mapping({"navigation": "fair", "environment": world}, "pictures")
    return JobPlan((ControllerSpec(name="rpp"),), settings, root_seed=1).job(scenario, 0, repeat)


def _shown(axes: Any, snapshot: Snapshot, title: str) -> None:
    """Draw a snapshot in the colours of ``mapbench drive --show-costmap``."""
    x0, y0, x1, y1 = snapshot.scenario.map.bounds
    axes.imshow(draw(snapshot, PIXELS), extent=(x0, x1, y0, y1))
    axes.set_title(title, fontsize=10)
    axes.set_xlabel("x, m")


def _seen_at(scenario: Scenario, noise: str) -> Snapshot:
    """The local costmap of RPP's robot at :data:`MOMENT`."""
    seen: list[SeenCostmap] = []
    episode = drive(_job(scenario, noise), lambda controller: seen.append(controller.seen_costmap))  # type: ignore[attr-defined]
    row = round(MOMENT / episode.control_period)
    pose, trail = Pose(*episode.trajectory[row, :3].tolist()), episode.trajectory[: row + 1, :2]
    return Snapshot(scenario, ROBOT, pose, trail, episode.path, seen=seen[row])


def _global_costmap(scenario: Scenario, navigation: NavigationParams) -> Snapshot:
    params = navigation.global_costmap
    costmap = build_static_costmap(scenario.map, params, params.make_footprint(ROBOT))
    path = make_planner("navfn").plan(costmap, scenario.start, scenario.goal)
    seen = SeenCostmap(costmap, IDENTITY, scenario.start)
    return Snapshot(scenario, ROBOT, scenario.start, path[:1, :2], path, seen=seen)


def costmaps() -> Any:
    """The global and the local costmap on the office map, and the cost by distance."""
    scenario, navigation = _office(), load_preset("fair")
    figure, (left, middle, right) = new_figure(3, width=10.5, height=3.6)
    _shown(left, _global_costmap(scenario, navigation), "global costmap and path")
    _shown(middle, _seen_at(scenario, "none"), f"local costmap after {MOMENT:g} s")
    _draw_inflation(right, navigation)
    return figure


def _draw_inflation(axes: Any, navigation: NavigationParams) -> None:
    """Draw the cost over the distance from an obstacle."""
    params = navigation.local_costmap
    layer, radius = params.inflation_layer, params.make_footprint(ROBOT).inscribed_radius
    reach = int(layer.inflation_radius / 0.001)
    costs = inflation_costs(layer, reach, 0.001, radius)[np.arange(reach + 1) ** 2]
    axes.plot(np.arange(reach + 1) * 0.001, costs, color=colour_of(["cost"], "cost"))
    for place, words in ((radius, "inscribed radius"), (layer.inflation_radius, "inflation radius")):
        axes.axvline(place, color="#888888", linestyle="--", linewidth=1)
        axes.text(place + 0.01, 20, words, fontsize=8, rotation=90)
    axes.set_xlim(0, layer.inflation_radius * 1.25)
    axes.set_ylim(0, 265)
    axes.set_title("cost by distance", fontsize=10)
    axes.set_xlabel("distance, m")
    axes.set_ylabel("cost (254: obstacle)")


def noise_seen() -> Any:
    """Draw the same moment of the same run at three levels of noise."""
    figure, panels = new_figure(3, width=10.5, height=3.1)
    for axes, level in zip(panels, LEVELS, strict=True):
        _shown(axes, _seen_at(_office(), level), f"noise: {level}")
    return figure


def noise_driven() -> Any:
    """Draw ten runs of one controller at three levels of noise."""
    scenario = _office()
    figure, panels = new_figure(3, width=10.5, height=3.1)
    for axes, level in zip(panels, LEVELS, strict=True):
        episodes = [drive(_job(scenario, level, repeat)) for repeat in range(10)]
        draw_map(axes, scenario)
        for episode in episodes:
            axes.plot(*episode.trajectory[:, :2].T, color=colour_of(["rpp"], "rpp"), linewidth=0.8, alpha=0.7)
        times = [episode.time for episode in episodes if episode.success]
        spread = f"{min(times):.1f} to {max(times):.1f} s" if times else "none"
        axes.set_title(f"{level}: {len(times)} of 10 at the goal, {spread}", fontsize=10)
    return figure


def ginis() -> Any:
    """Times of three controllers with Gini coefficients from 0 to 0.5, and their Lorenz curves."""
    names, order = ("A", "B", "C"), sorted(GINIS, key=gini)
    figure, panels = new_figure(len(order), width=10.0, height=2.9, sharey=True)
    for axes, times in zip(panels, order, strict=True):
        axes.bar(names, times, color=[colour_of(names, name) for name in names])
        axes.set_title(f"Gini {gini(times):.2f}", fontsize=10)
        for place, time in enumerate(times):
            axes.text(place, time + 2, f"{time:g}", ha="center", fontsize=8)
    panels[0].set_ylabel("travel time, s")
    panels[0].set_ylim(0, 145)
    return figure


def lorenz() -> Any:
    """The Lorenz curves of the same times."""
    order = sorted(GINIS, key=gini)
    return lorenz_figure(order, [f"Gini {gini(times):.2f}" for times in order])


def _sampled(name: str, family: Any, seed: int) -> Scenario:
    """Sample one map of a family."""
    config = EnvConfig(family=family)
    drawn = draw_from(np.random.default_rng(seed), config.family, config.shapes, config.robot)
    scenario = config.make_scenario(GridMap(drawn.cells, config.shapes.resolution), name)
    return replace(scenario, genome=drawn.genome)


def families() -> Any:
    """One map of every family that is not made of motifs."""
    names = [name for name in FAMILIES if not isinstance(make_family(name), AlongRoute)]
    return maps_figure([_sampled(name, name, seed=3) for name in names])


def motifs() -> Any:
    """One map of every motif, gates on a second route, and a sequence."""
    routes = {name: "straight" if name == "passages" else "diagonal" for name in MOTIFS.built_in}
    scenarios = [
        _sampled(f"{name}, {route}", {"name": name, "options": {"routes": [route], "count": [3, 3]}}, seed=8)
        for name, route in [("gates", "bent"), *routes.items()]
    ]
    return maps_figure([*scenarios, _sampled("sequences", "sequences", seed=8)])


def _scores(of_map: MapResults) -> list[float]:
    """Return the Gini coefficient of every trial of a map."""
    return [gini([run.time_s for (run,) in single]) for single in singles_of(of_map)]


def validation() -> Any:
    """Draw single trials of the maps of the kept set: seeds of the search, and held-out seeds."""
    run = load_run(KEPT / "quick")
    held_out = run.best_results["validation"]["seeds"]
    figure, (axes,) = new_figure(width=7.0, height=3.2)
    for place, of_map in enumerate(results_in(run.best_results, run.controllers)):
        search = _scores(tuple(runs[:-held_out] for runs in of_map))
        fresh = _scores(tuple(runs[-held_out:] for runs in of_map))
        axes.plot(search, np.full(len(search), place + 0.12), "o", color=colour_of("ab", "a"), alpha=0.7)
        axes.plot(fresh, np.full(len(fresh), place - 0.12), "D", color=colour_of("ab", "b"), alpha=0.7)
    axes.plot([], [], "o", color=colour_of("ab", "a"), label="seeds of the search and of the choice")
    axes.plot([], [], "D", color=colour_of("ab", "b"), label=f"{held_out} held-out seeds")
    axes.set_yticks(range(len(run.best_results["maps"])), [entry["name"] for entry in run.best_results["maps"]])
    axes.set_xlabel("Gini coefficient of a single trial")
    figure.legend(loc="outside lower center", frameon=False, fontsize=8, ncols=2)
    return figure


def heldout() -> Any:
    """Draw the held-out fitness of every search of the study ``robust``, by method, with boxes of the quartiles."""
    groups = _held_out_fitness()
    figure, (axes,) = new_figure(width=7.5, height=3.4)
    for place, values in enumerate(groups.values()):
        low, middle, high = np.percentile(values, [25, 50, 75])
        if len(values) >= LEAST_FOR_A_BOX:
            axes.barh(place, high - low, left=low, height=0.6, facecolor="#eeeeee", edgecolor="#888888")
            axes.plot([middle, middle], [place - 0.3, place + 0.3], color=colour_of("ab", "b"), linewidth=2)
        axes.plot(values, place + np.linspace(0.2, -0.2, len(values)), ".", color=colour_of("ab", "a"), alpha=0.7)
    axes.set_yticks(range(len(groups)), [f"{name} (n = {len(values)})" for name, values in groups.items()], fontsize=8)
    axes.invert_yaxis()
    axes.set_xscale("symlog", linthresh=10)
    axes.set_xticks([-5, 0, 5, 10, 40], ["-5", "0", "5", "10", "40"])
    axes.set_xlabel("held-out fitness (lower is better); boxes: quartiles and median")
    axes.grid(axis="x", alpha=0.3)
    return figure


def _held_out_fitness() -> dict[str, list[float]]:
    """Return the held-out fitness of searches with noise, by method."""
    groups: dict[str, list[float]] = {}
    for row in csv.DictReader((ROOT / "docs" / "concepts" / "heldout.csv").read_text(encoding="utf-8").splitlines()):
        if row["noise"] == "nominal" and not row["search"].startswith(OTHER_SCALES):
            groups.setdefault(row["search"], []).append(float(row["held_out_fitness"]))
    return groups


def metrics() -> Any:
    """Draw rank correlations of the metrics' Gini coefficients; on the diagonal those between two repeats."""
    rows = list(csv.DictReader((ROOT / "docs" / "concepts" / "metrics.csv").read_text(encoding="utf-8").splitlines()))
    names = [name for name in rows[0] if name not in ("map", "repeat")]
    table = np.array([[float(row[name]) for name in names] for row in rows]).reshape(-1, 2, len(names))
    rho = np.asarray(spearmanr(table.mean(axis=1)).statistic)
    np.fill_diagonal(rho, [spearmanr(table[:, 0, place], table[:, 1, place]).statistic for place in range(len(names))])
    figure, (axes,) = new_figure(width=7.5, height=6.0)
    axes.imshow(rho, cmap="Blues", vmin=0.0, vmax=1.0)
    for row, column in np.ndindex(rho.shape):
        colour = "white" if rho[row, column] > DARK else "black"
        axes.text(column, row, f"{rho[row, column]:.2f}", ha="center", va="center", fontsize=8, color=colour)
    axes.set_xticks(range(len(names)), names, rotation=40, ha="right", fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    return figure


PICTURES: dict[str, Callable[[], Any]] = {
    "costmaps": costmaps,
    "noise_seen": noise_seen,
    "noise_driven": noise_driven,
    "ginis": ginis,
    "lorenz": lorenz,
    "families": families,
    "motifs": motifs,
    "validation": validation,
    "heldout": heldout,
    "evolve": comparisons_figure,
    "budgets": budgets_figure,
    "metrics": metrics,
    "thesis_sizes": sizes_figure,
    "thesis_cluster": cluster_figure,
    "set_lorenz": lambda: solved_lorenz_figure(load_run(KEPT / "quick").best_results["maps"]),
}
"""Functions that draw a figure, by the name of its file."""
