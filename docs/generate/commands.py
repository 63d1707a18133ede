"""The reference of every command, from the argument parsers that the command itself uses."""

from __future__ import annotations

import argparse
import os
import textwrap
from collections.abc import Iterator
from unittest.mock import patch

from docs.generate.markdown import code, name, table
from evolution.cli import build_parser

WIDTH = "100"
"""Columns of usages and examples."""


def command_reference() -> str:
    """Return a section for each command, with one for each of its actions below it."""
    with patch.dict(os.environ, {"COLUMNS": WIDTH}):
        (commands,) = _subcommands(build_parser())
        return "\n\n".join(part for parser in commands.choices.values() for part in _sections(parser, "##", ""))


def _sections(parser: argparse.ArgumentParser, heading: str, summary: str) -> Iterator[str]:
    yield f"{heading} {parser.prog}"
    yield (parser.description or summary).capitalize() if heading == "###" else str(parser.description)
    yield code(textwrap.dedent(parser.format_usage().replace("usage: ", " " * 7)).rstrip())
    for group in parser._action_groups:
        rows = [_row(action) for action in group._group_actions if not isinstance(action, argparse._SubParsersAction)]
        if rows:
            yield table([_title(group.title), "what it is"], rows)
    if parser.epilog:
        yield code(parser.epilog.removeprefix("examples:\n").replace("\n  ", "\n").strip(), "console")
    for actions in _subcommands(parser):
        summaries = {choice.dest: choice.help or "" for choice in actions._choices_actions}
        for key, action in actions.choices.items():
            yield from _sections(action, "###", summaries[key] + ".")


def _subcommands(parser: argparse.ArgumentParser) -> list[argparse._SubParsersAction[argparse.ArgumentParser]]:
    return [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]


def _title(title: str | None) -> str:
    return {"positional arguments": "argument", "options": "option"}.get(str(title), str(title))


def _row(action: argparse.Action) -> list[str]:
    """Return an option with its value, and its help; choices stand for a value without a name."""
    taken = "" if action.nargs == 0 else _taken(action)
    written = [f"{option} {taken}".strip() for option in action.option_strings] or [taken]
    help_text = argparse.HelpFormatter("")._expand_help(action) if action.help else f"one of {_choices(action)}"
    return [", ".join(map(name, written)), help_text]


def _taken(action: argparse.Action) -> str:
    if action.metavar is not None:
        return " ".join([action.metavar] if isinstance(action.metavar, str) else action.metavar)
    return "{" + _choices(action) + "}" if action.choices else action.dest.upper()


def _choices(action: argparse.Action) -> str:
    return ", ".join(map(str, action.choices or ()))
