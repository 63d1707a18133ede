"""Models of documents and tables, checked when a file is read.

A model requires the keys that are used; a file may hold more.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from evolution.files.plain import Row, read_json
from evolution.files.versions import written_elsewhere
from gym_mapbench.errors import MapFormatError, RunError

LOG = logging.getLogger(__name__)


class Document(BaseModel):
    """A JSON document, or a line of a table; types are strict: a text does not pass for a number."""

    model_config = ConfigDict(strict=True, frozen=True)


class Versions(Document):
    """The versions that every ``config.json`` and ``study.json`` names."""

    version: str
    libraries: dict[str, str]


def warn_of_versions(document: Mapping[str, Any], where: str | Path) -> None:
    """Log a warning if other versions than those in use wrote a ``config.json`` or ``study.json``.

    Raises:
        RunError: If it names none.
    """
    check(Versions, document, where)
    for line in written_elsewhere(document):
        LOG.warning("%s: %s", where, line)


MADE_AGAIN = "--resume makes it again from the stored runs"
"""What to do about a damaged file that follows from the store."""


@contextmanager
def advising(advice: str = MADE_AGAIN) -> Iterator[None]:
    """Add to an error about a damaged file what the user can do.

    Raises:
        RunError: Instead of a ``RunError`` or ``MapFormatError`` inside the ``with`` block.
    """
    try:
        yield
    except (RunError, MapFormatError) as error:
        raise RunError(f"{error}; {advice}") from None


def check(model: type[Document], document: object, where: str | Path) -> None:
    """Refuse a document that is not as ``model`` says.

    Args:
        model: Describes what it must hold.
        document: The content of a file.
        where: Its file, or a part of it; the message begins with it.

    Raises:
        RunError: Naming the first key that is missing or wrong.
    """
    try:
        model.model_validate(document)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        message = (
            first["msg"].replace("Input should", "should").removeprefix("Value error, ").split(" or instance of ")[0]
        )
        what = "is missing" if first["type"] == "missing" else message
        raise RunError(f"{where}: {key}: {what}" if key else f"{where}: {what}") from None


def read_document(model: type[Document], path: Path) -> dict[str, Any]:
    """Return the content of a JSON file that is as ``model`` says.

    Raises:
        RunError: If the file cannot be read, or naming its first key that is missing or wrong.
    """
    document: dict[str, Any] = read_json(path)
    check(model, document, path)
    return document


def check_rows(model: type[Document], rows: Sequence[Row], path: Path) -> None:
    """Refuse a table with a line that is not as ``model`` says.

    Raises:
        RunError: Naming the first such line, counted without the heading.
    """
    for number, row in enumerate(rows, start=1):
        check(model, row, f"{path}: line {number}")
