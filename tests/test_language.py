"""The words of the project: earlier words and long sentences stay out of pages, help, messages and docstrings.

``docs/glossary.md`` lists earlier words and the terms that replaced them; it is the one page that may name them.
"""

from __future__ import annotations

import argparse
import ast
import re
from collections.abc import Iterator, Mapping

import pytest

from evolution.cli import build_parser
from tests.test_documents import ROOT

EARLIER = {
    r"chose nothing": "held-out seeds",
    r"\bdriv(?:e|en|es|ing|e \w+) (?:again|anew)\b": "re-evaluate, re-run",
    r"\bdrawn (?:again|anew)\b": "sample again",
    r"\b(?:single|fresh|further) drives?\b|\b(?:ten|\d+) drives\b|\bof the drives\b": "run, trial",
    r"\b(?:is|are|was|be|being) worth\b|\bexpected worth\b": "held-out fitness",
    r"\bfresh fitness\b|\bfresh seeds\b": "held-out fitness, held-out seeds",
    r"\bclaimed\b|\bpromised\b": "reported fitness",
    r"\bprospects?\b": "expected held-out fitness",
    r"\breads? (?:high|low|above|below|the same|-?\d)": "score of a map",
    r"\bke(?:ep|eps|pt) (?:its|their|the) order\b|\border kept\b": "rank agreement",
    r"could least do without": "largest marginal contribution",
    r"\bthe luckiest\b|\bby luck\b": "selection bias",
    r"\balike are\b": "are similar",
    r"\b(?:errors|maps|families|genes) (?:are|were) drawn\b|\bfamilies draw\b": "are sampled",
    r"\bby \w+(?:'s)? (?:\w+ )?own word\b": "name the source",
    r"\band (?:that|it) is all\b": "say what is returned",
    r"\bthe thesis' GA\b": "the thesis GA",
}
"""Earlier words, as patterns, and what to write instead."""
EARLIER_ON_PAGES = {
    r"\bclaims?\b|\bpromises?\b": "reported fitness",
    r"\bconfirm(?:s|ed|ation)\b": "validation stage",
}
"""Words that only pages may not hold: in messages a file claims a size, and options of older files keep their names."""
LONGEST_MEAN = 25
"""Words of a sentence, on average over a page."""
MOST_ENTRIES, LONGEST_ENTRY = 60, 160
"""Lines of the change log, and letters of one."""

PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in (
        *(ROOT / "docs").rglob("*.md"),
        *ROOT.glob("*.md"),
        ROOT / "examples/README.md",
        ROOT / "benchmarks/README.md",
    )
    if path.name != "glossary.md"
)
MODULES = sorted(
    path.relative_to(ROOT).as_posix()
    for package in ("gym_mapbench", "controllers", "evolution", "examples", "docs")
    for path in (ROOT / package).rglob("*.py")
)


def earlier_words_in(text: str, words: Mapping[str, str] = EARLIER) -> list[str]:
    """Return every earlier word of a text with its replacement."""
    flat = " ".join(text.split())
    return [
        f"{hit[0]!r}: write {now}"
        for pattern, now in words.items()
        for hit in re.finditer(pattern, flat, re.IGNORECASE)
    ]


def prose_of(markdown: str) -> str:
    """Return a page without code, comments and addresses."""
    text = re.sub(r"```.*?```|<!--.*?-->|`[^`]*`", " code ", markdown, flags=re.DOTALL)
    return re.sub(r"\]\([^)]*\)", "]", text)


def sentences_of(markdown: str) -> list[str]:
    """Return the sentences of paragraphs and lists; headings and tables have none."""
    blocks = re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )", re.sub(r"```.*?```", "", markdown, flags=re.DOTALL))
    running = [prose_of(block).strip() for block in blocks]
    texts = [" ".join(text.split()) for text in running if text and not text.startswith(("#", "|", "!", "<"))]
    return [part for text in texts for part in re.split(r"(?<=[.!?])[*_]*\s+", text) if len(part.split()) > 2]


def texts_of(module: str) -> Iterator[str]:
    """Docstrings, messages and help: every constant text of a module with a blank in it."""
    for node in ast.walk(ast.parse((ROOT / module).read_text(encoding="utf-8"))):
        if isinstance(node, ast.JoinedStr):
            yield "".join(part.value if isinstance(part, ast.Constant) else "X" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
            yield node.value


def parsers_of(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """A parser and all parsers of its commands and actions."""
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for choice in action.choices.values():
                yield from parsers_of(choice)


PARSERS = {parser.prog: parser for parser in parsers_of(build_parser())}


@pytest.mark.parametrize("page", PAGES)
def test_pages_speak_the_glossary(page):
    text = prose_of((ROOT / page).read_text(encoding="utf-8"))
    assert earlier_words_in(text, EARLIER | EARLIER_ON_PAGES) == []


@pytest.mark.parametrize("page", PAGES)
def test_sentences_are_short(page):
    lengths = [len(sentence.split()) for sentence in sentences_of((ROOT / page).read_text(encoding="utf-8"))]
    assert not lengths or sum(lengths) / len(lengths) <= LONGEST_MEAN


@pytest.mark.parametrize("name", PARSERS)
def test_help_speaks_the_glossary(name):
    assert earlier_words_in(PARSERS[name].format_help()) == []


@pytest.mark.parametrize("module", MODULES)
def test_messages_and_docstrings_speak_the_glossary(module):
    assert [line for text in texts_of(module) for line in earlier_words_in(text)] == []


def test_entries_of_the_change_log_are_single_short_lines_with_a_link():
    lines = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines()
    entries = [line for line in lines if line.startswith("- ")]
    assert 0 < len(entries) <= MOST_ENTRIES
    assert [line for line in entries if len(line) > LONGEST_ENTRY or not re.search(r"\]\([^)]+\)$", line)] == []
    assert [line for line in lines if line.startswith(" ")] == []


@pytest.mark.parametrize(
    "text",
    [
        "Ten new seeds, which chose nothing.",
        "What was best is driven\n  anew.",
        "its maps keep their order",
        "it claimed -5",
    ],
)
def test_earlier_words_are_found(text):
    assert len(earlier_words_in(text)) == 1


@pytest.mark.parametrize("text", ["`claim_seeds` sets the seeds", "in order to", "sort the rows in the order of maps"])
def test_other_words_pass(text):
    assert earlier_words_in(prose_of(text)) == []


def test_sentences_are_told_apart():
    page = "# A heading\n\nOne short sentence. A second\none here!\n\n| a | table |\n|---|---|\n\n- An item of a list\n"
    assert sentences_of(page) == ["One short sentence.", "A second one here!", "- An item of a list"]
