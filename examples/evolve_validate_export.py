"""Evolve a map set that discriminates between controllers, measure its held-out fitness, and take it to Gazebo.

Shows: `evolve` with options of your own, the held-out fitness of the best set, and a ROS 2 package.
Takes: about a minute on two cores; the first time on a machine about a minute more, for compiling.
Comes out: `runs/two_controllers` with the set, its figures and every run, and `runs/two_controllers_bundle`, a package
for colcon whose README says how to start it.

The commands do the same, with the options below in a file: `mapbench evolve --config FILE --out DIR`,
`mapbench bench DIR --repeats 10 --seed 1000`, `mapbench export DIR --format gazebo --out PACKAGE`.
"""

import os

from evolution import bench, evolve
from evolution.benchmark import reevaluation_sentence
from evolution.cli import main
from evolution.runs import validation_sentence

SMALL = bool(os.environ.get("MAPBENCH_SMALL"))  # the tests run a small form
OUT = "runs/two_controllers"
SEARCH = {"runs": 500, "seed": 4, "families": ["doors", "pillars", "slaloms"], "ga": {"pop_size": 10}}
TINY = {
    "runs": 60,
    "maps_per_set": 2,
    "ga": {"pop_size": 3},
    "validation": {"seeds": 2, "candidates": 2, "held_out_seeds": 2},
}

# What is not said here, the preset says: mapbench show robust
run = evolve(
    {
        "search": {**SEARCH, **(TINY if SMALL else {})},
        "controllers": ["dwb", {"name": "rpp_short", "kind": "rpp", "params": {"lookahead_dist": 0.4}}],
        "run": {"environment": {"robot": "turtlebot3_burger", "time_limit": 90.0}},
    },
    out=OUT,
)
print(run.table())
for line in validation_sentence(run.best_results, run.config["search"]):
    print(line)

again = bench(run, repeats=1 if SMALL else 10, seed=1000)
print(again.table())
if again.reevaluation is not None:
    print(reevaluation_sentence(again.reevaluation, run))

main(["export", OUT, "--format", "gazebo", "--out", f"{OUT}_bundle"])
