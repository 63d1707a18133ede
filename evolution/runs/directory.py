"""The directory of one run: plain files that can be read without this package.

Every file is written under another name and then renamed, so that it is complete at any moment.
Wall-clock values are only in ``timing.jsonl`` and in the result store; all other files are the
same, byte for byte, whenever the same experiment is run.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from evolution.files import (
    DirectoryKind,
    Document,
    GrowingCsv,
    Row,
    advising,
    append_line,
    check,
    check_rows,
    counted,
    csv_of,
    make_directory,
    npz_of,
    read_csv,
    read_document,
    read_json,
    read_json_lines,
    write_bytes,
    write_json,
    write_text,
)
from evolution.runs.documents import (
    Checkpoint,
    FrontRow,
    GenerationRow,
    IndividualRow,
    RunConfig,
    RunRow,
    TimingRow,
    check_driven,
    check_results,
)
from evolution.runs.former_names import present_results, present_row
from evolution.runs.front import front_rows
from evolution.runs.results import named, results_document
from evolution.search import Evaluation, Experiment, FrontPoint, Record, ValidationResult, nested_document
from gym_mapbench.errors import MapBenchError, RunError
from gym_mapbench.mapio.map_set_file import BEST_MAP_SET, map_set_document, read_map_set
from gym_mapbench.mapio.tasked_map import group_scenarios
from gym_mapbench.world.scenario import MapSet

CONFIG, CHECKPOINT, README = "config.json", "checkpoint.json", "README.txt"
GENERATIONS, INDIVIDUALS, RUNS = "generations.csv", "individuals.csv", "runs.csv"
BEST_RESULTS, MAPS, TIMING, STORE = "best_results.json", "maps", "timing.jsonl", "results.sqlite"
FRONT, FRONT_SETS = "front.csv", "front"

BODIES = "_bodies.json"
"""End of the names of the files with the moving bodies on the maps of a generation."""

RUN = DirectoryKind(
    "run",
    CONFIG,
    format_version=1,
    to_drive=("controllers", "run"),
    again=f"evolve --config {{path}}/{CONFIG} --allow-code --out NEW",
)

README_TEXT = """One run of mapbench. All lengths are m, times s, angles rad; smaller fitness is better.

config.json         all options as used, and the versions they were used with
generations.csv     one line per generation: fitness in the population after selection
individuals.csv     one line per evaluated map set: fitness, its parts, its maps by digest
runs.csv            one line per driven run, at its first use: map, controller, seed, outcome, measures
maps/NNNN.npz       maps first seen in generation NNNN, by digest: boolean arrays [row, col],
                    True where there is a wall, row 0 at the bottom (numpy.load)
maps/NNNN.json      genomes of these maps, by digest; only where families of motifs are sampled
maps/NNNN_bodies.json  people on these maps, by digest; only where people are sampled
best_map_set.json   the best map set so far, as text
best_results.json   its fitness, and every run on it; after the validation stage, its held-out fitness
front.csv           with several objectives: the sets of the Pareto front, their objectives in the search and on
                    held-out seeds, and whether they remain on the front
front/N.json        these sets, as best_map_set.json
checkpoint.json     where the search stands
figures/            the best maps with all trajectories, the best fitness over the search, travel times, and Lorenz
                    curves (the further from the diagonal, the larger the differences between controllers)
timing.jsonl        wall-clock seconds of each generation, and of the validation stage
results.sqlite      every result by the key of its run (SQLite, table "results")

