"""Groups of options of the env: observed windows, and weights of the reward."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gym_mapbench.quantities import Few, NonNegative, Positive
from gym_mapbench.settings import Settings

OBSERVATION_KEYS = ("pose", "odom", "velocity", "goal", "scan", "path", "costmap", "people")
RewardWeight = Annotated[float, Field(ge=-1e6, le=1e6)]


class PathWindow(Settings):
    """The next points of the global path, which NavFn plans at reset.

    Args:
        points: How many points.
        spacing: Distance between two of them along the path, m.
        rooms: Room beside the robot that the path keeps, m: the first of these with which there is a path. With 0
            alone, as in Nav2, a path may lead through a gap that leaves the robot 5 mm, although there is a wider way.
    """

    points: Few = 20
    spacing: Positive = 0.1
    rooms: Annotated[tuple[NonNegative, ...], Field(min_length=1)] = (0.0,)


class CostmapWindow(Settings):
    """The costmap around the robot, aligned with the map; also what the global path is planned on.

    Args:
        cells: Rows and columns of the window; 60 are Nav2's 3 m at 0.05 m a cell.
        inflation_radius: Reach of Nav2's inflation layer, m.
        cost_scaling_factor: Decay of the cost in Nav2's inflation layer, 1/m.
    """

    cells: Annotated[int, Field(ge=1, le=4000)] = 60
    inflation_radius: NonNegative = 0.55
    cost_scaling_factor: NonNegative = 3.0


class PeopleWindow(Settings):
    """The moving bodies that are observed.

    Args:
        nearest: How many: the nearest ones.
    """

    nearest: Few = 5


class RewardSettings(Settings):
    """Weights of the reward's terms.

    Args:
        progress: Per metre that the geodesic distance to the goal shrinks; 0 saves computing it.
        time: Taken off per simulated second.
        collision: Taken off whenever a contact begins.
        goal: Given once, on reaching the goal.
        caution: Additional weight of a metre along a wall, compared with a metre in the open, in the distance that
            progress is measured with. At 0 the shortest path is the best, which grazes corners.
        caution_reach: Room around the robot at which a metre counts as in the open, m; the less room, the more.
    """

    progress: RewardWeight = 1.0
    time: RewardWeight = 0.05
    collision: RewardWeight = 10.0
    goal: RewardWeight = 10.0
    caution: Annotated[float, Field(ge=0, le=100)] = 0.0
    caution_reach: Positive = 0.3
