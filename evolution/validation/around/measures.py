"""All measures of what is around the controllers."""

from __future__ import annotations

from evolution.validation.around.behaviors import behavior_measures
from evolution.validation.around.controller_server import controller_server_measures
from evolution.validation.around.recordings import AroundOracle
from evolution.validation.around.smoother import smoother_measures
from evolution.validation.around.tree import tree_measures
from evolution.validation.measures import Measure
from gym_mapbench.errors import MapBenchError, MapFormatError

MEASURES = (tree_measures, behavior_measures, controller_server_measures, smoother_measures)


def around_measures(oracle: AroundOracle) -> list[Measure]:
    """Replay all recordings of a directory; return shares of identical cases, and errors of the ends of runs.

    Raises:
        MapFormatError: If a file is missing or unreadable, or a record is not complete.
    """
    try:
        return [measure for take in MEASURES for measure in take(oracle)]
    except MapBenchError:
        raise
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise MapFormatError(f"{oracle.directory}: a record is not as expected ({error!r})") from None
