"""The content of the report of one run."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import yaml

from evolution.files import counted, written_elsewhere
from evolution.pictures import DrivenMap
from evolution.report.page import Attachment, Report, download, render_page
from evolution.report.replays import ReplayedMap
from evolution.report.sections import sections_of
from evolution.runs import (
    LoadedRun,
    errors_in,
    front_lines,
    results_in,
    slow_everywhere_sentence,
    summary_of_map,
    validation_sentence,
)
from evolution.search import SECTIONS
from gym_mapbench.mapio.map_set_file import BEST_MAP_SET


def report_of_run(
    run: LoadedRun, driven: Sequence[DrivenMap], sections: Iterable[str] = (), missing: Iterable[str] = ()
) -> Report:
    """Return the report of one evolution run.

    Args:
        run: The run, finished or not.
        driven: Its best maps with the runs of the replays, from :func:`evolution.pictures.drive_best`.
        sections: Names of sections to show in addition to those on every page.
        missing: What the report lacks and why, one line each.
    """
    search = run.config["search"]
    made, failed = sections_of(run, sections)
    return Report(
        title=f"Evolved maps: {run.path.name}",
        subtitle=(
            f"{' and '.join(_objectives(search['judging']))}, population {search['ga']['pop_size']}, "
            f"{counted(run.checkpoint['evaluations'], 'evaluation')}, seed {search['seed']}, "
            f"controllers {', '.join(run.controllers)}"
        ),
        verdict=_verdict(run),
        command=f"mapbench evolve --config config.yaml --out {shlex.quote(run.path.name)}"
        "  # config.yaml is among the downloads",
        configuration=_configuration(run),
        maps=replayed_maps(run, driven),
        sections=made,
        downloads=_downloads(run),
        missing=[*missing, *written_elsewhere(run.config), *_unfinished(run), *_errors(run), *failed],
        changed=changed_replays(run, driven),
    )


def _objectives(judging: Mapping[str, Any]) -> list[str]:
    """Return the names of the objectives of a search, beginning with the fitness."""
    return [f"{judging['fitness']} fitness", *judging.get("objectives", ())]


def changed_replays(run: LoadedRun, driven: Sequence[DrivenMap]) -> list[str]:
    """Report replays that do not end as the search recorded, because the code, a library or the machine has changed."""
    recorded = {entry["name"]: entry for entry in run.best_results["maps"]}
    lines = []
    for one in driven:
        for episode in one.episodes:
            was = recorded[one.name]["runs"][episode.controller][one.repeat]
            if (episode.outcome, episode.time) != (was["outcome"], was["time_s"]):
                lines.append(
                    f"The replay of {episode.controller} on {one.name} ends with {episode.outcome} after "
                    f"{episode.time:.2f} s; the search recorded {was['outcome']} after {was['time_s']:.2f} s."
                )
    return lines


def replayed_maps(run: LoadedRun, driven: Sequence[DrivenMap], group: str = "") -> list[ReplayedMap]:
    """Return the replays of the maps that have recorded runs; ``group`` is the heading under which they stand."""
    return [
        ReplayedMap(f"{one.name}: {one.summary.difference}", one.episodes, group, _samples(one))
        for one in driven
        if one.episodes
    ]


def replay_page(run: LoadedRun, driven: Sequence[DrivenMap]) -> str:
    """Return a page with the replays of the best maps and nothing else, to be shown inside another page."""
    return render_page(Report(f"Replays: {run.path.name}", "", [], "", "", replayed_maps(run, driven)))


def _samples(driven: DrivenMap) -> str:
    """Say which runs the title and the replay of a map show."""
    return f"Title: {driven.summary.sample_at_goal}. Replay: {driven.recorded_sample}."


def _verdict(run: LoadedRun) -> list[str]:
    """Say what fitness the best set has, and by how much the controllers differ on each map."""
    maps = [summary_of_map(entry["name"], entry["runs"]).in_words for entry in run.best_results["maps"]]
    maps += slow_everywhere_sentence(run.best_results, run.config["search"])
    if run.best_results.get("validation"):
        found = validation_sentence(run.best_results, run.config["search"])
    else:
        found = [_outcome(run), *_held(run)]
    return [*found, *_penalties(run.best_results["fitness"]), *front_lines(run), *maps]


def _penalties(fitness: float) -> list[str]:
    """Say what a fitness above 0 means; nothing of another fitness."""
    if fitness <= 0:
        return []
    return ["A fitness above 0 is a sum of penalties: runs fail, or the maps do not have the wanted differences."]


def _outcome(run: LoadedRun) -> str:
    """Say how good the best set is, and by how much the search improved it if generations are comparable."""
    first, last = run.generations[0]["best"], run.generations[-1]["best"]
    if run.config["search"].get("archive", {}).get("elite"):  # a re-evaluation changes the fitness of a set
        return f"The best set {'' if run.finished else 'so far '}has fitness {last:.2f} (lower is better)."
    improved = f"improved the best fitness from {first:.2f} to {last:.2f}"
    if first > 0 >= last:  # a fitness above 0 is made of penalties
        improved = f"reached fitness {last:.2f}; its first population had no set that all solve and whose maps differ"
    outcome = improved if last < first else f"found nothing better than its first population, fitness {last:.2f}"
    return f"The search {outcome} (lower is better)."


def _held(run: LoadedRun) -> list[str]:
    """Say whether the best set is validated; nothing if the search has no validation stage."""
    if run.config["search"].get("validation") and not run.finished:
        return ["The set is not validated yet: validation is the last stage of the search."]
    return validation_sentence(run.best_results, run.config["search"])


def _configuration(run: LoadedRun) -> str:
    used = {key: run.config[key] for key in ("version", "libraries", *SECTIONS)}
    return yaml.safe_dump(used, sort_keys=False)


def _downloads(run: LoadedRun) -> list[Attachment]:
    config = yaml.safe_dump({key: run.config[key] for key in SECTIONS}, sort_keys=False)
    files = [download(name, (run.path / name).read_bytes()) for name in (BEST_MAP_SET, "generations.csv")]
    return [download("config.yaml", config), *files]


def _unfinished(run: LoadedRun) -> list[str]:
    if run.finished:
        return []
    search = run.config["search"]
    done = f"{run.checkpoint['evaluations']} of {counted(search['evaluations'], 'set')}"
    if search.get("runs"):
        done = f"{len(run.runs)} of {counted(search['runs'], 'run')}"
    return [f"The search has come to {done}; mapbench evolve --resume {shlex.quote(str(run.path))} finishes it."]


def _errors(run: LoadedRun) -> list[str]:
    return errors_in(results_in(run.best_results, run.controllers), run.controllers, "in the search")
