"""The directory of a study: its settings, one result store for all runs, and a run directory for each.

::

    study.json                            the settings, the digests of learned models, and the versions
    resolved.json                         options that configurations take from earlier ones
    results.sqlite                        every run, shared by all
    runs/CONFIGURATION/seed-0003/         run directories, as those of mapbench evolve
    searches/CONFIGURATION/seed-0003/     searches over planned paths (path_length)
    reevaluation/CONFIGURATION/seed-0003.json     the best set on held-out seeds
    tables/  figures/  report.html        made from the above
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import FiniteFloat

from evolution.files import DirectoryKind, Document, check, read_json, write_json
from evolution.runs import CONFIG, RunDir
from evolution.studies.settings import StudySettings
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.trust import refuse_code

RESOLVED = "resolved.json"
TO_DRIVE = (
    *(f"study.{of}experiment.{section}" for of in ("", "configurations.") for section in ("controllers", "run")),
    "study.configurations.fresh_noise",
    "study.reevaluation.noise",
    "models",
)
"""Places in ``study.json`` that are used by runs only."""

STUDY = DirectoryKind(
    "study", "study.json", format_version=1, to_drive=TO_DRIVE, again="study {path} --allow-code --out NEW"
)


class Taken(Document):
    """An entry of ``resolved.json``: options taken from earlier configurations, and the seeds of these."""

    search: dict[str, FiniteFloat]
    seeds: list[int]


@dataclass(frozen=True)
class StudyDir:
    """The directory of one study; made by :meth:`create` or :meth:`open`.

    Args:
        path: The directory.
        settings: The study.
        config: Content of ``study.json``.
    """

    path: Path
    settings: StudySettings
    config: Mapping[str, Any]

    @classmethod
    def create(cls, path: str | Path, settings: StudySettings, models: Mapping[str, str] | None = None) -> StudyDir:
        """Make the directory of a new study.

        Args:
            path: New or empty.
            settings: The study.
            models: Content hashes of the models that drive, by file.

        Raises:
            ConfigError: If there is anything there already; nothing is changed.
            RunError: If it cannot be made.
        """
        path = Path(path)
        return cls(path, settings, STUDY.begin(path, _document(settings, models)))

    @classmethod
    def open(cls, path: str | Path) -> StudyDir:
        """Open the directory of a study, finished or not.

        Raises:
            RunError: If it is not a study directory, or of another format.
        """
        path = Path(path)
        config = STUDY.open(path)
        try:
            settings = StudySettings.from_mapping(config.get("study"), str(path / STUDY.mark))
        except ConfigError as error:
            raise RunError(str(error)) from None
        return cls(path, settings, config)

    @classmethod
    def open_to_drive(cls, path: str | Path) -> StudyDir:
        """Open the directory of a study that is to be continued; as :meth:`open`.

        Raises:
            UntrustedError: If its study names code.
        """
        directory = cls.open(path)
        refuse_code(directory.config, directory.path / STUDY.mark)
        return directory

    def check(self, settings: StudySettings, models: Mapping[str, str] | None = None) -> None:
        """Refuse to continue with settings or models other than those this directory was made for.

        Args:
            settings: The study.
            models: Content hashes of the models that drive, by file.

        Raises:
            ConfigError: If an option differs, naming it.
            RunError: If another version of this package wrote the directory, or ``resolved.json`` is damaged.
        """
        begun = {**self.config, **_document(self.settings)}
        STUDY.check_resumed(self.path, begun, _document(settings, models), _by_name)
        self.read_resolved()

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
        """Whether a run is finished.

        Raises:
            RunError: If its directory is damaged.
        """
        path = self.run_path(configuration, seed)
        return (path / CONFIG).is_file() and RunDir.open(path).finished

    def read_resolved(self) -> dict[str, Any]:
        """Read for each configuration what it took from earlier ones, and from which seeds.

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
        """Record the options that a configuration takes from earlier ones."""
        write_json(self.path / RESOLVED, {**self.read_resolved(), configuration: dict(resolved)})


def _document(settings: StudySettings, models: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return the document that a study is begun with."""
    return {"study": settings.model_dump(mode="json"), **({"models": dict(models)} if models else {})}


def _by_name(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a study, the configurations by name instead of by position."""
    study = document["study"]
    configurations = {one["name"]: one for one in study["configurations"]}
    return {**study, "configurations": configurations, "models": document.get("models")}
