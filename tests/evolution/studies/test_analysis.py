"""What a study says: fresh seeds, comparisons, tables, verdict; by hand-made runs with known answers."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from evolution.driving.jobs import RunResult
from evolution.runs import RecordedExperiment, Reevaluation, judge
from evolution.search.judging import Fitness, JudgingSettings
from evolution.search.settings import EvolveSettings
from evolution.studies import Configuration, StudyResults, StudyRun, StudySettings, load_results
from evolution.studies.analysis.comparisons import analyse
from evolution.studies.analysis.held_out import conditions, held_out_rows, rank_agreement, selected_sets
from evolution.studies.analysis.judges import judges_of, name_of
from evolution.studies.analysis.reported_fitness import repeatability, reported_fitness_rows
from evolution.studies.analysis.tables import map_rows, pair_rows, rank_rows, summary_rows, test_rows, write_tables
from evolution.studies.analysis.verdict import verdict_of
from gym_mapbench.errors import ConfigError
from tests.evolution.fake_runs import CONTROLLERS

WORLD = {"time_limit": 150.0, "noise": "none"}
GINI = Fitness.of(JudgingSettings(), 150.0)


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


def made_run(
    name,
    seed,
    seen,
    fresh=None,
    *,
    results=None,
    readings=(0.1, 0.2, 0.3),
    configuration=None,
    world=None,
    controllers=CONTROLLERS,
    scale=None,
    map_set=None,
    **search,
):
    """A run whose best set has this fitness, seen and on every fresh seed."""
    specs = tuple(spec.model_dump(mode="json") for spec in controllers)
    experiment = RecordedExperiment(
        EvolveSettings(seed=seed, **search), specs, {"environment": {**WORLD, **(world or {})}}
    )
    entries = [
        {
            "name": f"map_{i}",
            "score": r,
            "runs": {spec.name: [{"time_s": 9.0, "outcome": "goal"}] for spec in controllers},
        }
        for i, r in enumerate(readings, start=1)
    ]
    document = {
        "fitness": seen,
        "cluster_scale": scale,
        "success_rate": 1.0,
        "map_set": map_set or f"{name}{seed}",
        "maps": entries,
    }
    generations = [{"evaluations": 600, "best": seen}]
    again = None
    if fresh is not None:
        results = results or set_of([ALIKE], [TWICE], [FAR])
        one = GINI(set_of([ALIKE], [TWICE], [FAR]))
        one = type(one)(**{**vars(one), "objectives": (fresh,)})
        again = Reevaluation(results, (one,), (one,), readings)
    chosen = Configuration(name=name, **(configuration or {}))
    return StudyRun(chosen, seed, Path(name), experiment, generations, document, [], again)


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
    assert [f.scores for f in one] == [
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
    assert again.ranks_kept == (True, False)  # once as seen, once reversed; once a map has no reading
    assert again.rank_agreement == 0.5
    assert again.success_rate == pytest.approx((1 + 1 + 8 / 9) / 3)
    assert again.fitness == np.median([one.fitness for one in singles])
    as_seen, _, failed = (one.fitness for one in singles)
    assert as_seen < 0.0 < failed
    assert again.mean_trial == pytest.approx((as_seen + 0.0 + failed) / 3)
    unordered = Reevaluation(results, singles, singles, (0.0, 0.3, 0.6), ordered=False)
    assert unordered.mean_trial == pytest.approx(np.mean([one.fitness for one in singles]))
    assert np.isnan(Reevaluation(results, singles, singles, (0.0, None, 0.6)).rank_agreement)
    run = made_run("a", 0, -8.0, -6.5)
    assert run.selection_bias == pytest.approx(1.5)
    assert np.isnan(made_run("a", 0, -8.0).selection_bias)


def test_only_one_fitness_is_compared_at_a_time():
    study = made_study(
        *[made_run("a", s, -8.0 - s, -7.0) for s in range(3)],
        *[made_run("b", s, -5.0 - s, -4.0) for s in range(3)],
        *[made_run("c", s, -15.0, -14.0, fitness="cluster", cluster_scale=2.7, scale=2.7) for s in range(3)],
    )
    found = analyse(study).comparisons
    assert [(one.judge, one.quantity, sorted(one.values)) for one in found] == [
        ("gini fitness", "fitness", ["a", "b"]),
        ("gini fitness", "held_out_fitness", ["a", "b"]),
        ("cluster fitness (cluster_scale 2.7)", "fitness", ["c"]),
        ("cluster fitness (cluster_scale 2.7)", "held_out_fitness", ["c"]),
    ]
    assert found[2].pairs == []
    assert found[2].ranking is None
    assert name_of(EvolveSettings(metric="path_length", repeats=3)) == "gini fitness (metric path_length)"


@pytest.mark.parametrize(
    ("other", "named"),
    [
        ({"controllers": CONTROLLERS[:2]}, "gini fitness, controllers dwb, mppi"),
        ({"world": {"time_limit": 60.0}}, "gini fitness, environment.time_limit 60"),
        ({"world": {"noise": "nominal"}}, "gini fitness, environment.noise nominal"),
        ({"aggregate": "median"}, "gini fitness (aggregate median)"),
    ],
)
def test_values_that_mean_something_else_are_not_compared(other, named):
    study = made_study(
        *[made_run("a", s, -8.0, -7.0) for s in range(3)],
        *[made_run("b", s, -5.0, -4.0, **other) for s in range(3)],
    )
    first, second = judges_of(study)
    assert (list(first.groups), list(second.groups), second.name) == (["a"], ["b"], named)
    assert first.name.startswith("gini fitness")
    assert first.name != second.name
    assert all(one.pairs == [] and one.ranking is None for one in analyse(study).comparisons)


def test_scales_of_their_own_are_not_compared():
    own = {"fitness": "cluster"}
    study = made_study(
        *[made_run("a", s, -8.0, -7.0, scale=2.0 + s, **own) for s in range(3)],
        *[made_run("b", s, -5.0, -4.0, scale=2.5 + s, **own) for s in range(3)],
        *[made_run("given", s, -5.0, -4.0, scale=3.0, cluster_scale=3.0, **own) for s in range(3)],
        *[made_run("calibrated", s, -6.0, -4.0, scale=3.0, **own) for s in range(3)],
    )
    apart, alike = judges_of(study)
    assert (list(apart.groups), apart.scales, apart.comparable) == (["a", "b"], (2.0, 2.5, 3.0, 3.5, 4.0, 4.5), False)
    assert (list(alike.groups), alike.name) == (["given", "calibrated"], "cluster fitness (cluster_scale 3)")
    seen, fresh = analyse(study).of(apart)
    for one in (seen, fresh):
        assert (one.pairs, one.populations, one.ranking) == ([], [], None)
    assert [row["configuration"] for row in summary_rows(seen)] == ["a", "b"]
    assert len(analyse(study).of(alike)[0].pairs) == 1
    assert verdict_of(analyse(study))[0] == (
        "Cluster fitness (cluster_scale calibrated by every search): not compared. Every search calibrated its own "
        "cluster scale (2 to 4.5), so the values of different searches are on different scales (a and b)."
    )


def test_what_a_value_means_is_said_with_the_costs_of_the_search():
    (judge,) = judges_of(made_study(made_run("a", 0, -8.0)))
    assert judge.meaning == (
        "What the gini fitness means: lower is better. A set gains up to 20 for maps whose Gini coefficients spread "
        "wide and evenly; a failed run costs its share of 100 (11.1 if 3 controllers drive 3 maps once), a timeout 10 "
        "more, so 100 to 190 is a set on which every run failed; a set without a pattern (fewer than two maps with a "
        "value, or two with the same score) costs 20000 times its success rate (thesis, Alg. 2)."
    )
    every_run_failed = set_of(*[[[None, None, None]]] * 3)
    assert GINI(every_run_failed).fitness == 190.0
    assert GINI(set_of([ALIKE], [ALIKE], [FAR])).fitness == 20000.0
    (cluster,) = judges_of(made_study(made_run("a", 0, -8.0, fitness="cluster", base_cost=90.0, scale=1.0)))
    assert "its share of 90 (10.0 if" in cluster.meaning
    assert "pattern" not in cluster.meaning


def test_populations_are_those_that_differ_in_nothing_else():
    study = made_study(
        *[made_run("p20", s, v, pop_size=20) for s, v in enumerate(spread(-8.0))],
        *[made_run("p40", s, v, pop_size=40) for s, v in enumerate(spread(-8.1))],
        *[made_run("twice", s, v, pop_size=40, repeats=2) for s, v in enumerate(spread(-8.1))],
    )
    (one,) = analyse(study).comparisons
    (test,) = one.populations
    assert test.groups == ("p20", "p40")
    assert test.n == (12, 12)
    sentences = [sentence for sentence in verdict_of(analyse(study)) if sentence.startswith("The population size")]
    assert len(sentences) == 1
    assert {row["test"] for row in test_rows(one)} == {"Kruskal-Wallis", "Friedman"}


def test_equal_populations_are_no_comparison_of_populations():
    dense = {"method": "cellular", "cellular": {"fill_probability": (0.3,)}}
    study = made_study(
        *[made_run("p20", s, v, pop_size=20) for s, v in enumerate(spread(-8.0))],
        *[made_run("again", s, v, pop_size=20) for s, v in enumerate(spread(-8.0))],
        *[made_run("sparse", s, v, configuration={"method": "cellular"}) for s, v in enumerate(spread(-8.0))],
        *[made_run("dense", s, v, configuration=dense, pop_size=60) for s, v in enumerate(spread(-8.0))],
    )
    (one,) = analyse(study).comparisons
    assert one.populations == []


def test_what_differs_by_construction_is_not_tested():
    best = {"method": "best_triple", "of": "random"}
    study = made_study(
        *[made_run("random", s, v, v) for s, v in enumerate(spread(-8.0))],
        *[made_run("exact", s, v - 1.0, v, configuration=best) for s, v in enumerate(spread(-8.0))],
        *[made_run("ga", s, v - 0.1, v) for s, v in enumerate(spread(-8.0))],
    )
    seen, fresh = analyse(study).comparisons
    assert [pair.groups for pair in seen.pairs] == [("exact", "ga"), ("ga", "random")]
    assert len(fresh.pairs) == 3
    assert (seen.ranking.names, seen.ranking.test) == (("random", "ga"), None)
    assert set(fresh.ranking.names) == {"random", "exact", "ga"}
    marked = pair_rows(seen)[-1]
    assert (marked["first"], marked["second"], marked["by_construction"]) == ("exact", "random", "yes")
    assert np.isnan(marked["p_holm"])
    assert marked["a12"] > 0.9
    assert not any(row["by_construction"] for row in [*pair_rows(seen)[:-1], *pair_rows(fresh)])
    not_again = made_study(*[type(run)(**{**vars(run), "reevaluation": None}) for run in study.runs])
    assert verdict_of(analyse(not_again))[2].startswith("exact selects among all maps of random afterwards")


def test_what_cannot_be_worse_is_not_tested_either_where_it_is_as_good():
    best = {"method": "best_triple", "of": "random"}
    study = made_study(
        *[made_run("random", s, v) for s, v in enumerate(spread(-8.0))],
        *[made_run("exact", s, v, configuration=best) for s, v in enumerate(spread(-8.0))],
    )
    (seen,) = analyse(study).comparisons
    assert (seen.order, seen.pairs, seen.by_construction) == (["random", "exact"], [], [("exact", "random")])
    assert seen.ranking is None


@pytest.mark.parametrize(
    ("method", "options"), [("again", {}), ("best_triple", {"validation": {"seeds": 2, "held_out_seeds": 2}})]
)
def test_nothing_is_so_by_construction_where_a_set_was_taken_over_or_confirmed(method, options):
    later = {"method": method, "of": "ours"}
    study = made_study(
        *[made_run("ours", s, v, **options) for s, v in enumerate(spread(-8.0))],
        *[made_run("later", s, v - 0.1, configuration=later) for s, v in enumerate(spread(-8.0))],
    )
    (seen,) = analyse(study).comparisons
    assert [pair.groups for pair in seen.pairs] == [("later", "ours")]
    assert not any("afterwards" in sentence for sentence in verdict_of(analyse(study)))


def test_ranks_use_the_seeds_that_all_share():
    study = made_study(
        *[made_run("a", s, -9.0 - s) for s in range(5)],
        *[made_run("b", s, -6.0 - s) for s in range(1, 6)],
        *[made_run("c", s, -3.0 - s) for s in range(2, 9)],
    )
    (one,) = analyse(study).comparisons
    assert one.ranking.seeds == (2, 3, 4)
    assert one.ranking.ranks == pytest.approx([1, 2, 3])
    assert [row["configuration"] for row in rank_rows(one)] == ["a", "b", "c"]
    assert one.ranking.test.effect == pytest.approx(1.0)


def test_the_best_median_is_not_said_to_beat_what_is_better_in_most_pairs():
    """Nine of twenty searches with ``a`` find no pattern; those with ``b`` are far better or a little worse."""
    a = [-5.0 - s / 1000 if s < 11 else 50.0 + s / 1000 for s in range(20)]
    b = [-9.0 - s / 1000 if s < 9 else -4.0 + s / 1000 for s in range(20)]
    study = made_study(*[made_run(name, s, values[s]) for name, values in (("a", a), ("b", b)) for s in range(20)])
    first, second = verdict_of(analyse(study))[:2]
    assert first.startswith("Gini fitness, reported: a has the best median, -5.00 (")
    assert second.startswith("In most pairs of searches a is worse than b (median 1.0")
    assert "a better in 30 % of pairs of searches" in second
    assert not any("beats" in sentence for sentence in verdict_of(analyse(study)))


def test_an_equal_median_is_said():
    study = made_study(*[made_run(name, s, 100.0) for name in ("a", "b", "c") for s in range(3)])
    first = verdict_of(analyse(study))[0]
    assert first.startswith("Gini fitness, reported: a has the best median, 100.00 (")
    assert first.endswith("; b and c have the same.")


def test_a_clear_difference_is_said_with_all_its_numbers():
    study = groups(ga=-8.0, random=-6.0)
    first, second = verdict_of(analyse(study))[:2]
    assert first.startswith("Gini fitness, held out: ga has the best median, -8.03 (95 % interval -8.")
    assert first.endswith(", mean -8.03, n = 12; lower is better).")
    assert second == (
        "ga beats random (median 2.00 behind; ga better in 100 % of pairs of searches, A12; p < 0.001; n = 12 and 12)."
    )
    (row,) = pair_rows(analyse(study).comparisons[0])
    assert (row["first"], row["second"]) == ("ga", "random")
    assert row["median_difference"] == pytest.approx(-2.0)
    assert row["a12"] == 1.0
    assert row["cliffs_delta"] == 1.0
    assert row["p_holm"] < 0.001
    assert [row["configuration"] for row in summary_rows(analyse(study).comparisons[0])] == ["ga", "random"]


def test_what_is_judged_in_another_way_is_compared_by_what_it_is_worth_on_fresh_seeds():
    lucky = [made_run("lucky", s, v - 5.0, v) for s, v in enumerate(spread(-1.0))]
    careful = [made_run("careful", s, v, v, aggregate="median") for s, v in enumerate(spread(-3.0))]
    first, *rest = verdict_of(analyse(made_study(*lucky, *careful)))
    assert first.startswith("Median held-out fitness: careful -3.02 (95 % interval ")
    assert "; lucky -1.02 (95 % interval " in first
    assert "reported -6.03; rank agreement in 100 % of trials; n = 12" in first
    assert first.endswith(" Lower is better: careful is better in 100 % of pairs of searches (A12; p < 0.001).")
    assert not any(sentence.startswith("Median held-out fitness") for sentence in rest)
    alike = [made_run("alike", s, v, v, aggregate="median") for s, v in enumerate(spread(-1.0))]
    assert not verdict_of(analyse(made_study(*lucky, *alike)))[0].startswith("Median held-out fitness")


@pytest.mark.parametrize(
    "other",
    [{"pattern_weight": 40.0}, {"metric": "path_length"}, {"controllers": CONTROLLERS[:2]}, {"maps_per_set": 2}],
)
def test_promises_that_mean_something_else_are_not_held_against_each_other(other):
    study = made_study(
        *[made_run("a", s, v, v) for s, v in enumerate(spread(-8.0))],
        *[made_run("b", s, v, 2 * v, **other) for s, v in enumerate(spread(-8.0))],
        *[made_run("c", s, v, v, aggregate="median") for s, v in enumerate(spread(-4.0))],
    )
    assert [row["against"] for row in reported_fitness_rows(study)] == ["", "", "a"]
    assert not any("held-out fitness: b" in sentence for sentence in verdict_of(analyse(study)))


def test_promises_are_tested_with_a_correction_for_all_rows():
    one = [made_run("a", s, v, v) for s, v in enumerate(spread(-8.0))]
    others = [made_run(name, s, v, v) for name in "bcd" for s, v in enumerate(spread(-4.0))]
    (_, alone), (_, *together) = (
        reported_fitness_rows(made_study(*one, *others[: len(one)])),
        reported_fitness_rows(made_study(*one, *others)),
    )
    assert 0 < alone["p_holm"] < 0.01
    assert [row["p_holm"] for row in together] == pytest.approx([3 * alone["p_holm"]] * 3)


def test_text_and_table_give_one_direction():
    study = made_study(
        *[made_run("worse", s, v, v) for s, v in enumerate(spread(-7.8))],
        *[made_run("better", s, v, v) for s, v in enumerate(spread(-8.0))],
    )
    (row,) = pair_rows(analyse(study).comparisons[1])
    assert (row["first"], row["second"]) == ("better", "worse")
    assert f"better better in {100 * row['a12']:.0f} % of pairs of searches, A12" in " ".join(
        verdict_of(analyse(study))
    )
    assert 0.5 < row["a12"] < 1.0


def test_no_difference_is_said_as_well():
    sentences = verdict_of(analyse(groups(ga=-8.0, random=-7.98)))
    assert sentences[1].startswith("No significant difference between ga and random (median 0.02 behind; ga better")
    assert not any("too few" in sentence for sentence in sentences)


def test_too_few_runs_are_named_pair_by_pair():
    study = made_study(
        *[made_run("ga", s, v) for s, v in enumerate(spread(-8.0))],
        *[made_run("random", s, v) for s, v in enumerate(spread(-7.98))],
        *[made_run("short", s, -7.9) for s in range(2)],
    )
    assert "The searches are too few for a significant difference from short." in verdict_of(analyse(study))


def test_the_interval_is_of_the_median_and_needs_five_runs():
    values = [-9.0, -8.0, -7.0, -6.0, 20000.0]
    (one,) = analyse(made_study(*[made_run("ga", s, value) for s, value in enumerate(values)])).comparisons
    (row,) = summary_rows(one)
    assert row["ci_low"] <= row["median"] == -7.0 <= row["ci_high"]
    assert row["ci_low"] == -9.0
    (one,) = analyse(made_study(*[made_run("ga", s, value) for s, value in enumerate(values[:4])])).comparisons
    assert np.isnan(summary_rows(one)[0]["ci_low"])
    assert "interval" not in verdict_of(analyse(made_study(*[made_run("ga", s, -8.0, -6.0) for s in range(4)])))[0]


def test_few_fresh_values_are_no_verdict():
    seen = [made_run(name, s, v) for name in ("ga", "random") for s, v in enumerate(spread(-8.0, 4))]
    few = made_study(*[made_run("lucky", s, -8.0, -99.0) for s in range(3)], *seen)
    first, *others = verdict_of(analyse(few))
    assert first.startswith("Gini fitness, reported: ")
    assert (
        "Fewer than half of the searches are re-evaluated, so this compares the reported fitness. Not re-evaluated: "
        "ga (4 of 4 searches) and random (4 of 4 searches)."
    ) in others
    most = made_study(*[made_run("ga", s, -8.0, -7.0) for s in range(5)], *seen[:1])
    first, *others = verdict_of(analyse(most))
    assert first.startswith("Gini fitness, held out: ")
    assert "Left out, because not re-evaluated yet: ga (1 of 6 searches)." in others


def test_fresh_minus_seen_is_said_with_its_interval():
    study = made_study(*[made_run("ga", s, -8.0, -6.0) for s in range(6)])
    assert verdict_of(analyse(study))[2] == "Success rate of the best sets on held-out seeds: ga 100 %."
    assert verdict_of(analyse(study))[3] == (
        "Held-out minus reported fitness, gini fitness: the searches report a median of -8.00. With held-out seeds and "
        "nominal noise the median difference is +2.00 (95 % interval +2.00 to +2.00, n = 6 different sets). It is the "
        "selection bias (winner's curse) and the effect of the other noise together. All controllers solved all maps "
        "of a set in 100 % of trials. In 100 % of these the maps keep their rank."
    )
    better = made_study(*[made_run("ga", s, -8.0, -8.5) for s in range(6)])
    assert "the median difference is -0.50" in verdict_of(analyse(better))[3]
    assert not any("worse" in sentence for sentence in verdict_of(analyse(better)))


def test_luck_is_counted_once_and_where_something_was_selected():
    study = made_study(
        made_run("a", 0, -8.0, -6.0, map_set="same"),
        made_run("a", 1, -8.0, -6.0, map_set="same"),
        made_run("b", 0, -8.0, -6.0, map_set="same"),
        made_run("c", 0, -8.0),
        made_run("long", 0, 30.0, 9000.0, configuration={"method": "path_length"}),
    )
    assert [(run.configuration.name, run.seed) for run in selected_sets(study.runs)] == [("a", 0), ("a", 1)]
    assert [row["configuration"] for row in held_out_rows(study)] == ["a", "b", "long"]


@pytest.mark.parametrize(
    ("searched", "again", "words"),
    [
        ("none", "nominal", "held-out seeds and nominal noise"),
        ("nominal", "none", "held-out seeds without noise"),
        ("none", {"scan": 0.1}, "held-out seeds and other noise"),
        ("none", None, "held-out seeds"),
        ("nominal", "nominal", "held-out seeds"),
    ],
)
def test_added_noise_is_called_noise(searched, again, words):
    run = made_run("a", 0, -8.0, -6.0, world={"noise": searched})
    settings = StudySettings(name="made", configurations=[{"name": "a"}], reevaluation={"noise": again})
    study = StudyResults(Path("made"), settings, "0", {}, {}, (run,), ())
    assert conditions(run, study) == words
    assert ("other noise" in verdict_of(analyse(study))[-1]) == ("noise" in words)


def test_sets_driven_again_in_an_easier_world_beat_nobody():
    runs = [made_run("noisy", s, -7.0, v) for s, v in enumerate(spread(-1.0))]
    easy = [made_run("calm", s, -7.0, v) for s, v in enumerate(spread(-7.0))]
    assert any("beats noisy" in sentence for sentence in verdict_of(analyse(made_study(*runs, *easy))))
    calm = [replace(run, configuration=run.configuration.replace(fresh_noise="none")) for run in easy]
    assert not any("beats" in sentence for sentence in verdict_of(analyse(made_study(*runs, *calm))))


def test_the_order_is_judged_where_all_maps_are_solved():
    results = set_of([ALIKE, FAR, ALIKE], [TWICE, TWICE, [None, 1, 4]], [FAR, ALIKE, FAR])
    singles = judge(results, GINI, 1)
    run = made_run("a", 0, -8.0, -6.0)
    again = Reevaluation(results, singles, singles, (0.0, 0.3, 0.6))
    driven = type(run)(**{**vars(run), "reevaluation": again})
    assert rank_agreement([driven]) == pytest.approx((1 / 2, 2 / 3))  # as seen, reversed, and once not solved
    unseen = type(run)(**{**vars(run), "reevaluation": Reevaluation(results, singles, singles, (0.0, None, 0.6))})
    assert rank_agreement([unseen]) == pytest.approx((np.nan, np.nan), nan_ok=True)
    never = Reevaluation(results, singles[2:], singles[2:], (0.0, 0.3, 0.6))
    failed = type(run)(**{**vars(run), "reevaluation": never})
    assert rank_agreement([failed]) == pytest.approx((np.nan, 0.0), nan_ok=True)
    assert "In no trial did all controllers solve all maps" in verdict_of(analyse(made_study(failed)))[-1]
    assert rank_agreement([]) == pytest.approx((np.nan, np.nan), nan_ok=True)


def test_what_repeats_buy_is_said():
    study = made_study(
        *[made_run("once", s, -8.0, -5.0) for s in range(3)],
        *[made_run("thrice", s, -8.0, -7.5, repeats=3) for s in range(3)],
    )
    rows = {row["configuration"]: row for row in held_out_rows(study)}
    assert (rows["once"]["selection_bias"], rows["thrice"]["selection_bias"]) == (3.0, 0.5)
    assert verdict_of(analyse(study))[-1] == (
        "Repeats of every run in the search (once with 1: held-out minus reported fitness +3.00, rank agreement 100 %; "
        "thrice with 3: held-out minus reported fitness +0.50, rank agreement 100 %)."
    )


def test_little_is_said_about_little():
    assert verdict_of(analyse(made_study())) == ["No search of this study is finished."]
    assert verdict_of(analyse(made_study(made_run("ga", 0, -8.0))))[0] == (
        "Gini fitness, reported: ga has the median -8.00 (mean -8.00, n = 1; lower is better). It is the only "
        "configuration."
    )
    no_pattern = verdict_of(analyse(made_study(made_run("a", 0, -8.0), made_run("b", 0, 20000.0))))
    shown = "b (no pattern in the median; a better in 100 % of pairs of searches, A12; p = 1; n = 1 and 1)"
    assert no_pattern[1] == f"No significant difference between a and {shown}."
    assert no_pattern[2] == "The searches are too few for a significant difference from b."


def test_maps_by_hand():
    results = set_of([[5, 6, 7], [7, None, 7]], [[5, 6, 7], [5, 6, 7]], [[None, 6, 7], [None, 6, 7]])
    rows = map_rows(made_run("ga", 3, -8.0, -7.0, results=results))
    assert len(rows) == 9
    columns = ("map", "controller", "searched_s", "mean_s", "min_s", "max_s", "goals", "runs")
    assert [rows[0][name] for name in columns] == ["map_1", "dwb", 9.0, 6.0, 5.0, 7.0, 2, 2]
    assert rows[0]["std_s"] == pytest.approx(np.sqrt(2))
    assert (rows[1]["goals"], rows[1]["otherwise"]) == (1, "1 timeout")
    assert (rows[6]["goals"], rows[6]["otherwise"]) == (0, "2 timeout")
    assert np.isnan(rows[6]["mean_s"])


def test_a_study_is_written_as_tidy_tables(study_path):
    results = load_results(study_path)
    files = {path.stem: path for path in write_tables(analyse(results), results.path)}
    assert set(files) == {
        "runs", "reevaluation", "generations", "summary", "tests", "pairs", "ranks", "maps", "measures", "repeats",
        "reported_fitness",
    }  # fmt: skip
    read = {name: list(csv.DictReader(io.StringIO(path.read_text()))) for name, path in files.items()}
    assert len(read["runs"]) == 14
    assert len(read["reevaluation"]) == 14 * 3 * 3 * 4
    assert len(read["maps"]) == 14 * 3 * 3
    assert float(read["runs"][0]["fitness"]) == results.runs[0].fitness
    assert {row["outcome"] for row in read["reevaluation"]} <= {"goal", "timeout"}
    assert {row["min_clearance"] for row in read["reevaluation"]} == {"0.2"}
    promised = {row["configuration"]: row for row in read["reported_fitness"]}
    assert {row["n"] for row in promised.values()} == {"2"}
    of_first = [run for run in results.runs if run.configuration.name == results.runs[0].configuration.name]
    assert float(promised[of_first[0].configuration.name]["reported_fitness"]) == pytest.approx(
        np.median([run.fitness for run in of_first])
    )
    assert promised[of_first[0].configuration.name]["a12"] == ""  # it is what others are compared with
    with pytest.raises(ConfigError, match="unknown table 'run'; did you mean 'runs'"):
        results.rows("run")


def test_rows_are_read_by_their_former_names_too(study_path):
    row = load_results(study_path).rows()[0]
    assert row["fresh_fitness"] == row["held_out_fitness"]
    assert row["winners_curse"] == row["selection_bias"]
    assert "winners_curse" not in row
    with pytest.raises(KeyError, match="fitnes"):
        row["fitnes"]


def test_a_study_is_a_data_frame_where_pandas_is_there(study_path):
    pytest.importorskip("pandas")
    frame = load_results(study_path).to_pandas()
    assert frame.groupby("configuration")["fitness"].count().to_dict() == dict.fromkeys(frame["configuration"], 2)


def test_two_re_evaluations_of_an_unsteady_set_are_not_near_each_other():
    assert repeatability([-4.0] * 20) == 1.0
    assert repeatability([-4.0, -4.4] * 10) == 1.0
    assert 0.3 < repeatability([-2.0, -6.0] * 10) < 0.6
    assert repeatability([-2.0, -6.0]) == pytest.approx(0.375, abs=0.02)  # by hand: (1/4)^2 + (1/2)^2 + (1/4)^2
