"""The page: self-contained, true to what it shows, and never written over somebody's file."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
import zipfile
from base64 import b64decode
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import yaml

from evolution.benchmark import BENCHMARK
from evolution.cli import main
from evolution.pictures import drive_best
from evolution.report import replay_page
from evolution.report.page import Attachment, Report, Section, Table, render_page
from evolution.report.replays import ReplayedMap, replays_of, stuck_spots
from evolution.report.study_page import report_of_study
from evolution.report.writing import write_report
from evolution.runs import load_run
from evolution.studies import StudySettings, load_results
from evolution.studies.analysis.comparisons import analyse
from evolution.studies.analysis.figures import drive_best_sets, write_study_figures
from gym_mapbench.errors import ConfigError, PluginError, RunError
from tests.evolution.fake_study import drive, part_of, small_study

pytestmark = pytest.mark.usefixtures("fake_driving")


class Page(HTMLParser):
    """What a page refers to, its texts and its scripts' data."""

    def __init__(self, text):
        super().__init__()
        self.references, self.texts, self.data, self.inside = [], [], "", ""
        self.downloads = {}
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        named = dict(attributes)
        self.inside = named.get("id", tag) if tag == "script" else tag
        self.references += [named[key] for key in ("src", "href") if key in named]
        if "download" in named:
            self.downloads[named["download"]] = b64decode(named["href"].split("base64,")[1])

    def handle_endtag(self, tag):
        self.inside = ""

    def handle_data(self, text):
        if self.inside == "replays":
            self.data += text
        else:
            self.texts.append(text)

    @property
    def text(self):
        return " ".join(" ".join(self.texts).split())


@pytest.fixture(scope="module")
def results(study_path):
    return load_results(study_path)


@pytest.fixture(scope="module")
def best_sets(results):
    return drive_best_sets(results)


@pytest.fixture(scope="module")
def page(results, best_sets):
    return Page(render_page(report_of_study(analyse(results), best_sets)))


def test_nothing_is_loaded_from_elsewhere(page):
    assert page.references
    assert all(reference.startswith(("#", "data:")) for reference in page.references)


class Unscripted(HTMLParser):
    """Collects the texts of a page that are seen without JavaScript, where elements of the class scripted are not."""

    def __init__(self, page):
        super().__init__()
        self.open, self.texts = [], []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        if tag not in ("meta", "link", "input", "img", "wbr", "br"):
            self.open.append((tag, "scripted" in (dict(attributes).get("class") or "").split()))

    def handle_endtag(self, tag):
        assert self.open.pop()[0] == tag

    def handle_data(self, data):
        if not any(hidden or tag in ("script", "style") for tag, hidden in self.open):
            self.texts.append(data)


def test_what_needs_javascript_is_hidden_without_it(results, best_sets):
    page = render_page(report_of_study(analyse(results), best_sets))
    assert "<noscript><style>.scripted { display: none; }</style></noscript>" in page
    shown = " ".join(Unscripted(page).texts)
    assert "The replays need JavaScript" in shown
    for text in ("Play", "overlaid", "Click on", "The space key", "Ring: start"):
        assert text in page
        assert text not in shown


def test_the_styles_load_nothing_either():
    style = "".join(re.findall(r"<style>(.*?)</style>", render_page(Report("t", "s", [], "c", "y")), flags=re.DOTALL))
    assert "prefers-color-scheme: dark" in style
    assert not re.search(r"@import|url\(|//", style)


def test_the_verdict_comes_first_and_every_configuration_is_there(page):
    assert page.text.index("has the best median") < page.text.rindex("Maps and replays")
    for name in small_study().names:
        assert name in page.text
    for words in (
        "Held-out minus reported fitness",
        "Table 5.2",
        "Tables 5.3 and 5.4",
        "Every pair of configurations",
        "Kruskal-Wallis",
    ):
        assert words in page.text


def test_replays_are_the_driven_runs(page, best_sets):
    data = json.loads(page.data)
    assert data["controllers"] == ["dwb", "mppi", "rpp"]
    assert len(data["groups"]) == len(small_study().configurations)
    assert len(data["maps"]) == 3 * len(data["groups"])
    shown, driven = data["maps"][0], best_sets[0].maps[0]
    run, episode = shown["runs"][1], driven.episodes[1]
    assert (run["controller"], run["outcome"]) == ("mppi", episode.outcome)
    assert run["time"] == pytest.approx(episode.time, abs=1e-3)
    assert (run["x"][-1], run["y"][-1]) == pytest.approx(tuple(episode.trajectory[-1, :2]), abs=1e-3)
    assert [mark["kind"] for mark in run["marks"]] == ["spin", "contact"]
    walls = np.zeros(driven.episodes[0].scenario.map.shape, dtype=bool)
    for col, row, cols, rows in shown["walls"]:
        assert not walls[row : row + rows, col : col + cols].any()
        walls[row : row + rows, col : col + cols] = True
    assert np.array_equal(walls, driven.episodes[0].scenario.map.occupancy)


