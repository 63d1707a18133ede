"""The options of an atlas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.quantities import Count, Few
from gym_mapbench.settings import OptionError, Settings

MOST_AXES = 2
Ratio = Annotated[float, Field(gt=1.0, le=100.0)]
CellsOfAxis = Annotated[int, Field(ge=3, le=101)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class AtlasSettings(Settings):
    """How an atlas is filled.

    Args:
        runs: Runs of controllers in the search; the held-out runs follow.
        pairs: The axes, one or two: ``A/B`` is the time of controller A over that of B. If empty, the second and the
            third controller over the first.
        cells: Cells along each axis; an odd number has a cell around the ratio 1.
        largest_ratio: Ratio at the end of each axis; larger ratios are in the last cell.
        repeats: Runs of each controller on a map before it enters a cell.
        held_out_seeds: Runs of each controller on each elite after the search.
        batch: New maps that are evaluated at a time.
        fresh: Probability that a new map is sampled; all others are mutated elites. 1 is random sampling.
    """

    runs: Count = 1000
    pairs: tuple[str, ...] = ()
    cells: CellsOfAxis = 15
    largest_ratio: Ratio = 4.0
    repeats: Few = 3
    held_out_seeds: Few = 5
    batch: Few = 8
    fresh: Share = 0.3

    def axes(self, controllers: Sequence[str]) -> tuple[tuple[int, int], ...]:
        """Return the axes as pairs of places among the controllers.

        Raises:
            ConfigError: If there are fewer than two controllers, or the pairs are not one or two of their names.
        """
        if len(controllers) < 2:
            raise ConfigError(f"controllers: expected two or more to compare, got {', '.join(controllers)} alone")
        if not self.pairs:
            return tuple((place, 0) for place in range(1, min(len(controllers), MOST_AXES + 1)))
        if len(self.pairs) > MOST_AXES:
            raise OptionError("pairs", f"expected one or two, got {', '.join(self.pairs)}")
        axes = tuple(_places(pair, controllers) for pair in self.pairs)
        if len({frozenset(axis) for axis in axes}) < len(axes):
            raise OptionError("pairs", f"expected different pairs, got {', '.join(self.pairs)}")
        return axes

    def check(self, controllers: Sequence[str]) -> None:
        """Refuse options that do not go together with the controllers.

        Raises:
            ConfigError: Naming the option, the expected value, and the given one.
        """
        self.axes(controllers)
        if self.runs < (needed := len(controllers) * self.repeats):
            raise OptionError("runs", f"expected at least {needed}, which one map needs, got {self.runs}")


def _places(pair: str, controllers: Sequence[str]) -> tuple[int, int]:
    """Return the places of the two controllers of a pair."""
    names = tuple(name.strip() for name in pair.split("/"))
    if len(names) != 2 or names[0] == names[1]:
        raise OptionError("pairs", f"expected two controllers as A/B, got {pair!r}")
    for name in names:
        if name not in controllers:
            raise OptionError("pairs", str(unknown_name("controller", name, controllers)))
    return controllers.index(names[0]), controllers.index(names[1])
