"""The command ``mapbench``; what is wrong with its arguments is said in one line."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from evolution.commands.parser import USAGE_ERROR, build_parser

INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code (0 done, 2 wrong input, 130 interrupted)."""
    given = sys.argv[1:] if argv is None else argv
    args = build_parser(given[0] if given else "").parse_args(given, argparse.Namespace(given=tuple(given)))
    from evolution.commands.progress import be_quiet
    from gym_mapbench.errors import MapBenchError  # after the help, which does not wait for gymnasium
    from gym_mapbench.trust import allow_code

    be_quiet(args.quiet)
    try:
        with allow_code(getattr(args, "allow_code", False)):
            code: int = args.run(args)
    except MapBenchError as error:
        print(f"mapbench {args.command}: {error}", file=sys.stderr)
        return USAGE_ERROR
    except KeyboardInterrupt:
        print(f"mapbench {args.command}: interrupted; what was finished is kept", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of our output has gone (for example `| head`), so nothing more can be said.
        sys.stderr.close()
        return 0
    except OSError as error:
        where = "" if error.filename is None else f"{error.filename}: "
        print(f"mapbench {args.command}: {where}{error.strerror or error}", file=sys.stderr)
        return USAGE_ERROR
    return code
