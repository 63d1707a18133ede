"""The releases of Nav2 whose behaviour is reproduced."""

from __future__ import annotations

from typing import Literal, get_args

Release = Literal["humble", "jazzy", "lyrical"]
RELEASES: tuple[Release, ...] = get_args(Release)
