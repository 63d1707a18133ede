"""What makes a controller slow or stuck, and which parameter mends it at what price.

``python benchmarks/mechanisms.py [NAME] [--seeds R] [--workers W] [--params FILE ...] [--plot FILE] [--maps FILE]``
builds maps of equal elements (``gates``, ``bends`` or ``baffles``) on a route and prints the median times of DWB, MPPI
and RPP. Then it changes one parameter of the slow controller at a time: on one of these maps, and on sampled maps of
families without a route, where it may cost something. The last table has the map for other robots and releases, with
the controller as it is and as mended. With ``--params``, a table of these parameter files takes the place of the
others. ``--plot`` draws that map of each mechanism with a run of each controller, ``--maps`` writes these maps.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean, median
from typing import Any

from matplotlib.axes import Axes
from run_tables import MISSING, is_goal, of, share
from sampled_maps import sampled

from controllers.nav2_params import read_nav2_params
from evolution import bench
from evolution.driving import ControllerSpec, DriveSettings, JobPlan, drive
from evolution.files import Row
from evolution.pictures import colour_of, draw_map, draw_trajectories, new_figure
from evolution.search import load_preset, scenario_on
from gym_mapbench.errors import MapBenchError
from gym_mapbench.generator import FamilySpec, MotifGenes, ShapeSettings
from gym_mapbench.generator.genomes import genome_of
from gym_mapbench.generator.motifs import USUAL_WIDTH
from gym_mapbench.generator.motifs.genes import Section
from gym_mapbench.generator.motifs.motif import WIDTHS
from gym_mapbench.generator.motifs.routes import Route, RouteName
from gym_mapbench.mapio import save_map_set
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import Scenario

WAFFLE = "turtlebot3_waffle"
WORLDS = (
    (WAFFLE, "fair"),
    (WAFFLE, "jazzy_fair"),
    (WAFFLE, "lyrical_fair"),
    ("turtlebot3_waffle_gz", "fair"),
    ("turtlebot3_burger", "fair"),
    ("jackal", "fair"),
)
"""Robots and navigation presets of the last table."""
CONTROLLERS = ("dwb", "mppi", "rpp")
ROOT_SEED = 11
SHOWN = 6
"""Repeat that the picture shows."""
CHANGE_HEADER = (
    "| {controller} | {at}, s | goals elsewhere, % | time, s | clearance, m | contacts |\n|---|---|---|---|---|---|"
)
SAMPLED = 40
FIRST_SEED = 9000
Change = Mapping[str, Any]


@dataclass(frozen=True)
class Mechanism:
    """Equal elements on a route that make one controller slow or stuck.

    Args:
        controller: The controller.
        route: The route.
        regular: Genes that all maps have, m (slopes and phases are shares).
        varied: The gene that the first table varies, with its values, m.
        counts: Numbers of elements.
        probe: Value of the varied gene and number of elements on the map of the changes.
        changes: Changed parameters, by what the table says.
        mend: The change of the last table.
        lacking: Navigation presets whose controller does not have the parameter of ``mend``.
    """

    controller: str
    route: RouteName
    regular: Mapping[str, float]
    varied: tuple[str, tuple[float, ...]]
    counts: tuple[int, ...]
    probe: tuple[float, int]
    changes: Mapping[str, Change]
    mend: str
    lacking: tuple[str, ...] = ()


STRAIGHT = {"phase": 0.0, "shift": 0.0, "slope": 0.0, "swing": 0.0}
MECHANISMS: dict[str, Mechanism] = {
    "gates": Mechanism(
        controller="mppi",
        route="diagonal",
        regular={**STRAIGHT, "pitch": 1.5, "gap": 0.95},
        varied=("thickness", (0.1, 0.2, 0.3, 0.4)),
        counts=(1, 2, 3, 4),
        probe=(0.3, 4),
        changes={
            "CostCritic.cost_weight 3.81 to 2": {"CostCritic": {"cost_weight": 2.0}},
            "CostCritic.cost_weight 3.81 to 1": {"CostCritic": {"cost_weight": 1.0}},
            "PathFollowCritic.cost_weight 5 to 10": {"PathFollowCritic": {"cost_weight": 10.0}},
            "PathFollowCritic.cost_weight 5 to 20": {"PathFollowCritic": {"cost_weight": 20.0}},
            "PathAlignCritic.max_path_occupancy_ratio 0.05 to 0.3": {
                "PathAlignCritic": {"max_path_occupancy_ratio": 0.3}
            },
            "PathAlignCritic.max_path_occupancy_ratio 0.05 to 1": {
                "PathAlignCritic": {"max_path_occupancy_ratio": 1.0}
            },
            "PathAngleCritic without": {"PathAngleCritic": {"enabled": False}},
            "PreferForwardCritic without": {"PreferForwardCritic": {"enabled": False}},
            "temperature 0.3 to 0.1": {"temperature": 0.1},
            "wz_std 0.4 to 0.8": {"wz_std": 0.8},
            "vx_std 0.2 to 0.4": {"vx_std": 0.4},
            "PathFollowCritic.threshold_to_consider 1.4 to 0.5": {"PathFollowCritic": {"threshold_to_consider": 0.5}},
            "the same, vx_std 0.2 to 0.4": {"PathFollowCritic": {"threshold_to_consider": 0.5}, "vx_std": 0.4},
            "GoalCritic.threshold_to_consider 1.4 to 0.5": {"GoalCritic": {"threshold_to_consider": 0.5}},
            "prune_distance 1.7 to 1.2": {"prune_distance": 1.2},
        },
        mend="vx_std 0.2 to 0.4",
    ),
    "bends": Mechanism(
        controller="rpp",
        route="straight",
        regular={**STRAIGHT, "pitch": 2.2, "length": 1.0, "offset": 0.8},
        varied=("width", (0.7, 0.75, 0.8, 0.85, 0.9)),
        counts=(1,),
        probe=(0.8, 1),
        changes={
            "use_collision_detection false": {"use_collision_detection": False},
            "max_allowed_time_to_collision_up_to_carrot 1 to 0.5": {"max_allowed_time_to_collision_up_to_carrot": 0.5},
            "use_rotate_to_heading false": {"use_rotate_to_heading": False},
            "rotate_to_heading_min_angle 0.785 to 0.4": {"rotate_to_heading_min_angle": 0.4},
            "use_velocity_scaled_lookahead_dist true": {"use_velocity_scaled_lookahead_dist": True},
            "lookahead_dist 0.6 to 0.9": {"lookahead_dist": 0.9},
            "lookahead_dist 0.6 to 0.4": {"lookahead_dist": 0.4},
            "lookahead_dist 0.6 to 0.3": {"lookahead_dist": 0.3},
        },
        mend="lookahead_dist 0.6 to 0.3",
    ),
    "baffles": Mechanism(
        controller="dwb",
        route="straight",
        regular={**STRAIGHT, "overlap": 0.3, "thickness": 0.1},
        varied=("pitch", (1.3, 1.5)),
        counts=(2, 3, 4),
        probe=(1.3, 3),
        changes={
            "BaseObstacle.scale 0.02 to 0.1": {"BaseObstacle": {"scale": 0.1}},
            "PathAlign.scale 32 to 64": {"PathAlign": {"scale": 64.0}},
            "PathDist.scale 32 to 64": {"PathDist": {"scale": 64.0}},
            "GoalDist.scale 24 to 48": {"GoalDist": {"scale": 48.0}},
            "GoalDist.scale and GoalAlign.scale 24 to 12": {"GoalDist": {"scale": 12.0}, "GoalAlign": {"scale": 12.0}},
            "vx_samples 20 to 40": {"vx_samples": 40},
            "vtheta_samples 20 to 40": {"vtheta_samples": 40},
            "min_vel_x 0 to -0.1": {"min_vel_x": -0.1},
            "sim_time 1.7 to 1": {"sim_time": 1.0},
            "sim_time 1.7 to 2.5": {"sim_time": 2.5},
            "sim_time 1.7 to 3": {"sim_time": 3.0},
            "PathAlign.scale and PathDist.scale 32 to 16": {"PathAlign": {"scale": 16.0}, "PathDist": {"scale": 16.0}},
            "forward_prune_distance 2 to 1.2": {"forward_prune_distance": 1.2},
            "forward_prune_distance 2 to 1": {"forward_prune_distance": 1.0},
            "forward_prune_distance 2 to 0.8": {"forward_prune_distance": 0.8},
            "forward_prune_distance 2 to 0.6": {"forward_prune_distance": 0.6},
        },
        mend="forward_prune_distance 2 to 1",
        lacking=("lyrical_fair",),
    ),
}


def build(family: str, value: float, count: int, robot: str = WAFFLE) -> Scenario:
    """Return the map of some equal elements; gaps and corridors leave equal room beside each robot."""
    one, spec = MECHANISMS[family], make_robot(robot)
    usual = {**one.regular, one.varied[0]: value}
    wider = spec.width - USUAL_WIDTH
    shared = {gene: value + wider if gene in WIDTHS else value for gene, value in usual.items()}
    genes = MotifGenes(route=Route(name=one.route), sections=(Section(shared=shared, elements=({},) * count),))
    family_of_robot = FamilySpec(name=family, options={"routes": [one.route]}).for_robot(spec)
    scenario = scenario_on(family_of_robot.make().build(genes, ShapeSettings()), ShapeSettings())
    return replace(scenario, name=f"{family}_{count}_{value:g}", genome=genome_of(family_of_robot, genes))


def times(rows: Sequence[Row]) -> str:
    """Return the median time of some runs, the least, the greatest and the failures."""
    found = [float(row["time_s"]) for row in rows if is_goal(row)]
    if not found:
        return f"none of {len(rows)}"
    failed = f", {len(rows) - len(found)} failed" if len(found) < len(rows) else ""
    return f"{median(found):.1f} ({min(found):.1f} to {max(found):.1f}{failed})"


def print_maps(family: str, seeds: int, options: Mapping[str, Any]) -> None:
    """Print the times of all controllers by map."""
    one = MECHANISMS[family]
    gene, values = one.varied
    maps = {(value, count): build(family, value, count) for value in values for count in one.counts}
    rows = bench(list(maps.values()), list(CONTROLLERS), repeats=seeds, **options).rows
    print(f"| {gene}, m | {family} | DWB, s | MPPI, s | RPP, s |\n|---|---|---|---|---|")
    for (value, count), scenario in maps.items():
        own = [of(rows, map=scenario.name, controller=name) for name in CONTROLLERS]
        print(f"| {value:g} | {count} | " + " | ".join(map(times, own)) + " |", flush=True)


def print_changes(family: str, seeds: int, options: Mapping[str, Any]) -> None:
    """Print what each change does on one map, and elsewhere."""
    one = MECHANISMS[family]
    changes = {"as it is": {}, **one.changes}
    specs = [
        ControllerSpec(name=f"{one.controller}_{number}", kind=one.controller, params=dict(change))
        for number, change in enumerate(changes.values())
    ]
    found = bench([build(family, *one.probe)], specs, repeats=seeds, **options).rows
    elsewhere = bench(sampled(SAMPLED, FIRST_SEED), specs, repeats=1, **options).rows
    print(CHANGE_HEADER.format(controller=one.controller.upper(), at=f"{one.probe[1]} {family}"))
    for spec, label in zip(specs, changes, strict=True):
        print(change_line(label, *(of(some, controller=spec.name) for some in (found, elsewhere))), flush=True)


def change_line(label: str, at_map: Sequence[Row], elsewhere: Sequence[Row]) -> str:
    """Return the table line of one change."""
    goals = [row for row in elsewhere if is_goal(row)]
    means = (MISSING, MISSING)
    if goals:
        means = tuple(
            f"{fmean(float(row[column]) for row in goals):.{digits}f}"
            for column, digits in (("time_s", 1), ("min_clearance", 3))
        )
    contacts = f"{fmean(float(row['n_contacts'] or 0) for row in elsewhere):.2f}"
    return "| " + " | ".join([label, times(at_map), share(elsewhere), *means, contacts]) + " |"


def print_worlds(family: str, seeds: int, options: Mapping[str, Any]) -> None:
    """Print the times of robots and releases, as the controller is and as mended."""
    one = MECHANISMS[family]
    others = [name for name in CONTROLLERS if name != one.controller]
    heads = [*(f"{name.upper()}, s" for name in (*others, one.controller)), f"{one.controller.upper()}, {one.mend}, s"]
    print("| robot | preset | " + " | ".join(heads) + " |\n|---|---|---|---|---|---|")
    mended = ControllerSpec(name="mended", kind=one.controller, params=dict(one.changes[one.mend]))
    for robot, navigation in WORLDS:
        scenario = build(family, *one.probe, robot)
        specs = [*others, one.controller, *([] if navigation in one.lacking else [mended])]
        rows = bench([scenario], specs, repeats=seeds, settings=settings_of(robot, navigation), **options).rows
        found = [
            times(own) if (own := of(rows, controller=name)) else MISSING
            for name in (*others, one.controller, "mended")
        ]
        print(f"| {robot} | {navigation} | " + " | ".join(found) + " |", flush=True)


def print_files(family: str, files: Sequence[str], seeds: int, options: Mapping[str, Any]) -> None:
    """Print the times of the controller of each parameter file that has it, as it is and as mended.

    A file that cannot be read or driven is one line on standard error.
    """
    one = MECHANISMS[family]
    name = one.controller.upper()
    print(f"| file | {name}, s | {name}, {one.mend}, s |\n|---|---|---|")
    for file in files:
        try:
            print_file(family, file, seeds, options)
        except MapBenchError as error:
            print(f"{Path(file).stem}: {error}", file=sys.stderr)


def print_file(family: str, file: str, seeds: int, options: Mapping[str, Any]) -> None:
    """Print those times of one file, a line for each controller of the kind."""
    one = MECHANISMS[family]
    mended = ControllerSpec(name="mended", kind=one.controller, params=dict(one.changes[one.mend]))
    world = {"noise": "nominal", "time_limit": 150.0, "collision_ends_episode": False, **options}
    read = read_nav2_params(file, anyone=True)
    plugins = read.navigation.controllers
    for kept in (own for own in read.own_controllers if plugins[own].kind == one.controller):
        rows = bench([build(family, *one.probe)], [kept, mended], repeats=seeds, params=file, **world).rows
        found = " | ".join(times(of(rows, controller=which)) for which in (kept, "mended"))
        print(f"| {Path(file).stem} | {found} |", flush=True)


def plot(file: str) -> None:
    """Draw the map of the changes of each mechanism, with a run of each controller."""
    figure, places = new_figure(len(MECHANISMS), width=12.0, height=4.6)
    for axes, (family, one) in zip(places, MECHANISMS.items(), strict=True):
        draw_runs(axes, build(family, *one.probe), tuple(ControllerSpec(name=name) for name in CONTROLLERS))
    figure.savefig(file, dpi=90)


def draw_runs(axes: Axes, scenario: Scenario, specs: tuple[ControllerSpec, ...]) -> None:
    """Draw a map with a run of each controller, and write above it how each ended."""
    names = [spec.name for spec in specs]
    plan = JobPlan(specs, settings_of(WAFFLE, "fair"), ROOT_SEED)
    episodes = [drive(plan.job(scenario, number, SHOWN)) for number in range(len(specs))]
    draw_map(axes, scenario)
    draw_trajectories(axes, episodes, names)
    for row, run in enumerate(reversed(episodes)):
        end = f"{run.time:.0f} s" if run.success else f"{run.outcome} after {run.time:.0f} s"
        colour = colour_of(names, run.controller)
        axes.text(0.0, 1.02 + 0.06 * row, f"{run.controller}: {end}", color=colour, transform=axes.transAxes)


def settings_of(robot: str, navigation: str) -> DriveSettings:
    """Return the world of the default search with another robot and navigation."""
    run = load_preset("robust")["run"]
    run = {**run, "navigation": navigation, "environment": {**run["environment"], "robot": robot}}
    return DriveSettings.from_mapping(run, "run")


def main() -> None:
    """Print the tables of one mechanism, and draw them all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", nargs="?", choices=MECHANISMS)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--params", nargs="+", default=[], help="parameter files that take the place of the other tables"
    )
    parser.add_argument("--plot", help="file of the picture")
    parser.add_argument("--maps", help="map-set file of the maps that the picture shows")
    args = parser.parse_args()
    shared: dict[str, Any] = {"seed": ROOT_SEED, "workers": args.workers}
    options = {"settings": settings_of(WAFFLE, "fair"), **shared}
    if args.name and args.params:
        print_files(args.name, args.params, args.seeds, shared)
    elif args.name:
        print_maps(args.name, args.seeds, options)
        print_changes(args.name, args.seeds, options)
        print_worlds(args.name, args.seeds, shared)
    if args.plot:
        plot(args.plot)
    if args.maps:
        save_map_set([replace(build(name, *one.probe), name=name) for name, one in MECHANISMS.items()], args.maps)


if __name__ == "__main__":
    main()
