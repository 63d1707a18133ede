"""Draw random maps that no training has seen, for `mapbench bench`: python benchmarks/fresh_maps.py --out fresh15.json.

The maps are those of the thesis' kind, with start and goal where it has them, and one number of obstacles.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from gym_mapbench import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenarios
from gym_mapbench.mapio.map_set_file import write_map_set
from gym_mapbench.mapio.tasked_map import group_scenarios


def main() -> None:
    """Draw the maps and write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--obstacles", type=int, default=15, help="on every map (default 15)")
    parser.add_argument("--count", type=int, default=200, help="number of maps (default 200)")
    parser.add_argument("--seed", type=int, default=1, help="root of all randomness (default 1)")
    parser.add_argument("--out", type=Path, required=True, help="map-set file")
    args = parser.parse_args()
    world = EnvConfig(shapes={"n_obstacles": (args.obstacles, args.obstacles)})
    rng = np.random.default_rng((args.seed, args.obstacles))
    write_map_set(group_scenarios(draw_scenarios(world, rng, args.count)), args.out)


if __name__ == "__main__":
    main()
