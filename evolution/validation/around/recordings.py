"""Reads the recordings of what Nav2 does around its controllers: tree, behaviours, controller server, smoother.

The format is described in the README of the recorded directory.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from evolution.validation.recorded import Arrays, read_arrays, read_json
from gym_mapbench.errors import MapFormatError
from gym_mapbench.releases import Release

Record = Mapping[str, Any]
TREE_FIELDS = ("time_us", "node", "status", "offset", "tick_step_us", "tick_offset")


@dataclass(frozen=True)
class RecordedTree:
    """What one release's tree did in every scenario.

    Args:
        nodes: ``registration name:name`` of every node, in tree order.
        scenarios: The scenarios: script, events and runs.
        changes: Status changes and ticks of all scenarios, ragged by scenario.
    """

    nodes: tuple[str, ...]
    scenarios: tuple[Record, ...]
    changes: Arrays


class AroundOracle:
    """A directory of recordings around the controllers.

    Args:
        directory: Path of the directory.
    """

    def __init__(self, directory: str | Path) -> None:
        self.directory = Path(directory)
        self._documents: dict[str, dict[str, Any]] = {}

    @staticmethod
    def is_in(directory: str | Path) -> bool:
        """Whether a directory of recorded results is one around the controllers."""
        return (Path(directory) / "behaviors.json").is_file()

    @cached_property
    def footprints(self) -> Mapping[str, list[list[float]]]:
        """Padded corners, m, by name."""
        footprints: dict[str, list[list[float]]] = self._entry("behaviors.json", "footprints", dict)
        return footprints

    @property
    def behaviors(self) -> tuple[Record, ...]:
        """Runs of single behaviours."""
        return self._records("behaviors.json", "cases")

    @property
    def disturbed_behaviors(self) -> tuple[Record, ...]:
        """Runs of single behaviours while Humble's smoother commands the robot to stop."""
        name = "behaviors_with_smoother_humble.json"
        shared = {key: self._entry(name, key, kind) for key, kind in (("start", list), ("footprint", str))}
        return tuple({**shared, **case} for case in self._records(name, "cases"))

    @property
    def smoother(self) -> tuple[Record, ...]:
        """Runs of the velocity smoother."""
        return self._records("smoother.json", "cases")

    @property
    def costmap_waits(self) -> tuple[Record, ...]:
        """Runs of Humble's tree in which planner and controller wait for cleared costmaps."""
        return self._records("tree_costmap_waits_humble.json.gz", "scenarios")

    @property
    def releases(self) -> tuple[Release, ...]:
        """The releases whose tree and controller server were recorded."""
        return "humble", "jazzy"

    def controller_server(self, release: Release) -> tuple[Record, ...]:
        """Return runs of one release's controller server."""
        return self._records(f"controller_server_{release}.json.gz", "cases")

    def tree(self, release: Release) -> RecordedTree:
        """Return what one release's tree did."""
        name = f"tree_{release}.json.gz"
        nodes, scenarios = tuple(self._entry(name, "nodes", list)), self._records(name, "scenarios")
        return RecordedTree(nodes, scenarios, read_arrays(self.directory / f"tree_{release}.npz", TREE_FIELDS))

    def _records(self, name: str, key: str) -> tuple[Record, ...]:
        return tuple(self._entry(name, key, list))

    def _entry(self, name: str, key: str, kind: type) -> Any:
        if name not in self._documents:
            self._documents[name] = read_json(self.directory / name, dict)
        document = self._documents[name]
        if not isinstance(document.get(key), kind):
            raise MapFormatError(f"{self.directory / name}: expected a {kind.__name__} under {key!r}")
        return document[key]
