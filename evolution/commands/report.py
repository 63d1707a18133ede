"""``mapbench report``: write one HTML page about a run or a study, or a film of one of its replays."""

from __future__ import annotations

import argparse
from pathlib import Path

from evolution.commands import options
from evolution.commands.console import console, note
from evolution.results import kind_of, load
from evolution.runs import LoadedRun, experiment_in, load_run
from evolution.studies import StudyResults
from gym_mapbench.errors import ConfigError, RunError

EXAMPLES = """  mapbench report runs/first                          writes runs/first/report.html
  mapbench report runs/study-quick --out quick.html
  mapbench report runs/first --gif mppi.gif --map 2 --controller mppi"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "report", EXAMPLES)
    parser.add_argument("path", metavar="DIR", help="directory that mapbench evolve, study or tune wrote")
    parser.add_argument("--out", metavar="FILE", help="the page (default report.html in the directory)")
    parser.add_argument(
        "--section",
        action="append",
        default=[],
        metavar="NAME",
        help="a further section of a run's page: a name or module:attribute; may be given several times",
    )
    film = parser.add_argument_group("instead of the page, a film of the best map set")
    film.add_argument("--gif", metavar="FILE", help="write a replay as an animated picture")
    film.add_argument("--mp4", metavar="FILE", help="write a replay as a film (needs ffmpeg)")
    film.add_argument("--map", type=options.positive, metavar="N", help="which map of the best set (default 1)")
    film.add_argument("--controller", metavar="NAME", help="the controller (default: the first)")
    film.add_argument(
        "--configuration",
        metavar="NAME",
        help="of a study: the configuration whose best set is filmed (default: the first)",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Write the page or the films, and print their paths."""
    films = [Path(path) for path in (args.gif, args.mp4) if path is not None]
    if films:
        _write_films(args, films)
        return 0
    given = [name for name in ("map", "controller", "configuration") if getattr(args, name) is not None]
    if given:
        raise ConfigError(f"--{given[0]}: expected only with --gif or --mp4")
    from evolution.report import write_report

    page = write_report(args.path, args.out, sections=args.section, on_step=note)
    console.print(f"wrote {page} ({page.stat().st_size / 1e6:.1f} MB); open it in any browser")
    return 0


def _write_films(args: argparse.Namespace, films: list[Path]) -> None:
    """Repeat one run of the best set and film it."""
    from evolution.driving import drive
    from evolution.pictures import check_film, save_animation

    if args.out is not None:
        raise ConfigError("--out: expected without --gif and --mp4, which name their files themselves")
    if args.section:
        raise ConfigError("--section: expected without --gif and --mp4, which write no page")
    for film in films:
        check_film(film)
    found = _run_of(Path(args.path), args.configuration)
    experiment = experiment_in(found)
    number = args.map or 1
    if number > len(found.best):
        raise ConfigError(f"--map: expected 1 to {len(found.best)}, got {number}")
    name = args.controller or experiment.plan.names[0]
    jobs = {job.controller.name: job for job in experiment.plan.jobs(found.best[number - 1]) if job.repeat == 0}
    if name not in jobs:
        raise ConfigError(f"--controller: expected one of {', '.join(jobs)}, got {name!r}")
    episode = drive(jobs[name])
    for film in films:
        save_animation(episode, experiment.run.environment.robot, film)
        console.print(f"wrote {film}")


def _run_of(path: Path, configuration: str | None) -> LoadedRun:
    """Return the run whose best set is filmed."""
    results = load(path)
    if not isinstance(results, LoadedRun | StudyResults):
        raise RunError(f"{path}: expected a run or a study for a film, got a {kind_of(path).directory.what}")
    if isinstance(results, LoadedRun):
        if configuration is not None:
            raise ConfigError(f"--configuration: expected only with a study, got {path}")
        return results
    if configuration is not None:
        results.settings.configuration(configuration)
    runs = [run for run in results.runs if configuration in (None, run.configuration.name)]
    if not runs:
        raise RunError(f"{path}: no run of {configuration or 'this study'} is finished")
    first = [run for run in runs if run.configuration == runs[0].configuration]
    return load_run(min(first, key=lambda run: run.fitness).path)
