"""The files of an exported ROS 2 package: manifest and build file, launch file, runner and README."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass

from gym_mapbench.mapio.gazebo_navigation import BundledNavigation
from gym_mapbench.mapio.gazebo_robot import RobotModel
from gym_mapbench.mapio.output import Files
from gym_mapbench.mapio.rendering import render
from gym_mapbench.mapio.runner_results import COLUMNS
from gym_mapbench.releases import Release
from gym_mapbench.world.robot import ROBOTS
from gym_mapbench.world.scenario import Scenario

SIMULATORS: dict[Release, tuple[str, ...]] = {"humble": ("classic", "gz"), "jazzy": ("gz",), "lyrical": ("gz",)}
"""Simulators that have packages for a release, the usual one first."""

PREFIX = "mapbench_"
RUNNER = "run_benchmark.py"
"""The program of an exported package that runs its maps in Gazebo; no other directory has it."""
SILENCE, LOST_SCANS = 2.0, 5
"""Simulated seconds and number of lidar periods without a message after which the runner takes a topic for silent."""
TASKS = "gazebo_tasks.json"
"""Maps, tasks and controllers of a package; ``benchmark.json`` in packages of earlier versions."""


@dataclass(frozen=True)
class RosPackage:
    """The values from which the package's files are written.

    Args:
        folder: Name of its folder; the package is named after it.
        scenarios: Maps and tasks.
        navigation: Nav2's parameters and behaviour trees.
        model: The robot.
        time_limit: Simulated seconds after which the runner ends a run.
        wall_height: Height of the walls, m.
    """

    folder: str
    scenarios: Sequence[Scenario]
    navigation: BundledNavigation
    model: RobotModel
    time_limit: float
    wall_height: float

    @property
    def package(self) -> str:
        """Name of the package: lower case, digits and single underscores, as ROS wants it."""
        plain = re.sub(r"[^a-z0-9]+", "_", self.folder.lower()).strip("_")
        return PREFIX + (plain.removeprefix(PREFIX) or "bundle")

    @property
    def simulators(self) -> tuple[str, ...]:
        """Simulators it runs in, the usual one first."""
        return SIMULATORS[self.navigation.release]

    def files(self) -> Files:
        """Return what builds, launches, drives and explains it."""
        values: dict[str, object] = {
            "package": self.package,
            "release": self.navigation.release,
            "simulators": self.simulators,
            "controller_packages": self.navigation.packages,
            "maps": [scenario.name for scenario in self.scenarios],
        }
        return {
            "package.xml": render("package.xml.j2", **values),
            "CMakeLists.txt": render("CMakeLists.txt.j2", **values),
            TASKS: json.dumps(self._tasks(), indent=1) + "\n",
            "launch/benchmark.launch.py": render(
                "benchmark.launch.py.j2", smooths_paths=self.navigation.smooths_paths, **values
            ),
            RUNNER: render(
                "run_benchmark.py.j2",
                columns=list(COLUMNS),
                reports_codes=self.navigation.reports_codes,
                silence=max(SILENCE, LOST_SCANS / self.model.scan_rate),
                **values,
            ),
            "README.md": self._readme(values),
        }

    def _tasks(self) -> dict[str, object]:
        """Return the values that the launch file and the runner read."""
        x, y, z, yaw = self.model.lidar_pose
        return {
            "maps": [
                {"name": s.name, "start": list(s.start), "goal": list(s.goal), "digest": s.digest}
                for s in self.scenarios
            ],
            "controllers": list(self.navigation.controllers),
            "time_limit": self.time_limit,
            "behavior_server": self.navigation.behaves,
            "velocity_smoother": self.navigation.smooths,
            "collision_monitor": self.navigation.monitors,
            "filter_servers": self.navigation.filter_servers,
            "robot": {"name": self.model.spec.name, "lidar": {"x": x, "y": y, "z": z, "yaw": yaw}},
        }

    def _readme(self, values: dict[str, object]) -> str:
        robot = self.model.spec.name
        return render(
            "README.md.j2",
            controllers=list(self.navigation.controllers),
            columns=COLUMNS,
            robot=robot,
            # Without it, the robot has the limits of the parameter file, which may be higher than its own.
            robot_option=f"--robot {robot} " if robot in ROBOTS.names() else "",
            outline=self.model.describe(),
            people=any(scenario.bodies for scenario in self.scenarios),
            wall_height=self.wall_height,
            time_limit=self.time_limit,
            **values,
        )
