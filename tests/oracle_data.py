"""Where the recorded Nav2 results lie, for the tests that compare with them."""

from __future__ import annotations

from pathlib import Path

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
needs_plant_oracle = pytest.mark.skipif(not PLANT_ORACLE.is_dir(), reason="recorded motion is not at hand")
