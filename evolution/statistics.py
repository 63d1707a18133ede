"""Statistics of a study: every p-value comes with its effect size and n.

Tests are SciPy's, imported where they are used, because the import takes a second that every command would pay. What
SciPy lacks (Holm's correction, A12, Nemenyi's critical difference) is here, and so is Wilson's interval, which most
commands print.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from gym_mapbench.errors import ConfigError

CONFIDENCE = 0.95
"""Confidence of all intervals."""
TAILS = (1.0 - CONFIDENCE) / 2, (1.0 + CONFIDENCE) / 2
"""Shares below the ends of an interval."""
LEVEL = 0.05
"""Significance level of the p-values, which Holm has corrected."""
FEWEST_FOR_INTERVAL = 5
"""Fewest values for a bootstrap interval; fewer give too few different resamples to bound anything."""
RESAMPLES = 2000
"""Resamples of a bootstrap interval."""
BOOTSTRAP_SEED = 0


@dataclass(frozen=True)
class Summary:
    """One row of a table like the thesis' Table 5.2.

    ``std`` is the sample standard deviation, NaN for n = 1; ``ci_low`` and ``ci_high`` bound the median, NaN for
    fewer than :data:`FEWEST_FOR_INTERVAL` values.
    """

    n: int
    mean: float
    std: float
    median: float
    minimum: float
    maximum: float
    ci_low: float
    ci_high: float


@dataclass(frozen=True)
class TestResult:
    """The result of a test, with what is needed to interpret its p-value.

    Args:
        test: Name of the test.
        groups: Names of the groups compared.
        n: Size of each group.
        statistic: The test's statistic.
        p_value: Two-sided; corrected where the test says so.
        effect: Effect size.
        effect_name: Name of the effect size.
    """

    __test__ = False  # not a test class, whatever its name looks like to pytest

    test: str
    groups: tuple[str, ...]
    n: tuple[int, ...]
    statistic: float
    p_value: float
    effect: float
    effect_name: str

    def __str__(self) -> str:
        sizes = ", ".join(map(str, self.n))
        return (
            f"{self.test} ({' vs '.join(self.groups)}): statistic {self.statistic:.3f}, p = {self.p_value:.3g}, "
            f"{self.effect_name} = {self.effect:.3f}, n = {sizes}"
        )


def summarize(values: ArrayLike) -> Summary:
    """Summarise one sample; the interval is that of :func:`median_interval`."""
    sample = np.asarray(values, dtype=float)
    low, high = median_interval(sample)
    spread = float(sample.std(ddof=1)) if len(sample) > 1 else np.nan
    return Summary(
        n=len(sample),
        mean=float(sample.mean()),
        std=spread,
        median=float(np.median(sample)),
        minimum=float(sample.min()),
        maximum=float(sample.max()),
        ci_low=low,
        ci_high=high,
    )


def median_interval(values: ArrayLike) -> tuple[float, float]:
    """Percentile bootstrap interval of the median; NaN for fewer than :data:`FEWEST_FOR_INTERVAL` values.

    It is exact: the distribution of the median of all possible resamples is computed and not sampled (Efron, "Bootstrap
    methods: another look at the jackknife", 1979, section 3, for odd n). Drawn resamples of a few values give bounds
    that depend on the seed, because few different medians are possible.
    """
    ordered = np.sort(np.asarray(values, dtype=float))
    if len(ordered) < FEWEST_FOR_INTERVAL:
        return np.nan, np.nan
    medians, chances = _medians_of_resamples(ordered)
    order = np.argsort(medians, kind="stable")
    cumulated = np.cumsum(chances[order])
    places = np.searchsorted(cumulated, TAILS)
    low, high = medians[order][np.minimum(places, len(medians) - 1)]
    return float(low), float(high)


def _medians_of_resamples(ordered: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the possible medians of resamples of some values in ascending order, and their chances, both ``(m,)``."""
    n = len(ordered)
    half, ranks = (n + 1) // 2, np.arange(n + 1)
    # Chance that the value of rank ``half`` in a resample is among the first values: of none, of one, of two...
    below = scipy.special.bdtrc(half - 1, n, ranks / n)
    if n % 2:
        return ordered, np.diff(below)
    # With even n the median is the mean of two values of a resample, which come from the places i and j > i of the
    # sample if one half of the resample ends at i and the other one begins at j; in logarithms, as these are small.
    ends = half * np.log(ranks[1:] / n) + np.log1p(-((ranks[:-1] / ranks[1:]) ** half))
    ways = math.lgamma(n + 1) - 2 * math.lgamma(half + 1)
    later = np.triu(np.ones((n, n), dtype=bool), 1)
    pairs = np.exp(np.where(later, ways + ends[:, None] + ends[None, ::-1], -np.inf))
    chances = pairs + np.diag(np.diff(below) - pairs.sum(axis=1))
    first, second = np.nonzero(np.triu(np.ones((n, n), dtype=bool)))
    return (ordered[first] + ordered[second]) / 2, chances[first, second]


def wilson_interval(successes: float, n: float) -> tuple[float, float]:
    """Wilson's interval of a share; (0, 1) if there is no trial.

    Neither number need be whole, as runs that depend on each other count as fewer.
    Source: Newcombe (1998), method 3. These are the bits of ``scipy.stats``, which takes a second to import.
    """
    if n == 0:
        return 0.0, 1.0
    z = float(scipy.special.ndtri(0.5 + 0.5 * CONFIDENCE))
    share, scale = successes / n, 2 * (n + z**2)
    middle = (2 * n * share + z**2) / scale
    reach = z / scale * math.sqrt(4 * n * share * (1 - share) + z**2)
    return 0.0 if successes == 0 else middle - reach, 1.0 if successes == n else middle + reach


def share_interval(share: float, groups: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Wilson's interval of a share of trials that come in groups, such as the runs on one map.

    The trials of a group may depend on each other, so they count as fewer: by the design effect, the variance of the
    share between groups over that of independent trials (Kish 1965). Few groups can all be alike by chance, so the
    design effect is that of two more groups, of which one always succeeds and one always fails. With one trial in
    each group it is Wilson's interval of the trials.

    Args:
        share: The share.
        groups: The trials of each group, 1 for a success and 0 for a failure.
    """
    sizes = np.array([len(group) for group in groups], dtype=float)
    n = float(sizes.sum())
    if n == 0:
        return wilson_interval(0, 0)
    weights = np.append(sizes, [sizes.mean()] * 2)
    shares = np.array([*map(np.mean, groups), 1.0, 0.0])
    total, mean = weights.sum(), np.average(shares, weights=weights)
    between = len(weights) / (len(weights) - 1) * ((weights * (shares - mean)) ** 2).sum() / total**2
    effect = between / (mean * (1 - mean) / total)
    effective = n / float(np.clip(effect, 1.0, (sizes**2).sum() / n))
    return wilson_interval(share * effective, effective)


def share_difference_interval(
    first: Sequence[Sequence[float]], second: Sequence[Sequence[float]]
) -> tuple[float, float]:
    """Interval of the second share minus the first, of paired trials that come in groups; (-1, 1) if there is no trial.

    It joins the intervals of both shares by the correlation of the groups (Newcombe 1998, "Improved confidence
    intervals for the difference between binomial proportions based on paired data", method 10). Unlike a bootstrap
    interval it has a width where no trial differs, because a positive correlation is corrected for continuity.

    Args:
        first: Trials of each group, as for :func:`share_interval`.
        second: Those of the other side in the same groups, in the same order.
    """
    if not first:
        return -1.0, 1.0
    sizes = [len(group) for group in first]
    means = [[*map(np.mean, groups)] for groups in (first, second)]
    a, b = (float(np.average(side, weights=sizes)) for side in means)
    (a_low, a_high), (b_low, b_high) = share_interval(a, first), share_interval(b, second)
    (var_a, cov), (_, var_b) = np.cov(means, ddof=0, aweights=sizes)
    cov = max(cov - 0.5 / len(first), min(cov, 0.0))
    correlation = cov / math.sqrt(var_a * var_b) if min(var_a, var_b) > 0 else 0.0

    def reach(of_a: float, of_b: float) -> float:
        return math.sqrt(max(of_a**2 + of_b**2 - 2 * correlation * of_a * of_b, 0.0))

    return b - a - reach(a_high - a, b - b_low), b - a + reach(a - a_low, b_high - b)


def bootstrap_interval(
    values: ArrayLike, rng: np.random.Generator, counts: ArrayLike | None = None
) -> tuple[float, float]:
    """Expanded percentile bootstrap interval of the mean.

    The percentiles lie further out than those of the resamples, as Student's quantile lies beyond the normal one: the
    plain percentile interval of five values holds the mean in 85 % of samples only (Hesterberg 2015, section 5.3).

    Args:
        values: The values that are resampled.
        rng: Samples the resamples.
        counts: By how much each value counts in the mean, above 0: such as the runs whose mean it is; None for alike.

    Raises:
        ConfigError: If there are fewer than two values.
    """
    sample = np.asarray(values, dtype=float)
    if len(sample) < 2:
        raise ConfigError(f"bootstrap: expected at least two values, got {len(sample)}")
    weights = np.ones(len(sample)) if counts is None else np.asarray(counts, dtype=float) / np.max(counts)
    places = rng.integers(0, len(sample), (RESAMPLES, len(sample)))
    means = (weights * sample)[places].sum(axis=1) / weights[places].sum(axis=1)
    low, high = np.quantile(means, _expanded_tails(len(sample)))
    return float(low), float(high)


def mean_interval(groups: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Bootstrap interval of the mean of values that come in groups, such as the runs on one map.

    The groups are resampled, and each counts by its values. It is NaN for means without :func:`has_interval`.
    """
    means = [*map(fmean, groups)]
    if not has_interval(means):
        return np.nan, np.nan
    return bootstrap_interval(means, np.random.default_rng(BOOTSTRAP_SEED), [*map(len, groups)])


def has_interval(values: Sequence[float]) -> bool:
    """Whether a bootstrap interval bounds the mean of some values.

    Fewer than :data:`FEWEST_FOR_INTERVAL` have too few resamples, and values that are equal, but for rounding errors,
    have only equal ones: an interval without width would say that the mean is known exactly.
    """
    return len(values) >= FEWEST_FOR_INTERVAL and not math.isclose(min(values), max(values))


def _expanded_tails(n: int) -> tuple[float, float]:
    """Return the shares of resamples of ``n`` values below the ends of an interval of their mean."""
    below = float(scipy.special.ndtr(math.sqrt(n / (n - 1)) * scipy.special.stdtrit(n - 1, TAILS[0])))
    return below, 1.0 - below


def kruskal_wallis(groups: Mapping[str, ArrayLike]) -> TestResult:
    """Whether several groups come from one distribution (thesis: H = 0.44, p = 0.80 over populations).

    The effect size is epsilon squared, H / (n - 1).
    """
    from scipy import stats

    samples = _samples(groups)
    sizes = tuple(map(len, samples))
    if np.ptp(np.concatenate(samples)) == 0:
        statistic, p_value = 0.0, 1.0
    else:
        statistic, p_value = map(float, stats.kruskal(*samples))
    effect = statistic / (sum(sizes) - 1)
    return TestResult("Kruskal-Wallis", tuple(groups), sizes, statistic, p_value, effect, "epsilon^2")


def pairwise_mann_whitney(
    groups: Mapping[str, ArrayLike], pairs: Sequence[tuple[str, str]] | None = None
) -> list[TestResult]:
    """Mann-Whitney U of several pairs, p-values corrected by Holm over all of them.

    The effect size is A12 for values of which the smaller is better: the chance that a value of the first group is
    smaller than one of the second, ties half.

    Args:
        groups: Values by name.
        pairs: The pairs of names that are compared; all pairs if None.
    """
    from scipy import stats

    pairs = list(itertools.combinations(groups, 2)) if pairs is None else pairs
    samples = dict(zip(groups, _samples(groups), strict=True))
    raw = [stats.mannwhitneyu(samples[a], samples[b], alternative="two-sided") for a, b in pairs]
    corrected = holm([float(result.pvalue) for result in raw])
    return [
        TestResult(
            "Mann-Whitney U, Holm",
            (a, b),
            (len(samples[a]), len(samples[b])),
            float(result.statistic),
            p_value,
            vargha_delaney_a12(samples[b], samples[a]),
            "A12",
        )
        for (a, b), result, p_value in zip(pairs, raw, corrected, strict=True)
    ]


def holm(p_values: Sequence[float]) -> list[float]:
    """Holm's step-down correction, in the given order (Holm 1979)."""
    order = np.argsort(p_values, kind="stable")
    factors = len(p_values) - np.arange(len(p_values))
    stepped = np.minimum(np.maximum.accumulate(np.asarray(p_values)[order] * factors), 1.0)
    corrected = np.empty(len(p_values))
    corrected[order] = stepped
    return [float(p) for p in corrected]


def p_in_words(p_value: float) -> str:
    """Return a p-value as sentences give it."""
    return "p < 0.001" if p_value < 0.001 else f"p = {p_value:.2g}"


def vargha_delaney_a12(first: ArrayLike, second: ArrayLike) -> float:
    """Probability that a value of ``first`` is larger than one of ``second``, ties half (Vargha, Delaney 2000)."""
    a, b = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    difference = np.sign(a[:, None] - b[None, :])
    return float((difference.mean() + 1) / 2)


def cliffs_delta(first: ArrayLike, second: ArrayLike) -> float:
    """Cliff's delta, 2 A12 - 1."""
    return 2 * vargha_delaney_a12(first, second) - 1


def friedman(table: ArrayLike, methods: Sequence[str]) -> TestResult:
    """Whether several methods differ over several problems; ``table`` is ``(problems, methods)``.

    The effect size is Kendall's W.
    """
    from scipy import stats

    values = np.asarray(table, dtype=float)
    problems, count = values.shape
    if count < 3 or problems < 2:
        raise ConfigError(f"Friedman: expected at least 2 problems and 3 methods, got {problems} and {count}")
    if (np.ptp(values, axis=1) == 0).all():  # SciPy divides by zero where all ranks are tied
        statistic, p_value = 0.0, 1.0
    else:
        statistic, p_value = map(float, stats.friedmanchisquare(*values.T))
    agreement = statistic / (problems * (count - 1))
    return TestResult("Friedman", tuple(methods), (problems,) * count, statistic, p_value, agreement, "Kendall's W")


def critical_difference(table: ArrayLike) -> tuple[NDArray[np.float64], float]:
    """Mean ranks ``(methods,)`` (1 = smallest value) and Nemenyi's critical difference (Demsar 2006)."""
    from scipy import stats

    values = np.asarray(table, dtype=float)
    problems, count = values.shape
    ranks = stats.rankdata(values, axis=1).mean(axis=0)
    q = stats.studentized_range.ppf(CONFIDENCE, count, np.inf) / np.sqrt(2)
    return ranks, float(q * np.sqrt(count * (count + 1) / (6 * problems)))


def rank_correlation(first: ArrayLike, second: ArrayLike) -> tuple[float, float, float]:
    """Spearman's rho with an approximate interval by Fisher's transformation (Bonett and Wright 2000).

    The transformation of 1 is infinite, which would be an interval without width: where all pairs agree, the interval
    is that of lists in which two neighbours have changed places, and reaches up to 1.

    Returns:
        ``(rho, low, high)``; the interval is (-1, 1) for fewer than five pairs, all NaN for fewer than
        two or where one side does not vary.
    """
    from scipy import stats

    a, b = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if len(a) != len(b):
        raise ConfigError(f"rank correlation: expected two lists of one length, got {len(a)} and {len(b)}")
    if len(a) < 2 or np.ptp(a) == 0 or np.ptp(b) == 0:
        return np.nan, np.nan, np.nan
    rho = float(stats.spearmanr(a, b).statistic)
    if len(a) < 5:
        return rho, -1.0, 1.0
    spread = np.sqrt((1 + rho**2 / 2) / (len(a) - 3)) * stats.norm.ppf(TAILS[1])
    almost = 1.0 - 12.0 / (len(a) * (len(a) ** 2 - 1))
    middle = np.arctanh(np.clip(rho, -almost, almost))
    return rho, min(float(np.tanh(middle - spread)), rho), max(float(np.tanh(middle + spread)), rho)


def _samples(groups: Mapping[str, ArrayLike]) -> list[NDArray[np.float64]]:
    samples = [np.asarray(values, dtype=float) for values in groups.values()]
    empty = [name for name, sample in zip(groups, samples, strict=True) if len(sample) == 0]
    if len(samples) < 2 or empty:
        got = f"no value in {empty[0]!r}" if empty else f"{len(samples)} group"
        raise ConfigError(f"comparison: expected at least two groups with values, got {got}")
    return samples
