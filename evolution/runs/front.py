"""The Pareto front of a search: its table, its hypervolume, and what held-out seeds leave of it.

The hypervolume is measured in the box between the best and the worst value of each objective over all sets that
violated no constraint (``violation`` is 0 in ``individuals.csv``); 1 is the whole box.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.indicators.hv import HV

from evolution.files import Row, counted
from evolution.search import FrontPoint

Floats = NDArray[np.float64]
HELD_OUT = "held_out_"
"""Beginning of the names of columns with values on held-out seeds."""


def front_rows(points: Sequence[FrontPoint], names: Sequence[str]) -> list[Row]:
    """Return the rows of ``front.csv``, by fitness.

    Args:
        points: The front.
        names: Names of the objectives, beginning with the fitness.
    """
    return [_front_row(number, point, names) for number, point in enumerate(points, start=1)]


def _front_row(number: int, point: FrontPoint, names: Sequence[str]) -> Row:
    found, values = point.held_out, point.values or (None,) * len(names)
    return {
        "set": number,
        "map_set": point.evaluation.map_set.digest,
        **dict(zip(names, point.evaluation.judgement.objectives, strict=True)),
        **{HELD_OUT + name: value for name, value in zip(names, values, strict=True)},
        "goals": None if found is None else found.goals,
        "runs": None if found is None else found.runs,
        "order_kept": None if found is None else found.order_kept,
        "remains": None if point.remains is None else int(point.remains),
    }


def objectives_in(front: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the names of the objectives in rows of ``front.csv``."""
    return [name.removeprefix(HELD_OUT) for name in front[0] if name.startswith(HELD_OUT)]


def hypervolumes(individuals: Sequence[Row], names: Sequence[str]) -> dict[int, float]:
    """Return the hypervolume of all sets evaluated so far, by the number of evaluations after each generation.

    Args:
        individuals: Rows of ``individuals.csv``.
        names: Names of the objectives.
    """
    box = _Box.of(individuals, names)
    volumes: dict[int, float] = {}
    for _, rows in groupby(individuals, key=lambda row: row["generation"]):
        count = max(volumes, default=0) + len(list(rows))
        volumes[count] = box.volume(individuals[:count])
    return volumes


def front_sentence(front: Sequence[Row], individuals: Sequence[Row], names: Sequence[str]) -> list[str]:
    """Return in words what held-out seeds leave of a front; nothing if it was not re-evaluated.

    Args:
        front: Rows of ``front.csv``.
        individuals: Rows of ``individuals.csv``.
        names: Names of the objectives.
    """
    again = [row for row in front if row["remains"] is not None]
    if not again:
        return []
    box = _Box.of(individuals, names)
    before = box.volume_of(_table(again, names))
    after = box.volume_of(_table([row for row in again if row["remains"]], [HELD_OUT + name for name in names]))
    goals, runs = (sum(row[name] for row in again) for name in ("goals", "runs"))
    return [
        f"{_remaining(len(front), len(again), sum(row['remains'] for row in again))} The hypervolume is {after:.2f}, "
        f"where the search reported {before:.2f}. {goals} of {counted(runs, 'run')} reach the goal."
    ]


def _remaining(sets: int, again: int, left: int) -> str:
    """Say how many sets of a front were re-evaluated, and how many of these remain on it."""
    which = "the only set" if sets == 1 else f"{again} of the {sets} sets"
    whether = "it remains" if left else "it does not remain"
    if again > 1:
        whether = f"{left} of these {'remains' if left == 1 else 'remain'}"
    return f"The search re-evaluated {which} of the Pareto front on held-out seeds; {whether} on it."


class _Box:
    """The box in which the hypervolume is measured.

    Args:
        names: Names of the objectives.
        ideal: Best value of each objective.
        worst: Worst value of each.
    """

    def __init__(self, names: Sequence[str], ideal: Floats, worst: Floats) -> None:
        self._names = names
        self._ideal, self._width = ideal, np.where(worst > ideal, worst - ideal, 1.0)

    @classmethod
    def of(cls, individuals: Sequence[Row], names: Sequence[str]) -> _Box:
        """Return the box of all sets that violated no constraint."""
        table = _table(feasible(individuals), names)
        if not len(table):
            return cls(names, np.zeros(len(names)), np.ones(len(names)))
        return cls(names, table.min(axis=0), table.max(axis=0))

    def volume(self, individuals: Sequence[Row]) -> float:
        """Return the hypervolume of those of some sets that violated no constraint."""
        return self.volume_of(_table(feasible(individuals), self._names))

    def volume_of(self, table: Floats) -> float:
        """Return the hypervolume of some points, ``(n, objectives)``."""
        points = np.maximum((table - self._ideal) / self._width, 0.0)  # held-out values may be better than the box's
        inside = points[(points < 1.0).all(axis=1)] if len(points) else points
        return float(HV(ref_point=np.ones(len(self._names)))(inside)) if len(inside) else 0.0


def feasible(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of ``individuals.csv`` whose sets violated no constraint."""
    return [row for row in rows if row.get("violation", 0.0) <= 0.0]


def _table(rows: Sequence[Row], names: Sequence[str]) -> Floats:
    return np.array([[row[name] for name in names] for row in rows], dtype=np.float64).reshape(-1, len(names))