def test_downloads_repeat_the_study(page, results):
    assert StudySettings(**yaml.safe_load(page.downloads["study.yaml"])) == results.settings
    assert len(list(csv.DictReader(io.StringIO(page.downloads["runs.csv"].decode())))) == 14
    with zipfile.ZipFile(io.BytesIO(page.downloads["best_map_sets.zip"])) as archive:
        assert archive.namelist() == [f"{name}.json" for name in small_study().names]
        assert json.loads(archive.read("gini_6.json"))["maps"]


def test_equal_studies_give_equal_pages(results, best_sets):
    pages = [render_page(report_of_study(analyse(results), drive_best_sets(results))) for _ in range(2)]
    assert pages[0] == pages[1]


@pytest.mark.usefixtures("blank_figures")
def test_a_partial_study_says_what_is_missing(study_path, tmp_path):
    path = part_of(study_path, tmp_path / "part", ["gini_6"])
    shutil.rmtree(path / "reevaluation")
    written = write_report(path)
    assert written == path / "report.html"
    text = Page(written.read_text()).text
    assert "This report is partial:" in text
    assert "differ from what was recorded" not in text
    assert "random: none of its 2 searches was begun" in text
    assert "gini_6, seed 0: not re-evaluated yet" in text
    assert "It is the only configuration." in text
    shutil.rmtree(path / "runs")
    assert "No search of this study is finished" in Page(write_report(path).read_text()).text


def test_a_run_that_cannot_be_loaded_makes_way(study_path, tmp_path):
    path = tmp_path / "damaged"
    shutil.copytree(study_path, path)
    results = load_results(path)
    best = min(results.of("gini_6"), key=lambda run: run.fitness)
    for run in [best, *results.of("random")]:
        (run.path / "best_map_set.json").write_text("{")
    best_sets = drive_best_sets(results)
    other = next(run for run in results.of("gini_6") if run is not best)
    assert best_sets[0].run is other
    assert "random" not in [best.run.configuration.name for best in best_sets]
    text = Page(render_page(report_of_study(analyse(results), best_sets))).text
    assert f"gini_6: the best search (seed {best.seed}) could not be loaded and re-run; seed {other.seed}" in text
    assert "random: no replay, none of its best sets could be loaded and re-run" in text


def test_changed_replays_have_a_heading_of_their_own(results, best_sets, monkeypatch):
    monkeypatch.setattr("evolution.pictures.run_figures.drive", lambda job: replace(drive(job), time=1.0))
    text = Page(render_page(report_of_study(analyse(results), drive_best_sets(results)))).text
    assert "Replays that differ from what was recorded:" in text
    assert "gini_6: The replay of dwb on map_1 ends with goal after 1.00 s; the search recorded goal after" in text
    assert "This report is partial" not in text


def test_the_subtitle_names_the_controllers_of_all(results):
    run = results.runs[-1]
    fewer = replace(run.experiment, controllers=run.experiment.controllers[1:])
    mixed = replace(results, runs=(replace(run, experiment=fewer, reevaluation=None), *results.runs[:1]))
    assert "controllers mppi, rpp, dwb; 2 searches" in report_of_study(analyse(mixed)).subtitle


def test_what_holds_by_construction_is_marked(page):
    assert "Without best_of_random: never worse than another configuration by construction." in page.text
    assert page.text.count("Pairs by construction are not tested") == 1


@pytest.mark.usefixtures("blank_figures")
def test_long_names_of_judges_are_short_names_of_files(results, tmp_path):
    long = {"pattern_weight": 21.125, "unevenness_weight": 2.0625, "base_cost": 99.0, "timeout_cost": 11.0}
    run = results.runs[0]
    runs = []
    for place, epsilon in enumerate((0.001, 0.002)):
        search = run.experiment.search.replace(**long, epsilon=epsilon)
        configuration = results.settings.configurations[place]
        runs.append(replace(run, configuration=configuration, experiment=replace(run.experiment, search=search)))
    figures = write_study_figures(analyse(replace(results, runs=tuple(runs))), [], tmp_path)
    names = [figure.png.name for figure in figures if figure.png.name.startswith("progress")]
    assert len(set(names)) == 2
    assert max(map(len, names)) < 110


