"""How good are the rules of a search? Emulated searches, seconds each, with the recorded runs of real searches.

``python benchmarks/emulated_search.py runs/a runs/b --maps maps.json`` reads all runs of finished searches that this
checkout made (directories of ``mapbench evolve`` with their store), and repeats the first search with other seeds. A
run on a new map is one of the recorded runs on maps with similar genes. ``--maps`` writes the recorded maps, or reads
them where the file exists: so another checkout searches the same landscape. Emulation compares rules of searches; it
proves nothing about Nav2.

Printed are the reported and the held-out fitness (60 further seeds), and the share of trials that keep their rank.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import copy
from statistics import fmean, median

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from evolution.driving import Evaluator, Job, OnRun, RunResult
from evolution.driving.store import ResultStore
from evolution.runs import RunDir, experiment_in
from evolution.search import Experiment, evolve
from evolution.search.loop import EvolveResult
from evolution.search.validation_stage.trials import order_kept, trials_of
from gym_mapbench.errors import MapBenchError
from gym_mapbench.generator import MotifGenes
from gym_mapbench.world.genome import Genome
from gym_mapbench.world.scenario import Scenario

Floats = NDArray[np.float64]
Runs = Mapping[str, list[RunResult]]
"""Runs of each controller on one map, by name."""
MAPS = TypeAdapter(list[tuple[Genome, Runs]])

NEAREST = 12
"""A new map has runs of this many recorded maps at most."""
CONCENTRATION = 0.25
"""Shape of the gamma distribution of their weights: most new maps are like one to three of them."""
FEW = 4
"""Recorded runs of a map from which on it is known how its times scatter."""
MIXED = 0.7
"""Share of the runs that come from any of the nearest maps, where the map that was taken first has a single run."""
STEADY = 36.0
"""Times below this many seconds hardly scatter."""
JITTER = 0.02
"""Standard deviation of the logarithm of an emulated time about the recorded one."""
FURTHER = 60
"""Seeds of the held-out fitness."""


def no_run(job: Job) -> RunResult:
    """Refuse to drive: records answer every run."""
    raise MapBenchError(f"{job.scenario.name}: expected a recorded run")


class Recorder(Evaluator):
    """Answers the runs of a finished search, and keeps them with the genomes of their maps."""

    def __init__(self, store: ResultStore) -> None:
        super().__init__(no_run, store)
        self.maps: dict[str, tuple[Genome | None, Runs]] = {}

    def run(self, jobs: Sequence[Job], on_run: OnRun | None = None) -> list[RunResult]:
        """Return the recorded results of jobs."""
        results = super().run(jobs, on_run)
        for job, result in zip(jobs, results, strict=True):
            _, runs = self.maps.setdefault(job.scenario.world_digest, (job.scenario.genome, defaultdict(list)))
            runs[job.controller.name].append(result)
        return results


def recorded(path: Path) -> list[tuple[Genome, Runs]]:
    """Return the maps of a finished search that have a genome."""
    directory = RunDir.open(path)
    with (
        tempfile.TemporaryDirectory() as folder,
        closing(ResultStore(Path(copy(directory.store_path, folder)))) as store,
    ):
        recorder = Recorder(store)
        evolve(experiment_in(directory), recorder)
    return [(genome, dict(runs)) for genome, runs in recorder.maps.values() if genome is not None]


def recorded_maps(paths: Sequence[Path], file: Path | None) -> list[tuple[Genome, Runs]]:
    """Return the maps of some searches, or those of a file; a file that does not exist is written."""
    if file is not None and file.exists():
        return MAPS.validate_json(file.read_bytes())
    maps = [one for path in paths for one in recorded(path)]
    if file is not None:
        file.write_bytes(MAPS.dump_json(maps))
    return maps


def genes_of(genome: Genome) -> MotifGenes:
    return MotifGenes.from_mapping(genome.genes, "genes")


def kind_of(genome: Genome) -> tuple[str, ...]:
    """Maps of the same family and the same motifs are comparable."""
    return genome.family, *(section.motif for section in genes_of(genome).sections)


def features_of(genome: Genome, elements: int = 5) -> Floats:
    """Return the route, then for each section its shared genes, its count, and the deviations of its first elements."""
    genes = genes_of(genome)
    found = [2.0 * (genes.route.name == name) for name in ("diagonal", "straight", "bent")]
    found.append(0.5 * genes.route.mirrored)
    for section in genes.sections:
        found += [section.shared[name] for name in sorted(section.shared)]
        found.append(float(len(section.elements)))
        for number in range(elements):
            element = section.elements[number] if number < len(section.elements) else {}
            found += [0.25 * element.get(name, 0.0) for name in sorted(section.shared)]
    return np.array(found)


@dataclass(frozen=True)
class Pool:
    """Recorded maps of one kind, with their features in units of their spread."""

    runs: list[Runs]
    features: Floats
    scale: Floats

    @classmethod
    def of(cls, maps: Sequence[tuple[Genome, Runs]]) -> Pool:
        """Return a pool of maps of one kind."""
        features = np.array([features_of(genome) for genome, _ in maps])
        spread = features.std(axis=0)
        scale = np.where(spread > 0.0, spread, 1.0)
        return cls([runs for _, runs in maps], features / scale, scale)

    def nearest(self, genome: Genome) -> tuple[NDArray[np.intp], Floats]:
        """Return the numbers of the nearest maps, and their weights by distance."""
        distances = np.linalg.norm(self.features - features_of(genome) / self.scale, axis=1)
        near = np.argsort(distances, kind="stable")[:NEAREST]
        width = max(float(distances[near[min(4, len(near) - 1)]]), 1e-6)
        weights = np.exp(-((distances[near] / width) ** 2))
        return near, weights / weights.sum()


class Emulator(Evaluator):
    """Answers every run by a recorded one; a function of the recorded maps and the job's seed."""

    def __init__(self, maps: Sequence[tuple[Genome, Runs]]) -> None:
        super().__init__(no_run)
        kinds: dict[tuple[str, ...], list[tuple[Genome, Runs]]] = defaultdict(list)
        for genome, runs in maps:
            kinds[kind_of(genome)].append((genome, runs))
        most = max(len(runs) for _, runs in maps)
        whole = {kind for kind, some in kinds.items() if any(len(runs) == most for _, runs in some)}
        self.pools = {kind: Pool.of(some) for kind, some in kinds.items() if kind in whole}
        self._models: dict[str, tuple[Pool, NDArray[np.intp], Floats, Floats]] = {}

    def run(self, jobs: Sequence[Job], on_run: OnRun | None = None) -> list[RunResult]:
        """Return an emulated result of each job."""
        self.driven += len(jobs)
        return [self.answer(job) for job in jobs]

    def answer(self, job: Job) -> RunResult:
        """Return one of the recorded runs of the controller on maps that are like the job's."""
        pool, near, weights, by_distance = self._model(job.scenario)
        rng, name = np.random.default_rng(job.seed), job.controller.name
        runs = pool.runs[int(rng.choice(near, p=weights))]
        is_steady = all(run.success and run.time_s < STEADY for some in runs.values() for run in some)
        known = min(max(map(len, runs.values())), FEW)
        if not is_steady and rng.random() < MIXED * (1 - known / FEW):
            runs = pool.runs[int(rng.choice(near, p=by_distance))]
        others = (*(pool.runs[place] for place in near), *pool.runs)
        some = next(one[name] for one in (runs, *others) if one.get(name))
        result = some[int(rng.integers(len(some)))]
        if not result.success:
            return replace(result, seed=job.seed)
        time = min(result.time_s * float(np.exp(rng.normal(0.0, JITTER))), job.settings.environment.time_limit)
        return replace(result, time_s=time, seed=job.seed)

    def _model(self, scenario: Scenario) -> tuple[Pool, NDArray[np.intp], Floats, Floats]:
        digest = scenario.world_digest
        if digest not in self._models:
            rng = np.random.default_rng(int(digest[:15], 16))
            genome = scenario.genome
            pool = self.pools.get(kind_of(genome)) if genome is not None else None
            if genome is None or pool is None:
                pool = list(self.pools.values())[int(rng.integers(len(self.pools)))]
                near = rng.integers(len(pool.runs), size=NEAREST)
                by_distance = np.full(NEAREST, 1.0 / NEAREST)
            else:
                near, by_distance = pool.nearest(genome)
            weights = by_distance * (rng.gamma(CONCENTRATION, size=len(near)) + 1e-9)
            self._models[digest] = pool, near, weights / weights.sum(), by_distance
        return self._models[digest]


