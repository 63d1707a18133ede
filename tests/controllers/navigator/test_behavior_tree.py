from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.navigator.behavior_tree import (
    Condition,
    Node,
    PipelineSequence,
    RateController,
    ReactiveFallback,
    RecoveryNode,
    Rest,
    RoundRobin,
    Sequence,
    Status,
    halt_tree,
)
from controllers.navigator.rate import Clock as TreeClock
from controllers.navigator.tree_loop import TreeLoop

R, S, F = Status.RUNNING, Status.SUCCESS, Status.FAILURE


class Scripted(Node):
    """Answers from a list, the last answer for ever; counts what happens to it."""

    def __init__(self, *answers: Status) -> None:
        self.answers = list(answers)
        self.starts = self.ticks = self.halts = 0

    def tick(self) -> Status:
        self.starts += self.status is not Status.RUNNING
        self.ticks += 1
        return self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]

    def halt(self) -> None:
        self.halts += 1


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_stop_halts_only_what_runs():
    running, done = Scripted(R), Scripted(S)
    running.execute_tick()
    done.execute_tick()
    running.stop()
    done.stop()
    assert (running.halts, done.halts) == (1, 0)
    assert running.status is done.status is Status.IDLE


def test_condition_asks_anew():
    answers = [True, False]
    condition = Condition(lambda: answers.pop(0))
    assert [condition.execute_tick(), condition.execute_tick()] == [S, F]


def test_sequence_remembers_where_it_is():
    first, second = Scripted(S), Scripted(R, S)
    sequence = Sequence(first, second)
    assert sequence.execute_tick() is R
    assert sequence.execute_tick() is S
    assert (first.ticks, second.ticks) == (1, 2)


def test_sequence_begins_anew_after_a_failure():
    first, second = Scripted(S), Scripted(F, S)
    sequence = Sequence(first, second)
    assert [sequence.execute_tick(), sequence.execute_tick()] == [F, S]
    assert first.ticks == 2


def test_reactive_fallback_stops_earlier_children_when_a_later_one_runs():
    first, second = Scripted(R, F, S), Scripted(R)
    fallback = ReactiveFallback(first, second)
    assert fallback.execute_tick() is R
    assert fallback.execute_tick() is R
    assert second.ticks == 1
    assert fallback.execute_tick() is S
    assert second.halts == 1


def test_reactive_fallback_fails_with_all_children():
    assert ReactiveFallback(Scripted(F), Scripted(F)).execute_tick() is F


class TestRecoveryNode:
    def test_at_most_n_recoveries_and_n_plus_1_attempts(self):
        child, recovery = Scripted(F), Scripted(S)
        assert RecoveryNode(3, child, recovery).execute_tick() is F
        assert (child.ticks, recovery.ticks) == (4, 3)

    def test_failed_recovery_fails(self):
        child, recovery = Scripted(F), Scripted(F)
        assert RecoveryNode(3, child, recovery).execute_tick() is F
        assert (child.ticks, recovery.ticks) == (1, 1)

    def test_success_ends_it_whatever_was_retried(self):
        child = Scripted(F, F, S)
        assert RecoveryNode(2, child, Scripted(S)).execute_tick() is S

    def test_retries_are_counted_until_the_node_ends(self):
        child, recovery = Scripted(R, F, R, F, F), Scripted(S)
        node = RecoveryNode(1, child, recovery)
        assert [node.execute_tick() for _ in range(3)] == [R, R, F]
        assert recovery.ticks == 1
        assert node.retry_count == 0

    def test_runs_with_its_recovery(self):
        child, recovery = Scripted(F, S), Scripted(R, R, S)
        node = RecoveryNode(1, child, recovery)
        assert [node.execute_tick() for _ in range(3)] == [R, R, S]
        assert (child.ticks, recovery.starts) == (2, 1)

    @given(retries=st.integers(0, 8), failures=st.integers(0, 12))
    def test_counts(self, retries, failures):
        child, recovery = Scripted(*[F] * failures, S), Scripted(S)
        expected = S if failures <= retries else F
        assert RecoveryNode(retries, child, recovery).execute_tick() is expected
        assert child.ticks == min(failures, retries) + 1
        assert recovery.ticks == min(failures, retries)


class TestPipelineSequence:
    def test_running_child_blocks_only_those_not_reached(self):
        plan, follow = Scripted(R, S, R, R), Scripted(R)
        pipeline = PipelineSequence(plan, follow)
        assert pipeline.execute_tick() is R
        assert follow.ticks == 0
        for _ in range(3):
            assert pipeline.execute_tick() is R
        assert (plan.ticks, follow.ticks) == (4, 3)

    def test_any_failure_halts_all(self):
        plan, follow = Scripted(S, F), Scripted(R)
        pipeline = PipelineSequence(plan, follow)
        assert [pipeline.execute_tick(), pipeline.execute_tick()] == [R, F]
        assert follow.halts == 1

    def test_last_success_ends_it_and_halts_the_running(self):
        plan, follow = Scripted(S, R), Scripted(R, S)
        pipeline = PipelineSequence(plan, follow)
        assert [pipeline.execute_tick(), pipeline.execute_tick()] == [R, S]
        assert plan.halts == 1