def test_a_run_has_a_page_of_its_own(study_path, tmp_path):
    shutil.copytree(study_path / "runs" / "gini_6" / "seed-0000", tmp_path / "my run")
    page = Page(write_report(tmp_path / "my run", tmp_path / "page.html").read_text())
    assert "mapbench evolve --config config.yaml --out 'my run'" in page.text
    assert "The search improved the best fitness" in page.text
    assert set(page.downloads) == {"config.yaml", "best_map_set.json", "generations.csv"}
    assert set(yaml.safe_load(page.downloads["config.yaml"])) == {"search", "controllers", "run"}
    assert page.data.count('"controller":"dwb"') == 3


@pytest.mark.usefixtures("blank_figures")
def test_files_of_others_are_left_alone(study_path, tmp_path):
    shutil.copytree(study_path / "runs" / "gini_6" / "seed-0000", tmp_path / "run")
    mine = tmp_path / "mine.html"
    mine.write_text("mine")
    with pytest.raises(ConfigError, match=r"mine\.html: exists already; nothing is overwritten"):
        write_report(tmp_path / "run", mine)
    with pytest.raises(ConfigError, match="exists already"):
        write_report(tmp_path / "run", tmp_path)
    with pytest.raises(
        ConfigError, match=r"^-: expected the name of a file; a page is not written to standard output$"
    ):
        write_report(tmp_path / "run", "-")
    assert mine.read_text() == "mine"
    (tmp_path / "run" / "report.html").write_text("the last one")
    assert write_report(tmp_path / "run", tmp_path / "run" / "report.html").stat().st_size > 10_000
    with pytest.raises(RunError, match=r"expected the directory of a run \(config.json\), study"):
        write_report(tmp_path, tmp_path / "page.html")
    (tmp_path / BENCHMARK.mark).touch()
    with pytest.raises(RunError, match=r"the page of a benchmark is written by its own command, with --resume --html"):
        write_report(tmp_path, tmp_path / "page.html")
    with pytest.raises(ConfigError, match=r"page\.html: there is no directory"):
        write_report(tmp_path / "run", tmp_path / "none" / "page.html")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{run}", "--map", "2"], "--map: expected only with --gif or --mp4"),
        (["{run}", "--out", "a.html", "--gif", "a.gif"], "--out: expected without --gif and --mp4"),
        (["{run}", "--gif", "a.txt"], "a.txt: expected a name that ends in .gif or .mp4"),
        (["{run}", "--gif", "a.gif", "--configuration", "x"], "--configuration: expected only with a study"),
        (["nowhere"], "nowhere: expected the directory of a run (config.json), study (study.json)"),
    ],
)
def test_wrong_commands_are_one_line(arguments, message, study_path, capsys):
    run = str(study_path / "runs" / "gini_6" / "seed-0000")
    assert main(["report", *[argument.format(run=run) for argument in arguments]]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"mapbench report: {message}")
    assert error.count("\n") == 1


def test_text_cannot_break_the_page():
    nasty = "</script><b>&"
    report = Report(
        nasty,
        nasty,
        [nasty],
        nasty,
        nasty,
        sections=[Section(nasty, [nasty], [Table(nasty, [nasty], [[nasty]])])],
        missing=[nasty],
    )
    text = render_page(report)
    assert nasty not in text
    assert text.count("</script>") == 2


@pytest.mark.parametrize("name", ["<!--", "</script>", "<!--<script>", "a < b"])
def test_any_name_is_read_by_the_replays(name, best_sets):
    shown = ReplayedMap(name, best_sets[0].maps[0].episodes)
    page = Page(render_page(Report("a", "", [], "", "", [shown])))
    assert [one["title"] for one in json.loads(page.data)["maps"]] == [name]


def test_numbers_as_a_reader_wants_them():
    table = Table("t", ["a"], [[0.12345], [3], [float("nan")], [0.00001234]], "Note.")
    text = render_page(Report("t", "s", [], "c", "y", sections=[Section("s", tables=[table])]))
    cells = re.findall(r'<td class="number" data-label="a" data-sort="(.*?)">(.*?)</td>', text)
    assert cells == [("0.12345", "0.123"), ("3.0", "3"), ("", "-"), ("1.234e-05", "1.23e-05")]
    assert '<th scope="col" class="number">a</th>' in text


@pytest.mark.parametrize(
    ("column", "keys"),
    [
        (["9/12", "10/12", ""], ["9", "10", ""]),
        (["9/12", "-", "10/12"], ["9", "", "10"]),
        (["own", "-"], [None, None]),
        (["-27.9 (-30 to -20)", "9.5 (8 to 11)", "1e+03"], ["-27.9", "9.5", "1e+03"]),
        (["2025_hall", "10/12", "3"], [None, None, None]),
    ],
)
def test_texts_sort_by_the_numbers_that_all_of_them_begin_with(column, keys):
    table = Table("t", ["a"], [[cell] for cell in column])
    text = render_page(Report("t", "s", [], "c", "y", sections=[Section("s", tables=[table])]))
    cells = re.findall(r'<td data-label="a"(.*?)>(.*?)</td>', text)
    attributes = ["" if key is None else f' data-sort="{key}"' for key in keys]
    assert cells == list(zip(attributes, column, strict=True))


