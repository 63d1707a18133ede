"""Constrained numbers: the kinds of which options are made, each defined once.

A tighter bound is added where it is needed: ``Annotated[Count, Field(le=1000)]``. ``inf`` and ``nan`` are refused by
:class:`~gym_mapbench.settings.Settings`.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

Positive = Annotated[float, Field(gt=0)]
"""Greater than 0."""
NonNegative = Annotated[float, Field(ge=0)]
"""0 or greater."""
NonPositive = Annotated[float, Field(le=0)]
"""0 or less."""
Fraction = Annotated[float, Field(ge=0, le=1)]
"""0 to 1; also probabilities."""
SignedFraction = Annotated[float, Field(ge=-1, le=1)]
"""-1 to 1."""
Count = Annotated[int, Field(ge=1)]
"""1 or greater."""
Few = Annotated[int, Field(ge=1, le=10_000)]
"""1 to 10 000: of what every one costs."""
Natural = Annotated[int, Field(ge=0)]
"""0 or greater."""
