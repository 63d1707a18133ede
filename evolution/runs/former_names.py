"""Former names in the files of a run: earlier versions wrote them, and they are read under their present names.

==================================  ===========================  ================
file                                earlier versions             now
==================================  ===========================  ================
``best_results.json``               ``confirmation``             ``validation``
``best_results.json``               ``reading``, of each map     ``score``
``individuals.csv``                 ``reading_1``...             ``score_1``...
``config.json``, ``search``         options without sections     see :mod:`evolution.search.option_names`
==================================  ===========================  ================
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from evolution.files import Row

RESULTS = {"confirmation": "validation"}
MAP_ENTRY = {"reading": "score"}
COLUMN = ("reading_", "score_")


def present_results(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the results of a map set under their present names."""
    results = _renamed(document, RESULTS)
    maps = results.get("maps")
    if isinstance(maps, list):
        results["maps"] = [_renamed(entry, MAP_ENTRY) if isinstance(entry, Mapping) else entry for entry in maps]
    return results


def present_row(row: Row) -> Row:
    """Return a line of ``individuals.csv`` under its present column names."""
    former, present = COLUMN
    return {present + name.removeprefix(former) if name.startswith(former) else name: row[name] for name in row}


def _renamed(values: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    return {names.get(name, name): value for name, value in values.items()}
