"""The directory of one training: plain files, complete at any moment."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evolution.files import (
    DirectoryKind,
    Document,
    Row,
    Table,
    Tabled,
    check_rows,
    counted,
    csv_of,
    make_directory,
    read_csv,
    read_document,
    read_json,
    write_json,
    write_text,
)
from evolution.training.levels import EVERY_FIFTH, is_split
from evolution.training.settings import TrainSettings
from gym_mapbench.errors import RunError
from gym_mapbench.files.replacing import remove_abandoned
from gym_mapbench.mapio.map_set_file import map_set_document, parse_map_set
from gym_mapbench.mapio.tasked_map import group_scenarios
from gym_mapbench.world.scenario import Scenario

LOG = logging.getLogger(__name__)

CONFIG, STATE, CURVE, README = "training.json", "state.json", "curve.csv", "README.txt"
BEST, LATEST, CHECKPOINTS, FIGURES, LOGS = "best_model.zip", "model.zip", "checkpoints", "figures", "tensorboard"
MAPS, CURRICULUM = "maps.json", "curriculum.json"
COUNT_OF = {MAPS: "given_maps", CURRICULUM: "given_levels"}
"""By file of maps, the key of ``training.json`` with their number."""
STATISTICS, BUFFER = "vecnormalize.npz", "replay_buffer.npz"
CURVE_FIGURE = "learning_curve"

TRAINING = DirectoryKind("training", CONFIG, format_version=1)

README_TEXT = """One training of mapbench. Lengths are m, times s; success is a share, 0 to 1.

training.json       all options as used, and the versions they were used with
curve.csv           one line per evaluation: success on every group of held-out maps, and of the episodes in training;
                    of fewer than five given maps none is held out, and it is success on the training maps
figures/            the same as a picture
best_model.zip      the model with the best mean success over these groups: drive it with
                    mapbench bench MAP --controllers mppi,learned=best_model.zip
model.zip           the latest model, which --resume continues
checkpoints/        the model at every evaluation, by its steps, to be driven
maps.json, curriculum.json    the maps it trains on, if they are not random
state.json          where the training stands
tensorboard/        logs, if TensorBoard was installed
vecnormalize.npz    statistics of inputs and rewards that --resume needs, where the settings want them
replay_buffer.npz   experience of SAC, TD3 at the last Ctrl-C, SIGTERM or SIGHUP; --resume uses it if model.zip is of
                    its step

