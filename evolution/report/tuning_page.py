"""The page of a tuning: verdict, replays on test maps, changed parameters, and the history of the search."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from controllers.nav2_params.file.yaml_edits import as_yaml
from evolution.files import Row, counted
from evolution.report.benchmark_page import split_reasons
from evolution.report.page import Attachment, Report, Section, Table, download, picture
from evolution.report.replays import ReplayedMap
from evolution.tuning import FIGURES, PARAMS, TRIALS, Tuning, drive_test
from gym_mapbench.metrics.episode import Episode

MOST_REPLAYS = 6
"""Largest number of test maps with replays."""
OWN_ALONE = "Only the own values run on the test maps, as no trial is better."
COMPARED = "The own values and the tuned values run on the same test maps with the same seeds."
UNSEEN = "The search has used neither these maps nor these seeds."
OWN_FIRST = "Trial 0 has the own values. Each trial runs on the training maps in an order of its own"
STOPS = " and stops if the Wilcoxon test says that it is worse than the best trial."
NEVER_STOPS = "; with several objectives no trial stops early."
COSTS = {
    "time": "The cost time of a run is its time over the time of the shortest path at maximum speed; a failure costs "
    "twice the time limit.",
    "length": "The cost length of a run is its length over that of the shortest path; a failure costs as much as in "
    "the cost time.",
    "clearance": "The cost clearance of a run is its least distance to a wall in m, with a minus sign; a failure "
    "costs 0.",
}
"""The cost of a run for each objective, in words."""
VALIDATED = (
    "The best trials and the own values were re-run on all training maps with held-out seeds. The result is the trial "
    "with the lowest cost {}."
)
ROUNDS = (
    "After each round but the last, maps were evolved against its best values: maps on which these are slow or fail "
    "where another controller is fast. The maps joined the training maps. The table has the mean cost of the own "
    "values, of the best values of each round and of the tuned values, on held-out seeds."
)
CAPTIONS = {
    "history": "Cost of each trial; the cost of a stopped trial is estimated from its differences to the best trial",
    "front": "Costs of the trials, and the Pareto front of the finalists on held-out seeds with their numbers",
    "importance": "Importance of each parameter for the costs (PED-ANOVA)",
}


def report_of_tuning(tuning: Tuning) -> Report:
    """Return the page of a finished tuning; the replays are re-run."""
    begun, summary = tuning.config["tuning"], tuning.summary
    tasks = f"{counted(len(begun['train']), 'training task')}, {counted(len(begun['test']), 'test task')}"
    runs = counted(sum(summary.runs.values()), "run")
    return Report(
        title=f"Tuning of {summary.controller}",
        subtitle=f"{summary.maps or tasks}; {runs}; seed {begun['settings']['seed']}",
        verdict=tuning.verdict,
        command=_command(summary.controller, begun["settings"], begun["world"]["environment"]["time_limit"]),
        configuration=yaml.safe_dump(begun, sort_keys=False),
        maps=[_replayed(episodes) for episodes in drive_test(tuning, MOST_REPLAYS)],
        sections=_sections(tuning),
        downloads=[download(name, (tuning.path / name).read_bytes()) for name in (PARAMS, TRIALS)],
    )


def _command(controller: str, settings: Mapping[str, Any], time_limit: float) -> str:
    """Return the command of a tuning; its maps, its search space and the rest of its world are in the configuration."""
    given = {name: settings[name] for name in ("trials", "runs", "seed", "sampler", "finalists", "test_repeats")}
    words = [f"--{name.replace('_', '-')} {value}" for name, value in given.items() if value is not None]
    words += [f"--objective {name}" for name in settings["objectives"]]
    words += [f"--require {shlex.quote(text)}" for text in settings["requirements"]]
    if against := settings.get("against"):
        words.append(f"--against evolve --rounds {against['rounds']}")
    words.append(f"--time-limit {time_limit:g}")
    maps = "--train MAPS --test MAPS --params FILE --out DIR"
    command = " ".join(["mapbench tune", shlex.quote(controller), maps, *words])
    return f"{command}  # the configuration names all maps, values and options"


def _searched(objectives: Sequence[str]) -> str:
    """Return how the search ran, and what the costs are."""
    head = OWN_FIRST + (NEVER_STOPS if len(objectives) > 1 else STOPS)
    return " ".join([head, *(COSTS[name] for name in objectives)])


def _replayed(episodes: Sequence[Episode]) -> ReplayedMap:
    """Return the replay of a test map with the outcomes in its title; own values alone have no difference."""
    name = episodes[0].scenario.name
    runs = ", ".join(f"{one.controller} {one.outcome} after {one.time:.1f} s" for one in episodes)
    sample = "One of the test maps with the largest difference." if len(episodes) > 1 else ""
    return ReplayedMap(f"{name}: {runs}", episodes, sample=sample)


def _sections(tuning: Tuning) -> list[Section]:
    summary = tuning.summary
    runs, failures = split_reasons(summary.test)
    return [
        Section(
            "Changed parameters", [] if summary.changes else ["None."], _tables("Changes", _texts(summary.changes))
        ),
        Section("History", [_searched(summary.objectives)], figures=_figures(tuning, "history", "front")),
        Section("Importance", figures=_figures(tuning, "importance")),
        Section("Validation", [VALIDATED.format(summary.objectives[0])], _tables("Finalists", summary.finalists)),
        *([Section("Rounds", [ROUNDS], _tables("Mean cost", summary.rounds))] if summary.rounds else []),
        Section(
            "Test",
            [f"{COMPARED if summary.changes else OWN_ALONE} {UNSEEN}"],
            [*_tables("Failed runs", failures), *_tables("Runs", runs)],
        ),
        Section("Trials", tables=_tables("Trials", summary.trials)),
    ]


def _figures(tuning: Tuning, *names: str) -> list[Attachment]:
    paths = {name: tuning.path / FIGURES / f"{name}.png" for name in names}
    return [picture(CAPTIONS[name], path.read_bytes()) for name, path in paths.items() if path.is_file()]


def _tables(caption: str, rows: Sequence[Row]) -> list[Table]:
    """Return a table of some rows; truth values are written as words, and a missing number is a dash."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    cells = [[_cell(row.get(name)) for name in names] for row in rows]
    return [Table(caption, names, cells)] if rows else []


def _texts(changes: Sequence[Row]) -> list[Row]:
    """Return the changes as texts, since values of different kinds stand in a column."""
    return [{name: as_yaml(value) for name, value in row.items()} for row in changes]


def _cell(value: object) -> str | float | int:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return float("nan") if value is None else value if isinstance(value, int | float) else str(value)
