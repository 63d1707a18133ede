"""The film ``docs/policy.gif``: the shipped policies beside MPPI on a map that no training has seen.

Run from the root of the project::

    python benchmarks/fresh_maps.py --obstacles 30 --seed 1 --out fresh30.json
    python -m docs.generate.policy_film --map fresh30.json --scenario 41
"""

from __future__ import annotations

import argparse
from pathlib import Path

from evolution.driving import ControllerSpec, DriveSettings, JobPlan, drive
from evolution.pictures import save_comparison
from gym_mapbench.mapio import load_scenarios

POLICIES = [Path("examples/policies/ppo.zip"), Path("examples/policies/ppo_path.zip")]
TITLE = "Two shipped policies and Nav2's MPPI on a map of 30 obstacles that no training has seen: one run each"


def main() -> None:
    """Run the controllers and write the film."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--map", type=Path, required=True, help="any file of maps")
    parser.add_argument("--scenario", type=int, default=1, help="number of the map in the file (default 1)")
    parser.add_argument("--policy", type=Path, nargs="+", default=POLICIES, help="models (default: the shipped ones)")
    parser.add_argument("--out", type=Path, default=Path("docs/policy.gif"))
    args = parser.parse_args()
    scenario = load_scenarios(args.map)[args.scenario - 1]
    policies = [ControllerSpec(name=path.stem, kind=str(path.resolve())) for path in args.policy]
    controllers = [*policies, ControllerSpec(name="mppi", kind="mppi")]
    settings = DriveSettings(navigation="fair")
    episodes = [drive(job) for job in JobPlan(controllers, settings, 0).jobs(scenario)]
    save_comparison(episodes, args.out, TITLE)


if __name__ == "__main__":
    main()
