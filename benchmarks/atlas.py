"""Compare the atlas' search with random sampling at the same runs: coverage and QD score on held-out seeds."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean, stdev

from evolution.api import compose
from evolution.driving import Evaluator, ResultStore, preparation_of, run_job
from evolution.files import Row, Table, write_text
from evolution.quality_diversity import AtlasSettings, search_atlas
from evolution.search import experiment_of

METHODS = {"atlas": AtlasSettings().fresh, "random": 1.0}
"""Probability that a new map is sampled, by method."""
MEASURES = ("cells in the search", "cells", "coverage", "QD score")


def measure(method: str, seed: int, args: argparse.Namespace, store: ResultStore) -> Row:
    """Return the figures of one search; finished runs are in the store."""
    experiment = experiment_of(compose(args.preset, {"controllers": args.controllers.split(",")}, seed=seed))
    settings = AtlasSettings(
        runs=args.runs, repeats=args.repeats, held_out_seeds=args.held_out_seeds, fresh=METHODS[method]
    )
    prepare = preparation_of([experiment.plan])
    with Evaluator(run_job, store, workers=args.workers, warm_up=prepare) as evaluator:
        found = search_atlas(experiment, settings, evaluator)
    figures = found.searched.cells, found.held_out.cells, found.held_out.coverage, found.held_out.qd_score
    return {"method": method, "seed": seed, "runs": found.runs, **dict(zip(MEASURES, figures, strict=True))}


def summary(rows: Sequence[Row]) -> Table:
    """Return for each measure the means, and the mean paired difference with its 95 % t interval."""
    from scipy.stats import t

    lines = []
    for name in MEASURES:
        ours, theirs = ([row[name] for row in rows if row["method"] == method] for method in METHODS)
        gaps = [one - other for one, other in zip(ours, theirs, strict=True)]
        half = float(t.ppf(0.975, len(gaps) - 1)) * stdev(gaps) / len(gaps) ** 0.5
        interval = {"from": fmean(gaps) - half, "to": fmean(gaps) + half}
        lines.append({"measure": name, "atlas": fmean(ours), "random": fmean(theirs), **interval, "n": len(gaps)})
    return Table(lines, "Means, and the 95 % interval of the mean paired difference")


def main() -> None:
    """Search with every seed and both methods, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="robust")
    parser.add_argument("--controllers", default="dwb,mppi,rpp")
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--repeats", type=int, default=AtlasSettings().repeats)
    parser.add_argument("--held-out-seeds", type=int, default=AtlasSettings().held_out_seeds)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=3, help="number of seeds, two or more")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True, help="CSV; finished runs are in a file beside it")
    args = parser.parse_args()
    rows = []
    with ResultStore(args.out.with_suffix(".sqlite")) as store:
        for seed in range(args.first_seed, args.first_seed + args.seeds):
            for method in METHODS:
                rows.append(measure(method, seed, args, store))
                write_text(args.out, Table(rows).to_csv())
                print(rows[-1], flush=True)
    print(summary(rows))


if __name__ == "__main__":
    main()
