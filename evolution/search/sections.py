"""The sections of the options of a search that have no room of their own: archive and validation stage."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from evolution.search.judging.expected_fitness import RELIABILITY
from gym_mapbench.quantities import Few
from gym_mapbench.settings import OptionError, Settings

Seeds = Annotated[int, Field(ge=2)]


class ArchiveSettings(Settings):
    """How the archive of all evaluated maps takes part in a search.

    Args:
        elite: Whether the best expected set of the archive joins the population after every generation. With several
            objectives, the elite are the sets of the Pareto front.
        elite_seeds: After every generation this number of maps, for each map of a set, gets a further seed: maps that
            might make the best set better. The maps of the best set get up to twice as many. With ``surrogate`` one
            controller drives a seed, that about whose mean time least is known; otherwise all do. With several
            objectives: further runs on the maps of the Pareto front, and one more after every generation that a map
            stays in it, up to four times as many.
        staged: Whether controllers run on a map one after the other, the cheapest first, until one fails. Only runs
            that cannot change the search are left out. A failure policy that gives failed runs a value leaves out none.
        parents: Whether an offspring is the best expected set of the archive with one map replaced by a mutated map of
            the archive or a sampled map. With ``staged``, the controller whose values differ most between maps runs
            first, and the others run only on maps that may join the best set. If not, offspring are crossed and mutated
            sets of the population. Only with ``elite`` and one objective.
        surrogate: Whether Gaussian processes over the genes of maps of motifs estimate the values of controllers, also
            on new maps: the best of twelve mutated and twelve sampled maps is evaluated. If not, a map's estimate is
            shrunk towards that of its parent.
    """

    elite: bool = False
    elite_seeds: Annotated[int, Field(ge=0, le=100_000)] = 0
    staged: bool = True
    parents: bool = False
    surrogate: bool = False

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.elite_seeds and not self.elite:
            raise OptionError("elite_seeds", f"expected 0 without elite, got {self.elite_seeds}")
        return self


class ValidationSettings(Settings):
    """How the best maps are validated on held-out seeds before the best set is named.

    Args:
        seeds: Held-out seeds that the maps of the selected set get, besides those of the rounds.
        candidates: The rounds have the runs of this number times ``seeds`` to distribute, a third in each (sequential
            halving): so many maps get one held-out seed, the better half of them two more, and half of these four more.
            As with ``elite_seeds``, one controller or all drive a seed.
        held_out_seeds: Further held-out seeds of the chosen set; its held-out fitness is measured on these alone.
        reliability: Share of the trials of a set in which its maps should keep the ranks of their scores without a
            failed run. A set with a smaller share costs that part of a timeout by which it misses this one, when the
            set is chosen. During the search, failures alone cost so.
        avoid_contact: Whether a set is chosen only among the maps on which no run touched a wall or body, where these
            suffice. Contacts are what a simulator and Gazebo agree on least.
    """

    seeds: Seeds = 5
    candidates: Few = 9
    held_out_seeds: Seeds = 10
    reliability: Annotated[float, Field(gt=0, lt=1)] = RELIABILITY
    avoid_contact: bool = False

    @property
    def seeds_of_set(self) -> int:
        """Held-out seeds for which runs of a whole set are reserved: two selections, and the held-out fitness."""
        return 2 * self.seeds + self.held_out_seeds
