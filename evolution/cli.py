"""The command ``mapbench``; an error in its arguments is one line."""

from __future__ import annotations

import argparse
import contextlib
import gc
import os
import re
import sys
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import Any, NoReturn

from evolution.commands import (
    COMMANDS,
    COMMON,
    WITH_WORKERS,
    HelpText,
    add_commands,
    complain,
    load_command,
    set_messages,
)
from evolution.one_thread import use_one_thread

USAGE_ERROR = 2
INTERRUPTED = 130
PIPE_CLOSED = 141
"""128 plus the number of SIGPIPE, as shells report it of other programs."""
OWN_OPTIONS = ("-h", "--help", "--version")
"""Options that stand in place of a command; all others follow it."""
STANDARD_ERROR = 2
"""Number of the last file that is open when a process starts."""
NEGATIVE = re.compile(r"-(\.?\d|inf|nan)")
"""Start of a value such as ``-2,-1,0``, which argparse would otherwise take for an option."""

DESCRIPTION = "Evolve maps that tell navigation controllers apart; run, compare and export them."
EXAMPLES = """examples:
  mapbench evolve --preset quick --out runs/first     evolve map sets, a few minutes
  mapbench bench runs/first --repeats 5               every controller on the best maps, with other seeds
  mapbench drive runs/first --controller mppi --gif mppi.gif
  mapbench bench my_map.yaml --params nav2_params.yaml --start 1,2,0 --goal 8,6,1.57
  mapbench report runs/first                          one HTML page with maps and replays

'mapbench COMMAND --help' explains one command, with examples of its own."""


class Parser(argparse.ArgumentParser):
    """An argument parser that reports an error in one line with the command's name, and accepts negative poses."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **{"formatter_class": HelpText, **options})
        self._negative_number_matcher = NEGATIVE

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; a subcommand itself refuses arguments that it does not know, so that the error names it."""
        found, rest = super().parse_known_args(args, namespace)
        if rest:
            self.error(f"unrecognized arguments: {' '.join(rest)}{_meant(rest[0], self._option_string_actions)}")
        return found, rest

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        try:
            super()._check_value(action, value)
        except argparse.ArgumentError as error:
            error.message += _meant(value, action.choices or ())
            raise

    def error(self, message: str) -> NoReturn:
        """Print one line and exit with code 2."""
        print(f"{self.prog}: {message}", file=sys.stderr)
        raise SystemExit(USAGE_ERROR)


def _meant(given: object, valid: Iterable[object]) -> str:
    """Return the end of an error with the nearest valid name, without importing numpy as the registries' rule does."""
    near = get_close_matches(str(given).partition("=")[0], map(str, valid), n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


class Versions(argparse.Action):
    """Prints the versions of this package, of Python, and of the libraries that results depend on, and exits."""

    def __init__(self, option_strings: Sequence[str], dest: str, help: str) -> None:
        super().__init__(option_strings, dest=argparse.SUPPRESS, default=argparse.SUPPRESS, nargs=0, help=help)

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        """Print one line for each."""
        from evolution.files import version_lines

        print("\n".join(version_lines()))
        parser.exit()


def build_parser(chosen: str | None = None) -> Parser:
    """Build the parser of the command and of its subcommands.

    Args:
        chosen: The only subcommand whose options are needed, so that the help does not wait for imports; None for all.
    """
    parser = Parser(prog="mapbench", description=DESCRIPTION, epilog=EXAMPLES, allow_abbrev=False)
    parser.add_argument("--version", action=Versions, help="print the versions that results depend on, and exit")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=Parser)
    add_commands(subparsers, chosen)
    return parser


def start() -> int:
    """Run the command as a process of its own; returns its exit code.

    What the command imports stays until its end, so garbage collection passes over it, and workers share it.
    """
    use_one_thread()
    _prepare_output()
    gc.disable()
    try:
        with contextlib.suppress(OSError):  # :func:`main` imports the same, and says what is wrong
            _import(sys.argv[1:])
    finally:
        gc.freeze()
        gc.enable()
    return main()


def _prepare_output() -> None:
    """Accept closed input and output, and show letters that output cannot encode as escape sequences.

    The files 0, 1 and 2 are opened, or else the next files would get these numbers, and what workers print.
    """
    while (opened := os.open(os.devnull, os.O_RDWR)) <= STANDARD_ERROR:
        os.set_inheritable(opened, True)
    os.close(opened)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name) or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - until the process ends
        stream.reconfigure(errors="backslashreplace")
        setattr(sys, name, stream)


def _import(arguments: Sequence[str]) -> None:
    """Import what a command needs, and start the process from which its workers are copied."""
    for name in COMMANDS.keys() & set(arguments[:1]):
        load_command(name)
        if name in WITH_WORKERS:
            if any(part.endswith(".zip") for argument in arguments for part in argument.split(",")):
                with contextlib.suppress(Exception):  # who loads the model says what is wrong
                    import stable_baselines3  # noqa: F401 - or else each worker spends 3 s on importing torch
            from evolution.driving import copy_for_workers

            copy_for_workers()


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code (0 done, 2 wrong input, 130 interrupted, 141 nobody reads its output)."""
    try:
        return _run(sys.argv[1:] if argv is None else argv)
    except BrokenPipeError:
        # The reader of our output has gone (for example `| head`), so nothing more can be said.
        sys.stderr.close()
        return PIPE_CLOSED
    except OSError as error:
        print(f"mapbench: {error}", file=sys.stderr)
        return USAGE_ERROR


def _run(given: Sequence[str]) -> int:
    """Parse the arguments and run the command that they name."""
    parser = build_parser(given[0] if given else "")
    if given and given[0].startswith("-") and given[0] not in OWN_OPTIONS:
        parser.error(f"{given[0]}: expected COMMAND first, as in mapbench bench {given[0]}")
    args = parser.parse_args(given, argparse.Namespace(given=tuple(given), **COMMON))
    from gym_mapbench.errors import (
        ArgumentError,
        MapBenchError,
        visible,
    )  # after the help, which does not wait for gymnasium
    from gym_mapbench.trust import allow_code, only_code_named_in

    set_messages(quiet=args.quiet, verbose=args.verbose)
    try:
        with allow_code(args.allow_code), only_code_named_in(given):
            code: int = args.run(args)
    except MapBenchError as error:
        said = error.of_option() if isinstance(error, ArgumentError) else error
        complain(f"mapbench {args.command}: {said}")
        return USAGE_ERROR
    except KeyboardInterrupt:
        complain(f"mapbench {args.command}: interrupted; what was finished is kept")
        return INTERRUPTED
    except BrokenPipeError:
        raise
    except OSError as error:
        where = "" if error.filename is None else f"{error.filename}: "
        complain(visible(f"mapbench {args.command}: {where}{error.strerror or error}"))
        return USAGE_ERROR
    return code
