from __future__ import annotations

import pytest

from controllers.navigator.behavior_tree import Node, Status
from controllers.navigator.rate import Clock
from controllers.navigator.timers import Delay, Timeout
from tests.controllers.navigator.test_behavior_tree import F, R, S, Scripted


def at_times(node: Node, clock: Clock, *times: float) -> list[Status]:
    found = []
    for clock.now in times:
        found.append(node.execute_tick())
    return found


class TestTimeout:
    def test_a_child_that_runs_too_long_is_halted_and_the_next_one_has_all_the_time(self):
        clock, child = Clock(), Scripted(R)
        timeout = Timeout(child, 1.0, clock, wakes=False)
        assert at_times(timeout, clock, 5.0, 5.9, 6.0, 6.1, 7.0, 7.1) == [R, R, F, R, R, F]
        assert (child.halts, child.starts, clock.is_woken) == (2, 2, False)

    @pytest.mark.parametrize("result", [S, F])
    def test_the_result_of_a_child_in_time_is_its_own(self, result):
        clock = Clock()
        assert at_times(Timeout(Scripted(R, result), 1.0, clock, wakes=True), clock, 0.0, 0.9) == [R, result]

    def test_a_child_that_begins_after_a_halt_has_all_the_time(self):
        clock = Clock()
        timeout = Timeout(Scripted(R), 1.0, clock, wakes=False)
        at_times(timeout, clock, 0.0, 0.8)
        timeout.stop()
        assert at_times(timeout, clock, 1.5, 2.4, 2.5) == [R, R, F]

    def test_0_ms_are_no_end(self):
        clock = Clock()
        assert at_times(Timeout(Scripted(R), 0.0, clock, wakes=True), clock, 0.0, 1e6) == [R, R]

    def test_since_jazzy_the_tree_is_ticked_once_more(self):
        clock = Clock()
        at_times(Timeout(Scripted(R), 1.0, clock, wakes=True), clock, 0.0, 1.0)
        assert clock.is_woken


class TestDelay:
    def test_each_run_of_the_child_is_delayed(self):
        clock, child = Clock(), Scripted(R, S, F)
        delay = Delay(child, 0.5, clock, is_version_4=True)
        assert at_times(delay, clock, 1.0, 1.4, 1.5, 1.6, 1.7, 2.1, 2.2) == [R, R, R, S, R, R, F]

    def test_in_humble_each_tick_of_the_child_is_delayed(self):
        clock, child = Clock(), Scripted(R, S)
        delay = Delay(child, 0.5, clock, is_version_4=False)
        assert at_times(delay, clock, 1.0, 1.4, 1.5, 1.6, 2.0, 2.1) == [R, R, R, R, R, S]
        assert (child.ticks, child.halts, clock.is_woken) == (2, 0, False)

    def test_a_halt_while_it_waits_begins_the_time_anew(self):
        clock, child = Clock(), Scripted(S)
        delay = Delay(child, 0.5, clock, is_version_4=False)
        at_times(delay, clock, 0.0, 0.4)
        delay.stop()
        assert at_times(delay, clock, 0.6, 1.0, 1.1) == [R, R, S]
        assert child.ticks == 1

    def test_without_a_time_the_child_is_ticked_in_the_next_tick(self):
        clock = Clock()
        assert at_times(Delay(Scripted(S), 0.0, clock, is_version_4=False), clock, 0.0, 0.01) == [R, S]

    def test_the_tree_is_woken_once(self):
        clock = Clock()
        delay = Delay(Scripted(R), 0.5, clock, is_version_4=True)
        at_times(delay, clock, 0.0, 0.5)
        assert clock.is_woken
        clock.is_woken = False
        at_times(delay, clock, 0.6)
        assert not clock.is_woken
