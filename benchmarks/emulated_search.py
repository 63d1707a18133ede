"""How good are the rules of a search? Emulated searches, seconds each, with the recorded runs of real searches.

``python benchmarks/emulated_search.py runs/a runs/b --maps maps.json`` reads all runs of finished searches that this
checkout made (directories of ``mapbench evolve`` with their store), and repeats the first search with other seeds. A
run on a new map is one of the recorded runs on maps with similar genes. ``--maps`` writes the recorded maps, or reads
them where the file exists: so another checkout searches the same landscape. Emulation compares rules of selection; it
proves nothing about Nav2, and children inherit less than in real runs (docs/concepts/heldout.md).

Printed are the reported and the held-out fitness (60 further seeds), and the share of trials that keep their rank.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean, median
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from evolution.commands.options import positive
from evolution.driving import Evaluator, Job, RunResult
from evolution.driving.store import ResultStore
from evolution.runs import STORE, RunDir, experiment_in
from evolution.search import Experiment, evolve
from evolution.search.loop import EvolveResult
from evolution.search.validation_stage import ValidationResult
from evolution.search.validation_stage.held_out import held_out
from gym_mapbench.errors import MapBenchError, RunError
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
FURTHER = range(10_000, 10_060)
"""Repeats of the held-out fitness; a search has no repeats that late."""


def no_run(job: Job) -> RunResult:
    """Refuse to drive: records answer every run.

    Raises:
        RunError: Always.
    """
    missing = f"{job.controller.name} on {job.scenario.name}, repeat {job.repeat}"
    raise RunError(f"expected the runs of a search with the rules of this checkout, got none of {missing}")


class Recorder(Evaluator):
    """Answers the runs of a finished search, and keeps them with the genomes of their maps."""

    def __init__(self, store: ResultStore) -> None:
        super().__init__(no_run, store)
        self.maps: dict[str, tuple[Genome | None, Runs]] = {}

    def run(self, jobs: Sequence[Job]) -> list[RunResult]:
        """Return the recorded results of jobs.

        Raises:
            RunError: If one is not recorded: other rules made the record.
        """
        known = self.store.get_many(job.key for job in jobs)
        results = [known[job.key] if job.key in known else no_run(job) for job in jobs]
        for job, result in zip(jobs, results, strict=True):
            _, runs = self.maps.setdefault(job.scenario.world_digest, (job.scenario.genome, defaultdict(list)))
            runs[job.controller.name].append(result)
        return results


def recorded(path: Path) -> list[tuple[Genome, Runs]]:
    """Return the maps of a finished search that have a genome."""
    directory = RunDir.open(path)
    with ResultStore(directory.path / STORE) as store:
        recorder = Recorder(store)
        evolve(experiment_in(directory), recorder)
    return [(genome, dict(runs)) for genome, runs in recorder.maps.values() if genome is not None]


def recorded_maps(paths: Sequence[Path], file: Path | None) -> list[tuple[Genome, Runs]]:
    """Return the maps of some searches, or those of a file; a file that does not exist is written.

    Raises:
        RunError: If the file has something else.
    """
    if file is not None and file.exists():
        try:
            return MAPS.validate_json(file.read_bytes())
        except ValueError as error:
            raise RunError(f"{file}: expected the recorded maps that --maps writes, got something else") from error
    maps = [one for path in paths for one in recorded(path)]
    if file is not None:
        file.write_bytes(MAPS.dump_json(maps))
    return maps


def genes_of(genome: Genome) -> MotifGenes:
    """Return the genes of a genome of motifs."""
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
    """Recorded maps of one kind.

    Args:
        runs: The runs of each map.
        features: ``(maps, features)`` from :func:`features_of`, in units of their spread.
        scale: ``(features,)`` that spread; 1 where all maps are equal.
    """

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
        """Return the numbers of the nearest maps, ``(n,)``, and their weights by distance, ``(n,)`` with sum 1."""
        distances = np.linalg.norm(self.features - features_of(genome) / self.scale, axis=1)
        near = np.argsort(distances, kind="stable")[:NEAREST]
        width = max(float(distances[near[min(4, len(near) - 1)]]), 1e-6)
        weights = np.exp(-((distances[near] / width) ** 2))
        return near, weights / weights.sum()


class Neighbours(NamedTuple):
    """The recorded maps that a map has its runs from.

    Args:
        pool: Maps of its kind.
        near: ``(n,)`` numbers of the nearest ones there.
        weights: ``(n,)`` their probabilities on this map.
        by_distance: ``(n,)`` their probabilities on any map with these genes.
    """

    pool: Pool
    near: NDArray[np.intp]
    weights: Floats
    by_distance: Floats


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
        self._neighbours: dict[str, Neighbours] = {}

    def run(self, jobs: Sequence[Job]) -> list[RunResult]:
        """Return an emulated result of each job."""
        self.driven += len(jobs)
        return [self.answer(job) for job in jobs]

    def answer(self, job: Job) -> RunResult:
        """Return one of the recorded runs of the controller on maps that are like the job's."""
        pool, near, weights, by_distance = self._neighbours_of(job.scenario)
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

    def _neighbours_of(self, scenario: Scenario) -> Neighbours:
        digest = scenario.world_digest
        if digest not in self._neighbours:
            rng = np.random.default_rng(int(digest[:15], 16))
            pool, near, by_distance = self._nearest(scenario.genome, rng)
            weights = by_distance * (rng.gamma(CONCENTRATION, size=len(near)) + 1e-9)
            self._neighbours[digest] = Neighbours(pool, near, weights / weights.sum(), by_distance)
        return self._neighbours[digest]

    def _nearest(self, genome: Genome | None, rng: np.random.Generator) -> tuple[Pool, NDArray[np.intp], Floats]:
        """Return the nearest recorded maps; any maps for a map without genes, or of a kind that is not recorded."""
        pool = None if genome is None else self.pools.get(kind_of(genome))
        if genome is not None and pool is not None:
            return pool, *pool.nearest(genome)
        pool = list(self.pools.values())[int(rng.integers(len(self.pools)))]
        return pool, rng.integers(len(pool.runs), size=NEAREST), np.full(NEAREST, 1.0 / NEAREST)


