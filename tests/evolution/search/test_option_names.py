"""Names of options: flat files of earlier versions, and directories that they wrote, are read as before."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from evolution import load
from evolution.api import compose
from evolution.runs import RunDir, experiment_in, load_run
from evolution.search import EvolveSettings, load_preset, nested, nested_document, read_document, short_names
from evolution.search.option_names import SECTIONS, SHORT_NAMES
from evolution.studies import StudySettings
from gym_mapbench.errors import ConfigError
from tests.evolution.search.test_loop import go_on, reproducible_files, run, with_search

EARLIER_RUN = Path(__file__).parents[1] / "earlier_run"

FLAT = {
    "thesis": "search: {fitness: gini, pop_size: 40, evaluations: 600, maps_per_set: 3}",
    "robust": """
search:
  fitness: gini
  maps_per_set: 3
  pop_size: 16
  evaluations: 100000
  runs: 3000
  families:
    # Nearly equal gates in a line, where MPPI is slow most steadily; then motifs of all kinds.
    - name: gates
      options:
        routes: [diagonal]
        pitch: [1.5, 1.65]
        thickness: [0.25, 0.45]
        shift: [-0.1, 0.1]
        slope: [-0.05, 0.05]
        swing: [0.0, 0.1]
        deviation: [0.0, 0.03]
    - gates
    - pillar_rows
    - bends
    - baffles
    - sequences
  aggregate: median
  archive: true
  elite_seeds: 4
  parents: true
  surrogate: true
  caution: 0.5
  confirmation: {seeds: 5, candidates: 10, claim_seeds: 10, reliability: 0.9}
  mutation:
    probability: 1.0
    maps: one
    drivable: true
    adaptive: true
    move_probability: 0.15
    scale_probability: 0.1
    remove_probability: 0.1
    add_probability: 0.1
    operators: {nudge: 0.1, near_way: 0.15, door: 0.1, redraw: 0.2}
