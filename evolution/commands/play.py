"""``mapbench play``: draw a map, change parameters, and watch the controllers at once."""

from __future__ import annotations

import argparse
import threading
import webbrowser
from pathlib import Path

from controllers.nav2_params import PRESETS
from controllers.nav2_params.plugins import PRIMARIES
from evolution.commands import driving_options, options
from evolution.commands.console import console, note
from evolution.commands.parameter_file import add_reading_options
from evolution.driving import ControllerSpec
from evolution.inputs import load_all
from evolution.play import FILE, AskRandom, Beginning, Given, WorldSettings, export_session, sampled, scene_of, serve
from evolution.search import controllers_from
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError

EXAMPLES = """  mapbench play examples/office.yaml                    draw, change parameters, watch; Ctrl-C ends it
  mapbench play office.yaml --params nav2_params.yaml   with the parameters of a robot
  mapbench play runs/first                              the best maps of a search
  mapbench play office.yaml --controllers dwb,sac=models/sac.zip --no-browser
  mapbench play office.yaml --export office_page        a page to look at, without a server"""
LOCAL = "127.0.0.1"
MOST_MAPS = 60
RANDOM = AskRandom(family="doors", seed=1)
"""The map to begin with if none is named."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "play", EXAMPLES)
    parser.add_argument("maps", nargs="*", metavar="MAP", help="maps in any form that mapbench bench reads")
    options.add_task_options(parser)
    driving_options.add_controllers_option(parser)
    parser.add_argument(
        "--params",
        metavar="FILE|PRESET",
        help=f"a nav2_params.yaml, which the page can change, or a preset: {', '.join(PRESETS)} (default: thesis)",
    )
    add_reading_options(parser)
    driving_options.add_time_limit_option(parser)
    driving_options.add_seed_option(parser)
    driving_options.add_resource_options(parser)
    group = parser.add_argument_group("server")
    group.add_argument(
        "--port", type=options.non_negative, default=0, metavar="N", help="port (default: any that is free)"
    )
    group.add_argument(
        "--host",
        default=LOCAL,
        metavar="ADDRESS",
        help=f"address to listen on (default {LOCAL}, which only this machine can reach)",
    )
    parser.add_argument(
        "--export", metavar="DIR", help="write map, ways and overlays as a page without a server into a new directory"
    )
    group.add_argument("--no-browser", action="store_true", help="print the address of the page without opening it")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Serve the playground until Ctrl-C, or export what it would begin with."""
    beginning = _beginning(args)
    if args.export is not None:
        console.print(f"wrote {export_session(beginning, Path(args.export))}; open it in any browser")
        return 0
    if args.host != LOCAL:
        note(f"--host {args.host}: everyone who can reach this address and knows the token can use this machine")
    serve(beginning, host=args.host, port=args.port, on_start=_print if args.no_browser else _open)
    return 0


def _beginning(args: argparse.Namespace) -> Beginning:
    """Return what the options describe."""
    chosen = driving_options.controllers_of(args)
    file = driving_options.parameter_file(args)
    preset = FILE if file is not None else args.params or driving_options.DEFAULT_PARAMS
    world = EnvConfig() if args.time_limit is None else EnvConfig(time_limit=args.time_limit)
    scenarios = load_all(args.maps, args.start, args.goal)
    if len(scenarios) > MOST_MAPS:
        raise ConfigError(f"maps: expected at most {MOST_MAPS} maps, got {len(scenarios)}")
    return Beginning(
        Given(_with_others(chosen), file, world),
        [scene_of(scenario) for scenario in scenarios] or [sampled(RANDOM, world)],
        WorldSettings(preset=preset, seed=args.seed or 0),
        chosen,
        driving_options.resources_of(args),
    )


def _with_others(chosen: tuple[ControllerSpec, ...]) -> tuple[ControllerSpec, ...]:
    """Return the chosen controllers, then Nav2's others."""
    names = [spec.name for spec in chosen]
    return (*chosen, *controllers_from([name for name in PRIMARIES if name not in names]))


def _print(address: str) -> None:
    console.print(address)


def _open(address: str) -> None:
    """Print the address, and open it beside the server, as a browser for terminals returns only when it is left."""
    _print(address)
    threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
