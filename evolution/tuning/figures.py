"""Figures of a tuning: its history, the importances of the parameters, and the Pareto front."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from evolution.pictures import front_figure, history_figure, importance_figure, save_figure
from evolution.tuning.results import FIGURES


def write_figures(path: Path, summary: Mapping[str, Any]) -> None:
    """Write the figures of a tuning from the content of its ``summary.json``."""
    trials = summary["trials"]
    columns = [f"cost {name}" for name in summary["objectives"]]
    save_figure(history_figure(trials, columns[0]), path / FIGURES / "history")
    if summary["importances"]:
        save_figure(importance_figure(summary["importances"]), path / FIGURES / "importance")
    if len(columns) > 1:
        save_figure(front_figure(trials, summary["finalists"], summary["front"], columns), path / FIGURES / "front")
