"""The result of a minimisation, and the directory that holds it.

::

    minimize.json     map, controllers, world, verdict and seed, and the versions it was begun with
    results.sqlite    every run, as it ends
    maps.json         the original map and the smallest map, as a map set
    summary.json      number of obstacles, verdict on held-out seeds, and all steps
    report.html       both maps side by side with replays
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from evolution.files import DirectoryKind, Document, Row, Table, Tabled, advising, counted, read_document
from evolution.minimizing.obstacles import obstacles_of
from gym_mapbench.errors import RunError
from gym_mapbench.mapio import load_map_set
from gym_mapbench.world.scenario import Scenario

MINIMIZATION = DirectoryKind("minimization", "minimize.json", format_version=1, remade=True)
MAPS, SUMMARY = "maps.json", "summary.json"


class MinimizedSummary(Document):
    """``summary.json``."""

    keep: str
    held_before: list[bool]
    held_after: list[bool]
    steps: list[Row]


@dataclass(frozen=True)
class Minimized(Tabled):
    """A map before and after minimisation.

    Args:
        before: The original map with its task.
        after: The smallest map on which the verdict holds.
        keep: The verdict.
        held_before: For each held-out seed, whether the verdict holds on the original map.
        held_after: The same for the smallest map.
        steps: One row per smaller map: its number of obstacles and of occupied cells.
    """

    before: Scenario
    after: Scenario
    keep: str
    held_before: tuple[bool, ...]
    held_after: tuple[bool, ...]
    steps: tuple[Row, ...]

    @property
    def tables(self) -> Mapping[str, Callable[[], Table]]:
        """``maps``, the original and the smallest one, and ``steps``, all smaller maps."""
        return {"maps": self._maps, "steps": self._steps}

    def _steps(self) -> Table:
        return Table({name.replace("_", " "): value for name, value in row.items()} for row in self.steps)

    def _maps(self) -> Table:
        sides = (("before", self.before, self.held_before), ("after", self.after, self.held_after))
        return Table(
            {
                "map": what,
                "obstacles": len(obstacles_of(scenario.map)),
                "occupied cells": int(scenario.map.occupancy.sum()),
                "verdict on held-out seeds": f"{sum(held)}/{len(held)}",
            }
            for what, scenario, held in sides
        )

    def sentences(self) -> list[str]:
        """Return the result in words."""
        before, after = self.table()
        sure = sum(self.held_after) == len(self.held_after)
        trials = counted(len(self.held_after), "trial")
        enough = "The obstacles that are left are enough for the verdict."
        needed = enough if after["obstacles"] else "The verdict needs no obstacle."
        return [
            f"{counted(before['obstacles'], 'obstacle becomes', 'obstacles become')} {after['obstacles']}, and "
            f"the verdict '{self.keep}' still holds.",
            f"On held-out seeds the verdict holds in {sum(self.held_after)} of {trials} on the smallest map, and in "
            f"{sum(self.held_before)} on the original map.",
            needed
            if sure
            else "The verdict depends on noise: repeat with more --seeds for a map on which it is certain.",
        ]

    def document(self) -> Row:
        """Return everything but the maps, JSON-able."""
        held = {"held_before": list(self.held_before), "held_after": list(self.held_after)}
        return {"keep": self.keep, "maps": list(self.table()), **held, "steps": list(self.steps)}


def load_minimized(path: Path) -> Minimized:
    """Return the result in a directory.

    Raises:
        RunError: If it is not finished, damaged, or mixed with another minimization.
    """
    config = MINIMIZATION.open(path)
    if not (path / SUMMARY).is_file():
        raise RunError(f"{path}: the minimization was not finished; continue it with --resume")
    with advising():
        result, summary = _read(path)
        if result.document() != summary:
            raise RunError(f"{path / SUMMARY}: expected the summary of the maps in {MAPS}, got another")
        if result.before.digest != config.get("minimization", {}).get("map_digest"):
            raise RunError(f"{path / MAPS}: expected the map of {MINIMIZATION.mark} and the smallest map, got others")
    return result


def _read(path: Path) -> tuple[Minimized, Row]:
    """Return the result in a finished directory, and its summary."""
    summary = read_document(MinimizedSummary, path / SUMMARY)
    maps = load_map_set(path / MAPS)
    if len(maps) != 2:
        raise RunError(f"{path / MAPS}: expected the original and the smallest map, got {counted(len(maps), 'map')}")
    before, after = maps
    held = tuple(summary["held_before"]), tuple(summary["held_after"])
    return Minimized(before, after, summary["keep"], *held, tuple(summary["steps"])), summary
