"""The physics: a differential-drive robot among the walls and bodies of a world.

Box2D computes in float32, controllers are compared in float64. While nothing touches the robot its
motion is the float64 midpoint step of :mod:`gym_mapbench.kernels.motion`, and Box2D's body follows that pose,
set before every control step, so that it is never more than a few float32 roundings away.
As soon as a contact touches, the pose is what Box2D makes of it. Box2D may rest where neither wall nor body is within
reach; the box that it keeps around the robot is then kept for it, so that it wakes up as if it had never rested.
"""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.bodies import drive_robot_among
from gym_mapbench.kernels.motion import BOX, MARGIN, drive_robot
from gym_mapbench.world.box2d import Engine
from gym_mapbench.world.plant import PLANTS, PlantName
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose
from gym_mapbench.world.state import Worlds, drive_of, ground_of
from gym_mapbench.world.world import World

SPARE = 0.5
"""How far beyond the robot's reach walls are built where Box2D knows only the walls nearby, m."""


class Simulation:
    """One robot in one world, from a start pose on.

    The map's edge is a wall. Walls, bodies and robot have no friction: the robot slides along walls, or is
    stopped by them, while its wheels keep turning as told. A body that moves pushes a robot that moves, and no robot
    that stands still.

    Args:
        world: Walls and bodies; its unknown cells are free.
        robot: Shape and limits of the robot.
        start: Where it stands, at rest.
        plant: How the wheels follow a command and hold: a name of :data:`~gym_mapbench.world.plant.PLANTS`.
        rests: Whether Box2D rests while no wall and no body is within reach. For a disc, nothing changes; for a
            polygon, nothing up to the first touch: after it, which of several walls touched at once Box2D solves first
            depends on where the robot has been all along.
        nearby: Whether Box2D knows only the walls nearby; nothing changes up to the first touch.
        worlds: Holds the state of the robot, as its only world; None for a state of its own.

    Attributes:
        world: Walls and bodies, which move on with every call of :meth:`advance`.
    """

    def __init__(
        self,
        world: World,
        robot: RobotSpec,
        start: Pose,
        *,
        plant: PlantName = "ideal",
        rests: bool = False,
        nearby: bool = False,
        worlds: Worlds | None = None,
    ) -> None:
        self.world = world
        self._rests, self._nearby = rests, nearby
        self._worlds = Worlds() if worlds is None else worlds
        self._worlds.grounds[0] = ground_of(world.grid)
        self._worlds.robots[0] = (*start, *[0.0] * 6, False)
        self._worlds.boxes[0] = np.zeros((), BOX)
        self._robot = robot
        self._slipping = PLANTS[plant].slips
        self._walls = world.grid.framed.reshape(-1)
        self._drive = drive_of(robot, world.physics_hz, plant)
        self._can: tuple[float, ...] = self._drive.item(0)
        self._engine: Engine | None = None
        self._is_boxed = rests and robot.footprint is None
        world.watch(self._worlds.robots)

    def state(self) -> tuple[Pose, tuple[float, float]]:
        """Return pose and velocity; half the time of reading them one by one."""
        x, y, yaw, _, _, v, w, *_ = self._worlds.robots.item(0)
        return Pose(x, y, yaw), (v, w)

    @property
    def pose(self) -> Pose:
        """True pose: m, rad in (-pi, pi]."""
        return self.state()[0]

    @property
    def velocity(self) -> tuple[float, float]:
        """True forward speed (m/s) and turn rate (rad/s) of the body; the wheels' where nothing touches it."""
        return self.state()[1]

    def advance(self, v: float, w: float, ticks: int) -> int:
        """Drive ``ticks`` physics steps towards a command, and move the bodies on.

        Per tick the wheels' speeds approach the command, clipped to the robot's limits, by at most
        acceleration times tick; the robot is then driven along the heading in the middle of the tick.

        Args:
            v: Commanded forward speed, m/s.
            w: Commanded turn rate, rad/s.
            ticks: Number of physics steps.

        Returns:
            What the robot touched in any of them: 0, or a sum of :data:`~gym_mapbench.world.world.WALL` and ``BODY``.
        """
        touched = 0 if self._drive_free(v, w, ticks) else self.advance_in_box2d(v, w, ticks)
        if self.world.bodies:
            self.world.advance(ticks)
        return touched

    def _drive_free(self, v: float, w: float, ticks: int) -> bool:
        """Drive without Box2D if nothing is within reach; return whether that was done."""
        if not self._rests:
            return False
        worlds, world = self._worlds, self.world
        robots, boxes, grounds = worlds.robots, worlds.boxes, worlds.grounds
        moved: bool
        if world.bodies:
            bodies = world.poses, world.radii, world.pace
            moved = drive_robot_among(robots, boxes, 0, v, w, ticks, self._drive, grounds, self._walls, *bodies)
        else:
            moved = drive_robot(robots, boxes, 0, v, w, ticks, self._drive, grounds, self._walls)
        return moved

    def advance_in_box2d(self, v: float, w: float, ticks: int) -> int:
        """Do what :meth:`advance` does where a wall or body is within reach, but leave the bodies where they are."""
        worlds = self._worlds
        x, y, *_ = worlds.robots.item(0)
        engine = self._engine_at(x, y, ticks)
        if self._is_boxed:
            self._restore_box(engine)
        if self.world.bodies and ticks:  # a command as late as a whole control period drives no tick of it
            engine.meet(self.world, self._near(ticks), ticks)
        touched = engine.advance(worlds.robots, v, w, ticks, self._drive)
        if self._is_boxed and not engine.holds:
            worlds.boxes[0] = engine.box()
        return touched

    def _near(self, ticks: int) -> list[int]:
        """Return the numbers of the bodies that the robot might meet within the next ticks."""
        x, y, *_ = self._worlds.robots.item(0)
        return self.world.near(x, y, self._drive, ticks)

    def _restore_box(self, engine: Engine) -> None:
        """Have Box2D make its box again for the motion for which ``keep_box`` made it while Box2D rested."""
        boxes = self._worlds.boxes
        *_, x, y, to_x, to_y = boxes.item(0)
        if to_x or to_y:
            engine.make_box(x, y, to_x, to_y)
            boxes[0] = np.zeros((), BOX)

    def _engine_at(self, x: float, y: float, ticks: int) -> Engine:
        """Return Box2D with all walls that are within reach of a position."""
        if self._engine is None or self._nearby:
            tick, forward, reverse, _, _, _, radius, *_ = self._can
            reach = radius + max(forward, reverse) * ticks * tick + MARGIN
            if self._engine is None or not self._engine.covers(x, y, reach):
                area = (x, y, reach + SPARE) if self._nearby else None
                self._engine = Engine(self.world.grid, self._robot, area, self._slipping)
        return self._engine
