"""Tables and outputs on the pages are those of the CSV files and commands that they come from."""

from __future__ import annotations

import csv
import re
import shlex
from pathlib import Path
from statistics import fmean, median

import numpy as np
import pytest
from scipy.stats import mannwhitneyu, norm, spearmanr

from docs.generate.evolve_figures import COMPARISONS, a12_interval, compared, values_of
from evolution.cli import main
from evolution.studies.settings import load_study

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
ROUNDED = 0.0051
"""The CSV files have two decimals, so a median of an even number may be rounded either way."""
PRESENT = {
    "offspring of the archive": "ours",
    "random sampling, same rules": "random",
    "offspring, without the surrogate": "without_surrogate",
    "thesis GA, on the thesis' maps": "ga_own_maps",
    "thesis GA, on the families": "ga_thesis",
    "offspring, families with their own ranges alone |": "ours_wide",
    "random sampling of these | 32": "random_wide",
    "offspring, families with their own ranges alone, 300 runs": "ours_wide_300",
    "random sampling of these, 300 runs": "random_wide_300",
    "offspring, families with their own ranges alone, 3000 runs": "ours_wide_3000",
    "random sampling of these, 3000 runs": "random_wide_3000",
    "offspring, shapes of the thesis": "without_families",
    "random sampling of these | 16": "random_without_families",
    "offspring, Nav2 Jazzy": "ours_jazzy",
    "random sampling, Nav2 Jazzy": "random_jazzy",
    "offspring, fitness `roles`": "ours_roles",
    "random sampling, fitness `roles`": "random_roles",
    "offspring, fitness `pairs`": "ours_pairs",
    "random sampling, fitness `pairs`": "random_pairs",
    "offspring, parameters of the thesis": "ours_thesis",
    "random sampling, parameters of the thesis": "random_thesis",
    "offspring, `ppo.zip`": "ours_policy",
    "random sampling, `ppo.zip`": "random_policy",
}
"""How the rows of the table of the present search begin, and their searches in evolve.csv."""


def text_of(page):
    return (ROOT / page).read_text(encoding="utf-8")


def rows_of(table):
    return list(csv.DictReader(text_of(table).splitlines()))


def cells_of(page, start):
    """Cells of the only row of a page that begins so."""
    (line,) = [line for line in text_of(page).splitlines() if line.startswith(f"| {start}")]
    return [cell.strip() for cell in line.strip("|").split("|")]


def number(text):
    """First number of a cell."""
    return float(re.match(r"-?[\d.]+", text.replace("−", "-"))[0])


@pytest.mark.parametrize(("start", "search"), PRESENT.items(), ids=PRESENT.values())
def test_rows_of_the_present_search_follow_from_the_csv_file(start, search):
    _, n, reported, held_out, mean_trial, _, ranks, goals = cells_of("docs/concepts/heldout.md", start)
    rows = [row for row in rows_of("docs/concepts/evolve.csv") if row["search"] == search]

    def column(name):
        return [float(row[name]) for row in rows]

    assert int(n) == len(rows)
    assert number(reported) == pytest.approx(median(column("reported_fitness")), abs=ROUNDED)
    if "(" in held_out:
        assert number(held_out) == pytest.approx(median(column("held_out_fitness")), abs=ROUNDED)
    else:
        assert [float(value) for value in held_out.split(",")] == column("held_out_fitness")
    assert number(mean_trial) == pytest.approx(median(column("mean_trial")), abs=ROUNDED)
    assert number(ranks) == pytest.approx(100 * fmean(column("rank_agreement")), abs=0.51)
    assert number(goals) == pytest.approx(100 * fmean(column("held_out_success_rate")), abs=0.051)


@pytest.mark.parametrize(("name", "searches"), COMPARISONS.items(), ids=COMPARISONS)
def test_rows_of_evolution_and_random_sampling_follow_from_the_csv_file(name, searches):
    page = text_of("docs/concepts/heldout.md").split("## Evolution and random sampling")[1].split("\n\n")[1]
    (row,) = [line for line in page.splitlines() if line.replace("`", "").startswith(f"| {name}")]
    _, n, *medians, a12, p, better = [cell.strip() for cell in row.strip("|").split("|")]
    samples = [list(values_of(search, "held_out_fitness").values()) for search in searches]
    shown = compared(searches, "held_out_fitness")
    assert [len(values) for values in samples] == [int(n)] * 2
    assert [number(cell) for cell in medians] == pytest.approx([median(values) for values in samples], abs=ROUNDED)
    assert a12 == f"{shown.a12:.2f} ({shown.low:.2f} to {shown.high:.2f})"
    assert float(p) == pytest.approx(mannwhitneyu(*samples).pvalue, abs=0.011)
    assert better == f"{shown.better} of {shown.seeds}"


