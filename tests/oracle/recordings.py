"""The recordings of Nav2's own code that the tests of controllers and planners go through, set up as they were made."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import NamedTuple

import pytest

from evolution.validation import Oracle
from evolution.validation.setup import follower_setup, full_costmaps, make_follower
from tests.oracle_data import (
    JAZZY_ORACLE,
    LYRICAL_ORACLE,
    ORACLE,
    needs_jazzy_oracle,
    needs_lyrical_oracle,
    needs_oracle,
)


class Recording(NamedTuple):
    """One preset of a directory of recordings."""

    directory: Path
    name: str

    @property
    def oracle(self):
        return _open(self.directory)

    @property
    def preset(self):
        """Robot, costmap and task."""
        return next(preset for preset in self.oracle.presets if preset.name == self.name)

    @property
    def costmaps(self):
        """Inflated costmaps by number of the map."""
        return full_costmaps(self.oracle, self.preset)

    def load(self, kind):
        """Arrays of ``KIND_PRESET.npz``."""
        return self.oracle.table(kind, self.preset)

    def runs(self, controller, variant, local_costmap):
        """Records of the runs of one kind that were driven."""
        kind = (controller, variant, local_costmap)
        driven = (run for run in self.oracle.runs(self.preset) if run["reason"] != "no_path")
        return [run for run in driven if (run["controller"], run["variant"], run["local_costmap"]) == kind]

    def follower(self, controller, variant="default", seed=None):
        """A controller with the recorded parameters, ready to get a plan."""
        made = make_follower(self.oracle, controller, variant, seed)
        made.reset(follower_setup(self.oracle, self.preset))
        return made


@functools.cache
def _open(directory):
    return Oracle(directory)


RECORDINGS = [
    pytest.param(Recording(ORACLE, "A"), id="humble A", marks=needs_oracle),
    pytest.param(Recording(ORACLE, "B"), id="humble B", marks=needs_oracle),
    pytest.param(Recording(JAZZY_ORACLE, "A"), id="jazzy A", marks=needs_jazzy_oracle),
]
LYRICAL = pytest.param(Recording(LYRICAL_ORACLE, "A"), id="lyrical A", marks=needs_lyrical_oracle)
each_recording = pytest.mark.parametrize("recorded", RECORDINGS)
each_jazzy_recording = pytest.mark.parametrize("recorded", RECORDINGS[2:])
