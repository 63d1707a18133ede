"""Run a short search and print evaluations and runs per second, and the time not spent driving."""

from __future__ import annotations

import argparse
import os

from evolution.api import compose
from evolution.driving.evaluator import Evaluator
from evolution.driving.warmup import warm_up
from evolution.driving.worker import run_job
from evolution.search.experiments import experiment_of
from evolution.search.loop import Progress, evolve


def main() -> None:
    """Search and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--generations", type=int, default=3)
    args = parser.parse_args()
    document = compose("thesis", pop_size=20, evaluations=20 * args.generations)
    generations: list[Progress] = []
    with Evaluator(run_job, workers=args.workers, warm_up=warm_up) as evaluator:
        evolve(experiment_of(document), evaluator, on_generation=generations.append)
    later = generations[1:]  # the first one includes the start of the workers
    seconds = sum(one.seconds for one in later)
    driving = sum(one.evaluate_seconds for one in later)
    evaluations = later[-1].row["evaluations"] - generations[0].row["evaluations"]
    print(f"workers                     {args.workers}")
    print(f"evaluations per second      {evaluations / seconds:.2f}")
    print(f"driven runs per second      {sum(one.driven for one in later) / seconds:.2f}")
    print(f"share outside evaluation    {1 - driving / seconds:.3%}")


if __name__ == "__main__":
    main()
