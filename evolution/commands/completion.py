"""``mapbench completion``: a script that completes commands, options and names in a shell."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator

from evolution.commands import add_commands, options
from evolution.commands.catalogue import KINDS
from evolution.commands.export import GAZEBO
from evolution.commands.show import SHOWN
from evolution.search import METRIC_NAMES
from gym_mapbench.mapio.formats import WRITTEN

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
    "algo": "algorithms",
    "failures": "failure_policies",
    "study": "studies",
}
"""Arguments whose values are names of a kind of :data:`KINDS`."""
OWN: dict[tuple[str, str], Callable[[], Iterable[str]]] = {
    ("evolve", "metric"): lambda: METRIC_NAMES,
    ("export", "format"): lambda: (GAZEBO, *WRITTEN),
    ("maps draw", "format"): lambda: WRITTEN,
    ("list", "kinds"): lambda: KINDS,
    ("show", "name"): lambda: dict.fromkeys(name for kind in SHOWN.values() for name in kind.names()),
}
"""Arguments of one command, or of one of its actions, that take other names."""

HEAD = """# Completion of mapbench, printed by 'mapbench completion'.
_mapbench() {
  local current="${COMP_WORDS[COMP_CWORD]}" previous="${COMP_WORDS[COMP_CWORD-1]}" names=""
  local command="${COMP_WORDS[1]}" action="${COMP_WORDS[2]}" flags=""
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=( $(compgen -W "@COMMANDS@" -- "$current") )
    return
  fi
  case "$command $action $previous" in
"""
MIDDLE = """  esac
  if [ -z "$names" ]; then
    case "$command $action" in
"""
TAIL = """    esac
    case "$current" in -*) names="$flags" ;; esac
  fi
  COMPREPLY=( $(compgen -W "$names" -- "$current") )
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
    flags = [line for name, command in commands.items() for line in _argument_cases(name, command)]
    head = HEAD.replace("@COMMANDS@", " ".join([*commands, "--help", "--version"]))
    return head + "".join(values) + MIDDLE + "".join(flags) + TAIL


def _subcommands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return the subcommands of a parser by name; none if it has none."""
    found = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    return dict(found[0].choices) if found else {}


def _value_cases(name: str, parser: argparse.ArgumentParser) -> Iterator[str]:
    """Cases that complete the value after an option of a command; those of its actions come first."""
    for action, one in _subcommands(parser).items():
        yield from _cases(f"{name} {action}", one, f'"{name} {action} ')
    yield from _cases(name, parser, f'"{name} "*" ')


def _cases(name: str, parser: argparse.ArgumentParser, begun: str) -> Iterator[str]:
    """Cases of one parser, each of which begins with this pattern."""
    for argument in parser._actions:
        names = _values(name, argument)
        for flag in argument.option_strings if names else ():
            yield f'    {begun}{flag}") names="{" ".join(names)}" ;;\n'


def _values(name: str, argument: argparse.Action) -> list[str]:
    """Return the known values of an argument of a command."""
    if argument.choices is not None:
        return [str(choice) for choice in argument.choices]
    if own := OWN.get((name, argument.dest)):
        return list(own())
    kind = VALUES.get(argument.dest)
    return [] if kind is None else list(KINDS[kind].names())


def _argument_cases(name: str, parser: argparse.ArgumentParser) -> Iterator[str]:
    """Cases that complete the names that stand alone, and the options; those of the actions of a command come first."""
    for action, one in _subcommands(parser).items():
        yield f'      "{name} {action}") {_arguments(f"{name} {action}", one)} ;;\n'
    yield f'      "{name} "*) {_arguments(name, parser)} ;;\n'


def _arguments(name: str, parser: argparse.ArgumentParser) -> str:
    """Return the names that stand alone, and the options, which are offered for a word that begins with a minus."""
    alone = [value for one in parser._actions if not one.option_strings for value in _values(name, one)]
    flags = [flag for one in parser._actions for flag in one.option_strings]
    return f'names="{" ".join(alone)}" flags="{" ".join(flags)}"'
