"""Settings of the whole test suite."""

from __future__ import annotations

from hypothesis import settings

# A kernel compiles at its first call, which no deadline per example can know of.
settings.register_profile("mapbench", deadline=None)
settings.load_profile("mapbench")
