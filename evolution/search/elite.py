"""The elite: the best sets so far. Their maps, and those that might improve them, get further seeds.

The best of many maps with single runs has a selection bias, which further seeds reduce (ranking and selection).
"""

from __future__ import annotations

from collections.abc import Iterable

from evolution.search.algorithms import Evaluation
from evolution.search.budget import Budget, runs_in
from evolution.search.expectations import Expectations
from evolution.search.settings import EvolveSettings


def race(expectations: Expectations, budget: Budget) -> None:
    """Drive further seeds on the maps that might make the best expected set better (racing).

    The maps are ranked by how good the best set would be if they were steady. The first ones may have most runs. Each
    gets a run of the controller about which least is known, or of each controller (:meth:`Expectations.turn`).

    Args:
        expectations: Ranks the maps; they are updated.
        budget: Limits the runs; ``elite_seeds`` maps for each map of a set are driven at most.
    """
    archive, settings = budget.archive, budget.settings
    size, seeds = settings.maps_per_set, settings.archive.elite_seeds
    potentials = expectations.potentials()
    further: dict[str, tuple[int, ...]] = {}
    for place, name in enumerate(sorted(potentials, key=potentials.__getitem__)):
        most = settings.repeats + 2 * seeds // (1 + place // size)
        if archive.repeats_of(name) < most and len(further) < seeds * size:
            more = further | {name: expectations.turn(name)}
            if runs_in(more) <= budget.runs:
                further = more
    archive.drive_more(further)
    expectations.update()


def give_further_seeds(front: Iterable[Evaluation], budget: Budget) -> None:
    """Drive the maps of a Pareto front with further seeds: those of the elite, then one more in each generation.

    Args:
        front: Its sets; of the last ones, nothing is driven where the runs do not suffice.
        budget: Limits the runs.
    """
    archive, settings = budget.archive, budget.settings
    further: dict[str, tuple[int, ...]] = {}
    for one in front:
        names = [scenario.world_digest for scenario in one.map_set]
        more = further | archive.missing({name: _next_repeats(archive.repeats_of(name), settings) for name in names})
        if runs_in(more) <= budget.runs:
            further = more
    archive.drive_more(further)


def _next_repeats(repeats: int, settings: EvolveSettings) -> int:
    """Return the number of repeats that a map of the front should have next."""
    if repeats < settings.elite_repeats:
        return settings.elite_repeats
    return max(repeats, min(repeats + 1, settings.most_elite_repeats))
