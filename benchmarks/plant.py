"""The effect of the plant on runs: ``python benchmarks/plant.py --maps 200`` (about half an hour on one core).

Maps are of the families without a route; controllers, world and noise are those of the preset ``robust``. Each run is
compared with the run of
the plant ``ideal`` with the same seed. The control is ``ideal`` with another seed.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from evolution.driving import JobPlan, Resources, RunResult, run_job, warm_up
from evolution.search import Experiment, experiment_of, load_preset, scenario_on
from evolution.statistics import median_interval, wilson_interval
from gym_mapbench.generator import WITHOUT_ROUTE, FamilySpec, draw_map
from gym_mapbench.world.scenario import Scenario

VARIANTS = {"ideal": ("ideal", 0), "ideal, another seed": ("ideal", 1), "fortress": ("fortress", 0)}
"""Plant and number of the repeat."""

FAMILIES = [FamilySpec(name=name) for name in WITHOUT_ROUTE]


def sample(experiment: Experiment, count: int, seed: int) -> list[Scenario]:
    """Return maps of the families without a route."""
    search, rng = experiment.search, np.random.default_rng(seed)
    cells = [draw_map(rng, search.shapes, FAMILIES, experiment.run.robot) for _ in range(count)]
    return [scenario_on(one, search.shapes) for one in cells]


def run_all(experiment: Experiment, scenarios: Sequence[Scenario], workers: int) -> dict[str, list[list[RunResult]]]:
    """Return the results of each variant, ``[controller][map]``."""
    found = {}
    with Resources(workers=workers).evaluator(run_job, warm_up=warm_up) as evaluator:
        for name, (plant, repeat) in VARIANTS.items():
            world = experiment.run.environment.replace(plant=plant)
            plan = JobPlan(experiment.controllers, experiment.run.replace(environment=world))
            numbers = range(len(plan.names))
            jobs = [plan.job(scenario, number, repeat) for number in numbers for scenario in scenarios]
            results = evaluator.run(jobs)
            found[name] = [results[number * len(scenarios) :][: len(scenarios)] for number in numbers]
    return found


def line(runs: Sequence[RunResult], base: Sequence[RunResult]) -> str:
    """Return success, contacts, and the agreement with the runs of the base."""
    goals, touched = sum(run.success for run in runs), sum(run.value("n_contacts") > 0 for run in runs)
    same = sum(one.outcome == other.outcome for one, other in zip(runs, base, strict=True))
    ratios = [one.time_s / other.time_s for one, other in zip(runs, base, strict=True) if one.success and other.success]
    shares = [
        f"{count} ({low:.2f} to {high:.2f})"
        for count in (goals, touched, same)
        for low, high in [wilson_interval(count, len(runs))]
    ]
    low, high = median_interval(ratios)
    five, most = np.percentile(ratios, [5, 95])
    return f"{' | '.join(shares)} | {np.median(ratios):.3f} ({low:.3f} to {high:.3f}) | {five:.2f} to {most:.2f}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", type=int, default=200)
    parser.add_argument("--seed", type=int, default=20261123)
    parser.add_argument("--workers", type=int, default=1)
    args = parser.parse_args()
    experiment = experiment_of(load_preset("robust"))
    found = run_all(experiment, sample(experiment, args.maps, args.seed), args.workers)
    print("controller, plant | goals | contacts | same outcome | time ratio, median | 5 % to 95 %")
    for number, controller in enumerate(experiment.controllers):
        for name in VARIANTS:
            print(f"{controller.name}, {name} | {line(found[name][number], found['ideal'][number])}")


if __name__ == "__main__":
    main()