def held_out_again(result: EvolveResult, experiment: Experiment, emulator: Emulator) -> ValidationResult:
    """Return the held-out fitness of the named set on further seeds."""
    plan, best = experiment.plan, result.best
    places = range(len(plan.controllers))
    results = tuple(
        tuple(tuple(emulator.answer(plan.job(scenario, place, number)) for number in FURTHER) for place in places)
        for scenario in best.map_set
    )
    return held_out(results, best.judgement, result.fitness, len(FURTHER), candidates=1)


def main() -> None:
    """Read the options, and emulate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="directories of finished searches")
    parser.add_argument("--maps", type=Path, metavar="FILE", help="recorded maps, JSON; written if it does not exist")
    parser.add_argument("--seeds", type=positive, default=16, help="number of searches (default 16)")
    parser.add_argument("--first-seed", type=int, default=1000, help="seed of the first one (default 1000)")
    parser.add_argument("--algorithm", default="ga", help="algorithm of the search: ga or random (default ga)")
    args = parser.parse_args()
    try:
        emulate(args)
    except MapBenchError as error:
        parser.error(str(error))


def emulate(args: argparse.Namespace) -> None:
    """Search with each seed, and print a line for each search and the means."""
    experiment, maps = experiment_in(RunDir.open(args.runs[0])), recorded_maps(args.runs, args.maps)
    if not maps:
        raise RunError(f"{args.runs[0]}: expected maps with genes, got none")
    print(f"{len(maps)} recorded maps with genes")
    reported, again = [], []
    for seed in range(args.first_seed, args.first_seed + args.seeds):
        search = experiment.search.replace(seed=seed, algorithm=args.algorithm)
        emulated, emulator = replace(experiment, search=search), Emulator(maps)
        result = evolve(emulated, emulator)
        reported.append(result.best.judgement.fitness if result.validation is None else result.validation.fitness)
        again.append(found := held_out_again(result, emulated, emulator))
        shown = f"held-out {found.fitness:.2f}, rank kept {found.order_kept:.2f}, goals {found.goals / found.runs:.3f}"
        print(f"seed {seed}: reported {reported[-1]:.2f}, {shown}", flush=True)
    values, kept = [one.fitness for one in again], fmean(one.order_kept for one in again)
    near = fmean(abs(one - other) <= 0.5 for one, other in zip(reported, values, strict=True))
    print(f"held-out fitness: median {median(values):.2f}, mean {fmean(values):.2f}; n = {len(values)}")
    print(f"rank kept {kept:.2f}; within 0.5 of reported {near:.2f}")


if __name__ == "__main__":
    main()
