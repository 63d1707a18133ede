"""``mapbench completion``: a script that completes commands, options and names in a shell."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from evolution.commands import add_commands, options
from evolution.commands.catalogue import KINDS

EXAMPLES = """  mapbench completion bash > ~/.local/share/bash-completion/completions/mapbench
  mapbench completion zsh >> ~/.zshrc"""

VALUES = {
    "controllers": "controllers",
    "controller": "controllers",
    "planner": "planners",
    "robot": "robots",
    "params": "params",
    "preset": "presets",
    "metric": "metrics",
    "noise": "noise",
    "family": "families",
    "fitness": "fitnesses",
    "executor": "executors",
    "section": "sections",
}
"""Options whose values are names of a kind of :data:`KINDS`."""

HEAD = """# Completion of mapbench, printed by 'mapbench completion'.
_mapbench() {
  local current="${COMP_WORDS[COMP_CWORD]}" previous="${COMP_WORDS[COMP_CWORD-1]}" words=""
  local command="${COMP_WORDS[1]}" action="${COMP_WORDS[2]}"
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=( $(compgen -W "@COMMANDS@" -- "$current") )
    return
  fi
  case "$command $previous" in
"""
MIDDLE = """  esac
  if [ -z "$words" ]; then
    case "$command $action" in
"""
TAIL = """    esac
  fi
  COMPREPLY=( $(compgen -W "$words" -- "$current") )
}
complete -o default -F _mapbench mapbench
"""
ZSH = "autoload -U +X compinit && compinit\nautoload -U +X bashcompinit && bashcompinit\n"


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "completion", EXAMPLES)
    parser.add_argument("shell", choices=("bash", "zsh"))
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the script."""
    parser = argparse.ArgumentParser("mapbench")
    add_commands(parser.add_subparsers())
    print((ZSH if args.shell == "zsh" else "") + script(parser), end="")
    return 0


def script(parser: argparse.ArgumentParser) -> str:
    """Return the script for a parser with subcommands; files are completed where no name is expected."""
    commands = _subcommands(parser)
    values = [line for name, command in commands.items() for line in _value_cases(name, command)]
    flags = [line for name, command in commands.items() for line in _option_cases(name, command)]
    head = HEAD.replace("@COMMANDS@", " ".join([*commands, "--help", "--version"]))
    return head + "".join(values) + MIDDLE + "".join(flags) + TAIL


def _subcommands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return the subcommands of a parser by name; none if it has none."""
    found = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    return dict(found[0].choices) if found else {}


def _value_cases(name: str, parser: argparse.ArgumentParser) -> Iterator[str]:
    """Cases that complete the value after an option."""
    for one in (parser, *_subcommands(parser).values()):
        for action in one._actions:
            names = _values(action)
            for flag in action.option_strings if names else ():
                yield f'    "{name} {flag}") words="{" ".join(names)}" ;;\n'


def _values(action: argparse.Action) -> list[str]:
    """Return the known values of an option."""
    if action.choices is not None:
        return [str(choice) for choice in action.choices]
    kind = VALUES.get(action.dest)
    return [] if kind is None else list(KINDS[kind].names())


def _option_cases(name: str, parser: argparse.ArgumentParser) -> Iterator[str]:
    """Cases that complete the options of a command; those of its actions come first."""
    actions = _subcommands(parser)
    for action, one in actions.items():
        yield f'      "{name} {action}") words="{_flags(one)}" ;;\n'
    yield f'      "{name} "*) words="{" ".join([*actions, _flags(parser)])}" ;;\n'


def _flags(parser: argparse.ArgumentParser) -> str:
    positional = [value for action in parser._actions if not action.option_strings for value in _plain(action)]
    return " ".join([*positional, *(flag for one in parser._actions for flag in one.option_strings)])


def _plain(action: argparse.Action) -> list[str]:
    """Return the values of a positional argument that is no subcommand."""
    return [] if isinstance(action, argparse._SubParsersAction) else _values(action)
