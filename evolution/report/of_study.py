"""What the report of a study says."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence

import yaml

from evolution.files import Row, csv_of
from evolution.report.of_run import changed_replays
from evolution.report.page import Attachment, Report, Table, picture
from evolution.report.replays import ReplayedMap
from evolution.study.comparisons import QUANTITIES, Comparison, compare
from evolution.study.figures import BestSet, StudyFigure
from evolution.study.results import StudyResults, StudyRun
from evolution.study.settings import load_study, study_names
from evolution.study.tables import map_rows, measure_rows, pair_rows, rank_rows, repeat_rows, summary_rows, test_rows
from evolution.study.verdict import verdict_of
from gym_mapbench.mapio.bundle import BEST_MAP_SET

ZIP_DATE = (1980, 1, 1, 0, 0, 0)
"""The oldest date a zip file can hold: equal content gives equal bytes."""

SUMMARY = {
    "configuration": "configuration",
    "n": "n",
    "mean": "mean",
    "std": "std",
    "median": "median",
    "min": "min",
    "max": "max",
    "ci_low": "mean: 95 % from",
    "ci_high": "to",
}
PAIRS = {
    "first": "first",
    "second": "second",
    "median_difference": "difference of medians",
    "p_holm": "p (Holm)",
    "a12": "A12",
    "cliffs_delta": "Cliff's delta",
    "n_first": "n first",
    "n_second": "n second",
}
TESTS = {
    "test": "test",
    "groups": "of",
    "statistic": "statistic",
    "p_value": "p",
    "effect": "effect",
    "effect_name": "which",
    "n": "n",
}
REPEATS = {
    "configuration": "configuration",
    "repeats": "repeats in the search",
    "n": "n",
    "seen": "seen (median)",
    "fresh": "fresh (median)",
    "winners_curse": "winner's curse (median)",
    "order_kept": "order kept",
    "fresh_success_rate": "success on fresh seeds",
}
MAPS = {
    "map": "map",
    "reading": "reading",
    "controller": "controller",
    "seen_s": "search saw, s",
    "mean_s": "mean s",
    "min_s": "min s",
    "max_s": "max s",
    "std_s": "std s",
    "goals": "goals",
    "runs": "runs",
    "otherwise": "otherwise",
}
RUNS = {
    "configuration": "configuration",
    "seed": "seed",
    "pop_size": "population",
    "evaluations": "evaluations",
    "fitness": "fitness seen",
    "fresh_fitness": "on fresh seeds",
    "winners_curse": "winner's curse",
    "order_kept": "order kept",
    "fresh_success_rate": "success on fresh seeds",
    "driven": "runs driven",
    "seconds": "seconds",
}


def report_of_study(
    results: StudyResults, best_sets: Sequence[BestSet] = (), figures: Sequence[StudyFigure] = ()
) -> Report:
    """Collect the report of a study, as far as it has come.

    Args:
        results: The study.
        best_sets: What :func:`evolution.study.figures.drive_best_sets` returned: the replays.
        figures: What :func:`evolution.study.figures.write_study_figures` returned.
    """
    settings = results.settings
    controllers = results.runs[0].experiment.plan.names if results.runs else ()
    return Report(
        title=f"Study: {settings.name}",
        subtitle=(
            f"{len(settings.configurations)} configurations x {settings.runs} runs, {settings.budget} map sets "
            f"evaluated in each; controllers {', '.join(controllers) or 'unknown'}; {len(results.runs)} runs finished"
        ),
        verdict=verdict_of(results),
        command=_command(results),
        configuration=_configuration(results),
        maps=[shown for best in best_sets for shown in _replayed(best)],
        tables=_tables(results, best_sets),
        figures=[picture(figure.caption, figure.png.read_bytes()) for figure in figures],
        downloads=_downloads(results, best_sets),
        missing=[*results.missing, *[line for best in best_sets for line in _changed(best)]],
    )


def table_of(caption: str, columns: Mapping[str, str], rows: Sequence[Row], note: str = "") -> Table:
    """Turn rows into a table with the columns that are asked for, under their headings; None becomes a dash."""
    cells = [[float("nan") if row[name] is None else row[name] for name in columns] for row in rows]
    return Table(caption, tuple(columns.values()), cells, note)


def _tables(results: StudyResults, best_sets: Sequence[BestSet]) -> list[Table]:
    tables = [table for one in compare(results) for table in _comparison_tables(one)]
    if any(run.fresh is not None for run in results.runs):
        note = "Fitness on fresh seeds minus the fitness the search saw; share of fresh seeds with the maps' order."
        tables.append(table_of("Winner's curse", REPEATS, repeat_rows(results), note))
    tables += [table for best in best_sets if best.run.fresh is not None for table in _best_set_tables(best.run)]
    if results.runs:
        tables.append(table_of("Every run", RUNS, results.rows()))
    return tables


def _comparison_tables(comparison: Comparison) -> list[Table]:
    """Table 5.2 and the tests behind the verdict."""
    title = f"{comparison.judge}, {QUANTITIES[comparison.quantity]}"
    tables = [table_of(f"Best fitness of a run: {title} (thesis, Table 5.2)", SUMMARY, summary_rows(comparison))]
    if comparison.pairs:
        note = "Mann-Whitney U, corrected by Holm. A12 is the chance that a run of the first is worse (0.5: no effect)."
        tables.append(table_of(f"Every two configurations: {title}", PAIRS, pair_rows(comparison), note))
    if tests := test_rows(comparison):
        tables.append(table_of(f"Tests over several configurations: {title}", TESTS, tests))
    if ranking := comparison.ranking:
        columns = {"configuration": "configuration", "mean_rank": "mean rank"}
        note = (
            f"Over {len(ranking.seeds)} seeds, 1 is best; ranks less than {ranking.critical_difference:.2f} apart "
            "cannot be told apart (Nemenyi, 0.05)."
        )
        tables.append(table_of(f"Ranks: {title}", columns, rank_rows(comparison), note))
    return tables


def _best_set_tables(run: StudyRun) -> list[Table]:
    """Times and other measures of the best set of a configuration."""
    what = f"Best set of {run.configuration.name} (seed {run.seed}) on fresh seeds"
    measures = measure_rows(run)
    names = dict.fromkeys(name for row in measures for name in row if name not in ("configuration", "seed"))
    rows = [{name: row.get(name) for name in names} for row in measures]
    return [
        table_of(f"{what} (thesis, Tables 5.3 and 5.4)", MAPS, map_rows(run), "Of the runs that reached the goal."),
        table_of(
            f"{what}: other measures", {name: name for name in names}, rows, "Means over the same runs; SI units."
        ),
    ]


def _replayed(best: BestSet) -> list[ReplayedMap]:
    """The best set of one configuration with its recorded runs."""
    radius = float(best.loaded.config["run"]["environment"]["robot"]["radius"])
    group = f"{best.run.configuration.name} (seed {best.run.seed}, fitness {best.run.fitness:.2f})"
    return [
        ReplayedMap(f"{one.name} ({one.reading})", one.episodes, radius, group) for one in best.maps if one.episodes
    ]


def _changed(best: BestSet) -> list[str]:
    return [f"{best.run.configuration.name}: {line}" for line in changed_replays(best.loaded, best.maps)]


def _command(results: StudyResults) -> str:
    name = results.settings.name
    if name in study_names() and load_study(name) == results.settings:
        return f"mapbench study {name} --out {results.path.name}"
    return f"mapbench study study.yaml --out {results.path.name}  # study.yaml is among the downloads"


def _configuration(results: StudyResults) -> str:
    document = {
        "version": results.version,
        "libraries": dict(results.libraries),
        "taken from earlier configurations": dict(results.resolved),
    }
    return f"{_yaml(document)}\n# study.yaml\n{_study_yaml(results)}"


def _study_yaml(results: StudyResults) -> str:
    """The study's file, options at their defaults left out."""
    return _yaml(results.settings.model_dump(mode="json", exclude_defaults=True))


def _yaml(document: object) -> str:
    return yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=110)


def _downloads(results: StudyResults, best_sets: Sequence[BestSet]) -> list[Attachment]:
    maps = [row for run in results.runs for row in map_rows(run)]
    files = [
        Attachment("study.yaml", "application/yaml", _study_yaml(results).encode()),
        Attachment("runs.csv", "text/csv", csv_of(results.rows()).encode()),
        Attachment("maps.csv", "text/csv", csv_of(maps).encode()),
    ]
    if best_sets:
        files.append(Attachment("best_map_sets.zip", "application/zip", _zipped(best_sets)))
    return files


def _zipped(best_sets: Sequence[BestSet]) -> bytes:
    """The best set of every configuration as map-set files."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for best in best_sets:
            entry = zipfile.ZipInfo(f"{best.run.configuration.name}.json", ZIP_DATE)
            text = (best.run.path / BEST_MAP_SET).read_bytes()
            archive.writestr(entry, text, compress_type=zipfile.ZIP_DEFLATED)
    return content.getvalue()
