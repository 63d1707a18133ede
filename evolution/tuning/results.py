"""Tuning: the results in the directory of a finished tuning.

::

    tuning.json         options, search space, world and maps, and the versions it was begun with
    results.sqlite      every run, as it ends
    nav2_params.yaml    the user's file with the tuned values; its own behaviour tree is beside it
    summary.json        verdict, changed parameters, trials, finalists, importances, and the runs on the test maps
    trials.csv          one line per trial
    test.json           the test maps
    evolved.json        the evolved maps that joined the training maps, with --against evolve
    test.csv            one line per run on the test maps
    front/              with several objectives, a parameter file for each point of the Pareto front
    figures/            history, importances, Pareto front
    report.html         the page
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from pydantic import Field

from evolution.files import DirectoryKind, Document, Row, Table, Tabled, advising, read_document
from gym_mapbench.errors import RunError

TUNING = DirectoryKind("tuning", "tuning.json", format_version=1, remade=True)
SUMMARY, TRIALS, TEST, PARAMS, FRONT = "summary.json", "trials.csv", "test.csv", "nav2_params.yaml", "front"
TEST_MAPS, EVOLVED_MAPS, FIGURES = "test.json", "evolved.json", "figures"


class TuningSummary(Document):
    """The content of ``summary.json`` that readers use.

    Args:
        verdict: The result in sentences.
        tuning: Digest of the options, as :func:`digest_of` returns it; empty in the summary of an earlier version.
        maps: Numbers of training and test maps in words; empty in the summary of an earlier version.
        controller: The tuned controller.
        objectives: Names of the objectives.
        winner: Number of the chosen trial; 0 for the user's own values.
        runs: Number of runs of the search, the validation stage and the test.
        changes: For each changed parameter, its name and its value before and after.
        finalists: The trials of the validation stage.
        front: Numbers of the trials on the Pareto front; with one objective, that of the winner.
        importances: For each parameter, its importance for each objective.
        trials: A row for each trial.
        test: A row for each run on the test maps.
        rounds: The mean cost of the values of each round on each group of training maps; empty for a single round.
    """

    verdict: list[str]
    tuning: str = ""
    maps: str = ""
    controller: str
    objectives: list[str]
    winner: int
    runs: dict[str, int]
    changes: list[Row]
    finalists: list[Row]
    front: list[int]
    importances: list[Row]
    trials: list[Row]
    test: list[Row]
    rounds: list[Row] = Field(default_factory=list)


@dataclass(frozen=True)
class Tuning(Tabled):
    """A finished tuning.

    Args:
        path: Its directory.
        config: The options it was begun with.
        summary: The result.
    """

    path: Path
    config: Row
    summary: TuningSummary

    @property
    def params(self) -> Path:
        """The tuned parameter file."""
        return self.path / PARAMS

    @property
    def verdict(self) -> list[str]:
        """The result in sentences."""
        return self.summary.verdict

    @property
    def tables(self) -> Mapping[str, Callable[[], Table]]:
        """``changes`` (the tuned parameters before and after), and other fields of the summary."""
        names = ("changes", "trials", "finalists", "importances", "test", "rounds")
        return {name: partial(Table, getattr(self.summary, name)) for name in names}


def load_tuning(path: str | Path) -> Tuning:
    """Read the directory of a tuning.

    Raises:
        RunError: If it is not a tuning, was not finished, or is damaged.
    """
    path = Path(path)
    config = TUNING.open(path)
    if not (path / SUMMARY).is_file():
        raise RunError(f"{path}: the tuning was not finished; continue it with --resume")
    with advising():
        summary = TuningSummary.model_validate(read_document(TuningSummary, path / SUMMARY))
        if summary.tuning not in ("", digest_of(config)):
            raise RunError(
                f"{path / SUMMARY}: expected the summary of the tuning in {TUNING.mark}, got that of another"
            )
    return Tuning(path, config, summary)


def digest_of(config: Row) -> str:
    """Return a content hash of everything that the result of a tuning depends on.

    Args:
        config: Content of ``tuning.json``.
    """
    return hashlib.blake2b(json.dumps(config["tuning"], sort_keys=True).encode(), digest_size=16).hexdigest()
