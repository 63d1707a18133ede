"""Sentences about the results of a run."""

from __future__ import annotations

from evolution.runs import contact_sentence


def test_runs_with_a_contact_are_counted():
    counted = [{"n_contacts": count} for count in (0.0, 2.0, 1.0, 0.0)]
    failed = {"n_contacts": None, "outcome": "error"}
    assert contact_sentence([*counted, failed]) == ["2 of 4 runs touch a wall or body (15.0 to 85.0 %)."]
    assert contact_sentence([{"outcome": "goal"}]) == [], "an earlier version counted none"
