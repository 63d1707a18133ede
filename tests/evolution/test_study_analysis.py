"""What a study says: fresh seeds, comparisons, tables, verdict; by hand-made runs with known answers."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from evolution.fitness import Fitness
from evolution.jobs import RunResult
from evolution.settings import EvolveSettings, Experiment
from evolution.study import Configuration, StudyResults, StudyRun, StudySettings, load_results
from evolution.study.comparisons import compare, judge_of
from evolution.study.reevaluation import Reevaluation, judge
from evolution.study.tables import map_rows, pair_rows, rank_rows, repeat_rows, summary_rows, test_rows, write_tables
from evolution.study.verdict import verdict_of
from gym_mapbench.errors import ConfigError
from tests.evolution.fake_runs import CONTROLLERS
from tests.evolution.fake_study import ENGINE, FakeWorld

GINI = Fitness.of(EvolveSettings(), 150.0)


def goal(time):
    return RunResult("goal", float(time), 1.0)


def set_of(*maps):
    """Results of maps, each a list of repeats of the three controllers' times; None is a timeout."""
    return tuple(
        tuple(
            tuple(goal(t) if t else RunResult("timeout", 150.0, 1.0) for t in of_one)
            for of_one in zip(*rows, strict=True)
        )
        for rows in maps
    )


ALIKE, TWICE, FAR = [5, 5, 5], [1, 1, 4], [0.1, 0.1, 9]


def made_run(name, seed, seen, fresh=None, results=(), readings=(0.1, 0.2, 0.3), **search):
    """A run whose best set has this fitness, seen and on every fresh seed."""
    experiment = Experiment(EvolveSettings(seed=seed, **search), CONTROLLERS, FakeWorld())
    entries = [
        {
            "name": f"map_{i}",
            "reading": r,
            "runs": {spec.name: [{"time_s": 9.0, "outcome": "goal"}] for spec in CONTROLLERS},
        }
        for i, r in enumerate(readings, start=1)
    ]
    document = {
        "fitness": seen,
        "cluster_scale": None,
        "success_rate": 1.0,
        "map_set": f"{name}{seed}",
        "maps": entries,
    }
    generations = [{"evaluations": 600, "best": seen}]
    again = None
    if fresh is not None:
        one = GINI(set_of([ALIKE], [TWICE], [FAR]))
        one = type(one)(**{**vars(one), "total": fresh})
        again = Reevaluation(results, (one,), (one,), readings)
    return StudyRun(Configuration(name=name), seed, Path(name), experiment, generations, document, [], again)


def made_study(*runs):
    names = list(dict.fromkeys(run.configuration.name for run in runs)) or ["none"]
    settings = StudySettings(name="made", configurations=[{"name": name} for name in names])
    return StudyResults(Path("made"), settings, "0", {}, {}, tuple(runs), ())


def spread(middle, n=12, step=0.05):
    return [middle + step * (i - n / 2) for i in range(n)]


def groups(**means):
    """Twelve runs of each configuration around a mean, the same seen and fresh."""
    return made_study(
        *[made_run(name, seed, value, value) for name, mean in means.items() for seed, value in enumerate(spread(mean))]
    )


def test_every_fresh_seed_is_judged_alone():
    results = set_of([ALIKE, FAR], [TWICE, TWICE], [FAR, ALIKE])
    one = judge(results, GINI, 1)
    assert [f.readings for f in one] == [
        pytest.approx(
            (
                0.0,
                1 / 3,
                0.645,
            ),
            abs=1e-3,
        ),
        pytest.approx((0.645, 1 / 3, 0.0), abs=1e-3),
    ]
    both = judge(results, GINI, 2)
    assert len(both) == 1
    assert both[0].values[1] == (1.0, 1.0, 4.0)
    assert both[0].values[0] == (2.55, 2.55, 7.0)
    # Three runs of two at a time: the third has no partner.
    assert len(judge(set_of([ALIKE] * 3, [TWICE] * 3, [FAR] * 3), GINI, 2)) == 1
    # Fewer than the search used: judged as they are.
    assert len(judge(set_of([ALIKE]), GINI, 3)) == 1