class TestRoundRobin:
    def test_goes_on_after_each_success(self):
        children = [Scripted(S) for _ in range(3)]
        robin = RoundRobin(*children)
        for _ in range(4):
            assert robin.execute_tick() is S
            robin.stop()
        assert [child.ticks for child in children] == [2, 1, 1]

    def test_failure_tries_the_next_at_once(self):
        children = [Scripted(F), Scripted(S), Scripted(S)]
        robin = RoundRobin(*children)
        assert robin.execute_tick() is S
        assert [child.ticks for child in children] == [1, 1, 0]

    def test_all_fail(self):
        assert RoundRobin(Scripted(F), Scripted(F)).execute_tick() is F

    def test_halted_while_running_begins_anew(self):
        children = [Scripted(S), Scripted(R)]
        robin = RoundRobin(*children)
        assert [robin.execute_tick(), robin.execute_tick()] == [S, R]
        robin.stop()
        robin.execute_tick()
        assert [child.ticks for child in children] == [2, 1]


class TestRateController:
    @pytest.fixture
    def clock(self):
        return Clock()

    def test_ticks_once_a_period(self, clock):
        child = Scripted(S)
        node = RateController(1.0, clock, child)
        ticked = []
        for step in range(61):
            clock.now = step * 0.05
            if node.execute_tick() is S:
                ticked.append(step)
        assert ticked == [0, 20, 40, 60]

    def test_period_counts_from_the_childs_success(self, clock):
        child = Scripted(R, S, S)
        node = RateController(1.0, clock, child)
        answers = []
        for now in (0.0, 0.5, 1.0, 1.4, 1.5):
            clock.now = now
            answers.append(node.execute_tick())
        assert answers == [R, S, R, R, S]

    def test_first_time_again_after_a_halt(self, clock):
        child = Scripted(S)
        node = RateController(1.0, clock, child)
        node.execute_tick()
        node.stop()
        clock.now = 0.1
        assert node.execute_tick() is S


def test_round_robin_keeps_its_place_for_the_next_goal_unless_the_whole_tree_is_halted():
    first, second = Scripted(S), Scripted(S)
    robin = RoundRobin(first, second)
    robin.execute_tick()
    robin.stop()
    robin.execute_tick()
    assert (first.ticks, second.ticks) == (1, 1)
    robin = RoundRobin(Scripted(S), second)
    robin.execute_tick()
    halt_tree(robin)
    robin.execute_tick()
    assert second.ticks == 1


class Messages(Scripted):
    """Runs until a message comes."""

    news = False

    def rest(self):
        return Rest(math.inf, lambda: self.news)


class TestRest:
    """A tree rests where a tick would change nothing."""

    def tree(self, *plans: Status):
        clock, plan, follow = TreeClock(), Scripted(*plans), Messages(R)
        root = RecoveryNode(1, PipelineSequence(RateController(1.0, clock, plan), follow), Scripted(R))
        return clock, plan, follow, root

    def test_it_rests_until_the_next_period_or_a_message(self):
        clock, _, follow, root = self.tree(S)
        root.execute_tick()
        assert root.rest() is None
        clock.now = 0.5
        root.execute_tick()
        rest = root.rest()
        assert (rest.until, rest.has_news()) == (1.0, False)
        follow.news = True
        assert rest.has_news()

    def test_it_does_not_rest_while_the_plan_is_running(self):
        clock, _, _, root = self.tree(S, R)
        for clock.now in (0.0, 1.0):
            root.execute_tick()
        assert root.rest() is None

    def test_it_does_not_rest_during_a_recovery(self):
        _, _, _, root = self.tree(F)
        assert root.execute_tick() is R
        assert root.rest() is None

    def test_nodes_do_not_rest_by_themselves(self):
        assert Scripted(R).rest() is Sequence(Messages(R)).rest() is ReactiveFallback(Messages(R)).rest() is None

    @given(st.lists(st.sampled_from([False] * 9 + [True]), max_size=60))
    def test_a_loop_that_rests_does_as_one_that_does_not(self, news):
        assert self.drive(news, rests=True) == self.drive(news, rests=False)

    def drive(self, news, *, rests):
        clock, plan, follow, root = self.tree(S)
        loop = TreeLoop(root, clock, 0.1, lambda now: None)
        root.rest = root.rest if rests else lambda: None
        seen = []
        for comes in news:
            follow.news = comes
            follow.answers = [S if comes else R]
            if loop.status is R:
                loop.tick()
            seen.append((loop.status, clock.now, plan.ticks))
        return seen