A model is a file of Stable-Baselines3 with a card in it, mapbench.json: what it sees, how often it decides.
Model files can run code when they are loaded to drive: use only your own, and those of people you trust. --resume reads
numbers only, and runs nothing that is in here.
"""


NO_SCORE = -1.0
"""Best success in ``state.json`` before the first evaluation."""


class State(Document):
    """``state.json``."""

    steps: int
    seconds: float
    best: float
    finished: bool


class CurveRow(Document):
    """A line of ``curve.csv``; the columns of the groups of held-out maps come after these."""

    steps: int
    seconds: float
    success: float


@dataclass(frozen=True)
class Training(Tabled):
    """A training as far as it has come; read by :func:`load_training`.

    Args:
        path: Its directory.
        config: ``training.json``.
        state: ``state.json``.
        curve: ``curve.csv``: one row per evaluation.
        not_held_out: As of :class:`TrainingDir`.
    """

    path: Path
    config: Mapping[str, Any]
    state: Mapping[str, Any]
    curve: list[Row]
    not_held_out: tuple[str, ...] = ()

    @property
    def finished(self) -> bool:
        """Whether all steps were done."""
        return bool(self.state["finished"])

    @property
    def best(self) -> Path:
        """File of the best model."""
        return self.path / BEST

    @property
    def tables(self) -> Mapping[str, Callable[[], Table]]:
        """The learning curve, ``curve``, is the only table."""
        return {"curve": self._curve}

    def _curve(self) -> Table:
        but = f" ({' and '.join(self.not_held_out)}: not held out)" if self.not_held_out else ""
        return Table(self.curve, f"Success on held-out maps, {self.config['algorithm']}{but}")


@dataclass(frozen=True)
class TrainingDir:
    """The directory of a training; made by :meth:`create` or :meth:`open`.

    Args:
        path: The directory.
        config: Content of ``training.json``.
    """

    path: Path
    config: Mapping[str, Any]

    @classmethod
    def create(
        cls, path: Path, settings: TrainSettings, maps: Sequence[Scenario], curriculum: Sequence[Scenario]
    ) -> TrainingDir:
        """Make the directory of a new training.

        Args:
            path: New or empty.
            settings: Settings of the training.
            maps: The maps to train on; empty for random ones.
            curriculum: The curriculum's levels; empty for none.

        Raises:
            ConfigError: If there is anything there already; nothing is changed.
            RunError: If it cannot be made.
        """
        given = {MAPS: maps, CURRICULUM: curriculum}
        counts = {COUNT_OF[name]: len(scenarios) for name, scenarios in given.items()}
        config = TRAINING.begin(path, {**settings.model_dump(mode="json"), **counts})
        for name, scenarios in given.items():
            if scenarios:
                write_json(path / name, map_set_document(group_scenarios(scenarios)))
        return cls(path, config)

    def complete(self) -> None:
        """Make what a killed training may lack, the folders and the README, and remove what it left half-written."""
        for name in (CHECKPOINTS, FIGURES):
            make_directory(self.path / name)
        remove_abandoned(self.path)
        write_text(self.path / README, README_TEXT)

    @classmethod
    def open(cls, path: Path) -> TrainingDir:
        """Open the directory of a training, finished or not.

        Raises:
            RunError: If it is no such directory, or of another format.
        """
        return cls(path, TRAINING.open(path))

    @property
    def settings(self) -> TrainSettings:
        """Settings of the training."""
        fields = {name: value for name, value in self.config.items() if name in TrainSettings.model_fields}
        return TrainSettings.from_mapping(fields, str(self.path / CONFIG))

    def read_maps(self) -> tuple[list[Scenario], list[Scenario]]:
        """Read the maps to train on and the curriculum's levels.

        Raises:
            MapFormatError: If a file is damaged.
            RunError: If maps are missing: the training would go on with random maps.
        """
        maps, curriculum = (self._given(name) for name in (MAPS, CURRICULUM))
        return maps, curriculum

    @property
    def not_held_out(self) -> tuple[str, ...]:
        """Which of ``maps`` and ``curriculum`` are too few to hold one out, so that they are evaluated on as well."""
        files = {"maps": MAPS, "curriculum": CURRICULUM}
        return tuple(name for name, file in files.items() if self._holds_none_out(file))

    def _holds_none_out(self, name: str) -> bool:
        """Whether a file has too few maps to hold one out; of a deleted file, their recorded number decides."""
        count = self.config.get(COUNT_OF[name], 0)
        if count and not (self.path / name).is_file():
            said = "%s: was deleted; whether maps were held out follows from their number, %d"
            LOG.warning(said, self.path / name, count)
            return bool(count < EVERY_FIFTH)
        scenarios = self._given(name)
        return bool(scenarios) and not is_split(scenarios)

    def _given(self, name: str) -> list[Scenario]:
        """Read a file of maps; an earlier version did not record how many there are."""
        path = self.path / name
        scenarios = [*_scenarios(path)] if path.is_file() else []
        wanted = self.config.get(COUNT_OF[name], len(scenarios))
        if len(scenarios) != wanted:
            what = f"expected the {counted(wanted, 'map')} that the training was begun with, got {len(scenarios)}"
            raise RunError(f"{path}: {what}; begin it again in another directory")
        return scenarios

    @property
    def state(self) -> dict[str, Any] | None:
        """Content of ``state.json``; None before the first checkpoint."""
        path = self.path / STATE
        if not path.is_file():
            return None
        return read_document(State, path)

    def read_curve(self) -> list[Row]:
        """Read ``curve.csv``, empty before the first evaluation; raises ``RunError`` if it is damaged."""
        path = self.path / CURVE
        rows = read_csv(path) if path.is_file() else []
        check_rows(CurveRow, rows, path)
        if not rows and self.state is not None and self.state["best"] > NO_SCORE:
            raise RunError(f"{path}: expected the evaluations that chose the best model so far, got none")
        return rows

    def write_curve(self, rows: Sequence[Row]) -> None:
        """Write ``curve.csv``."""
        write_text(self.path / CURVE, csv_of(rows))

    def write_state(self, state: Mapping[str, Any]) -> None:
        """Write ``state.json``."""
        write_json(self.path / STATE, state)


def load_training(path: str | Path) -> Training:
    """Read the directory of a training, as far as it has come.

    Raises:
        RunError: If it is not a training directory, has no checkpoint, or is damaged.
    """
    directory = TrainingDir.open(Path(path))
    state = directory.state
    if state is None:
        raise RunError(f"{path}: no checkpoint was written; continue it with --resume")
    return Training(directory.path, directory.config, state, directory.read_curve(), directory.not_held_out)


def _scenarios(path: Path) -> Iterator[Scenario]:
    """Read the maps of a map-set file, in order."""
    return (scenario for tasked in parse_map_set(read_json(path), str(path)) for scenario in tasked.scenarios())
