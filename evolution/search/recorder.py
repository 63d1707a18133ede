"""Recording of a search: the interface of what keeps it, and the replay of what was kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from evolution.search.algorithms import Evaluation
from evolution.search.experiment import Experiment
from evolution.search.judging import best_of
from evolution.search.record import Record
from evolution.search.validation_stage import FrontPoint, ValidationResult
from gym_mapbench.errors import RunError

Checkpoint = Mapping[str, Any]


def checkpoint_of(
    generation: int, evaluations: int, population: Sequence[Evaluation], cluster_scale: float | None
) -> dict[str, Any]:
    """Return the checkpoint of a search that is not finished, after a generation with so many evaluations."""
    best = best_of(population)
    return {
        "generation": generation,
        "evaluations": evaluations,
        "finished": False,
        "cluster_scale": cluster_scale,
        "best": best.map_set.digest,
        "best_fitness": best.judgement.fitness,
        "population": [one.map_set.digest for one in population],
    }


class Recorder(Protocol):
    """Keeps a search, so that it can be read and continued; a run directory is one."""

    @property
    def path(self) -> Path:
        """Where it is kept; error messages begin with it."""
        ...

    @property
    def checkpoint(self) -> Checkpoint | None:
        """The last checkpoint; None for a new search."""
        ...

    def check_experiment(self, experiment: Experiment) -> None:
        """Raise ``ConfigError`` if another experiment was begun here."""
        ...

    def write_generation(
        self, record: Record, best: Evaluation, checkpoint: Checkpoint, validation: ValidationResult | None = None
    ) -> None:
        """Write everything known after a generation, or after the validation stage."""
        ...

    def write_front(self, points: Sequence[FrontPoint], names: Sequence[str]) -> None:
        """Write the Pareto front of a search whose objectives have these names."""
        ...

    def write_checkpoint(self, checkpoint: Checkpoint) -> None:
        """Replace the checkpoint."""
        ...

    def append_timing(self, row: Mapping[str, Any]) -> None:
        """Add the wall-clock seconds of a generation, or of the validation stage."""
        ...


class Journal:
    """Writes a search to its recorder; checks the generations of a replay against the checkpoint instead.

    Args:
        recorder: Keeps the search; nothing is kept if None.
        experiment: The experiment of the search.

    Raises:
        ConfigError: If the recorder was made for another experiment.
    """

    def __init__(self, recorder: Recorder | None, experiment: Experiment) -> None:
        if recorder is not None:
            recorder.check_experiment(experiment)
        self.recorder = recorder
        self.expected = None if recorder is None else recorder.checkpoint

    @property
    def is_new(self) -> bool:
        """Whether there is nothing to replay."""
        return self.expected is None

    @property
    def was_finished(self) -> bool:
        """Whether the search was finished before it was continued."""
        return bool(self.expected and self.expected["finished"])

    def write(self, record: Record, best: Evaluation, checkpoint: Checkpoint) -> bool:
        """Write a generation; in a replay, check it instead and return True.

        Raises:
            RunError: If the replay differs from the checkpoint.
        """
        if self.recorder is None:
            return False
        if self.expected is not None and checkpoint["generation"] <= self.expected["generation"]:
            if checkpoint["generation"] == self.expected["generation"]:
                self._check_replay(self.expected, checkpoint)
            return True
        self.recorder.write_generation(record, best, checkpoint)
        return False

    def write_front(self, points: Sequence[FrontPoint], names: Sequence[str]) -> None:
        """Write the Pareto front of a search whose objectives have these names."""
        if self.recorder is not None:
            self.recorder.write_front(points, names)

    def write_end(
        self, record: Record, best: Evaluation, checkpoint: Checkpoint, validation: ValidationResult | None, stage: bool
    ) -> None:
        """Write the end of a search; everything after a validation stage (``stage``), else only the checkpoint."""
        if self.recorder is None:
            return
        if stage:
            self.recorder.write_generation(record, best, checkpoint, validation)
        else:
            self.recorder.write_checkpoint(checkpoint)

    def write_timing(self, row: Mapping[str, Any]) -> None:
        """Write the wall-clock seconds of a generation, or of the validation stage."""
        if self.recorder is not None:
            self.recorder.append_timing(row)

    def _check_replay(self, expected: Checkpoint, reached: Checkpoint) -> None:
        reached = {**reached, "finished": bool(expected["finished"])}
        different = [name for name in reached if reached[name] != expected.get(name)]
        if different:
            where = self.recorder.path if self.recorder else ""
            raise RunError(
                f"{where}: generation {reached['generation']} cannot be repeated ({different[0]} differs): "
                "the code, its libraries or the result store have changed since"
            )
