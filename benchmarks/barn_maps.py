"""Write BARN worlds as a map set, for robots other than BARN's: python benchmarks/barn_maps.py DIR --out barn.json.

`mapbench bench barn:DIR` has BARN's own rules and drives its Jackal. A map set is driven with the rules of any other
map. Of the worlds, those are written through which the robot fits, and to whose goal NavFn finds a path for it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from evolution.benchmark import load_barn
from gym_mapbench import EnvConfig
from gym_mapbench.env.observation import has_path
from gym_mapbench.env.task import distance_to_goal
from gym_mapbench.mapio.map_set_file import write_map_set
from gym_mapbench.mapio.tasked_map import group_scenarios


def main() -> None:
    """Read the worlds and write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder with world_N.world files")
    parser.add_argument("--robot", default="turtlebot3_waffle", help="(default turtlebot3_waffle)")
    parser.add_argument("--every", type=int, default=1, help="take every so manieth world, from the first (default 1)")
    parser.add_argument("--out", type=Path, required=True, help="map-set file")
    args = parser.parse_args()
    world = EnvConfig(robot=args.robot)
    taken = load_barn(f"barn:{args.folder}")[:: args.every]
    fits = [one for one in taken if distance_to_goal(one, world.robot).solvable and has_path(world, one)]
    write_map_set(group_scenarios(fits), args.out)
    print(f"{args.robot} fits through {len(fits)} of {len(taken)} worlds")


if __name__ == "__main__":
    main()
