"""The content of the report of one run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import yaml

from evolution.files import written_elsewhere
from evolution.pictures import DrivenMap
from evolution.report.page import Attachment, Report
from evolution.report.replays import ReplayedMap
from evolution.report.sections import sections_of
from evolution.runs import LoadedRun, errors_in, results_in, typical_repeat, validation_sentence
from evolution.search import SECTIONS
from gym_mapbench.mapio.map_set_file import BEST_MAP_SET


def report_of_run(
    run: LoadedRun, driven: Sequence[DrivenMap], sections: Iterable[str] = (), missing: Iterable[str] = ()
) -> Report:
    """Collect the report of one evolution run.

    Args:
        run: The run, as far as it has come.
        driven: Its best maps, driven again for the replays (:func:`evolution.pictures.run_figures.drive_best`).
        sections: Names of sections to show in addition to those on every page.
        missing: What could not be done, and why.
    """
    search = run.config["search"]
    made, failed = sections_of(run, sections)
    return Report(
        title=f"Evolved maps: {run.path.name}",
        subtitle=(
            f"{search['judging']['fitness']} fitness, population {search['ga']['pop_size']}, "
            f"{run.checkpoint['evaluations']} evaluations, seed {search['seed']}, "
            f"controllers {', '.join(run.controllers)}"
        ),
        verdict=_verdict(run),
        command=f"mapbench evolve --config config.yaml --out {run.path.name}  # config.yaml is among the downloads",
        configuration=_configuration(run),
        maps=replayed_maps(run, driven),
        sections=made,
        downloads=_downloads(run),
        missing=[*missing, *written_elsewhere(run.config), *_unfinished(run), *_errors(run), *failed],
        changed=changed_replays(run, driven),
    )


def changed_replays(run: LoadedRun, driven: Sequence[DrivenMap]) -> list[str]:
    """Report replays that do not end as the search recorded, because the code, a library or the machine has changed."""
    recorded = {entry["name"]: entry for entry in run.best_results["maps"]}
    lines = []
    for one in driven:
        for episode in one.episodes:
            was = recorded[one.name]["runs"][episode.controller][typical_repeat(recorded[one.name])]
            if (episode.outcome, episode.time) != (was["outcome"], was["time_s"]):
                lines.append(
                    f"The replay of {episode.controller} on {one.name} ends with {episode.outcome} after "
                    f"{episode.time:.2f} s; the search recorded {was['outcome']} after {was['time_s']:.2f} s."
                )
    return lines


def replayed_maps(run: LoadedRun, driven: Sequence[DrivenMap], group: str = "") -> list[ReplayedMap]:
    """The best maps that were driven again, with their runs; ``group`` is the heading under which they stand."""
    shown = [one for one in driven if one.episodes]
    return [ReplayedMap(f"{one.name} ({one.score})", one.episodes, _radius(run), group) for one in shown]


def _radius(run: LoadedRun) -> float:
    return float(run.config["run"]["environment"]["robot"]["radius"])


def _verdict(run: LoadedRun) -> list[str]:
    """Say in words what fitness was reached, and what each map shows."""
    maps = [_map_sentence(entry) for entry in _by_reading(run)]
    if run.best_results.get("validation"):
        return [*validation_sentence(run.best_results, run.config["search"]), *maps]
    return [_outcome(run), *_held(run), *maps]


def _outcome(run: LoadedRun) -> str:
    """Say how good the best set is, and what the search gained where fitnesses of all generations can be compared."""
    first, last = run.generations[0]["best"], run.generations[-1]["best"]
    if run.config["search"].get("archive", {}).get("elite"):  # sets are judged anew when their maps are driven again
        return f"The best set {'' if run.finished else 'so far '}has fitness {last:.2f} (lower is better)."
    improved = f"improved the best fitness from {first:.2f} to {last:.2f}"
    if first > 0 >= last:  # a fitness above 0 is made of penalties
        improved = f"reached fitness {last:.2f}; its first population had no set that all solve and whose maps differ"
    outcome = improved if last < first else f"found nothing better than its first population, fitness {last:.2f}"
    return f"The search {outcome} (lower is better)."


def _held(run: LoadedRun) -> list[str]:
    """Say whether the best set was validated, where the search has a validation stage."""
    if run.config["search"].get("validation") and not run.finished:
        return ["It is not validated yet: the validation stage comes at the end of the search."]
    return validation_sentence(run.best_results, run.config["search"])


def _by_reading(run: LoadedRun) -> list[dict[str, Any]]:
    """Maps from the most alike to the most different; maps without a score last."""
    return sorted(run.best_results["maps"], key=lambda entry: np.inf if entry["score"] is None else entry["score"])


def _map_sentence(entry: dict[str, Any]) -> str:
    if entry["values"] is None:
        failed = [name for name, runs in entry["runs"].items() if any(one["outcome"] != "goal" for one in runs)]
        return f"{entry['name']}: {', '.join(failed)} did not reach the goal, so the map counts as unsolved."
    ordered = sorted(entry["values"].items(), key=lambda item: item[1])
    (fast, least), (slow, most) = ordered[0], ordered[-1]
    ratio = most / least if least > 0 else np.inf
    if ratio < 1.1:
        times = f"{least:.1f} s" if f"{least:.1f}" == f"{most:.1f}" else f"{least:.1f} to {most:.1f} s"
        return f"{entry['name']}: all controllers take about the same ({times})."
    return f"{entry['name']}: {fast} is fastest ({least:.1f} s), {slow} takes {ratio:.1f} times as long ({most:.1f} s)."


def _configuration(run: LoadedRun) -> str:
    used = {key: run.config[key] for key in ("version", "libraries", *SECTIONS)}
    return yaml.safe_dump(used, sort_keys=False)


def _downloads(run: LoadedRun) -> list[Attachment]:
    config = yaml.safe_dump({key: run.config[key] for key in SECTIONS}, sort_keys=False)
    return [
        Attachment("config.yaml", "application/yaml", config.encode()),
        _download(run, BEST_MAP_SET, "application/json"),
        _download(run, "generations.csv", "text/csv"),
    ]


def _download(run: LoadedRun, name: str, media_type: str) -> Attachment:
    return Attachment(name, media_type, (run.path / name).read_bytes())


def _unfinished(run: LoadedRun) -> list[str]:
    if run.finished:
        return []
    search, done = (
        run.config["search"],
        f"{run.checkpoint['evaluations']} of {run.config['search']['evaluations']} sets",
    )
    if search.get("runs"):
        done = f"{len(run.runs)} of {search['runs']} runs"
    return [f"The search has come to {done}; mapbench evolve --resume {run.path} finishes it."]


def _errors(run: LoadedRun) -> list[str]:
    return errors_in(results_in(run.best_results, run.controllers), run.controllers, "in the search")
