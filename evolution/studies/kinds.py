"""The two kinds of study, searches and sweeps over worlds; the content of a file tells which it is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from evolution.arguments import path_from
from evolution.studies.directory import STUDY, StudyDir
from evolution.studies.settings import StudySettings, read_definition
from evolution.studies.sweep.running import SWEEP, read_sweep
from evolution.studies.sweep.settings import SweepSettings
from gym_mapbench.errors import ConfigError

AnyStudy = StudySettings | SweepSettings


def load_definition(name_or_file: str | Path) -> AnyStudy:
    """Read a study of any kind by name or from a YAML file; one with ``worlds`` is a sweep.

    Raises:
        ConfigError: If there is no such study, or it cannot be used.
    """
    values = read_definition(name_or_file)
    kind = SweepSettings if isinstance(values, Mapping) and "worlds" in values else StudySettings
    return kind.from_mapping(values, str(name_or_file))


def study_in(
    settings: str | Path | AnyStudy, out: str | Path | None = None, *, resume: bool = False
) -> tuple[AnyStudy, Path]:
    """Return a study and its directory; a directory to be resumed holds its study.

    Raises:
        ConfigError: If there is no such study, two directories are given, or something else.
        RunError: If a directory is damaged.
    """
    if isinstance(settings, AnyStudy):
        wanted = settings
    elif not isinstance(settings, str | Path):
        raise ConfigError(f"settings: expected a study, its name, or a file, got {settings!r:.80}")
    elif resume and (STUDY.holds(settings) or SWEEP.holds(settings)):
        if out is not None:
            raise ConfigError(f"out: expected none beside the study directory {settings}")
        found = StudyDir.open_to_drive(settings).settings if STUDY.holds(settings) else read_sweep(settings)
        return found, Path(settings)
    else:
        wanted = load_definition(settings)
    return wanted, path_from("out", out or Path("runs") / f"study-{wanted.name}")
