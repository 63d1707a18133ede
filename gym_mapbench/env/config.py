"""EnvConfig: the options of ``gymnasium.make("MapBench-v0", ...)``."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field, field_validator, model_validator

from gym_mapbench.env.action import ActionKind
from gym_mapbench.env.groups import OBSERVATION_KEYS, CostmapWindow, PathWindow, PeopleWindow, RewardSettings
from gym_mapbench.errors import ConfigError, refuse_unknown
from gym_mapbench.files.documents import read_yaml
from gym_mapbench.generator import FamilySpecs, ShapeSettings, default_task
from gym_mapbench.kernels.motion import MAX_TICK_TRAVEL
from gym_mapbench.quantities import Positive
from gym_mapbench.settings import ExtendedSettings
from gym_mapbench.trust import refuse_code
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import LidarSettings
from gym_mapbench.world.noise import NOISES, NoiseSettings
from gym_mapbench.world.plant import PlantName
from gym_mapbench.world.robot import LidarMount, RobotSpec, make_robot
from gym_mapbench.world.scenario import MapSet, Pose, Scenario

ROW_CHARACTERS = frozenset("#.? ")
Rate = Annotated[float, Field(gt=0, le=10_000)]
Rows = tuple[str, ...]
Maps = str | Rows | tuple[Rows, ...] | dict[str, Any] | None


class EnvConfig(ExtendedSettings):
    """One environment, as a frozen value that JSON and YAML can hold.

    Args:
        maps: The maps. None: a new random map of the thesis at every reset, solvable for the robot.
            A file name or several: whatever :func:`gym_mapbench.mapio.load_scenarios` reads. Text rows (``#``
            occupied, ``.`` free, ``?`` unknown, first row at the top), as a list or as one text of several lines
            (indented or not), or several maps of them as lists. A mapping: the document of a map-set file.
        start: ``(x, y, yaw)`` m, rad; None takes the map's own, or the thesis'.
        goal: The same for the goal.
        resolution: Side of a cell of text rows, pictures and random maps, m; None means 0.05.
        family: Sample a map of this family at every reset, e.g. ``"doors"``: a name of
            :data:`gym_mapbench.generator.FAMILIES`, a mapping ``{name: doors, options: {gap: [0.6, 0.7]}}``, or
            several of these, of which one is sampled each time. None: random shapes, as in the thesis.
        shapes: Size and borders of sampled maps, and kind and number of random shapes.
        robot: A preset's name, a YAML file, or the options of a robot.
        plant: How the robot follows a command: ``ideal`` (the plant of the recorded Nav2 runs), or ``fortress`` (Gazebo
            Fortress: steps of 1 ms, and a command takes effect one step after it arrives).
        physics_hz: Physics steps per second.
        control_hz: Actions per second; ``physics_hz`` must be a multiple of it.
        time_limit: Simulated seconds until an episode is truncated.
        action: ``physical``: m/s and rad/s. ``normalized``: -1 to 1, where 1 is the robot's limit and 0 is rest.
        collision_ends_episode: Whether the first touch of a wall or body ends the episode.
        goal_ends_episode: Whether reaching the goal ends the episode.
        xy_goal_tolerance: Largest distance from the goal, m; once the robot has been this close, only its heading
            counts (Nav2's SimpleGoalChecker).
        yaw_goal_tolerance: Largest error of the heading at the goal, rad.
        observation: Which of ``pose odom velocity goal scan path costmap people`` are observed.
        lidar: Beams and ranges of the scan, and the scanner's place on the robot.
        path: The observed window of the global path.
        costmap: The observed window of the costmap.
        people: The observed moving bodies.
        noise: ``none``, ``nominal``, ``rough``, or a mapping of
            :class:`~gym_mapbench.world.noise.NoiseSettings`, in which ``level`` may name the level that the other
            values change: ``{level: nominal, scan: 0.02}``.
        reward: Weights of the reward's terms.
    """

    meant: ClassVar[Mapping[str, str]] = {"max_episode_steps": "expected 'time_limit', in s"}
    newer: ClassVar[tuple[str, ...]] = ("plant", "people")

    maps: Maps = None
    start: tuple[float, float, float] | None = None
    goal: tuple[float, float, float] | None = None
    resolution: Positive | None = None
    family: FamilySpecs = ()
    shapes: ShapeSettings = ShapeSettings()
    robot: RobotSpec = make_robot("turtlebot3_waffle")
    plant: PlantName = "ideal"
    physics_hz: Rate = 100.0
    control_hz: Rate = 20.0
    time_limit: Annotated[float, Field(gt=0, le=1e6)] = 150.0
    action: ActionKind = "physical"
    collision_ends_episode: bool = True
    goal_ends_episode: bool = True
    xy_goal_tolerance: Positive = 0.25
    yaw_goal_tolerance: Positive = 0.25
    observation: tuple[str, ...] = ("pose", "velocity", "goal", "scan")
    lidar: LidarSettings = LidarSettings()
    path: PathWindow = PathWindow()
    costmap: CostmapWindow = CostmapWindow()
    people: PeopleWindow = PeopleWindow()
    noise: NoiseSettings = NoiseSettings()
    reward: RewardSettings = RewardSettings()

    @classmethod
    def build(cls, config: EnvConfig | Mapping[str, Any] | str | Path | None = None, **options: Any) -> EnvConfig:
        """Build from a config, a mapping or a YAML file, with ``options`` on top.

        An option replaces the whole field: of a group such as ``lidar`` or ``reward``, what the option does not name
        has its default, whatever ``config`` says.

        Raises:
            ConfigError: On an unknown key, a bad value, or a file that cannot be read or names code.
        """
        if isinstance(config, str | Path):
            document = read_yaml(config)
            refuse_code(document, config)
            return cls.from_mapping(document, str(config)).replace(**options)
        if isinstance(config, EnvConfig):
            return config.replace(**options)
        return cls.from_mapping({} if config is None else config, "config").replace(**options)

    @field_validator("maps", mode="before")
    @classmethod
    def _known_form(cls, value: object) -> object:
        if isinstance(value, str) and "\n" in value:
            return tuple(textwrap.dedent(value).strip("\n").splitlines())
        if value is None or isinstance(value, str | Mapping):
            return value
        if isinstance(value, Path):
            return str(value)
        if isinstance(value, Sequence) and value and all(_is_text(item) for item in value):
            return tuple(str(item) for item in value)
        if isinstance(value, Sequence) and value and all(_are_rows(item) for item in value):
            return tuple(tuple(item) for item in value)
        raise ConfigError(
            f"expected a file name, text rows, several of either, or a map set's document, got {value!r:.80}"
        )

    @field_validator("robot", mode="before")
    @classmethod
    def _robot_by_name(cls, value: object) -> object:
        return make_robot(value) if isinstance(value, str) else value

    @field_validator("noise", mode="before")
    @classmethod
    def _noise_by_name(cls, value: object) -> object:
        return NOISES.get(value) if isinstance(value, str) else value

    @field_validator("observation")
    @classmethod
    def _known_keys(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for key in value:
            refuse_unknown("observation key", key, OBSERVATION_KEYS)
        if not value or len(set(value)) < len(value):
            raise ConfigError(f"expected at least one key, each once, got {value}")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> EnvConfig:
        if self.family and self.maps is not None:
            raise ConfigError("family: expected none beside maps, which already name the maps")
        ticks = self.physics_hz / self.control_hz
        if abs(ticks - round(ticks)) > 1e-9 or ticks < 0.5:
            raise ConfigError(
                f"physics_hz: expected a multiple of control_hz {self.control_hz:g}, got {self.physics_hz:g}"
            )
        needed = lowest_physics_hz(self.robot)
        if self.physics_hz < needed:
            raise ConfigError(f"physics_hz: expected at least {needed:g} for this robot, got {self.physics_hz:g}")
        return self

    @model_validator(mode="after")
    def _lidar_fits(self) -> EnvConfig:
        lidar = self.mounted_lidar
        away, reach = math.hypot(lidar.place.x, lidar.place.y), self.robot.circumscribed_radius
        if away > reach:
            raise ConfigError(f"lidar: expected a place on the robot, within {reach:g} m of its centre, got {away:g} m")
        if lidar.no_reading == "zero" and self.noise.scan_dropout and not lidar.range_min:
            raise ConfigError("lidar.range_min: expected more than 0 where lost beams are reported as 0 m, got 0")
        return self

    @property
    def ticks(self) -> int:
        """Physics steps per control step."""
        return round(self.physics_hz / self.control_hz)

    @property
    def late_ticks(self) -> int:
        """Physics steps of every control step in which the robot still obeys the previous command."""
        return math.floor(self.noise.latency * self.ticks + 0.5)

    @property
    def delay(self) -> float:
        """Seconds of every control step in which the robot still obeys the previous command."""
        return self.late_ticks / self.physics_hz

    @property
    def mounted_lidar(self) -> LidarSettings:
        """The scanner with its place on the robot and its shortest range filled in."""
        return self.lidar.mounted(self.robot.lidar if self.noise.lidar_mount == "robot" else LidarMount())

    @property
    def physics_may_rest(self) -> bool:
        """Whether Box2D may rest where no wall is within reach; for polygons, where nothing happens after a touch."""
        return self.collision_ends_episode or self.robot.footprint is None

    @property
    def max_steps(self) -> int:
        """Control steps until the time limit."""
        return math.ceil(self.time_limit * self.control_hz - 1e-9)

    def with_maps(self, map_set: MapSet) -> EnvConfig:
        """Return this configuration on the maps and tasks of a map set, still JSON-able."""
        from gym_mapbench.mapio.map_set_file import map_set_document
        from gym_mapbench.mapio.tasked_map import group_scenarios

        return self.replace(maps=map_set_document(group_scenarios(map_set)), start=None, goal=None, family=())

    def load_scenarios(self) -> tuple[Scenario, ...] | None:
        """Load the scenarios of ``maps``; None where every reset samples a map.

        Raises:
            ConfigError: If a start or goal is missing, off the map or occupied.
            MapFormatError: If a file is not a map.
        """
        if self.maps is None:
            return None
        if isinstance(self.maps, dict):
            return tuple(self._with_own_task(scenario) for scenario in _from_document(self.maps))
        items = (self.maps,) if isinstance(self.maps, str) else self.maps
        if all(isinstance(item, str) for item in items) and all(set(item) <= ROW_CHARACTERS for item in items):
            items = (items,)  # type: ignore[assignment]
        return tuple(scenario for item in items for scenario in self._load(item))

    def _load(self, item: str | Rows) -> list[Scenario]:
        """Load one file, or one map of text rows."""
        if isinstance(item, tuple):
            return [self.make_scenario(GridMap.from_rows(item, self.resolution or 0.05))]
        from gym_mapbench.mapio import load_scenarios

        return load_scenarios(item, start=self.start, goal=self.goal, resolution=self.resolution)

    def make_scenario(self, grid: GridMap, name: str = "map") -> Scenario:
        """Put the configured start and goal on a map; the thesis' where they are not given.

        Raises:
            ConfigError: If one is off the map or occupied, or the map is too small for the thesis' task.
        """
        start, goal = self.start, self.goal
        if start is None or goal is None:
            margin = self.shapes.border + self.shapes.task_distance
            usual_start, usual_goal = default_task(grid, margin)
            start, goal = start or usual_start, goal or usual_goal
        return Scenario(grid, Pose(*start), Pose(*goal), name)

    def _with_own_task(self, scenario: Scenario) -> Scenario:
        start = scenario.start if self.start is None else Pose(*self.start)
        goal = scenario.goal if self.goal is None else Pose(*self.goal)
        return replace(scenario, start=start, goal=goal)


def lowest_physics_hz(robot: RobotSpec) -> float:
    """Return the lowest number of physics steps per second in which contacts of a robot are found."""
    speed = max(robot.max_linear_velocity, robot.max_reverse_velocity)
    return max(speed / MAX_TICK_TRAVEL, robot.max_angular_velocity / (math.pi / 2))


def _from_document(document: dict[str, Any]) -> list[Scenario]:
    from gym_mapbench.mapio.map_set_file import parse_map_set

    return [scenario for tasked in parse_map_set(document, "maps") for scenario in tasked.scenarios()]


def _is_text(item: object) -> bool:
    return isinstance(item, str | Path)


def _are_rows(item: object) -> bool:
    return isinstance(item, Sequence) and bool(item) and all(isinstance(row, str) for row in item)
