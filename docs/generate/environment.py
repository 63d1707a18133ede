"""The tables of the Gymnasium environment, from its docstring."""

from __future__ import annotations

import inspect

from docs.generate.docstrings import plain
from gym_mapbench.env.single import MapBenchEnv


def environment_tables() -> str:
    """Return action, observation, reward, starting state, end of an episode and info of MapBenchEnv as Markdown."""
    tables = inspect.cleandoc(MapBenchEnv.__doc__ or "").partition("\n\n")[2].partition("\nArgs:\n")[0]
    return plain(tables).strip()
