"""The subcommands of ``mapbench``, one file each, in the order of the help."""

from __future__ import annotations

from evolution.commands import (
    bench,
    drive,
    evolve,
    export,
    import_results,
    maps,
    params,
    report,
    study,
    train,
    validate,
)

COMMANDS = (evolve, study, report, bench, train, drive, maps, params, export, import_results, validate)
