"""The tables of ``mapbench validate --format json``, from the output of a run that is kept in docs/fidelity."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from docs.generate.markdown import table

KEPT = Path(__file__).parents[1] / "fidelity"


def measures_of(oracle: str) -> str:
    """Return a table of every measure with its target, and the runs that ended differently."""
    document = json.loads((KEPT / f"{oracle}.json").read_text(encoding="utf-8"))
    differing = document.pop("disagreements")
    rows = [_row(key, one) for key, one in document.items()]
    shown = table(["measure", "value", "target", "cases", "worst case"], rows)
    if not differing:
        return f"{shown}\n\nNo run ended differently."
    return shown + "\n\nRuns that ended differently:\n\n" + "\n".join(f"- {line}" for line in differing)


def _row(key: str, one: dict[str, Any]) -> list[str]:
    value = "not a number" if one["value"] is None else f"{one['value']:.6g}"
    target = one["target"] + (" (missed)" if one["missed"] else "")
    return [f"`{key}`", value, target or "none", f"{one['count']:,}".replace(",", " "), one["worst"]]
