"""The one way a kernel is compiled: cached on disk, IEEE arithmetic, no Python errors.

No fast-math: the same inputs give the same bits on every machine of one architecture.
"""

from __future__ import annotations

import functools

import numba

kernel = functools.partial(numba.njit, cache=True, error_model="numpy", nogil=True)
