"""The directory of a study: its settings, one store for all runs, and a run directory for every run.

::

    study.json                            the settings, and the version they are run with
    resolved.json                         what configurations took from earlier ones
    results.sqlite                        every driven run, shared by all
    runs/CONFIGURATION/seed-0003/         run directories, as those of mapbench evolve
    searches/CONFIGURATION/seed-0003/     searches in which no controller drove (path_length)
    reevaluation/CONFIGURATION/seed-0003.json     the best set on fresh seeds
    tables/  figures/  report.html        made from the above
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evolution.documents import Taken, check
from evolution.files import differences, make_directory, read_json, refuse_used, write_json
from evolution.header import header, read_header, refuse_version
from evolution.rundir import CONFIG, STORE, RunDir
from evolution.study.settings import StudySettings
from gym_mapbench.errors import ConfigError, RunError

FORMAT = "mapbench-study"
FORMAT_VERSION = 1
STUDY, RESOLVED = "study.json", "resolved.json"


@dataclass(frozen=True)
class StudyDir:
    """The directory of one study; made by :meth:`create` or :meth:`open`.

    Args:
        path: The directory.
        settings: The study.
        config: What ``study.json`` says.
    """

    path: Path
    settings: StudySettings
    config: Mapping[str, Any]

    @classmethod
    def create(cls, path: str | Path, settings: StudySettings) -> StudyDir:
        """Make the directory of a new study.

        Raises:
            ConfigError: If there is anything there already; nothing is changed.
            RunError: If it cannot be made.
        """
        path = Path(path)
        refuse_used(path, STUDY, "study")
        config = {**header(FORMAT, FORMAT_VERSION), "study": settings.model_dump(mode="json")}
        make_directory(path)
        write_json(path / STUDY, config)
        return cls(path, settings, config)

    @classmethod
    def open(cls, path: str | Path) -> StudyDir:
        """Open the directory of a study, finished or not.

        Raises:
            RunError: If it is not a study directory, or of another format.
        """
        path = Path(path)
        if not is_study(path):
            raise RunError(f"{path}: not a study directory (no {STUDY})")
        config = read_header(path / STUDY, FORMAT, FORMAT_VERSION)
        try:
            settings = StudySettings.from_mapping(config.get("study"), str(path / STUDY))
        except ConfigError as error:
            raise RunError(str(error)) from None
        return cls(path, settings, config)

    def check(self, settings: StudySettings) -> None:
        """Refuse to go on with anything but the study this directory was made for.

        Raises:
            ConfigError: If an option differs, naming it.
            RunError: If another version of this package wrote the directory, or ``resolved.json`` is damaged.
        """
        refuse_version(self.config, self.path)
        self.read_resolved()
        for name, was, now in differences(_by_name(self.settings), _by_name(settings)):
            raise ConfigError(f"{self.path}: {name} was {was!r} when the study began, got {now!r}")

    @property
    def store_path(self) -> Path:
        """Where all runs keep their results."""
        return self.path / STORE

    def run_path(self, configuration: str, seed: int) -> Path:
        """Run directory of one run."""
        return self.path / "runs" / configuration / f"seed-{seed:04d}"

    def search_path(self, configuration: str, seed: int) -> Path:
        """Run directory of a search in which no controller drove."""
        return self.path / "searches" / configuration / f"seed-{seed:04d}"

    def reevaluation_path(self, configuration: str, seed: int) -> Path:
        """File with the re-evaluation of one run."""
        return self.path / "reevaluation" / configuration / f"seed-{seed:04d}.json"

    def is_finished(self, configuration: str, seed: int) -> bool:
        """Whether a run came to its end.

        Raises:
            RunError: If its directory is damaged.
        """
        path = self.run_path(configuration, seed)
        return (path / CONFIG).is_file() and RunDir.open(path).finished

    def read_resolved(self) -> dict[str, Any]:
        """Read by configuration what it took from earlier ones, and from which seeds.

        Raises:
            RunError: If the file is damaged.
        """
        path = self.path / RESOLVED
        if not path.is_file():
            return {}
        try:
            entries = read_json(path)
            for name, entry in entries.items():
                check(Taken, entry, f"{path}: {name}")
        except RunError as error:
            raise RunError(f"{error}; delete it: --resume takes it from the earlier runs again") from None
        return entries

    def write_resolved(self, configuration: str, resolved: Mapping[str, Any]) -> None:
        """Keep what a configuration took from earlier ones."""
        write_json(self.path / RESOLVED, {**self.read_resolved(), configuration: dict(resolved)})


def _by_name(settings: StudySettings) -> dict[str, Any]:
    """All options of a study, the configurations by name instead of by position."""
    document = settings.model_dump(mode="json")
    return {**document, "configurations": {one["name"]: one for one in document["configurations"]}}


def is_study(path: str | Path) -> bool:
    """Whether a path is the directory of a study."""
    return (Path(path) / STUDY).is_file()
