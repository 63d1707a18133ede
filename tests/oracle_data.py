"""Where the recorded Nav2 results lie, for the tests that compare with them."""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared"
ORACLE = SHARED / "nav2-oracle"
JAZZY_ORACLE = SHARED / "nav2-oracle-jazzy"
LYRICAL_ORACLE = SHARED / "nav2-oracle-lyrical"
LAYERS_ORACLE = SHARED / "nav2-oracle-layers"
PLANT_ORACLE = SHARED / "fortress-plant"
AROUND_ORACLE = SHARED / "nav2-bt-oracle"
DATA = SHARED / "data"

needs_oracle = pytest.mark.skipif(not ORACLE.is_dir(), reason="recorded Nav2 results are not at hand")
needs_jazzy_oracle = pytest.mark.skipif(not JAZZY_ORACLE.is_dir(), reason="recorded Jazzy results are not at hand")
needs_lyrical_oracle = pytest.mark.skipif(
    not LYRICAL_ORACLE.is_dir(), reason="recorded Lyrical results are not at hand"
)
needs_layers_oracle = pytest.mark.skipif(not LAYERS_ORACLE.is_dir(), reason="recorded Nav2 layers are not at hand")
needs_around_oracle = pytest.mark.skipif(
    not AROUND_ORACLE.is_dir(), reason="recordings of Nav2 around the controllers are not at hand"
)
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the sample map files are not at hand")


class Recording(NamedTuple):
    """One preset of what one release's own code made of the recorded tasks."""

    release: str
    preset: str
    directory: Path

    @property
    def config(self):
        return _config(self.directory)

    @property
    def spec(self):
        """Robot, costmap and task."""
        return self.config["presets"][self.preset]

    def load(self, kind):
        """Arrays of ``KIND_PRESET.npz``."""
        with np.load(self.directory / f"{kind}_{self.preset}.npz") as file:
            return dict(file)

    def arrays(self, name):
        """Arrays of a file that belongs to no preset."""
        with np.load(self.directory / name) as file:
            return dict(file)

    def runs(self, controller, variant, local_costmap):
        """Records of the runs of one kind that were driven."""
        kind = (controller, variant, local_costmap)
        records = json.loads((self.directory / f"runs_{self.preset}.json").read_text())
        driven = (run for run in records if run["reason"] != "no_path")
        return [run for run in driven if (run["controller"], run["variant"], run["local_costmap"]) == kind]

    def params(self, controller, ros_only, **changes):
        """Recorded parameters of a controller, and the release."""
        given = {**self.config["controllers"][controller], **changes, "release": self.release}
        return {key: value for key, value in given.items() if key.split(".")[0] not in ros_only}

    def variant(self, name):
        """What a variant changes, nothing if there is no such variant."""
        return self.config["variants"].get(name, {})


@functools.cache
def _config(directory):
    return json.loads((directory / "config.json").read_text())


RECORDINGS = [
    pytest.param(Recording("humble", "A", ORACLE), id="humble A", marks=needs_oracle),
    pytest.param(Recording("humble", "B", ORACLE), id="humble B", marks=needs_oracle),
    pytest.param(Recording("jazzy", "A", JAZZY_ORACLE), id="jazzy A", marks=needs_jazzy_oracle),
]
LYRICAL = pytest.param(Recording("lyrical", "A", LYRICAL_ORACLE), id="lyrical A", marks=needs_lyrical_oracle)
each_recording = pytest.mark.parametrize("recorded", RECORDINGS)
each_jazzy_recording = pytest.mark.parametrize("recorded", RECORDINGS[2:])
needs_plant_oracle = pytest.mark.skipif(not PLANT_ORACLE.is_dir(), reason="recorded motion is not at hand")
