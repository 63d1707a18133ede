"""Small pieces of Markdown."""

from __future__ import annotations

from collections.abc import Sequence


def table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; bars in cells do not end them, and angle brackets are no tags."""
    lines = [columns, ["---"] * len(columns), *([_cell(cell) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def code(text: str, language: str = "text") -> str:
    """Return a block of code."""
    return f"```{language}\n{text}\n```"


def name(text: str) -> str:
    """Return a word in code type."""
    return f"`{text}`"


def _cell(text: str) -> str:
    outside = [part if number % 2 else part.replace("<", "&lt;") for number, part in enumerate(text.split("`"))]
    return " ".join("`".join(outside).replace("|", "\\|").split()) or " "
