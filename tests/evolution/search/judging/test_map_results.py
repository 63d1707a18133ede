"""The results of a map whose controllers have different numbers of runs."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evolution.driving import RunResult
from evolution.search.judging import Fitness, JudgingSettings, is_solved, missing_runs, singles_of, success_share
from evolution.search.judging.map_results import failed_trials, solved_trials, without_failed_trials

RUN = st.builds(RunResult, st.sampled_from(["goal", "goal", "goal", "timeout", "collision"]), st.floats(1.0, 99.0))


@st.composite
def uneven_maps(draw):
    """Results of a map, and the same with the runs of each controller repeated until all have as many."""
    counts = draw(st.tuples(*[st.sampled_from([1, 2, 3, 6])] * 3))
    most = 6 if 6 in counts or {2, 3} <= set(counts) else max(counts)
    uneven = [draw(st.lists(RUN, min_size=count, max_size=count)) for count in counts]
    if max(counts) < most:
        uneven[counts.index(max(counts))] *= most // max(counts)
    return tuple(map(tuple, uneven)), tuple(tuple(runs) * (most // len(runs)) for runs in uneven)


@given(uneven_maps())
def test_controllers_with_fewer_runs_count_as_if_their_runs_were_repeated(maps):
    uneven, even = maps
    assert singles_of(uneven) == singles_of(even)
    assert failed_trials(uneven) == failed_trials(even)
    assert is_solved(uneven) == is_solved(even)
    assert success_share(uneven) == pytest.approx(success_share(even))
    assert is_solved(solved_trials(uneven)) or solved_trials(uneven) == uneven
    assert missing_runs((uneven,)) == 0
    for policy in ("exclude", "par2"):
        fitness = Fitness.of(JudgingSettings(caution=0.5, aggregate="median", failures=policy), 150.0)
        ours, theirs = fitness((uneven,) * 3), fitness((even,) * 3)
        assert ours.scores == pytest.approx(theirs.scores)
        assert ours.fitness == pytest.approx(theirs.fitness)
        assert fitness.bound((uneven,)) == pytest.approx(fitness.bound((even,)))


def test_a_run_counts_once_in_the_values_of_a_map():
    """The first run is often the one that the map was selected by, so it must not fill up the trials of others."""
    steady = tuple(RunResult("goal", 20.0, 1.0) for _ in range(5))
    lucky = tuple(RunResult("goal", time_s, 1.0) for time_s in (100.0, 40.0, 50.0, 60.0))
    assert solved_trials((steady, lucky)) == (steady, lucky)
    judged = Fitness.of(JudgingSettings(aggregate="median"), 150.0).judge_map(solved_trials((steady, lucky)))
    assert judged.values == (20.0, 55.0)
    failing = (*lucky[:2], RunResult("timeout", 150.0, 1.0), lucky[3])
    assert solved_trials((steady, failing)) == ((*steady[:2], *steady[3:]), (*lucky[:2], lucky[3]))


def test_a_controller_that_was_left_out_has_failed():
    goal, failed = RunResult("goal", 20.0, 1.0), RunResult("timeout", 150.0, 1.0)
    of_map = ((goal, goal), (goal, failed), ())
    assert not is_solved(of_map)
    assert success_share(of_map) == pytest.approx((2 + 1) / 6)
    assert missing_runs((of_map,)) == 2
    assert failed_trials(of_map) == 1
    assert singles_of(of_map) == [((goal,), (goal,), ()), ((goal,), (failed,), ())]
    assert without_failed_trials(of_map) == ((goal,), (goal,), ())
