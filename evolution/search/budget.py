"""The budget of a search: how many map sets it may still evaluate, and how many runs it may still ask for."""

from __future__ import annotations

from collections.abc import Mapping

from evolution.search.archive import Archive
from evolution.search.settings import EvolveSettings

NO_LIMIT = 2**62


class Budget:
    """What is left of the evaluations and runs of a search.

    Args:
        settings: Options of the search.
        archive: Counts the runs.
    """

    def __init__(self, settings: EvolveSettings, archive: Archive) -> None:
        self.settings = settings
        self.archive = archive
        self.controllers = len(archive.plan.controllers)

    def sets(self, evaluated: int, first: bool) -> int:
        """Return how many map sets may be evaluated next.

        Args:
            evaluated: Sets evaluated so far.
            first: Whether they are the first population, all maps of which are new.
        """
        options = self.settings
        one_map = not first and options.algorithm == "ga" and options.mutation.maps == "one"
        runs = self.controllers * options.repeats * (1 if one_map else options.maps_per_set)
        return min(options.evaluations - evaluated, self.runs // runs)

    @property
    def runs(self) -> int:
        """Runs that may still be asked for, without those that are kept back for the confirmation."""
        return self.runs_to_confirm - self.settings.runs_to_confirm(self.controllers)

    @property
    def runs_to_confirm(self) -> int:
        """Runs that may still be asked for."""
        return NO_LIMIT if self.settings.runs is None else self.settings.runs - self.archive.count

    def cost_of(self, repeats: Mapping[str, int]) -> int:
        """Return how many runs it takes until maps of the archive were driven so often, by digest."""
        missing = (wanted - self.archive.repeats_of(digest) for digest, wanted in repeats.items())
        return self.controllers * sum(max(number, 0) for number in missing)
