"""Parameters as records, the form in which kernels take many named values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from controllers.parameters import ReleaseSettings


def record_type(
    settings: type[ReleaseSettings], *, numbers: Sequence[str], switches: Sequence[str]
) -> np.dtype[np.void]:
    """Build the type of a record that holds a controller's parameters and the values that a run adds to them.

    Args:
        settings: The parameters: numbers and switches only, but for the release, which is left out.
        numbers: Names of the numbers that the run adds.
        switches: Names of the switches that the run adds.
    """
    own = [(name, field.annotation) for name, field in settings.model_fields.items() if name != "release"]
    return np.dtype(
        [
            *((name, np.bool_ if bool in (kind, *get_args(kind)) else np.float64) for name, kind in own),
            *((name, np.float64) for name in numbers),
            *((name, np.bool_) for name in switches),
        ],
        align=True,
    )


def fill_record(kind: np.dtype[np.void], values: Mapping[str, Any]) -> NDArray[np.void]:
    """Return a ``(1,)`` record of ``values``; None becomes NaN, or false for a switch."""
    record = np.zeros(1, dtype=kind)
    for name in kind.fields or ():
        missing = math.nan if kind[name] == np.float64 else False
        record[name] = missing if values[name] is None else values[name]
    return record
