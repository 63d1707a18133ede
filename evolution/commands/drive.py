"""``mapbench drive``: one run of one controller, to watch."""

from __future__ import annotations

import argparse
import logging
from functools import partial
from pathlib import Path

from controllers.base import Controller
from controllers.navigator.navigator import Navigator
from evolution.benchmark import barn_settings
from evolution.commands import driving_options, options
from evolution.commands.console import console
from evolution.commands.run_notes import note_models
from evolution.driving import DriveSettings, JobPlan, check_room, drive, try_controllers
from evolution.inputs import barn_source, load_all, run_of, world_of
from evolution.pictures import check_display, check_film, save_animation, show_animation
from evolution.runs import LoadedRun
from gym_mapbench.env.render import SeenCostmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.metrics import measure
from gym_mapbench.metrics.episode import Episode

LOG = logging.getLogger(__name__)
EXAMPLES = """  mapbench drive runs/first --controller mppi --gif mppi.gif
  mapbench drive runs/first --controller rpp --noise nominal --show-costmap --gif costmap.gif
  mapbench drive office.yaml --controller rpp --start 1,2,0 --goal 8,6,1.57 --show"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "drive", EXAMPLES)
    parser.add_argument(
        "map",
        metavar="MAP",
        help="map_server yaml, map-set file, run directory, ...; for the best maps of a run, its world is used "
        "(mapbench report RUN --gif FILE films its own runs)",
    )
    parser.add_argument(
        "--controller",
        required=True,
        metavar="NAME",
        help="the controller: NAME, NAME=KIND or NAME=model.zip; for a controller of the run, its name",
    )
    parser.add_argument(
        "--scenario", type=options.positive, default=1, metavar="N", help="which of the scenarios in MAP (default 1)"
    )
    options.add_task_options(parser)
    driving_options.add_drive_options(parser, default=driving_options.OF_THE_RUN)
    driving_options.add_unknown_map_option(parser)
    parser.add_argument(
        "--seed", type=options.non_negative, default=0, metavar="N", help="root of all randomness (default 0)"
    )
    parser.add_argument("--gif", metavar="FILE", help="write the run as an animated picture")
    parser.add_argument("--mp4", metavar="FILE", help="write the run as a film (needs ffmpeg)")
    parser.add_argument(
        "--show-costmap", action="store_true", help="lay the robot's local costmap over the pictures, as RViz does"
    )
    parser.add_argument("--show", action="store_true", help="show the run in a window")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the controller, print the result, write or show the film."""
    targets = [Path(path) for path in (args.gif, args.mp4) if path is not None]
    for path in targets:
        check_film(path)
    if args.show:
        check_display()
    if args.show_costmap and not (targets or args.show):
        raise ConfigError("--show-costmap: expected --gif, --mp4 or --show beside it")
    scenarios = load_all([args.map], args.start, args.goal)
    if args.scenario > len(scenarios):
        raise ConfigError(f"--scenario: expected 1 to {len(scenarios)}, got {args.scenario}")
    scenario = scenarios[args.scenario - 1]
    searched = run_of([args.map])
    settings = _settings(args, searched)
    check_room([scenario], settings)
    known = driving_options.controllers_known_from(searched, args)
    controllers = driving_options.listed_controllers(args.controller, known)
    if len(controllers) != 1:
        raise ConfigError(f"--controller: expected one controller, got {args.controller!r}")
    note_models(controllers, settings)
    try_controllers(controllers, settings)
    (job,) = JobPlan(controllers, settings, args.seed).jobs(scenario)
    LOG.info("seeds %d and %d (noise), both from --seed %d and the map", job.seed, job.noise_seed, args.seed)
    seen: list[SeenCostmap] = []
    episode = drive(job, partial(_look, seen) if args.show_costmap else None)
    _print(episode)
    for path in targets:
        save_animation(episode, settings.environment.robot, path, seen)
        console.print(f"wrote {path}")
    if args.show:
        show_animation(episode, settings.environment.robot, seen)
    return 0


def _settings(args: argparse.Namespace, searched: LoadedRun | None) -> DriveSettings:
    """Return the world and navigation of the options, of the run whose maps are used, and of BARN's rules."""
    settings = driving_options.drive_settings(args, world_of(searched))
    if barn_source([args.map]) is None:
        return settings
    driving_options.refuse_beside_barn(args)
    return barn_settings(settings)


def _look(seen: list[SeenCostmap], controller: Controller) -> None:
    """Remember the controller's local costmap.

    Raises:
        ConfigError: If it has none.
    """
    if not isinstance(controller, Navigator):
        raise ConfigError("--show-costmap: expected one of Nav2's controllers; this one keeps no costmap")
    seen.append(controller.seen_costmap)


def _print(episode: Episode) -> None:
    reason = f" ({episode.reason})" if episode.reason else ""
    console.print(f"{episode.controller}: {episode.outcome}{reason} after {episode.time:.2f} s")
    for name, value in measure(episode).items():
        console.print(f"  {name:24s} {value:.4g}")
    for event in episode.events:
        if event.kind != "replan":
            console.print(f"  {event.time:8.2f} s  {event.kind} {event.detail}")
