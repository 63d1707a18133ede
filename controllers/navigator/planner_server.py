"""PlannerServer: Nav2's ComputePathToPose action around one global planner.

Source: nav2_planner (Humble and Jazzy) src/planner_server.cpp.
"""

from __future__ import annotations

from controllers.navigator import error_codes
from controllers.navigator.actions import Outcome, Result
from controllers.navigator.computing import Computing
from controllers.navigator.costmap_wait import CostmapWait, ServedCostmap
from controllers.navigator.rate import NEVER
from controllers.navigator.robot_state import RobotOnMap
from gym_mapbench.errors import EndpointError, PlanningError, UnsafeEndpointError
from gym_mapbench.planners.base import GlobalPlanner
from gym_mapbench.world.scenario import Pose

TIMED_OUT = Outcome(Result.ABORTED, error_codes.PLANNER_TIMED_OUT, "Costmap timed out waiting for update")


class PlannerServer(Computing):
    """Plans from where the robot is to the goal; it waits for the global costmap where that has been cleared.

    Args:
        planner: The planner.
        robot: Where the robot is.
        costmap: The global costmap.
        planning_time: Seconds that a plan takes, in simulated time.
        timeout: Seconds after which it gives up to wait for the costmap.
    """

    goal: Pose

    def __init__(
        self,
        planner: GlobalPlanner,
        robot: RobotOnMap,
        costmap: ServedCostmap,
        planning_time: float = 0.0,
        timeout: float = NEVER,
    ) -> None:
        super().__init__(planning_time)
        self._planner, self._robot, self._costmap = planner, robot, costmap
        self._wait = CostmapWait(costmap, timeout)

    def begin(self, goal: Pose, now: float) -> None:
        """Begin to plan to a pose on the map."""
        super().begin(goal, now)
        self._wait.forget()

    def step(self, now: float) -> Outcome | None:
        """Go on waiting for the costmap, plan, or hand over the plan."""
        if self._outcome is not None:
            return self._outcome
        if not self._wait.is_over(now):
            self.next_time = self._wait.next_time
            return None
        return TIMED_OUT if self._wait.has_failed else super().step(now)

    def compute(self) -> Outcome:
        """Plan from where the robot is."""
        try:
            path = self._planner.plan(self._costmap.costmap, self._robot.pose, self.goal)
        except EndpointError as error:
            return Outcome(Result.ABORTED, error_codes.START_OR_GOAL_OUTSIDE, str(error))
        except UnsafeEndpointError as error:
            return Outcome(Result.ABORTED, error_codes.PLANNER_UNKNOWN, str(error))
        except PlanningError as error:
            return Outcome(Result.ABORTED, error_codes.NO_VALID_PATH, str(error))
        return Outcome(Result.SUCCEEDED, value=path)
