"""What Nav2 does around its controllers, replayed by our own tree, servers, behaviours and smoother."""

from __future__ import annotations

from evolution.validation.around.measures import around_measures
from evolution.validation.around.recordings import AroundOracle

__all__ = ["AroundOracle", "around_measures"]
