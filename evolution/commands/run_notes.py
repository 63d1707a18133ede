"""What commands say about runs: models in another world, and runs that ended in an error."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from controllers.learned import NO_CARD, read_card
from evolution.commands.console import note
from evolution.driving import ControllerSpec, DriveSettings, ResultStore, try_controllers
from evolution.files import Row, counted
from evolution.runs import STORE
from gym_mapbench.errors import RunError


def note_models(specs: Sequence[ControllerSpec], settings: DriveSettings) -> None:
    """Print how the world differs from the training world of each model, and what is assumed of one without a card.

    Raises:
        ConfigError: If a controller cannot run there; then nothing is printed.
    """
    models = {spec.name: spec.registered_name for spec in specs if spec.registered_name.endswith(".zip")}
    cards = {name: read_card(path) for name, path in models.items()}
    if cards:
        try_controllers(specs, settings)
    for name, card in cards.items():
        for said in [NO_CARD] if card is None else card.differences(settings.environment):
            note(f"{name}: {said}")


def note_errors(path: str | Path) -> None:
    """Print how many runs in a directory ended in an error, why, and how to repeat them; nothing if none did."""
    store = Path(path) / STORE
    with ResultStore(store) as results:
        reasons, runs = results.errors(), len(results)
    delete = "DELETE FROM results WHERE json_extract(result, '$.outcome') = 'error'"
    command = f'sqlite3 {shlex.quote(str(store))} "{delete}"'
    changed = "--resume repeats them once code of your own that they ran has changed."
    note_reasons(reasons, runs, f"{changed} To repeat them as they are, delete them first: {command}")


def note_reasons(reasons: Sequence[str], runs: int, how_to_repeat: str) -> None:
    """Print how many of some runs ended in an error, the first of their reasons, and how to repeat them."""
    if reasons:
        note(f"{len(reasons)} of {counted(runs, 'run')} ended in an error, the first because: {reasons[0]}")
        note(how_to_repeat)


def check_measured(rows: Sequence[Row]) -> None:
    """Refuse results that measure nothing.

    Raises:
        RunError: If every run ended in an error.
    """
    if all(row["outcome"] == "error" for row in rows):
        raise RunError(f"every run ended in an error, the first because: {rows[0]['reason']}")