""",
}
"""The search of the presets in the words of earlier versions."""


def search_in(text):
    return yaml.safe_load(text)["search"]


@pytest.mark.parametrize("name", ["thesis", "robust", "quick"])
def test_presets_as_they_were_mean_the_same(name):
    flat = search_in(FLAT.get(name, FLAT["robust"]))
    flat |= {"runs": 1000} if name == "quick" else {}
    was, now = (
        EvolveSettings.from_mapping(flat, "file"),
        EvolveSettings.from_mapping(load_preset(name)["search"], "preset"),
    )
    assert was == now
    assert nested(flat) == nested(load_preset(name)["search"])


def test_a_flat_file_is_laid_over_a_preset(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "search: {pop_size: 12, archive: false, elite_seeds: 0, confirmation: {claim_seeds: 4}, runs: 2000}"
    )
    search = EvolveSettings.from_mapping(compose("robust", read_document(path), fitness="roles")["search"], "mine")
    robust = EvolveSettings.from_mapping(load_preset("robust")["search"], "robust")
    changes = {"pop_size": 12, "elite": False, "elite_seeds": 0, "fitness": "roles", "runs": 2000}
    assert search == robust.replace(**changes, validation=robust.validation.replace(held_out_seeds=4))


def test_short_names_are_those_of_one_section_each():
    names = [name for model in SECTIONS.values() for name in model.model_fields]
    assert len({*names, *EvolveSettings.model_fields}) == len(names) + len(EvolveSettings.model_fields)
    assert set(names) == set(SHORT_NAMES)
    options = EvolveSettings(pop_size=7, fitness="pairs", drive_last=[])
    assert (options.ga.pop_size, options.judging.fitness, options.archive.staged) == (7, "pairs", False)
    assert EvolveSettings(**short_names(options.model_dump())) == options
    assert options.replace(caution=2.0, ga={"pop_size": 9}).judging == options.judging.replace(caution=2.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"pop_size": 4, "ga": {"pop_size": 5}}, r"^ga\.pop_size: expected once, got it under two names"),
        ({"confirmation": None, "validation": {}}, r"^validation: expected once, got it under two names"),
        ({"pop_sise": 4}, r"^unknown key 'pop_sise'; did you mean 'pop_size'\?"),
        ({"ga": {"pop_sise": 4}}, r"^ga: unknown key 'pop_sise'; did you mean 'pop_size'\?"),
        ({"failures": "par3"}, r"^judging\.failures: unknown failure policy 'par3'; did you mean 'par2'\?"),
        ({"judging": {"base_cost": -1}}, r"^judging\.base_cost: expected greater than or equal to 0, got -1"),
        ({"mutation": {"adaptive": True}}, r"^ga\.mutation\.adaptive: expected maps 'one' beside it, got 'all'"),
        ({"ga": 3}, r"^ga: expected a mapping of options, got 3"),
    ],
)
def test_messages_name_the_section(options, message):
    with pytest.raises(ConfigError, match=message):
        EvolveSettings(**options)


def test_an_option_under_two_names_is_said_with_its_file(tmp_path):
    (tmp_path / "both.yaml").write_text("search: {fitness: gini, judging: {fitness: roles}}")
    with pytest.raises(
        ConfigError, match=r"both\.yaml: search: judging\.fitness: expected once, got it under two names"
    ):
        read_document(tmp_path / "both.yaml")


def written_before(path):
    """Give the files of a run the names that earlier versions wrote."""
    config = json.loads((path / "config.json").read_text())
    search = short_names(config["search"])
    search["archive"] = search.pop("elite")
    if stage := search.pop("validation"):
        stage["claim_seeds"] = stage.pop("held_out_seeds")
    (path / "config.json").write_text(json.dumps({**config, "search": {**search, "confirmation": stage}}))
    results = (path / "best_results.json").read_text().replace('"validation"', '"confirmation"')
    (path / "best_results.json").write_text(results.replace('"score"', '"reading"'))
    table = (path / "individuals.csv").read_text()
    (path / "individuals.csv").write_text(table.replace("score_", "reading_"))


def test_a_directory_of_an_earlier_version_is_read_and_continued(tmp_path):
    options = {"runs": 300, "evaluations": 10_000, "pop_size": 6, "elite": True, "seed": 3}
    experiment = with_search(**options, validation={"seeds": 2, "candidates": 6, "held_out_seeds": 3})
    run(tmp_path, experiment)
    now, files = load_run(tmp_path), reproducible_files(tmp_path)
    written_before(tmp_path)
    assert "reading_1" in (tmp_path / "individuals.csv").read_text()
    before = load_run(tmp_path)
    assert (before.config, before.best_results, before.individuals) == (now.config, now.best_results, now.individuals)
    go_on(RunDir.open(tmp_path), experiment)
    assert reproducible_files(tmp_path) | {"config.json": b""} == files | {"config.json": b""}


def test_a_run_that_an_earlier_version_wrote_is_read():
    config = json.loads((EARLIER_RUN / "config.json").read_text())
    assert "fitness" in config["search"]
    found = nested_document(config, "config.json")["search"]
    assert found["judging"]["fitness"] == config["search"]["fitness"]
    loaded = load(EARLIER_RUN)
    assert len(loaded.best) == len(loaded.best_results["maps"])
    assert loaded.best_results["validation"]["seeds"] == config["search"]["confirmation"]["claim_seeds"]
    assert experiment_in(loaded).search.validation.held_out_seeds == config["search"]["confirmation"]["claim_seeds"]


def test_a_flat_study_means_the_same():
    flat = {"fitness": "cluster", "pop_size": 4, "confirmation": None}
    sections = {"judging": {"fitness": "cluster"}, "ga": {"pop_size": 4}, "validation": None}
    studies = [
        StudySettings(name="a", experiment={"search": search}, configurations=[{"name": "ga"}])
        for search in (flat, sections)
    ]
    assert studies[0] == studies[1]
