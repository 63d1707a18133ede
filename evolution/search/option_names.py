"""Names of the options of a search: the section of each short name, and the names of earlier versions.

The options of the sections ``ga``, ``judging`` and ``archive`` can be given by their short names: ``pop_size`` stands
for ``ga: {pop_size: ...}``. Keyword arguments and options of the command line are short names, and so are all options
in files of earlier versions, which had no sections.

=====================  ======================================
earlier versions       now
=====================  ======================================
``archive: true``      ``archive: {elite: true}``
``confirmation``       ``validation``
``claim_seeds``        ``held_out_seeds``, in ``validation``
``drive_last: [...]``  ``staged: true``; ``staged: false`` if empty
=====================  ======================================
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from evolution.search.algorithms import GaSettings
from evolution.search.judging import JudgingSettings
from evolution.search.sections import ArchiveSettings
from gym_mapbench.errors import ConfigError
from gym_mapbench.settings import Settings

SECTIONS: dict[str, type[Settings]] = {"ga": GaSettings, "judging": JudgingSettings, "archive": ArchiveSettings}
"""The sections whose options have short names."""

SHORT_NAMES = {name: section for section, model in SECTIONS.items() for name in model.model_fields}
"""The section of each short name."""

FORMER_OF_VALIDATION = {"claim_seeds": "held_out_seeds"}
"""Former names of options of the validation stage."""

FORMER_OF_STAGED = "drive_last"
"""Former option of the archive: the controllers that ran on a map last, only where the others reached the goal."""


def nested(search: Mapping[str, Any]) -> dict[str, Any]:
    """Return options of a search in their sections, under their present names; unknown options stay as they are.

    Args:
        search: Some options of a search; each by its short name, by a former name, or in its section.

    Raises:
        ConfigError: If an option is given twice, by two names.
    """
    found: dict[str, Any] = {}
    for name, value in search.items():
        _put(found, *_present(name, value))
    return found


def nested_document(document: Mapping[str, Any], where: str = "experiment") -> dict[str, Any]:
    """Return the document of an experiment with the options of its search, if it has any, in their sections.

    Args:
        document: Sections ``search``, ``controllers`` and ``run``, each of them optional.
        where: Beginning of every error message.

    Raises:
        ConfigError: If an option is given twice, by two names.
    """
    search = document.get("search")
    if not isinstance(search, Mapping):
        return dict(document)
    try:
        return {**document, "search": nested(search)}
    except ConfigError as error:
        raise ConfigError(f"{where}: search: {error}") from None


def short_names(search: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a search by their short names; those of ``validation`` stay in their section.

    Args:
        search: Options in their sections.
    """
    found: dict[str, Any] = {}
    for name, value in search.items():
        found |= dict(value) if name in SECTIONS and isinstance(value, Mapping) else {name: value}
    return found


def _present(name: str, value: Any) -> tuple[str, Any]:
    """Return the present name of an option, and its value in its section."""
    if name in SHORT_NAMES:
        return SHORT_NAMES[name], {name: value}
    if name == "archive" and isinstance(value, bool):
        return name, {"elite": value}
    if name == FORMER_OF_STAGED:
        return "archive", {"staged": bool(value)}
    if name == "archive" and isinstance(value, Mapping):
        return name, dict(_staged(*option) for option in value.items())
    if name in ("confirmation", "validation"):
        return "validation", _renamed(value) if isinstance(value, Mapping) else value
    return name, value


def _staged(name: str, value: Any) -> tuple[str, Any]:
    """Return an option of the archive under its present name."""
    return ("staged", bool(value)) if name == FORMER_OF_STAGED else (name, value)


def _renamed(validation: Mapping[str, Any]) -> dict[str, Any]:
    return {FORMER_OF_VALIDATION.get(name, name): value for name, value in validation.items()}


def _put(found: dict[str, Any], name: str, value: Any) -> None:
    """Add an option, or some options of a section, to those found."""
    if name not in found:
        found[name] = value
        return
    before = found[name]
    both = isinstance(before, Mapping) and isinstance(value, Mapping)
    twice = [f"{name}.{option}" for option in value if option in before] if both else [name]
    if twice:
        raise ConfigError(f"{twice[0]}: expected once, got it under two names")
    found[name] = {**before, **value}
