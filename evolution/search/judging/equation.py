"""The fitness of the thesis (Eq. 4.5): ``C_b (1 - s) + C_t t - w_p pattern s``, smaller is better.

``s`` is the success rate, ``t`` the number of timed-out runs per repeat. The first two terms are the penalty of a
set, the last one its gain.

The -1000 of Alg. 2 enters negated, as every pattern value does. Two equal Gini coefficients, or fewer than two maps
with a value, therefore cost ``w_p * 1000 * s``: 20 000 with the defaults and all runs successful. A set on which
every run failed costs 100. As in the thesis, sets without a pattern rank worse the more of their runs succeed. They
disappear as soon as a set with two different maps exists. Alg. 4 has no such jump: without a pattern it returns 0.
"""

from __future__ import annotations

from evolution.search.judging.settings import JudgingSettings


def penalty(weights: JudgingSettings, success_rate: float, timeouts: float) -> float:
    """Return ``C_b (1 - s) + C_t t``.

    Args:
        weights: C_b and C_t.
        success_rate: s.
        timeouts: t.
    """
    return weights.base_cost * (1.0 - success_rate) + weights.timeout_cost * timeouts


def gain(weights: JudgingSettings, pattern: float, success_rate: float = 1.0) -> float:
    """Return ``w_p pattern s``.

    Args:
        weights: w_p.
        pattern: Value of the pattern; greater is better.
        success_rate: s.
    """
    return weights.pattern_weight * pattern * success_rate
