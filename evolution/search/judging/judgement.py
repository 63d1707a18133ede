"""The answer of judging: objectives and constraints of a set, what each map contributes, and how answers compare."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeVar


class JudgedMap(NamedTuple):
    """What a map contributes to any set.

    Args:
        score: Its score; None where the map has no value.
        values: The aggregated value of each controller; None where the map has no value.
        successes: Successful runs in all trials.
        runs: Runs in all trials, those that were left out among them.
        timeouts: Timed-out runs per repeat.
        spread: By how much its score counts as less extreme.
    """

    score: float | None
    values: tuple[float, ...] | None
    successes: float
    runs: int
    timeouts: float
    spread: float

    @property
    def success_rate(self) -> float:
        """Successful runs / all runs."""
        return self.successes / self.runs


@dataclass(frozen=True)
class Judgement:
    """How good one map set is.

    Args:
        objectives: Values to minimise; the first is the fitness that tables and pages show.
        success_rate: s of Eq. 4.5: successful runs / all runs.
        timeouts: t of Eq. 4.5: timed-out runs per repeat.
        pattern: How good the scores are together; greater is better.
        scores: The score of each map, e.g. its Gini coefficient; None where the map has no value.
        values: For each map the aggregated value of each controller; None where the map has no value.
        constraints: Values that must not be above 0.
    """

    objectives: tuple[float, ...]
    success_rate: float
    timeouts: float
    pattern: float
    scores: tuple[float | None, ...]
    values: tuple[tuple[float, ...] | None, ...]
    constraints: tuple[float, ...] = ()

    @property
    def fitness(self) -> float:
        """The first objective."""
        return self.objectives[0]

    @property
    def rank_key(self) -> tuple[float, tuple[float, ...]]:
        """Sort key, the best first: by the sum of violated constraints, then by the objectives in their order."""
        return sum(max(one, 0.0) for one in self.constraints), self.objectives

    def gain_over(self, other: Judgement) -> float:
        """Return by how much the fitness is better than another; negative if it is worse."""
        return other.fitness - self.fitness


class Judged(Protocol):
    """Anything with a judgement."""

    @property
    def judgement(self) -> Judgement:
        """How good it is."""
        ...


T = TypeVar("T", bound=Judged)


def best_of(judged: Iterable[T]) -> T:
    """Return the best; of equals, the first."""
    return min(judged, key=lambda one: one.judgement.rank_key)


def order_of(scores: Sequence[float | None]) -> tuple[int, ...] | None:
    """Return the rank of each map by its score, 0 for the smallest; equal scores share one. None if a score is missing.

    Cluster scores and numbers of groups are often equal, because they have a smallest and a largest value.
    """
    known = [score for score in scores if score is not None]
    ranks = {score: rank for rank, score in enumerate(sorted(set(known)))}
    return tuple(ranks[score] for score in known) if len(known) == len(scores) else None


def order_kept(trials: Iterable[Judgement], scores: Sequence[float | None], ordered: bool) -> list[bool]:
    """Return for each trial whether the scores of its maps have the ranks of given scores.

    Args:
        trials: Judgements of trials of a set.
        scores: One score for each map, None for a map without one; no trial has their order if a score is missing.
        ordered: Whether the order counts in the fitness; if not, every trial has it.
    """
    wanted = order_of(scores)
    return [wanted is not None and (order_of(one.scores) == wanted or not ordered) for one in trials]


def values_in_order(trials: Iterable[Judgement], kept: Iterable[bool]) -> list[float]:
    """Return the fitness of each trial; a trial that loses the order of the maps counts as 0, or as its penalty."""
    return [one.fitness if in_order else max(one.fitness, 0.0) for one, in_order in zip(trials, kept, strict=True)]
