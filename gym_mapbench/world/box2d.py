"""Box2D's world: the walls of a map, the robot, and the bodies near it.

Lengths inside Box2D are metres times :data:`~gym_mapbench.kernels.motion.SCALE`: its fixed tolerances (5 mm of
permitted overlap, 15 mm at the first touch) shrink to 0.13 mm and 0.38 mm. Coordinates count from the map's lower-left
corner. Walls, robot and bodies have no friction: with friction a robot would not slide along walls as in Gazebo.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.kernels.motion import SCALE, plan_ticks
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import wrap_angle
from gym_mapbench.world.state import Records
from gym_mapbench.world.world import BODY, WALL, World

with warnings.catch_warnings():
    # Its SWIG types make Python warn; where warnings are errors, Box2D would crash the interpreter here.
    warnings.simplefilter("ignore", DeprecationWarning)
    from Box2D import (
        b2_kinematicBody,
        b2AABB,
        b2Body,
        b2CircleShape,
        b2Contact,
        b2ContactListener,
        b2FixtureDef,
        b2Manifold,
        b2MassData,
        b2PolygonShape,
        b2World,
    )

SKIN = 0.02
"""Rounding of a polygon robot in Box2D units: four times its slop, so that fast contacts are found in time."""
HOLDS = 1e-3
"""Largest speed of a wheel over the ground that counts as rounding, m/s."""
VELOCITY_ITERATIONS = 6
POSITION_ITERATIONS = 2

ELSEWHERE = b2AABB(lowerBound=(-1e6, -1e6), upperBound=(-1e6, -1e6))


class Engine:
    """The walls of a map, the robot, and the bodies near it, in Box2D.

    Args:
        grid: The map.
        robot: Its shape.
        area: Only walls in a square are built, given by its centre x, y and half its side, m; None for all.
        slips: Whether wheels that slip the same way cannot turn the robot.
    """

    def __init__(
        self, grid: GridMap, robot: RobotSpec, area: tuple[float, float, float] | None, slips: bool = False
    ) -> None:
        self._area = area
        self._slips, self._lever = slips, 0.5 * robot.wheel_separation
        self._rows = np.empty((0, 5))
        self._origin_x, self._origin_y = grid.origin
        self._touch = _Touch() if robot.footprint is None else _SeamlessTouch(grid)
        self._world = b2World(gravity=(0, 0), doSleep=False, contactListener=self._touch)
        _build_walls(self._world.CreateStaticBody(), grid, area)
        self._body = _build_robot(self._world, robot)
        self._broad_phase = self._world.contactManager.broadPhase
        # Its tree numbers its nodes in the order in which they are made: a leaf, then each leaf with its parent.
        self._leaf = 2 * self._broad_phase.proxyCount - 3
        self._traffic = _Traffic(self._world, grid)
        self._reach = float(np.float32(robot.radius * SCALE))

    def covers(self, x: float, y: float, reach: float) -> bool:
        """Whether all walls within ``reach`` (m) of a position are built."""
        return self._area is None or max(abs(x - self._area[0]), abs(y - self._area[1])) + reach <= self._area[2]

    @property
    def holds(self) -> bool:
        """Whether there are walls in the box that Box2D keeps around the robot."""
        held: bool = self._world.contactCount > self._traffic.contacts
        return held

    def box(self) -> tuple[float, ...]:
        """Return the BOX that Box2D keeps around the robot."""
        box = self._broad_phase.GetFatAABB(self._leaf)
        return *box.lowerBound, *box.upperBound, 0.0, 0.0, 0.0, 0.0

    def make_box(self, x: float, y: float, to_x: float, to_y: float) -> None:
        """Make the box of a disc again in Box2D, for a motion between two points (Box2D's units); see ``keep_box``."""
        reach = self._reach
        lower, upper = (min(x, to_x) - reach, min(y, to_y) - reach), (max(x, to_x) + reach, max(y, to_y) + reach)
        self._broad_phase.MoveProxy(self._leaf, ELSEWHERE, (0.0, 0.0))
        self._broad_phase.MoveProxy(self._leaf, b2AABB(lowerBound=lower, upperBound=upper), (to_x - x, to_y - y))

    def meet(self, world: World, near: list[int], ticks: int) -> None:
        """Put the bodies with these numbers, and no others, where they are now, on their way for the next ticks."""
        self._traffic.meet(world, near, ticks)

    def advance(self, robots: Records, v: float, w: float, ticks: int, drive: Records) -> int:
        """Drive ``ticks`` physics steps towards a command.

        Args:
            robots: ``(1,)`` ROBOT, in and out.
            v: Commanded forward speed, m/s.
            w: Commanded turn rate, rad/s.
            ticks: Number of physics steps.
            drive: ``(1,)`` DRIVE.

        Returns:
            What was touched: 0, or a sum of ``WALL`` and ``BODY``.
        """
        self._x, self._y, self._yaw, *wheels = robots.item(0)[:5]
        if len(self._rows) != ticks:
            self._rows = np.empty((ticks, 5))
        rows, tick = self._rows, drive.item(0)[0]
        plan_ticks(robots, self._yaw, v, w, 0, drive, rows)
        plan = rows.tolist()
        if not self._touch.count:
            self._follow()
        touched = 0
        for number in range(ticks):
            vx, vy, turn, *_ = plan[number]
            if self._slips and self._touch.count:
                turn = self._turn_rate(turn, wheels)
            wheels = plan[number][3:]
            stopped = self._step(vx, vy, turn, tick)
            if stopped and number + 1 < ticks:
                plan_ticks(robots, self._yaw, v, w, number + 1, drive, rows)
                plan = rows.tolist()
            touched |= stopped
        self._write(robots)
        return touched

    def _write(self, robots: Records) -> None:
        """Write the state after a control step; the speeds of the wheels are there already."""
        _, _, _, *wheels, _, _, target_v, target_w, _ = robots.item(0)
        self._yaw = wrap_angle(self._yaw)
        speeds = self._velocity() if self._touch.count else wheels
        robots[0] = (self._x, self._y, self._yaw, *wheels, *speeds, target_v, target_w, self.holds)

    def _step(self, vx: float, vy: float, w: float, tick: float) -> int:
        """Move by one tick with a mean velocity (m/s, m/s, rad/s); return what was touched."""
        body, touch = self._body, self._touch
        touch.robot_rests = not (vx or vy or w)
        body.linearVelocity = vx * SCALE, vy * SCALE
        body.angularVelocity = w
        self._world.Step(tick, VELOCITY_ITERATIONS, POSITION_ITERATIONS)
        if touch.count or touch.begun:
            self._take_over()
            return touch.take()
        self._x += vx * tick
        self._y += vy * tick
        self._yaw += w * tick
        return 0

    def _turn_rate(self, turn: float, wheels: Sequence[float]) -> float:
        """Return the turn rate of a robot that touches something and whose wheels would turn it (rad/s).

        Two wheels that slip the same way push with the same force (Coulomb), so the robot keeps its turn rate.

        Args:
            turn: Turn rate if the wheels hold, rad/s.
            wheels: Speeds of the wheels, m/s and rad/s.
        """
        v, w = self._velocity()
        slip = abs(wheels[0] - v) - self._lever * abs(wheels[1] - w)
        return w if slip > HOLDS else turn

    def _follow(self) -> None:
        """Set the body to the float64 pose."""
        self._body.transform = ((self._x - self._origin_x) * SCALE, (self._y - self._origin_y) * SCALE), self._yaw

    def _take_over(self) -> None:
        """Take the pose from the body."""
        position = self._body.position
        self._x = self._origin_x + position.x / SCALE
        self._y = self._origin_y + position.y / SCALE
        self._yaw = self._body.angle

    def _velocity(self) -> tuple[float, float]:
        """Forward speed (m/s) and turn rate (rad/s) of the body."""
        velocity = self._body.linearVelocity
        forward = velocity.x * math.cos(self._yaw) + velocity.y * math.sin(self._yaw)
        return forward / SCALE, self._body.angularVelocity


class _Traffic:
    """The bodies near the robot, as kinematic bodies of Box2D: they move on, whatever they touch.

    Args:
        world: Box2D's world.
        grid: The map.
    """

    def __init__(self, world: b2World, grid: GridMap) -> None:
        self._world, self._origin = world, np.array(grid.origin)
        self._here: dict[int, b2Body] = {}

    @property
    def contacts(self) -> int:
        """Number of bodies in the box that Box2D keeps around the robot."""
        return sum(len(body.contacts) for body in self._here.values())

    def meet(self, world: World, near: list[int], ticks: int) -> None:
        """As :meth:`Engine.meet`."""
        for number in sorted(self._here.keys() - set(near)):
            self._world.DestroyBody(self._here.pop(number))
        if not near:
            return
        now, then = ((poses[near, :2] - self._origin) * SCALE for poses in (world.poses, world.after(ticks)))
        velocities = (then - now) * (world.physics_hz / ticks)
        for number, place, velocity in zip(near, now.tolist(), velocities.tolist(), strict=True):
            if number not in self._here:
                self._here[number] = self._enter(world.radii[number])
            self._here[number].position = place
            self._here[number].linearVelocity = velocity

    def _enter(self, radius: float) -> b2Body:
        body = self._world.CreateKinematicBody()
        body.CreateFixture(b2FixtureDef(shape=b2CircleShape(radius=radius * SCALE), friction=0.0))
        return body


class _Touch(b2ContactListener):  # type: ignore[misc]
    """Counts the contacts that touch; Box2D calls it only when one begins, persists or ends.

    Attributes:
        robot_rests: Whether the wheels stand still in this tick; bodies then do not push the robot.
    """

    def __init__(self) -> None:
        super().__init__()
        self.robot_rests = False
        self.count = 0
        self.begun = 0
        self._of_bodies = 0

    def take(self) -> int:
        """Return what touches, or has touched since the last call: a sum of ``WALL`` and ``BODY``."""
        walls, bodies = self.count > self._of_bodies, self._of_bodies > 0
        touched, self.begun = self.begun | walls * WALL | bodies * BODY, 0
        return touched

    def BeginContact(self, contact: b2Contact) -> None:  # noqa: N802, the name is Box2D's
        self.count += 1
        self._of_bodies += _is_of_body(contact)
        self.begun |= BODY if _is_of_body(contact) else WALL

    def EndContact(self, contact: b2Contact) -> None:  # noqa: N802, the name is Box2D's
        self.count -= 1
        self._of_bodies -= _is_of_body(contact)

    def PreSolve(self, contact: b2Contact, old_manifold: b2Manifold) -> None:  # noqa: N802, the name is Box2D's
        if self.robot_rests and _is_of_body(contact):
            contact.enabled = False


def _is_of_body(contact: b2Contact) -> bool:
    """Whether a contact is with a moving body, and not with a wall."""
    return b2_kinematicBody in (contact.fixtureA.body.type, contact.fixtureB.body.type)


class _SeamlessTouch(_Touch):
    """Ignores contacts with faces between two wall rectangles, on which a polygon sliding along would catch."""

    def __init__(self, grid: GridMap) -> None:
        super().__init__()
        self._cell = grid.resolution * SCALE
        self._occupied = grid.framed

    def PreSolve(self, contact: b2Contact, old_manifold: b2Manifold) -> None:  # noqa: N802, the name is Box2D's
        super().PreSolve(contact, old_manifold)
        if _is_of_body(contact):
            return
        manifold = contact.worldManifold
        wall_first = not contact.fixtureA.body.mass
        sign = 1.0 if wall_first else -1.0
        normal = manifold.normal[0] * sign, manifold.normal[1] * sign
        if max(abs(normal[0]), abs(normal[1])) < 0.999:
            return
        box = (contact.fixtureA if wall_first else contact.fixtureB).GetAABB(0)
        points = manifold.points[: contact.manifold.pointCount]
        if all(self._behind_wall(box, normal, point) for point in points):
            contact.enabled = False

    def _behind_wall(self, box: b2AABB, normal: tuple[float, float], point: tuple[float, float]) -> bool:
        """Whether the cell in front of a wall's face, next to the point, is itself a wall."""
        inside = 0.01 * self._cell
        x = min(max(point[0], box.lowerBound.x + inside), box.upperBound.x - inside)
        y = min(max(point[1], box.lowerBound.y + inside), box.upperBound.y - inside)
        if abs(normal[0]) > abs(normal[1]):
            x = box.upperBound.x + inside if normal[0] > 0 else box.lowerBound.x - inside
        else:
            y = box.upperBound.y + inside if normal[1] > 0 else box.lowerBound.y - inside
        row, col = int(y // self._cell) + 1, int(x // self._cell) + 1
        rows, cols = self._occupied.shape
        return bool(self._occupied[min(max(row, 0), rows - 1), min(max(col, 0), cols - 1)])


def _build_walls(body: b2Body, grid: GridMap, area: tuple[float, float, float] | None) -> None:
    """Add merged rectangles and the map's edge as fixtures of one body; shape and definition are reused (4x faster).

    Args:
        body: What they are added to.
        grid: The map.
        area: As for :class:`Engine`.
    """
    shape = b2PolygonShape()
    shape.radius = 0.0
    definition = b2FixtureDef(shape=shape, friction=0.0)
    rectangles = grid.rectangles if area is None else _rectangles_in(grid, *area)
    row, col, height, width = rectangles.T
    half = 0.5 * grid.resolution * SCALE
    boxes = np.stack([width, height, 2 * col + width, 2 * row + height], axis=1) * half
    rows, cols = (2 * half * cells for cells in grid.shape)
    edge = 1.0
    for half_x, half_y, x, y in [
        *boxes.tolist(),
        (edge, rows / 2 + edge, -edge, rows / 2),
        (edge, rows / 2 + edge, cols + edge, rows / 2),
        (cols / 2, edge, cols / 2, -edge),
        (cols / 2, edge, cols / 2, rows + edge),
    ]:
        shape.SetAsBox(half_x, half_y, (x, y), 0.0)
        body.CreateFixture(definition)


def _rectangles_in(grid: GridMap, x: float, y: float, half: float) -> NDArray[np.int64]:
    """Return the map's rectangles of walls that meet a square, ``(n, 4)`` as in :attr:`GridMap.rectangles`."""
    column, line = (x - grid.origin[0]) / grid.resolution, (y - grid.origin[1]) / grid.resolution
    half /= grid.resolution
    row, col, height, width = grid.rectangles.T
    across = (col <= column + half) & (col + width >= column - half)
    nearby: NDArray[np.int64] = grid.rectangles[across & (row <= line + half) & (row + height >= line - half)]
    return nearby


def _build_robot(world: b2World, robot: RobotSpec) -> b2Body:
    """Add the robot, its centre of mass on the axle so that it turns about its own origin."""
    body = world.CreateDynamicBody()
    if robot.footprint is None:
        shape = b2CircleShape(radius=robot.radius * SCALE)
    else:
        corners = _inset(np.asarray(robot.footprint) * SCALE, SKIN)
        shape = b2PolygonShape(vertices=[tuple(corner) for corner in corners.tolist()])
        shape.radius = SKIN
    body.CreateFixture(b2FixtureDef(shape=shape, density=1.0, friction=0.0))
    body.massData = b2MassData(mass=body.mass, center=(0.0, 0.0), I=body.inertia)
    return body


def _inset(corners: NDArray[np.float64], distance: float) -> NDArray[np.float64]:
    """Move every edge of a convex polygon around (0, 0) inwards; ``(n, 2)`` corners in either direction."""
    edges = np.roll(corners, -1, axis=0) - corners
    inwards = np.stack([-edges[:, 1], edges[:, 0]], axis=1) / np.hypot(*edges.T)[:, None]
    inwards *= -np.sign((inwards * corners).sum(axis=1))[:, None]
    before = np.roll(inwards, 1, axis=0)
    offsets: NDArray[np.float64] = (before + inwards) / (1 + (before * inwards).sum(axis=1))[:, None]
    return corners + distance * offsets
