"""The budget of a search: the map sets and the runs that are left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from evolution.search.archive import Archive
from evolution.search.settings import EvolveSettings

NO_LIMIT = 2**62


class Budget:
    """The evaluations and runs that a search has left.

    Args:
        settings: Options of the search.
        archive: Every evaluated map, with all runs so far.
    """

    def __init__(self, settings: EvolveSettings, archive: Archive) -> None:
        self.settings = settings
        self.archive = archive
        self.controllers = len(archive.plan.controllers)

    def sets(self, evaluated: int, first: bool) -> int:
        """Return the number of map sets that may be evaluated next.

        Args:
            evaluated: Sets evaluated so far.
            first: Whether they are the first population, all maps of which are new.
        """
        options = self.settings
        one_map = not first and options.ga.kind.varies and options.ga.mutation.maps == "one"
        runs = self.controllers * options.repeats * (1 if one_map else options.maps_per_set)
        return min(options.evaluations - evaluated, self.runs // runs)

    @property
    def runs(self) -> int:
        """Runs that are left for the search, without those reserved for the validation stage."""
        return self.all_runs - self.settings.validation_runs(self.controllers)

    @property
    def all_runs(self) -> int:
        """Runs that are left."""
        return NO_LIMIT if self.settings.runs is None else self.settings.runs - self.archive.count


def runs_in(further: Mapping[str, Sequence[int]]) -> int:
    """Return the number of further runs, given for each map and controller."""
    return sum(map(sum, further.values()))
