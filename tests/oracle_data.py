"""Where the recorded Nav2 results lie, for the tests that compare with them."""

from __future__ import annotations

from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[2] / "shared"
ORACLE = SHARED / "nav2-oracle"
LAYERS_ORACLE = SHARED / "nav2-oracle-layers"
DATA = SHARED / "data"

needs_oracle = pytest.mark.skipif(not ORACLE.is_dir(), reason="recorded Nav2 results are not at hand")
needs_layers_oracle = pytest.mark.skipif(not LAYERS_ORACLE.is_dir(), reason="recorded Nav2 layers are not at hand")
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the sample map files are not at hand")
