"""Options of the commands that search for maps: preset, file and families, and the experiment built from them."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from evolution.api import compose
from evolution.commands import driving_options, options
from evolution.search import DEFAULT_PRESET, Experiment, experiment_of, preset_names, read_document


def add_preset_options(group: argparse._ArgumentGroup) -> None:
    """Add ``--preset`` and ``--config``."""
    group.add_argument(
        "--preset", help=f"options to start from: {', '.join(preset_names())} (default {DEFAULT_PRESET})"
    )
    group.add_argument(
        "--config", metavar="FILE", help="YAML with the sections search, controllers, run, or the config.json of a run"
    )


def add_map_options(group: argparse._ArgumentGroup) -> None:
    """Add ``--family`` and ``--people``."""
    options.add_family_option(group, "those of the preset")
    group.add_argument(
        "--people",
        type=options.non_negative,
        metavar="N",
        help="people who walk on every new map (default: those of the preset); the search changes them like walls",
    )


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """Add the options about controllers, robot, world, seed and resources."""
    driving_options.add_controllers_option(
        parser, "those of --config, else the controller_plugins of the --params file, else those of the preset"
    )
    driving_options.add_drive_options(parser, "that of the preset or of --config")
    driving_options.add_seed_option(parser)
    driving_options.add_resource_options(parser)


def configuration_in(args: argparse.Namespace) -> Mapping[str, Any]:
    """Return the content of ``--config``; nothing if it is not given."""
    return {} if args.config is None else read_document(args.config)


def experiment_from(args: argparse.Namespace, config: Mapping[str, Any], given: Mapping[str, Any]) -> Experiment:
    """Build the experiment: the preset, overlaid by the user's file, then by the options of the command line.

    Args:
        args: The parsed options.
        config: Content of the file, see :func:`configuration_in`.
        given: Further options of the search, by their short names.
    """
    search = dict(given)
    if args.family is not None:
        search["families"] = list(args.family)
    if args.people is not None:
        search["people"] = {"count": args.people}
    document = compose(args.preset, config, **search)
    named = driving_options.named_controllers(args)
    if named and (args.controllers is not None or "controllers" not in config):
        document["controllers"] = [spec.model_dump() for spec in named]
    experiment = experiment_of(document)
    settings = driving_options.drive_settings(args, experiment.run)
    return Experiment(experiment.search, experiment.controllers, settings)
