from __future__ import annotations

import pytest

from controllers.navigator.action_nodes import ActionNode
from controllers.navigator.actions import ActionServer, Outcome, Result
from controllers.navigator.behavior_tree import Status
from controllers.navigator.cancel_node import CancelGoals
from controllers.navigator.latency import LATENCIES, Latency
from controllers.navigator.rate import Clock
from tests.controllers.navigator.test_actions import Cycles
from tests.controllers.navigator.test_behavior_tree import F, R, S


class Asking(ActionNode):
    """A leaf whose goals take 100 cycles."""

    def __init__(self, clock: Clock, server: ActionServer, latency: Latency) -> None:
        super().__init__(clock, server, latency)
        self.results: list[Result] = []

    def make_goal(self) -> int:
        return 100

    def on_result(self, outcome: Outcome) -> None:
        self.results.append(outcome.result)


def begun(latency: Latency) -> tuple[Clock, ActionServer, Asking, CancelGoals]:
    """Return a leaf whose goal was accepted at 0 s, and a leaf that cancels it."""
    clock = Clock()
    server = ActionServer(Cycles(), latency)
    leaf = Asking(clock, server, latency)
    assert leaf.execute_tick() is R
    return clock, server, leaf, CancelGoals(server, clock)


@pytest.mark.parametrize("latency", ["ideal", "nav2"])
def test_a_cancelled_goal_ends_and_its_leaf_succeeds(latency):
    clock, server, leaf, cancel = begun(LATENCIES[latency])
    clock.now = 0.05
    assert cancel.execute_tick() is S
    assert clock.now == pytest.approx(0.05 + 2.0 * LATENCIES[latency].message)
    clock.now = 0.2
    assert leaf.execute_tick() is S
    assert (leaf.results, server.executor.log[-1]) == ([Result.CANCELED], "cancel")


@pytest.mark.parametrize(("now", "cancelled"), [(0.009, False), (0.0110, True)])
def test_goals_younger_than_10_ms_are_left_alone(now, cancelled):
    clock, server, _, cancel = begun(LATENCIES["nav2"])
    clock.now = now
    assert cancel.execute_tick() is S
    server.advance(1.0)
    assert ("cancel" in server.executor.log) == cancelled


def test_it_succeeds_without_a_goal_and_fails_without_an_answer_in_20_ms():
    clock = Clock()
    assert CancelGoals(ActionServer(Cycles(), LATENCIES["nav2"]), clock).execute_tick() is S
    assert CancelGoals(ActionServer(Cycles(), Latency(message=0.011)), clock).execute_tick() is F
    assert clock.now == pytest.approx(0.001 + 0.02)


def test_a_halt_does_not_wait_for_a_goal_that_is_cancelled_already():
    clock, server, leaf, cancel = begun(LATENCIES["nav2"])
    clock.now = 0.05
    cancel.execute_tick()
    halted_at = clock.now
    leaf.stop()
    assert (clock.now, leaf.status, leaf.results) == (halted_at, Status.IDLE, [])
    server.advance(1.0)
    assert server.executor.log[-1] == "cancel"


def test_a_halt_cancels_a_goal_that_nobody_has_cancelled():
    clock, _, leaf, _ = begun(LATENCIES["nav2"])
    clock.now = 0.05
    leaf.stop()
    assert clock.now > 0.05
    assert leaf.results == [Result.CANCELED]