def test_all_comparisons_together_are_those_of_the_csv_file():
    every = [compared(searches, "held_out_fitness") for searches in COMPARISONS.values()]
    shares = f"{sum(one.better for one in every)} of {sum(one.seeds for one in every)}"
    assert f"evolution is better on {shares} seeds" in text_of("docs/concepts/heldout.md")


@pytest.mark.parametrize("shift", [0.0, 1.0])
def test_the_interval_of_a12_holds_the_truth_as_often_as_it_says(shift):
    rng, truth = np.random.default_rng(0), norm.cdf(shift / np.sqrt(2.0))
    first, second = rng.normal(shift, size=(1000, 8, 1)), rng.normal(size=(1000, 1, 8))
    intervals = [a12_interval(share, 8, 8) for share in (first > second).mean(axis=(1, 2))]
    assert 0.93 <= fmean(low <= truth <= high for low, high in intervals) <= 0.98


@pytest.mark.parametrize(("share", "end"), [(0.0, (0.0, 0.244)), (1.0, (0.756, 1.0))])
def test_the_interval_of_an_extreme_a12_ends_there(share, end):
    assert a12_interval(share, 8, 8) == pytest.approx(end, abs=0.001)


@pytest.mark.parametrize(
    ("start", "other"),
    [
        ("thesis GA, with noise", "thesis GA, on the thesis' maps"),
        ("the default, `robust`", "offspring of the archive"),
        ("random maps of its families", "random sampling, same rules"),
    ],
)
def test_the_readme_has_the_values_of_the_page(start, other):
    _, n, reported, held_out, _, _, ranks, goals = cells_of("docs/concepts/heldout.md", other)
    assert cells_of("README.md", start)[1:] == [n, reported, held_out, ranks, goals]


def test_correlations_of_metrics_follow_from_the_csv_file():
    rows = rows_of("docs/concepts/metrics.csv")
    columns = {name.removesuffix("_m").removesuffix("_s"): name for name in rows[0]}

    def both(metric):
        repeats = [[float(row[columns[metric]]) for row in rows if row["repeat"] == repeat] for repeat in "01"]
        return np.array(repeats)

    page = text_of("docs/concepts/metrics.md")
    table = [line.split("|")[1:4] for line in page.splitlines() if line.startswith("| `")]
    assert len(table) == 11
    for metric, with_time, between in table:
        values = both(metric.strip(" `"))
        expected = spearmanr(values.mean(axis=0), both("time").mean(axis=0)).statistic, spearmanr(*values).statistic
        assert (float(with_time), float(between)) == pytest.approx(expected, abs=ROUNDED), metric


def test_means_of_the_atlas_follow_from_the_csv_file():
    rows = rows_of("docs/howto/atlas.csv")
    names = {"cells in the search": "cells in the search", "cells on held-out seeds": "cells"}
    for start, name in {**names, "QD score on held-out seeds": "QD score"}.items():
        shown = [float(cell) for cell in cells_of("docs/howto/atlas.md", start)[1:3]]
        means = [fmean(float(row[name]) for row in rows if row["method"] == method) for method in ("atlas", "random")]
        assert shown == pytest.approx(means, abs=0.051)


def test_counts_of_the_campaign_add_up():
    page = text_of("docs/robustness.md")
    kinds = re.findall(r"^\| [^|]+ \| ([\d ]+) \| [\d ]+ \| [\d ]+ \| \d+ \| \d+ \|$", page, re.MULTILINE)
    files = f"{sum(int(count.replace(' ', '')) for count in kinds):,}".replace(",", " ")
    killed = re.findall(r"^\| \w+ \| (\d+) of \d+[^|]*\| (\d+) of \d+[^|]*\| \d+ of \d+ \|$", page, re.MULTILINE)
    kills = sum(int(count) for row in killed for count in row)
    assert f"| damaged files | {files} |" in page
    assert f"| kills (`kill -9`) | {kills} |" in page
    assert f"{files} damaged files, {kills} kills" in text_of("README.md")


def test_the_check_of_a_parameter_file_prints_what_the_tutorial_shows(capsys):
    page = text_of("docs/tutorials/nav2.md")
    (shown,) = re.findall(r"```text\n(read as .*?)```", page, re.DOTALL)
    assert main(["params", "check", str(ROOT / "examples/nav2_params.yaml")]) == 0
    assert capsys.readouterr().out == shown


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_studies_on_the_pages_have_these_configurations(page):
    for study, names in re.findall(r"mapbench study (\w+)[^`\n]* --only (\S+)", page.read_text(encoding="utf-8")):
        known = {one.name for one in load_study(study).configurations}
        assert set(shlex.split(names)[0].strip("`").split(",")) <= known, study
