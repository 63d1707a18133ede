"""Former names of the columns of a study: rows are still read by them.

A table in ``tables/`` has the present names only; a :class:`StudyRow` from Python answers to both. The former table
``promises.csv`` is ``reported_fitness.csv``.
"""

from __future__ import annotations

from typing import Any

FORMER_COLUMNS = {
    "fresh_fitness": "held_out_fitness",
    "fresh_fitness_as_searched": "held_out_fitness_as_searched",
    "fresh_success_rate": "held_out_success_rate",
    "fresh_low": "held_out_low",
    "fresh_high": "held_out_high",
    "fresh": "held_out_fitness",
    "seen": "reported_fitness",
    "claimed": "reported_fitness",
    "seen_s": "searched_s",
    "winners_curse": "selection_bias",
    "order_kept": "rank_agreement",
    "order": "rank_agreement",
    "off": "absolute_error",
    "kept": "within_half",
    "goals": "held_out_success_rate",
    "reading": "score",
}
"""Former name of a column, and its present name."""


class StudyRow(dict[str, Any]):
    """A row of a study's table, which is also read by the former names of its columns."""

    def __missing__(self, name: str) -> Any:
        """Return the value under the present name; raises ``KeyError`` if the row has no such column."""
        present = FORMER_COLUMNS.get(name, name)
        if present not in self:
            raise KeyError(name)
        return self[present]