def test_order_and_curse_by_hand():
    results = set_of([ALIKE, FAR, ALIKE], [TWICE, TWICE, [None, 1, 4]], [FAR, ALIKE, FAR])
    singles = judge(results, GINI, 1)
    again = Reevaluation(results, singles, singles, (0.0, 0.3, 0.6))
    assert again.order_kept == pytest.approx(1 / 3)  # once as seen, once reversed, once a map without a reading
    assert again.success_rate == pytest.approx((1 + 1 + 8 / 9) / 3)
    assert again.fitness == np.median([one.total for one in singles])
    assert np.isnan(Reevaluation(results, singles, singles, (0.0, None, 0.6)).order_kept)
    run = made_run("a", 0, -8.0, -6.5)
    assert run.winners_curse == pytest.approx(1.5)
    assert np.isnan(made_run("a", 0, -8.0).winners_curse)


def test_only_one_fitness_is_compared_at_a_time():
    study = made_study(
        *[made_run("a", s, -8.0 - s, -7.0) for s in range(3)],
        *[made_run("b", s, -5.0 - s, -4.0) for s in range(3)],
        *[made_run("c", s, -15.0, -14.0, fitness="cluster", cluster_scale=2.7) for s in range(3)],
    )
    found = compare(study)
    assert [(one.judge, one.quantity, sorted(one.values)) for one in found] == [
        ("gini fitness", "fitness", ["a", "b"]),
        ("gini fitness", "fresh_fitness", ["a", "b"]),
        ("cluster fitness (cluster_scale 2.7)", "fitness", ["c"]),
        ("cluster fitness (cluster_scale 2.7)", "fresh_fitness", ["c"]),
    ]
    assert found[2].pairs == []
    assert found[2].ranking is None
    assert judge_of(EvolveSettings(metric="path_length", repeats=3)) == "gini fitness (metric path_length)"


def test_populations_are_those_that_differ_in_nothing_else():
    study = made_study(
        *[made_run("p20", s, v, pop_size=20) for s, v in enumerate(spread(-8.0))],
        *[made_run("p40", s, v, pop_size=40) for s, v in enumerate(spread(-8.1))],
        *[made_run("twice", s, v, pop_size=40, repeats=2) for s, v in enumerate(spread(-8.1))],
    )
    (one,) = compare(study)
    (test,) = one.populations
    assert test.groups == ("p20", "p40")
    assert test.n == (12, 12)
    assert {row["test"] for row in test_rows(one)} == {"Kruskal-Wallis", "Friedman"}


def test_ranks_use_the_seeds_that_all_share():
    study = made_study(
        *[made_run("a", s, -9.0 - s) for s in range(5)],
        *[made_run("b", s, -6.0 - s) for s in range(1, 6)],
        *[made_run("c", s, -3.0 - s) for s in range(2, 9)],
    )
    (one,) = compare(study)
    assert one.ranking.seeds == (2, 3, 4)
    assert one.ranking.ranks == pytest.approx([1, 2, 3])
    assert [row["configuration"] for row in rank_rows(one)] == ["a", "b", "c"]
    assert one.ranking.test.effect == pytest.approx(1.0)


def test_a_clear_difference_is_said_with_all_its_numbers():
    study = groups(ga=-8.0, random=-6.0)
    first, second = verdict_of(study)[:2]
    assert first.startswith(
        "Gini fitness, on fresh seeds: ga has the best median, -8.03 (mean -8.03, 95 % interval -8."
    )
    assert second == "ga beats random (2.00 behind, p < 0.001, A12 = 1.00, n = 12 and 12)."
    (row,) = pair_rows(compare(study)[0])
    assert (row["first"], row["second"]) == ("ga", "random")
    assert row["median_difference"] == pytest.approx(-2.0)
    assert row["a12"] == 0.0
    assert row["cliffs_delta"] == -1.0
    assert row["p_holm"] < 0.001
    assert [row["configuration"] for row in summary_rows(compare(study)[0])] == ["ga", "random"]


def test_no_difference_is_said_as_well():
    sentences = verdict_of(groups(ga=-8.0, random=-7.98))
    assert sentences[1].startswith("No difference could be shown between ga and random (0.02 behind, p = ")
    assert "so few" not in sentences[1]
    assert sentences[2].startswith("The population size made no difference")


