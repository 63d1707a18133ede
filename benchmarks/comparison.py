"""Time a comparison of two parameter sets on 20 maps x 5 seeds, beside a benchmark of as many runs of one set."""

from __future__ import annotations

import argparse
import time

import numpy as np

from evolution import bench, compare, configuration_of
from evolution.driving import Resources, available_cores
from gym_mapbench import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenarios


def main() -> None:
    """Run both and print the seconds and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--params", nargs=2, default=["thesis", "fair"], metavar="FILE")
    parser.add_argument("--controller", default="rpp")
    parser.add_argument("--maps", type=int, default=20)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--workers", type=int, default=available_cores())
    args = parser.parse_args()
    maps = draw_scenarios(EnvConfig(shapes={"n_obstacles": (15, 15)}), np.random.default_rng(1), args.maps)
    first, second = args.params
    options = {"repeats": args.repeats, "noise": "nominal"}
    resources = Resources(workers=args.workers)
    began = time.perf_counter()
    compare(
        maps,
        [configuration_of(label, file, [args.controller], **options) for label, file in (("a", first), ("b", second))],
        resources=resources,
    )
    compared = time.perf_counter() - began
    began = time.perf_counter()
    for file in args.params:
        bench(maps, [args.controller], params=file, resources=resources, **options)
    alone = time.perf_counter() - began
    print(f"workers                          {args.workers}")
    print(f"comparison of two sets           {compared:.1f} s")
    print(f"the same runs as two benchmarks  {alone:.1f} s")
    print(f"ratio                            {compared / alone:.2f}")


if __name__ == "__main__":
    main()
