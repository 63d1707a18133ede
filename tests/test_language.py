"""Help, messages, docstrings and pages use the field's terms: phrases that the glossary replaces do not come back."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("gym_mapbench", "controllers", "evolution")
FORMER_NAMES = ("evolution/runs/former_names.py", "evolution/search/option_names.py")
"""The two files that read the words of older result files."""

REPLACED = re.compile(
    r"chose nothing|driven anew|driven again|drawn anew|drives? again|\b(?:is|are) worth\b|could least do without"
    r"|\balike are\b|\breads? (?:high|low)\b|by the \w+ own word|, and (?:that|it) is all\b|\bfresh seeds\b"
    r"|\bkeeps? (?:its|their) order\b|\bprospects\b|\bthe luckiest\b|chosen by luck|\berrors are drawn\b"
    r"|\bfamilies draw\b|\bconfirmation\b|\bsingle drives?\b|\bthesis' GA\b",
    re.IGNORECASE,
)
PAGES = sorted(
    path
    for path in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "examples").rglob("*.md")]
    if path.name != "glossary.md"
)
MODULES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def texts_in(source):
    """All text constants of a module with their lines: docstrings, messages, help."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, " ".join(node.value.split())


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_pages_use_the_terms_of_the_glossary(page):
    text = " ".join(page.read_text(encoding="utf-8").split())
    assert not [match.group() for match in REPLACED.finditer(text)]


def test_docstrings_messages_and_help_use_the_terms_of_the_glossary():
    found = [
        f"{name_of(path)}:{line}: {match.group()}"
        for path in MODULES
        if name_of(path) not in FORMER_NAMES
        for line, text in texts_in(path.read_text(encoding="utf-8"))
        if (match := REPLACED.search(text))
    ]
    assert not found


@pytest.mark.parametrize("phrase", ["maps that were driven again", "It is worth -3", "seeds that chose nothing"])
def test_replaced_phrases_are_found(phrase):
    assert REPLACED.search(phrase)