def test_luck_is_said_with_its_interval():
    study = made_study(*[made_run("ga", s, -8.0, -6.0) for s in range(6)])
    assert verdict_of(study)[1] == (
        "Winner's curse (gini fitness): the searches saw a median of -8.00; driven again with fresh seeds and "
        "nominal noise the same sets are worse by 2.00 in the median (95 % interval 2.00 to 2.00, n = 6). "
        "The maps of a set kept their order on 100 % of the fresh seeds."
    )


def test_what_repeats_buy_is_said():
    study = made_study(
        *[made_run("once", s, -8.0, -5.0) for s in range(3)],
        *[made_run("thrice", s, -8.0, -7.5, repeats=3) for s in range(3)],
    )
    rows = {row["configuration"]: row for row in repeat_rows(study)}
    assert (rows["once"]["winners_curse"], rows["thrice"]["winners_curse"]) == (3.0, 0.5)
    assert verdict_of(study)[-1] == (
        "Repeats of every run in the search (once with 1: winner's curse 3.00, order kept on 100 %; thrice with 3: "
        "winner's curse 0.50, order kept on 100 %)."
    )


def test_little_is_said_about_little():
    assert verdict_of(made_study()) == ["No run of this study is finished, so there is nothing to say yet."]
    assert verdict_of(made_study(made_run("ga", 0, -8.0))) == [
        "Gini fitness, as the search saw it: ga has a median of -8.00 (mean -8.00, n = 1; lower is better). "
        "There is nothing to compare it with."
    ]
    no_pattern = verdict_of(made_study(made_run("a", 0, -8.0), made_run("b", 0, 20000.0)))[1]
    assert "b (without a pattern in the median, p = 1, A12 = 1.00, n = 1 and 1)" in no_pattern
    assert no_pattern.endswith("With so few runs none could have been shown.")


def test_maps_by_hand():
    results = set_of([[5, 6, 7], [7, None, 7]], [[5, 6, 7], [5, 6, 7]], [[None, 6, 7], [None, 6, 7]])
    rows = map_rows(made_run("ga", 3, -8.0, -7.0, results=results))
    assert len(rows) == 9
    columns = ("map", "controller", "seen_s", "mean_s", "min_s", "max_s", "goals", "runs")
    assert [rows[0][name] for name in columns] == ["map_1", "dwb", 9.0, 6.0, 5.0, 7.0, 2, 2]
    assert rows[0]["std_s"] == pytest.approx(np.sqrt(2))
    assert (rows[1]["goals"], rows[1]["otherwise"]) == (1, "1 timeout")
    assert (rows[6]["goals"], rows[6]["otherwise"]) == (0, "2 timeout")
    assert np.isnan(rows[6]["mean_s"])


def test_a_study_is_written_as_tidy_tables(study_path):
    results = load_results(study_path, ENGINE)
    files = {path.stem: path for path in write_tables(results)}
    assert set(files) == {
        "runs", "reevaluation", "generations", "summary", "tests", "pairs", "ranks", "maps", "measures", "repeats"
    }  # fmt: skip
    read = {name: list(csv.DictReader(io.StringIO(path.read_text()))) for name, path in files.items()}
    assert len(read["runs"]) == 14
    assert len(read["reevaluation"]) == 14 * 3 * 3 * 4
    assert len(read["maps"]) == 14 * 3 * 3
    assert float(read["runs"][0]["fitness"]) == results.runs[0].fitness
    assert {row["outcome"] for row in read["reevaluation"]} <= {"goal", "timeout"}
    assert {row["min_clearance"] for row in read["reevaluation"]} == {"0.2"}
    with pytest.raises(ConfigError, match="unknown table 'run'; did you mean 'runs'"):
        results.rows("run")


def test_a_study_is_a_data_frame_where_pandas_is_there(study_path):
    pytest.importorskip("pandas")
    frame = load_results(study_path, ENGINE).dataframe()
    assert frame.groupby("configuration")["fitness"].count().to_dict() == dict.fromkeys(frame["configuration"], 2)
