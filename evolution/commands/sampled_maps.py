"""``mapbench maps draw``: sample maps from families, with their genes and a picture."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from evolution.commands import options
from evolution.commands.console import console
from evolution.files import counted, write_json
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.generator import draw_from
from gym_mapbench.mapio.conversion import write_maps
from gym_mapbench.mapio.formats import WRITTEN
from gym_mapbench.mapio.tasked_map import GENES, group_scenarios
from gym_mapbench.world.gridmap import GridMap


def add_draw(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the action."""
    draw = options.action_parser(actions, "draw", "sample maps from families, with their genes and a picture")
    options.add_family_option(draw, "shapes")
    draw.add_argument("--count", type=options.positive, default=4, metavar="N", help="number of maps (default 4)")
    draw.add_argument("--seed", type=options.non_negative, default=0, metavar="N", help="default 0")
    draw.add_argument(
        "--robot",
        metavar="NAME",
        default="turtlebot3_waffle",
        help="robot that the maps must be solvable for (default turtlebot3_waffle)",
    )
    draw.add_argument(
        "--format", metavar="NAME", default="map_server", help=f"{', '.join(WRITTEN)} (default map_server)"
    )
    draw.add_argument("--out", metavar="DIR", required=True, help="new folder for the maps, genes.json and maps.png")
    draw.set_defaults(run=run_draw)


def run_draw(args: argparse.Namespace) -> int:
    """Sample the maps, write them, and print where they are."""
    from evolution.pictures import maps_figure, save_figure  # other actions do not wait for it

    config = EnvConfig.build(family=args.family or ("shapes",), robot=args.robot)
    rng, out = np.random.default_rng(args.seed), Path(args.out)
    scenarios, genes = [], {}
    for number in range(args.count):
        sampled = draw_from(rng, config.family, config.shapes, config.robot)
        name = f"{sampled.family.rpartition(':')[2]}_{number}"
        scenario = config.make_scenario(GridMap(sampled.cells, config.shapes.resolution), name)
        scenarios.append(replace(scenario, genome=sampled.genome))
        genes[name] = {"family": sampled.family, "genes": sampled.genes.model_dump(mode="json")}
    write_maps(group_scenarios(scenarios), out, args.format)
    write_json(out / GENES, genes)
    save_figure(maps_figure(scenarios), out / "maps", formats=("png",))
    console.print(f"wrote {counted(args.count, 'map')}; look at {out / 'maps.png'}")
    return 0
