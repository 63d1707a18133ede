"""The pages of the site: every command on them parses, every block runs, and what they take from the code is there.

The blocks run in this process, in one folder, with small budgets, so that the pages share what they make. Benchmarks
of docs/extending.md have worker processes, which must find the examples, too. Those of README.md run in processes of
their own, in test_documents.py.
"""

from __future__ import annotations

import argparse
import csv
import re
import runpy
import shlex
import shutil
import subprocess
from contextlib import chdir
from statistics import median
from types import SimpleNamespace

import pytest
import yaml
from PIL import Image

from docs.generate import gallery, options, thesis_study, thesis_tables
from docs.generate.commands import command_reference
from docs.generate.docstrings import arguments, block_of, plain
from docs.generate.gallery import KEPT
from docs.generate.inserts import INSERTS, LINE, filled
from docs.generate.labels import labelled
from docs.generate.markdown import table
from evolution.cli import build_parser, main
from evolution.commands import COMMANDS
from evolution.commands.catalogue import KINDS
from evolution.driving import EXECUTORS
from evolution.runs import load_run
from evolution.search import EvolveSettings, load_preset
from evolution.search.judging.equation import gain
from evolution.search.judging.patterns.gini import NO_PATTERN, gini, gini_fitness
from gym_mapbench.mapio.formats import FORMATS
from gym_mapbench.metrics import METRICS
from tests.evolution.fake_runs import InProcess
from tests.test_documents import FEW, ROOT, TINY, blocks_of, name_of

SITE = yaml.load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"), yaml.BaseLoader)
PAGES = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md"))
IN_ORDER = re.findall(r"[\w/-]+\.md", str(SITE["nav"]))
RUN_HERE = [f"docs/{page}" for page in IN_ORDER]
WITH_WORKERS = "docs/extending.md"
"""The page whose benchmarks have worker processes: these must find what an example names ``module:attribute``."""

REDUCED = (
    (r"mapbench evolve .*--preset thesis", f"{FEW} --controllers dwb,rpp --time-limit 60"),
    (r"mapbench evolve", f"{FEW} --config tiny.yaml"),
    (r"mapbench atlas", "--runs 8 --repeats 1 --held-out-seeds 1 --controllers dwb,rpp --time-limit 60"),
    (r"mapbench minimize", "--seeds 1 --held-out-seeds 1 --time-limit 20"),
    (r"mapbench bench", "--repeats 1 --time-limit 60 --workers 1"),
    (r"mapbench drive", "--time-limit 2"),
    (r"mapbench maps draw .*--out (train|test)", "--count 2"),
    (r"mapbench tune", "--trials 2 --finalists 1 --test-repeats 1 --time-limit 60"),
)
"""What is added to a command that runs here; of an option that is given twice, the last counts."""
ONLY_PARSED = (
    r"mapbench (train|study|validate)",  # hours; tests of their own run them with small budgets
    r"runs/(ppo|study)|report runs/thesis",  # needs what those would have made; one report is enough
    r"--config mine.yaml",  # three controllers, three roles; the page's Python block reads the file
    r"--out runs/(mine|cluster|doors|pairs|four_people)",  # one more search each, of which others run
    r"cluster.md|dask|pip install|scheduler",
)
FOREIGN = ("dask_jobqueue", "dask_kubernetes")
"""Modules of clusters, which no test has."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder for all pages, with the examples in it as in a clone."""
    folder = tmp_path_factory.mktemp("reader")
    shutil.copytree(ROOT / "examples", folder / "examples")
    (folder / "tiny.yaml").write_text(TINY, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def done():
    """Commands that were run; one that stands on two pages runs once."""
    return set()


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN_HERE)
@pytest.mark.filterwarnings("error::DeprecationWarning:__main__")
def test_blocks_run(page, folder, done, monkeypatch):
    for registry in (EXECUTORS, FORMATS, METRICS):  # what a block registers, it registers for itself
        monkeypatch.setattr(registry, "_entries", dict(registry._entries))
    processes = EXECUTORS.get("processes")
    monkeypatch.syspath_prepend(folder)
    with chdir(folder):
        for position, (language, text) in enumerate(blocks_of(page)):
            with_workers = page == WITH_WORKERS and (language == "python" or "mapbench bench" in text)
            monkeypatch.setitem(EXECUTORS._entries, "processes", processes if with_workers else InProcess)
            if language == "python" and not any(module in text for module in FOREIGN):
                script = folder / name_of(text, position, language)
                script.write_text(text, encoding="utf-8")
                runpy.run_path(str(script), run_name="__main__")
            elif language == "bash":
                run_lines(text, done)