def held_out(result: EvolveResult, experiment: Experiment, emulator: Emulator) -> tuple[float, float]:
    """Return the median fitness of trials with further seeds, and the share of them that keep their rank."""
    plan, first = experiment.plan, 10_000
    results = tuple(
        tuple(
            tuple(emulator.answer(plan.job(scenario, place, first + number)) for number in range(FURTHER))
            for place in range(len(plan.controllers))
        )
        for scenario in result.best.map_set
    )
    trials = [result.fitness(one) for one in trials_of(results)]
    kept = order_kept(trials, result.best.judgement, result.fitness)
    return median(one.fitness for one in trials), fmean(kept)


def main() -> None:
    """Print a line for each search, and the medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="directories of finished searches")
    parser.add_argument("--maps", type=Path, metavar="FILE", help="recorded maps, JSON; written if it does not exist")
    parser.add_argument("--seeds", type=int, default=16, help="number of searches (default 16)")
    parser.add_argument("--first-seed", type=int, default=1000, help="seed of the first one (default 1000)")
    parser.add_argument("--algorithm", default="ga", help="algorithm of the search: ga or random (default ga)")
    args = parser.parse_args()
    experiment, maps = experiment_in(RunDir.open(args.runs[0])), recorded_maps(args.runs, args.maps)
    print(f"{len(maps)} recorded maps with genes")
    rows = []
    for seed in range(args.first_seed, args.first_seed + args.seeds):
        search = experiment.search.replace(seed=seed, algorithm=args.algorithm)
        again, emulator = replace(experiment, search=search), Emulator(maps)
        result = evolve(again, emulator)
        reported = result.best.judgement.fitness if result.validation is None else result.validation.fitness
        rows.append((reported, *held_out(result, again, emulator)))
        print(
            f"seed {seed}: reported {reported:.2f}, held-out {rows[-1][1]:.2f}, rank kept {rows[-1][2]:.2f}", flush=True
        )
    values, kept = [row[1] for row in rows], fmean(row[2] for row in rows)
    near = fmean(abs(row[0] - row[1]) <= 0.5 for row in rows)
    print(f"held-out fitness: median {median(values):.2f}, mean {fmean(values):.2f}; n = {len(rows)}")
    print(f"rank kept {kept:.2f}; within 0.5 of reported {near:.2f}")


if __name__ == "__main__":
    main()
