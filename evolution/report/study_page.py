"""The content of the report of a study."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

import yaml

from evolution.files import counted, csv_of, zip_of
from evolution.report.page import Attachment, Report, Section, Table, download, picture, tables_of
from evolution.report.replays import ReplayedMap
from evolution.report.run_page import changed_replays, replayed_maps
from evolution.statistics import FEWEST_FOR_INTERVAL
from evolution.studies import (
    BestSet,
    Comparison,
    StudyAnalysis,
    StudyFigure,
    StudyResults,
    StudyRun,
    held_out_rows,
    load_study,
    map_rows,
    measure_rows,
    pair_rows,
    rank_rows,
    reported_fitness_rows,
    study_names,
    summary_rows,
    test_rows,
    verdict_of,
)
from gym_mapbench.mapio.map_set_file import BEST_MAP_SET

SUMMARY = {
    "configuration": "configuration",
    "n": "n",
    "mean": "mean",
    "std": "std",
    "median": "median",
    "ci_low": "median: 95 % from",
    "ci_high": "to",
    "min": "min",
    "max": "max",
}
SUMMARY_NOTE = f"The interval is a bootstrap interval of the median, given for {FEWEST_FOR_INTERVAL} searches or more."
RANKS = {"configuration": "configuration", "mean_rank": "mean rank"}
PAIRS = {
    "first": "first",
    "second": "second",
    "median_difference": "difference of medians",
    "p_holm": "p (Holm)",
    "a12": "A12: first better",
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
HELD_OUT = {
    "configuration": "configuration",
    "repeats": "repeats in the search",
    "n": "n",
    "reported_fitness": "reported (median)",
    "held_out_fitness": "held-out (median)",
    "selection_bias": "held-out minus reported (median)",
    "solved": "held-out seeds with all maps solved",
    "rank_agreement": "rank agreement on these",
    "held_out_success_rate": "success on held-out seeds",
}
HELD_OUT_NOTE = (
    "Held-out fitness minus reported fitness: the selection bias (winner's curse), and the noise of the held-out runs "
    "if the search had no noise. path_length selects without runs. Rank agreement is the share of the held-out seeds "
    "with all maps solved on which the maps keep the ranks of their scores."
)
REPORTED = {
    "configuration": "configuration",
    "n": "n",
    "reported_fitness": "reported (median)",
    "held_out_fitness": "held-out (median)",
    "held_out_low": "from",
    "held_out_high": "to",
    "mean_trial": "mean trial (median)",
    "absolute_error": "difference (median)",
    "within_half": "difference of 0.5 at most",
    "within_half_repeated": "of two re-evaluations",
    "held_out_success_rate": "success on held-out seeds",
    "rank_agreement": "rank agreement",
    "roles": "all roles filled",
    "against": "compared with",
    "a12": "A12",
    "p_holm": "p (Holm)",
}
REPORTED_NOTE = (
    "Reported and held-out fitness of the best sets; the interval is the 95 % interval of the median over searches. A "
    "mean trial is the mean fitness of the held-out trials of a set, of which one that loses the ranks counts as 0 or "
    "its penalty. Two re-evaluations of the same set, resampled from its held-out seeds, differ by 0.5 at most in the "
    "next share, which is what a report without selection bias can reach. Rank agreement counts over all held-out "
    "trials. All roles are filled if on one map all controllers are within a factor of 1.2, on another two groups are "
    "further apart than that, and so on. A12 and p (corrected by Holm over these rows) compare with the first "
    "configuration of the same fitness, navigation and held-out noise."
)
MAPS = {
    "map": "map",
    "score": "score",
    "controller": "controller",
    "searched_s": "in the search, s",
    "mean_s": "mean s",
    "min_s": "min s",
    "max_s": "max s",
    "std_s": "std s",
    "goals": "goals",
    "runs": "runs",
    "otherwise": "other outcomes",
}
HELD_OUT_TIMES = (
    "Times of the runs on held-out seeds that reached the goal. Replays and figures of maps show runs of the search."
)
RUNS = {
    "configuration": "configuration",
    "seed": "seed",
    "pop_size": "population",
    "evaluations": "evaluations",
    "cluster_scale": "cluster scale",
    "fitness": "reported fitness",
    "held_out_fitness": "held-out fitness",
    "selection_bias": "held-out minus reported",
    "held_out_success_rate": "success on held-out seeds",
    "driven": "new runs",
    "seconds": "seconds for these runs",
}
RUNS_NOTE = (
    "All searches of a study share one store of results. A search reuses the runs of earlier searches, so the last two "
    "columns depend on the order of the searches."
)


def report_of_study(
    analysis: StudyAnalysis, best_sets: Sequence[BestSet] = (), figures: Sequence[StudyFigure] = ()
) -> Report:
    """Return the report of a study, finished or not.

    Args:
        analysis: The study with its comparisons.
        best_sets: What :func:`evolution.studies.analysis.figures.drive_best_sets` returned, for the replays.
        figures: What :func:`evolution.studies.analysis.figures.write_study_figures` returned.
    """
    results, settings = analysis.results, analysis.results.settings
    controllers = dict.fromkeys(name for run in results.runs for name in run.experiment.names)
    return Report(
        title=f"Study: {settings.name}",
        subtitle=(
            f"{counted(len(settings.configurations), 'configuration')} x "
            f"{counted(settings.runs, 'search', 'searches')}, {counted(settings.budget, 'map set')} evaluated in each; "
            f"controllers {', '.join(controllers) or 'unknown'}; "
            f"{counted(len(results.runs), 'search', 'searches')} finished"
        ),
        verdict=verdict_of(analysis),
        command=_command(results),
        configuration=_configuration(results),
        maps=[shown for best in best_sets for shown in _replayed(best)],
        sections=[
            Section("Tables", tables=_tables(analysis, best_sets), id="tables"),
            Section("Figures", figures=[picture(one.caption, one.png.read_bytes()) for one in figures], id="figures"),
        ],
        downloads=_downloads(results, best_sets),
        missing=[*refused_replays(best_sets), *results.missing, *_not_shown(results, best_sets)],
        changed=[line for best in best_sets for line in _changed(best)],
    )


def _tables(analysis: StudyAnalysis, best_sets: Sequence[BestSet]) -> list[Table]:
    results = analysis.results
    validated = [best.run for best in best_sets if best.run.reevaluation is not None]
    return [
        *(table for one in analysis.comparisons for table in _comparison_tables(one)),
        *tables_of("Held-out minus reported fitness", HELD_OUT, held_out_rows(results), HELD_OUT_NOTE),
        *tables_of("Reported and held-out fitness", REPORTED, reported_fitness_rows(results), REPORTED_NOTE),
        *(table for run in validated for table in _best_set_tables(run)),
        *tables_of("Every search", RUNS, results.rows(), RUNS_NOTE),
    ]


def _comparison_tables(comparison: Comparison) -> list[Table]:
    """Table 5.2 and the tests behind the verdict."""
    title = comparison.title
    summary = f"Best fitness of a search: {title} (thesis, Table 5.2)"
    pairs = PAIRS | ({"by_construction": "by construction"} if comparison.by_construction else {})
    return [
        *tables_of(summary, SUMMARY, summary_rows(comparison), SUMMARY_NOTE),
        *tables_of(f"Every pair of configurations: {title}", pairs, pair_rows(comparison), _pairs_note(comparison)),
        *tables_of(f"Tests over several configurations: {title}", TESTS, test_rows(comparison)),
        *tables_of(f"Ranks: {title}", RANKS, rank_rows(comparison), _ranks_note(comparison)),
    ]


def _pairs_note(comparison: Comparison) -> str:
    """Return the note of the table of pairs."""
    note = (
        "The first configuration has the better median. p: Mann-Whitney U test, corrected by Holm. A12 is the share of "
        "pairs of searches in which the first is better; ties count half (0.5: no effect). Searches with one seed "
        "share their first population. The tests treat searches as independent, which is conservative under positive "
        "dependence."
    )
    if not comparison.by_construction:
        return note
    return (
        f"{note} Pairs by construction are not tested: the first configuration selects among all maps that the second "
        "evaluated, so its reported fitness is never worse."
    )


def _ranks_note(comparison: Comparison) -> str:
    """Return the note of the table of ranks, which names the configurations without a rank."""
    if (ranking := comparison.ranking) is None:
        return ""
    names = ", ".join(best for best, _ in comparison.by_construction)
    left_out = f" Without {names}: never worse than another configuration by construction." if names else ""
    return (
        f"Over {counted(len(ranking.seeds), 'seed')}; rank 1 is best. Ranks less than "
        f"{ranking.critical_difference:.2f} apart do not differ significantly (Nemenyi, 0.05).{left_out}"
    )


def refused_replays(best_sets: Sequence[BestSet]) -> list[str]:
    """Say in one line which best sets were not re-run because they name code."""
    refused = {best.run.configuration.name: best.refused for best in best_sets if best.refused}
    return [f"There are no replays of {', '.join(refused)}: {next(iter(refused.values()))}"] if refused else []


def _not_shown(results: StudyResults, best_sets: Sequence[BestSet]) -> list[str]:
    """Name the configurations without a replay, or with the replay of another than the best set."""
    shown = {best.run.configuration.name: best.run for best in best_sets}
    lines = []
    for name, runs in results.by_configuration.items():
        best = min(runs, key=lambda run: run.fitness)
        if name not in shown:
            lines.append(f"{name}: no replay, none of its best sets could be loaded and re-run")
        elif shown[name] is not best:
            lines.append(
                f"{name}: the best search (seed {best.seed}) could not be loaded and re-run; seed "
                f"{shown[name].seed} is shown"
            )
    return lines


def _best_set_tables(run: StudyRun) -> list[Table]:
    """Times and other measures of the best set of a configuration."""
    what = f"Best set of {run.configuration.name} (seed {run.seed}) on held-out seeds"
    measures = measure_rows(run)
    names = {name: name for row in measures for name in row if name not in ("configuration", "seed")}
    rows = [{name: row.get(name) for name in names} for row in measures]
    return [
        *tables_of(f"{what} (thesis, Tables 5.3 and 5.4)", MAPS, map_rows(run), HELD_OUT_TIMES),
        *tables_of(f"{what}: other measures", names, rows, "Means over the same runs; SI units."),
    ]


def _replayed(best: BestSet) -> list[ReplayedMap]:
    """Return the replays of the best set of one configuration."""
    group = f"{best.run.configuration.name} (seed {best.run.seed}, reported fitness {best.run.fitness:.2f})"
    return replayed_maps(best.loaded, best.maps, group)


def _changed(best: BestSet) -> list[str]:
    return [f"{best.run.configuration.name}: {line}" for line in changed_replays(best.loaded, best.maps)]


def _command(results: StudyResults) -> str:
    name, out = results.settings.name, shlex.quote(results.path.name)
    if name in study_names() and load_study(name) == results.settings:
        return f"mapbench study {name} --out {out}"
    return f"mapbench study study.yaml --out {out}  # study.yaml is among the downloads"


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
        download("study.yaml", _study_yaml(results)),
        download("runs.csv", csv_of(results.rows())),
        download("maps.csv", csv_of(maps)),
    ]
    if best_sets:
        sets = {
            f"{best.run.configuration.name}.json": (best.run.path / BEST_MAP_SET).read_bytes() for best in best_sets
        }
        files.append(download("best_map_sets.zip", zip_of(sets)))
    return files
