from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.navigator.behavior_tree import Status
from controllers.navigator.parallel import Parallel
from tests.controllers.navigator.test_behavior_tree import F, R, S, Scripted


def ticks(node: Parallel, times: int) -> list[Status]:
    return [node.execute_tick() for _ in range(times)]


@pytest.mark.parametrize(
    ("successes", "failures", "answers", "found"),
    [
        (-1, 1, [(S, S), (R, S)], [R, S]),
        (-1, 1, [(S, S), (R, F)], [R, F]),
        (1, -1, [(R, R), (F, F), (R, S)], [R, S]),
        (1, -1, [(F, F), (R, F)], [R, F]),
        (2, 3, [(F, F), (R, R), (R, F)], [R, F]),
        (-2, 2, [(F, F), (R, S), (S, S)], [R, S]),
    ],
)
def test_it_ends_when_enough_have_succeeded_or_failed(successes, failures, answers, found):
    children = [Scripted(*row) for row in answers]
    assert ticks(Parallel(*children, successes=successes, failures=failures), 2) == found


def test_a_child_that_has_ended_waits_for_the_others_and_begins_again_with_them():
    quick, slow = Scripted(S), Scripted(R, R, S)
    parallel = Parallel(quick, slow, successes=-1, failures=1)
    assert ticks(parallel, 3) == [R, R, S]
    assert (quick.ticks, slow.ticks) == (1, 3)
    slow.answers = [S]
    assert ticks(parallel, 1) == [S]
    assert quick.ticks == 2


def test_the_end_halts_those_that_run_and_leaves_out_the_rest():
    running, last = Scripted(R), Scripted(S)
    assert ticks(Parallel(running, Scripted(F), last, successes=-1, failures=1), 1) == [F]
    assert (running.halts, last.ticks) == (1, 0)


def test_a_halt_forgets_who_has_ended():
    first, second = Scripted(S), Scripted(R)
    parallel = Parallel(first, second, successes=-1, failures=1)
    ticks(parallel, 2)
    parallel.stop()
    ticks(parallel, 1)
    assert (first.ticks, second.halts) == (2, 1)


@pytest.mark.parametrize(("counts_anew", "end", "ticks_of_second"), [(True, F, 2), (False, S, 1)])
def test_humble_counts_a_child_that_has_ended_only_in_its_turn(counts_anew, end, ticks_of_second):
    first, second, third = Scripted(R, S), Scripted(R, F), Scripted(S, S)
    parallel = Parallel(first, second, third, successes=2, failures=1, counts_anew=counts_anew)
    assert ticks(parallel, 2) == [R, end]
    assert second.ticks == ticks_of_second


@given(
    st.lists(st.lists(st.sampled_from([R, S, F]), min_size=1, max_size=4), min_size=1, max_size=4),
    st.integers(1, 4),
    st.integers(1, 4),
)
def test_any_children_give_the_result_of_a_plain_count(rows, successes, failures):
    """Counts all ends of a run in the order of ticks and children."""
    successes, failures = min(successes, len(rows)), min(failures, len(rows))
    ends = sorted((n, child) for child, row in enumerate(rows) for n, answer in enumerate(row) if answer is not R)
    first = {child: (n, child) for n, child in reversed(ends)}
    found: Status = R
    results: list[Status] = []
    for n, child in sorted(first.values()):
        results.append(rows[child][n])
        hopeless = len(rows) - results.count(F) < successes
        if results.count(S) >= successes or hopeless or results.count(F) >= failures:
            found = S if results.count(S) >= successes else F
            break
    statuses = ticks(Parallel(*(Scripted(*row) for row in rows), successes=successes, failures=failures), 4)
    assert next((status for status in statuses if status is not R), R) is found