def test_wide_pictures_get_the_whole_width():
    header = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"
    assert Attachment("a", "image/png", header + (300).to_bytes(4, "big") + (100).to_bytes(4, "big")).wide
    assert not Attachment("a", "image/png", header + (200).to_bytes(4, "big") + (100).to_bytes(4, "big")).wide
    assert not Attachment("a", "image/svg+xml", b"<svg>").wide


def test_stuck_spots_by_hand():
    drive = np.column_stack([np.linspace(0, 2, 41), np.zeros(41)])
    stand = np.repeat(drive[-1:], 50, axis=0)
    go_on = drive + drive[-1]
    states = np.vstack([drive, stand, go_on])
    ((x, y, start, end),) = stuck_spots(states, 0.1)
    assert (x, y) == pytest.approx((2.0, 0.0), abs=0.1)
    assert start == pytest.approx(4.0, abs=0.3)
    assert end == pytest.approx(9.0, abs=0.3)
    assert stuck_spots(drive, 0.1) == []
    assert stuck_spots(stand[:10], 0.1) == []


def test_a_run_that_a_plugin_now_fails_in_has_no_replay(study_path, monkeypatch, caplog):
    def drive(job):
        raise PluginError(f"controller {job.controller.name!r}: KeyError, mine.py line 3")

    monkeypatch.setattr("evolution.pictures.run_figures.drive", drive)
    assert not any(one.episodes for one in drive_best(load_run(study_path / "runs" / "gini_6" / "seed-0000")))
    assert "no replay of rpp on map_1: controller 'rpp': KeyError, mine.py line 3" in caplog.messages


def test_replays_alone_need_no_verdict(study_path):
    run = load_run(study_path / "runs" / "gini_6" / "seed-0000")
    page = Page(replay_page(run, drive_best(run)))
    assert len(json.loads(page.data)["maps"]) == 3
    assert "Maps and replays" in page.text
    for words in ("Verdict", "Repeat it", "Configuration as used"):
        assert words not in page.text


def test_no_replay_no_board():
    assert replays_of([])["maps"] == []
    assert ReplayedMap("a", []).group == ""


def best_fitness(run):
    best = run.generations[-1]["best"]
    return Section("My <own> section", [f"It ended at {best:.2f}."], [Table("Best", ("fitness",), [[best]])])


def silent(run):
    return None


def lost(run):
    return {}["nothing"]


def mistaken(run):
    return "<p>text</p>"


def uneven(run):
    return Section("x", tables=[Table("t", ("a", "b"), [[1]])])


def changes(run):
    for entry in run.best_results["maps"]:
        for runs in entry["runs"].values():
            runs[0]["time_s"] = 1.0


HERE = "tests.evolution.report.test_report"


@pytest.fixture
def run_path(study_path, tmp_path):
    return shutil.copytree(study_path / "runs" / "gini_6" / "seed-0000", tmp_path / "run")


@pytest.mark.usefixtures("blank_figures")
def test_sections_of_ones_own(run_path):
    names = [f"{HERE}:{name}" for name in ("best_fitness", "silent", "lost", "mistaken", "uneven")]
    page = Page(write_report(run_path, sections=names).read_text())
    assert "#section-3" in page.references
    assert "My <own> section It ended at" in page.text
    assert page.text.index("Figures Click") < page.text.index("It ended at") < page.text.index("mapbench evolve")
    for words in (
        "lost': KeyError: 'nothing', test_report.py line",
        "mistaken': expected a Section or None, got a str",
        "table 't': expected 2 cells in every row",
    ):
        assert words in page.text
    assert page.text.count("report section '") == 2


def test_a_section_of_ones_own_cannot_change_the_rest_of_the_page(run_path):
    assert write_report(run_path, sections=[f"{HERE}:changes"]).read_text() == write_report(run_path).read_text()


def test_sections_that_are_not_there(run_path, study_path):
    with pytest.raises(ConfigError, match="unknown report section 'tabels'; did you mean 'tables'"):
        write_report(run_path, sections=["tabels"])
    assert not (run_path / "report.html").exists()
    with pytest.raises(ConfigError, match="sections: expected only of a run"):
        write_report(study_path, sections=["tables"])
