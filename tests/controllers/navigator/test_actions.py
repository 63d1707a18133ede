"""The action server's rules, step by step."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from controllers.navigator.actions import ActionServer, Outcome, Result
from controllers.navigator.latency import LATENCIES
from controllers.navigator.rate import NEVER, Rate

NAV2 = LATENCIES["nav2"]
HALF = NAV2.message
DONE = Outcome(Result.SUCCEEDED)


class Cycles:
    """Does a cycle every 0.1 s, and is done after as many as the goal says; notes what happens to it."""

    def __init__(self, listens: bool = True, goes_on: bool = False) -> None:
        self.listens, self.goes_on = listens, goes_on
        self.next_time, self.log = NEVER, []

    def accepts(self, goal: int) -> bool:
        return goal > 0

    def begin(self, goal: int, now: float) -> None:
        self.left, self.next_time = goal, now
        self.log.append(("begin", round(now, 9)))

    def update(self, goal: int, now: float) -> bool:
        if self.goes_on:
            self.log.append(("update", round(now, 9)))
        return self.goes_on

    def step(self, now: float) -> Outcome | None:
        self.next_time = now + 0.1
        self.left -= 1
        return None if self.left else DONE

    def cancel(self) -> None:
        self.log.append("cancel")


def test_a_goal_arrives_after_half_the_latency_and_ends_with_its_last_cycle():
    server = ActionServer(Cycles(), NAV2)
    handle = server.send(3, 1.0)
    server.advance(1.0)
    assert server.executor.log == []
    server.advance(2.0)
    assert (handle.outcome, round(handle.ended, 9)) == (DONE, 1.0 + HALF + 0.2)


def test_a_refused_goal_never_begins():
    server = ActionServer(Cycles(), NAV2)
    handle = server.send(-1, 0.0)
    server.advance(1.0)
    assert (handle.is_accepted, server.executor.log) == (False, [])


def test_a_newer_goal_replaces_the_running_one_at_the_next_cycle():
    server = ActionServer(Cycles(), NAV2)
    old, new = server.send(50, 0.0), server.send(1, 0.25)
    server.advance(1.0)
    assert (old.outcome.result, round(old.ended, 9)) == (Result.ABORTED, 0.3 + HALF)
    assert server.executor.log == [("begin", HALF), "cancel", ("begin", 0.3 + HALF)]
    assert new.outcome == DONE


def test_a_newer_goal_may_go_on_with_the_running_one():
    server = ActionServer(Cycles(goes_on=True), NAV2)
    old, new = server.send(5, 0.0), server.send(5, 0.25)
    server.advance(1.0)
    assert (old.outcome.result, new.outcome) == (Result.ABORTED, DONE)
    assert round(new.ended, 9) == 0.4 + HALF


def test_what_comes_with_the_beginning_of_a_cycle_waits_for_the_next():
    server = ActionServer(Cycles(goes_on=True), NAV2)
    server.send(50, 0.0)
    server.send(50, 0.2)
    server.advance(1.0)
    assert server.executor.log == [("begin", HALF), ("update", 0.3 + HALF)]


def test_of_several_newer_goals_the_newest_counts():
    server = ActionServer(Cycles(), NAV2)
    handles = [server.send(50, time) for time in (0.0, 0.22, 0.24, 0.26)]
    server.advance(0.5)
    assert [handle.outcome and handle.outcome.result for handle in handles] == [Result.ABORTED] * 3 + [None]
    assert len([entry for entry in server.executor.log if entry != "cancel"]) == 2


def test_a_cancellation_is_seen_at_the_next_cycle_and_answered_before():
    server = ActionServer(Cycles(), NAV2)
    handle = server.send(50, 0.0)
    server.advance(0.12)
    assert server.request_cancel(handle, 0.12) == 0.12 + 2 * HALF
    server.advance(0.19)
    assert handle.outcome is None
    server.advance(0.25)
    assert (handle.outcome.result, round(handle.ended, 9)) == (Result.CANCELED, 0.2 + HALF)


def test_who_does_not_listen_ends_its_goal_and_then_begins_the_next():
    server = ActionServer(Cycles(listens=False), NAV2)
    old, new = server.send(5, 0.0), server.send(1, 0.1)
    server.request_cancel(old, 0.15)
    server.advance(1.0)
    assert (old.outcome, new.outcome, round(new.ended, 9)) == (DONE, DONE, 0.4 + HALF)


def test_without_latency_everything_is_seen_at_once():
    server = ActionServer(Cycles(goes_on=True), LATENCIES["ideal"])
    server.send(50, 0.0)
    server.advance(0.15)
    newer = server.send(50, 0.15)
    server.advance(0.15)
    assert server.executor.log == [("begin", 0.0), ("update", 0.15)]
    server.request_cancel(newer, 0.17)
    server.advance(0.17)
    assert newer.ended == 0.17


class TestRate:
    def beginnings(self, rate: Rate, durations):
        now, times = 0.0, []
        rate.start(now)
        for duration in durations:
            times.append(round(now, 6))
            now = rate.next_after(now + duration)
        return times

    @given(st.floats(0.0, 0.0099), st.integers(1, 100))
    def test_cycles_that_are_short_enough_begin_a_period_apart(self, duration, count):
        times = self.beginnings(Rate(0.01), [duration] * count)
        assert times == [round(0.01 * number, 6) for number in range(count)]

    def test_a_cycle_that_is_a_bit_too_long_delays_only_the_next(self):
        assert self.beginnings(Rate(0.01), [0.011, 0.0, 0.0, 0.0]) == [0.0, 0.011, 0.02, 0.03]

    def test_after_two_periods_pauses_last_a_period_until_the_delays_add_up(self):
        times = self.beginnings(Rate(0.01), [0.026, 0.0, 0.001, 0.001, 0.0])
        assert times == [0.0, 0.026, 0.036, 0.047, 0.058]

    def test_the_controller_server_does_not_catch_up(self):
        assert self.beginnings(Rate(0.05, restarts=True), [0.07] * 4) == [0.0, 0.07, 0.14, 0.21]

    def test_a_period_is_whole_nanoseconds(self):
        assert Rate(1.0 / 30.0).next_after(0.0) == 0.033333333