def run_lines(text, done):
    """Run the lines of a block: those of ``mapbench`` in this process, the others in between by bash."""
    for part in re.split(r"^(mapbench .*)$", text.replace("\\\n", " "), flags=re.MULTILINE):
        if not part.startswith("mapbench "):
            if part.strip() and not skipped(part):
                subprocess.run(["bash", "-e", "-c", part], check=True)
        elif part not in done and not skipped(part):
            done.add(part)
            extra = next((extra for pattern, extra in REDUCED if re.match(pattern, part)), "")
            assert main([*shlex.split(part, comments=True)[1:], *extra.split()]) == 0, part


def skipped(part):
    return any(re.search(pattern, part) for pattern in ONLY_PARSED)


def commands_in(text):
    """All commands of a page: lines of its blocks, and what stands in code type in its sentences."""
    blocks = re.findall(r"```\w+\n(.*?)```", text, flags=re.DOTALL)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    return [*lines, *re.findall(r"`([^`]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL).replace("\n", " "))]


@pytest.mark.parametrize("page", ["README.md", *PAGES])
def test_commands_parse(page, monkeypatch):
    parser = build_parser()
    monkeypatch.setattr(type(parser), "error", refuse)
    for line in commands_in((ROOT / page).read_text(encoding="utf-8")):
        words = line.partition(" > ")[0].split()
        if words[:1] == ["mapbench"] and words[1:2] and words[1] in COMMANDS:
            parse(parser, shlex.split(" ".join(words), comments=True)[1:], line)


def parse(parser, words, line):
    try:
        parser.parse_args(words)
    except argparse.ArgumentError as problem:
        pytest.fail(f"{line}: {problem.message}")
    except SystemExit:
        pass  # --help, or something that a sentence leaves out


def refuse(self, message):
    """Let pass what a sentence leaves out, and nothing else."""
    if "the following arguments are required" in message or "expected one argument" in message:
        raise SystemExit
    raise argparse.ArgumentError(None, message)


@pytest.mark.parametrize("package", ["evolution", "controllers", "gym_mapbench"])
def test_the_picture_of_the_architecture_shows_rooms_that_exist(package):
    picture = (ROOT / "docs/architecture.svg").read_text(encoding="utf-8")
    drawn = re.findall(r'class="room">(\w+)<', picture.partition(f'<g id="{package}">')[2].partition("</g>")[0])
    assert len(drawn) >= 8
    assert [room for room in drawn if not (ROOT / package / room / "__init__.py").is_file()] == []


def test_tests_that_robustness_names_exist():
    named = re.findall(r"`(tests/[\w/]+\.py)`", (ROOT / "docs/robustness.md").read_text(encoding="utf-8"))
    assert len(named) > 10
    assert [path for path in named if not (ROOT / path).is_file()] == []


@pytest.mark.parametrize(
    ("search", "row"),
    [("thesis GA with noise", "| thesis GA, searching with noise |"), ("robust", "| `robust`, 1000 runs |")],
)
def test_medians_of_held_out_fitness_are_those_of_the_csv_file(search, row):
    table = csv.DictReader((ROOT / "docs/concepts/heldout.csv").read_text(encoding="utf-8").splitlines())
    values = [float(one["held_out_fitness"]) for one in table if (one["search"], one["noise"]) == (search, "nominal")]
    page = (ROOT / "docs/concepts/heldout.md").read_text(encoding="utf-8")
    (line,) = [line for line in page.splitlines() if line.startswith(row)]
    assert line.startswith(f"{row} {len(values)} |")
    assert f"| {median(values):.2f} (" in line


def test_every_page_has_its_place():
    assert sorted(f"docs/{page}" for page in IN_ORDER) == PAGES


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md", *PAGES])
def test_links_lead_to_files(page):
    for target in re.findall(r"\]\(([^)#:]+)(?:#[\w-]*)?\)", (ROOT / page).read_text(encoding="utf-8")):
        assert "made/" in target or (ROOT / page).parent.joinpath(target).is_file(), f"{page}: {target}"


@pytest.mark.parametrize("page", PAGES)
def test_inserts_are_filled_in(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    assert len(re.findall("<!-- insert", text)) == len(LINE.findall(text))
    assert "<!-- insert" not in filled(text)


def test_the_reference_of_commands_is_complete():
    text = command_reference()
    assert all(f"\n## mapbench {name}\n" in f"\n{text}" for name in COMMANDS)
    assert "### mapbench maps draw" in text
    assert "| `--fail-if RULE` |" in text


@pytest.mark.parametrize("root", options.ROOTS)
def test_every_option_is_described(root):
    text = options.option_reference(root) + options.family_reference() + options.planner_reference()
    text += options.smoother_reference() + options.layer_reference()
    rows = re.findall(r"^\| `(\w+)` \| (.*?) \| .* \| .* \|$", text, re.MULTILINE)
    assert len(rows) > 40
    assert [name for name, about in rows if not about.strip()] == []


def test_all_names_are_on_the_page():
    shown = {words[0] for name, words in inserts_of("docs/reference/names.md") if name == "names"}
    assert shown == set(KINDS)


def inserts_of(page):
    return [(name, words.split()) for name, words in LINE.findall((ROOT / page).read_text(encoding="utf-8"))]


def test_every_kind_of_insert_is_used():
    assert {name for page in PAGES for name, _ in inserts_of(page)} == set(INSERTS)


@pytest.mark.parametrize("kept", sorted(KEPT.iterdir()), ids=lambda path: path.name)
def test_kept_runs_are_read(kept):
    run = load_run(kept)
    assert run.finished
    assert run.best_results["validation"]["goals"] >= 0.97 * run.best_results["validation"]["runs"]
    assert sum(path.stat().st_size for path in kept.iterdir()) < 350_000


def test_a_run_is_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(gallery, "KEPT", tmp_path)
    source = next(KEPT.iterdir())
    gallery.keep(source, "again")
    assert load_run(tmp_path / "again").best == load_run(source).best


def searches(name, fitness):
    """Results of a study with one configuration."""
    runs = [{"configuration": name, "seed": seed, "fitness": value, "extra": 1} for seed, value in fitness.items()]
    return [dict.fromkeys(thesis_study.COLUMNS["runs"], 0.5) | row for row in runs]


def test_parts_of_the_thesis_study_add_up(tmp_path, monkeypatch):
    parts = iter(
        [searches("gini_20", {1: -4.0, 0: -5.0}), searches("gini_40", {0: -6.0}), searches("gini_20", {1: -7.0})]
    )
    monkeypatch.setattr(thesis_study, "KEPT", tmp_path)
    monkeypatch.setattr(
        thesis_study,
        "load_results",
        lambda study: SimpleNamespace(
            by_configuration={}, runs=[], rows=lambda table="runs": next(parts) if table == "runs" else []
        ),
    )
    for _ in range(3):
        thesis_study.keep(tmp_path)
    found = [(row["configuration"], row["seed"], row["fitness"]) for row in thesis_study.kept("runs")]
    assert found == [("gini_20", 0, -5.0), ("gini_20", 1, -7.0), ("gini_40", 0, -6.0)]
    assert "extra" not in thesis_study.kept("runs")[0]


@pytest.mark.parametrize(("place", "fitness"), [(0, "-8.03"), (1, "-1.15")], ids=["mean times", "least times"])
def test_the_fitness_of_the_thesis_set_is_that_of_its_table(place, fitness):
    """Worked example: the Gini coefficients of Table 5.3's mean times are 0.444, 0.116 and 0.028."""
    ginis = [
        gini([of_controller[place] for of_controller in of_map]) for of_map in thesis_tables.THESIS_TIMES["gini_40"]
    ]
    assert f"{-20 * gini_fitness(ginis):.2f}" == fitness
    assert fitness in (ROOT / "docs/concepts/thesis.md").read_text(encoding="utf-8")


def test_the_thesis_page_lists_the_values_of_the_preset():
    search = EvolveSettings.from_mapping(load_preset("thesis")["search"], "thesis")
    shapes, mutation = search.shapes, search.ga.mutation
    chances = {mutation.move_probability, mutation.scale_probability, mutation.remove_probability}
    lines = (ROOT / "docs/concepts/thesis.md").read_text(encoding="utf-8").splitlines()
    found = {cells[1].strip(): cells[3] for line in lines if len(cells := line.split("|")) == 5}
    for row, value in {
        "number of obstacles of a new map": "{} to {},".format(*shapes.n_obstacles),
        "start and goal": f" {shapes.task_distance} free cells",
        "cleared area, border": f" {2 * shapes.cleared_distance + 1} by {2 * shapes.cleared_distance + 1} cells",
        "probability of a mutation": f"{mutation.probability} for each offspring, {mutation.maps} its maps",
        "changed obstacles k": "{} to {} on each map".format(*mutation.shapes_per_map),
        "the four operators": f"{chances.pop()} each; moves up to {mutation.move_distance} cells",
        "connected components": f"{mutation.connectivity} neighbours",
        "two equal coefficients": f"costs {-gain(search.judging, NO_PATTERN):,.0f} times s".replace(",", " "),
    }.items():
        assert value in found[row]
    assert not chances
    assert "factors {} to {}".format(*mutation.scale_factor) in found["the four operators"]
    assert search.judging.timeout_outcomes == ("timeout",)


def test_the_thesis_page_counts_every_kept_search():
    runs = thesis_study.kept("runs")
    for line, name in zip(thesis_tables.thesis_sizes().splitlines()[2:5], thesis_tables.THESIS_SIZES, strict=True):
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        values = [row["fitness"] for row in runs if row["configuration"] == name]
        assert cells[2] == str(len(values))
        assert cells[3].startswith(f"{sum(values) / len(values):.2f} (")


def test_docstrings_are_read():
    def example(first, second):
        """Do something.

        ::

            file    what it is

        Args:
            first: With a ``word``, and
                a second line.
            second: See :class:`~some.module.Name`.
        """

    assert arguments(example) == {"first": "With a `word`, and a second line.", "second": "See `Name`."}
    assert block_of(example) == "file    what it is"
    assert plain("so:\n\n::\n\n    code") == "so:\n\nFor example:\n\n    code"


def test_cells_are_labelled_with_their_columns():
    heads, row = (
        '<tr>\n<th>a <code>b</code></th>\n<th>c &lt; "d"</th>\n</tr>',
        "<tr>\n<td>1</td>\n<td><em>2</em></td>\n</tr>",
    )
    page = f"<table>{heads}{row}{row}</table><td>"
    cells = '<tr>\n<td data-label="a b">1</td>\n<td data-label="c &lt; &quot;d&quot;"><em>2</em></td>\n</tr>'
    assert labelled(page) == f"<table>{heads}{cells}{cells}</table><td>"


@pytest.mark.parametrize("film", ["controllers.gif", "policy.gif", "playground.gif"])
def test_the_films_move_and_are_small(film):
    path = ROOT / "docs" / film
    assert path.stat().st_size < 3_000_000
    with Image.open(path) as picture:
        assert picture.n_frames > 30


def test_cells_of_tables_are_escaped():
    assert table(["a"], [["x | `<b>` <i>"]]).splitlines()[-1] == "| x \\| `<b>` &lt;i> |"
