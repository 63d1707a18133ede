"""A fitness with two objectives and a constraint, as a third party would write it."""

from __future__ import annotations

from evolution.search import Pattern, gini


class PenaltyAndGain(Pattern):
    """The two sides of Eq. 4.5 apart; at least half of all runs must succeed."""

    objectives = ("penalty", "negative_gain")
    constraints = ("failures",)

    def score(self, times):
        return gini(times)

    def judge(self, scores, maps):
        return max(scores) - min(scores) if len(scores) > 1 else 0.0

    def objectives_of(self, parts):
        return parts.penalty, -parts.gain

    def constraints_of(self, parts):
        return (0.5 - parts.success_rate,)