All but the last two are the same whenever the same experiment is run.
"""


@dataclass(frozen=True)
class RunDir:
    """The directory of one run; made by :meth:`create` or :meth:`open`.

    Args:
        path: The directory.
        config: Content of ``config.json``.
    """

    path: Path
    config: Mapping[str, Any]
    _tables: defaultdict[str, GrowingCsv] = field(
        default_factory=lambda: defaultdict(GrowingCsv), init=False, repr=False, compare=False
    )

    @classmethod
    def create(cls, path: str | Path, experiment: Experiment) -> RunDir:
        """Make the directory of a new run.

        Raises:
            ConfigError: If there is anything there already; nothing is changed.
            RunError: If it cannot be made.
        """
        path = Path(path)
        return cls(path, RUN.begin(path, experiment.document()))

    @classmethod
    def open(cls, path: str | Path) -> RunDir:
        """Open the directory of a run, finished or not.

        Raises:
            RunError: If it is not a run directory, of another format, or damaged.
        """
        path = Path(path)
        config = nested_document(RUN.open(path), str(path / CONFIG))
        check(RunConfig, config, path / CONFIG)
        return cls(path, config)

    @property
    def checkpoint(self) -> Mapping[str, Any] | None:
        """Content of ``checkpoint.json``; None before the end of the first generation."""
        path = self.path / CHECKPOINT
        if not path.is_file():
            return None
        with advising("delete it: --resume makes it again from the stored runs"):
            return read_document(Checkpoint, path)

    @property
    def finished(self) -> bool:
        """Whether the search is finished."""
        return bool((self.checkpoint or {}).get("finished"))

    @property
    def generation(self) -> int:
        """Number of the last generation that is complete."""
        return int((self.checkpoint or {"generation": 0})["generation"])

    @property
    def controllers(self) -> tuple[str, ...]:
        """Names of the compared controllers, in order."""
        return controllers_in(self.config)

    @property
    def repeats(self) -> int | None:
        """Runs of every controller on every map; None where the search drives some maps more or less often."""
        search = self.config["search"]
        archive = search.get("archive", {})
        uneven = archive.get("staged") or archive.get("elite") or search.get("validation")
        return None if uneven else int(search["repeats"])

    def check_files(self) -> None:
        """Refuse a run that lacks one of the files that not every reader opens.

        Raises:
            RunError: Naming the first that is missing.
        """
        for name in (INDIVIDUALS, RUNS, BEST_MAP_SET):
            if not (self.path / name).is_file():
                raise RunError(f"{self.path / name}: is missing")

    def read_generations(self) -> list[Row]:
        """Read ``generations.csv``; raises ``RunError`` if it is missing, damaged, or ends before the checkpoint."""
        return self._read_table(GENERATIONS, GenerationRow)

    def read_individuals(self) -> list[Row]:
        """Read ``individuals.csv``; raises ``RunError`` if it is missing, damaged, or ends before the checkpoint."""
        rows = [present_row(row) for row in self._read_table(INDIVIDUALS, IndividualRow)]
        for number, row in enumerate(rows, start=1):
            for name in self._maps:
                if not isinstance(row.get(name), str):
                    raise RunError(f"{self.path / INDIVIDUALS}: line {number}: {name}: is missing")
        return rows

    @property
    def _maps(self) -> list[str]:
        """Columns of the maps of a set."""
        return [f"map_{number}" for number in range(1, self.config["search"]["maps_per_set"] + 1)]

    def read_runs(self, individuals: Sequence[Row]) -> list[Row]:
        """Read ``runs.csv``.

        Args:
            individuals: Rows of ``individuals.csv``; their maps up to the checkpoint must have been driven.

        Raises:
            RunError: If the file is missing or damaged, or lacks a run.
        """
        rows = read_csv(self.path / RUNS)
        check_rows(RunRow, rows, self.path / RUNS)
        wanted = [row[name] for row in individuals if row["generation"] <= self.generation for name in self._maps]
        check_driven(rows, wanted, self.controllers, self.repeats, self.path / RUNS)
        return rows

    def read_best_results(self) -> Mapping[str, Any]:
        """Read ``best_results.json``; raises ``RunError`` if it is missing or damaged."""
        path, search = self.path / BEST_RESULTS, self.config["search"]
        results = present_results(read_json(path))
        check_results(results, path, self.controllers, search["maps_per_set"], self.repeats)
        return results

    def read_best(self, digest: str) -> MapSet:
        """Read ``best_map_set.json``.

        Args:
            digest: Digest of the map set that ``best_results.json`` is about.

        Raises:
            RunError: If it is missing, damaged, or holds another map set.
        """
        path = self.path / BEST_MAP_SET
        try:
            best = MapSet(tuple(scenario for tasked in read_map_set(path) for scenario in tasked.scenarios()))
        except MapBenchError as error:
            raise RunError(str(error) if str(path) in str(error) else f"{path}: {error}") from None
        if best.digest != digest:
            raise RunError(f"{path}: expected the map set of {BEST_RESULTS} ({digest}), got {best.digest}")
        return best

    def read_timing(self) -> list[Row]:
        """Read ``timing.jsonl``, if there is one, without a half-written last line; raises ``RunError`` if damaged."""
        rows = read_json_lines(self.path / TIMING)
        check_rows(TimingRow, rows, self.path / TIMING)
        return rows

    def _read_table(self, name: str, model: type[Document]) -> list[Row]:
        """Read a table that grows with every generation."""
        rows = read_csv(self.path / name)
        check_rows(model, rows, self.path / name)
        last = rows[-1]["generation"] if rows else 0
        if last < self.generation:
            raise RunError(f"{self.path / name}: expected {counted(self.generation, 'generation')}, got {last}")
        return rows

    def check_experiment(self, experiment: Experiment) -> None:
        """Refuse to continue with another experiment than the one this directory was made for.

        Raises:
            ConfigError: If an option differs, naming it.
            RunError: If another version of this package wrote the directory.
        """
        RUN.check_resumed(self.path, self.config, experiment.document())

    def write_generation(
        self,
        record: Record,
        best: Evaluation,
        checkpoint: Mapping[str, Any],
        validation: ValidationResult | None = None,
    ) -> None:
        """Write everything known after a generation, or after the validation stage; the checkpoint last."""
        RUN.check_there(self.path)
        generation = int(checkpoint["generation"])
        make_directory(self.path / MAPS)
        write_text(self.path / README, README_TEXT)
        write_bytes(self.path / MAPS / f"{generation:04d}.npz", npz_of(record.maps))
        if record.genomes:
            genomes = {digest: genome.model_dump(mode="json") for digest, genome in record.genomes.items()}
            write_json(self.path / MAPS / f"{generation:04d}.json", genomes)
        if record.bodies:
            bodies = {digest: [one.model_dump(mode="json") for one in some] for digest, some in record.bodies.items()}
            write_json(self.path / MAPS / f"{generation:04d}{BODIES}", bodies)
        self._write_table(GENERATIONS, record.generations)
        self._write_table(INDIVIDUALS, record.individuals)
        self._write_table(RUNS, list(record.runs.values()))
        write_json(self.path / BEST_MAP_SET, map_set_document(group_scenarios(named(best.map_set))))
        results = results_document(best, record.plan.names, checkpoint["cluster_scale"], validation)
        write_json(self.path / BEST_RESULTS, results)
        self.write_checkpoint(checkpoint)

    def write_front(self, points: Sequence[FrontPoint], names: Sequence[str]) -> None:
        """Write the Pareto front of a search whose objectives have these names."""
        RUN.check_there(self.path)
        make_directory(self.path / FRONT_SETS)
        for number, point in enumerate(points, start=1):
            sets = group_scenarios(named(point.evaluation.map_set))
            write_json(self.path / FRONT_SETS / f"{number}.json", map_set_document(sets))
        write_text(self.path / FRONT, csv_of(front_rows(points, names)))

    def read_front(self) -> list[Row]:
        """Read ``front.csv``; empty for a search of one objective, or an unfinished one."""
        path = self.path / FRONT
        rows = read_csv(path) if path.is_file() else []
        check_rows(FrontRow, rows, path)
        return rows

    def _write_table(self, name: str, rows: Sequence[Row]) -> None:
        """Write a table that has grown since it was last written by this object."""
        write_text(self.path / name, self._tables[name].text(rows))

    def write_checkpoint(self, checkpoint: Mapping[str, Any]) -> None:
        """Replace the checkpoint."""
        write_json(self.path / CHECKPOINT, checkpoint)

    def append_timing(self, row: Mapping[str, Any]) -> None:
        """Add a line to ``timing.jsonl``."""
        append_line(self.path / TIMING, json.dumps(row))


def controllers_in(config: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the compared controllers in a ``config.json``, in order."""
    return tuple(spec["name"] for spec in config["controllers"])
