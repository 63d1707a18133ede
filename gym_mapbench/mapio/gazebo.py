"""Export for Gazebo and Nav2: worlds, models, maps, parameters, behaviour trees, and a runner that drives it all.

A map has the files that the thesis lists (section 4.2), in ``maps/``, ``worlds/``, ``models/NAME/`` and ``params/``.
The same walls and poses run in Gazebo Classic (SDF 1.6) and in a current gz-sim.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio.actors import actors_of, check_actors, names_of_actors
from gym_mapbench.mapio.gazebo_navigation import BundledNavigation
from gym_mapbench.mapio.gazebo_package import RosPackage
from gym_mapbench.mapio.gazebo_robot import RobotModel
from gym_mapbench.mapio.map_server import map_server_pgm, map_server_yaml
from gym_mapbench.mapio.mesh import WALL_HEIGHT, Mesh, wall_mesh
from gym_mapbench.mapio.output import Files, check_names, write_new_folder
from gym_mapbench.mapio.people import people_yaml
from gym_mapbench.mapio.poses import poses_yaml, waypoints_yaml
from gym_mapbench.mapio.rendering import render
from gym_mapbench.mapio.tasked_map import genome_files
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import LidarSettings
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Scenario

ROBOT_MODELS = {"classic": "mapbench_robot", "gz": "mapbench_robot_gz"}
SDF_VERSIONS = {"classic": "1.6", "gz": "1.8"}
WORLDS = {"classic": "world", "gz": "sdf"}
"""Endings of the worlds' files."""
TAKEN = (*ROBOT_MODELS.values(), "world", "physics", "sun", "ground_plane")
"""Names that no map's model may have: of what a world holds besides, and of the frame of every world in SDFormat."""


def export_gazebo(
    scenarios: Iterable[Scenario],
    out_dir: str | Path,
    *,
    navigation: BundledNavigation,
    robot: RobotSpec,
    lidar: LidarSettings | None = None,
    wall_height: float = WALL_HEIGHT,
    time_limit: float = 150.0,
) -> list[Path]:
    """Write everything needed to drive the scenarios in Gazebo under Nav2, as a ROS 2 package.

    Args:
        scenarios: A map set, or any scenarios; their names become file names.
        out_dir: A folder that is new or empty; the package is named after it.
        navigation: Nav2's parameters and behaviour trees.
        robot: Shape and limits of the robot, and where its lidar sits.
        lidar: Beams and ranges of its lidar, and its place where it has one of its own.
        wall_height: Height of the walls, m.
        time_limit: Simulated seconds after which the runner ends a run.

    Returns:
        The files, as written.

    Raises:
        ConfigError: If the folder holds something, a name cannot be a file name or is taken, or the walls do not
            reach the lidar, or a body moves in another way than ``scripted`` or ``wander``, walks through walls, or
            leaves the robot no room at start or goal.
    """
    scenarios, out_dir = list(scenarios), Path(out_dir)
    model = RobotModel.of(robot, lidar or LidarSettings())
    check_actors(scenarios, robot)
    people = (f"{scenario.name}_people" for scenario in scenarios if scenario.bodies)
    actors = (scenario.name for scenario in scenarios if scenario.name in names_of_actors(scenario))
    check_names("map", [scenario.name for scenario in scenarios], reserved=(*TAKEN, *people, *actors))
    if wall_height <= model.lidar_z:
        raise ConfigError(f"wall height: expected more than the lidar's {model.lidar_z:g} m, got {wall_height:g}")
    package = RosPackage(out_dir.resolve().name, scenarios, navigation, model, time_limit, wall_height)
    files = (
        navigation.files(package.package) | package.files() | genome_files((one.name, one.genome) for one in scenarios)
    )
    for scenario in scenarios:
        files |= map_files(scenario, wall_height, package.simulators)
    for simulator in package.simulators:
        files |= _robot_files(model, simulator)
    return write_new_folder(files, out_dir)


def map_files(scenario: Scenario, wall_height: float, simulators: Iterable[str]) -> Files:
    """Return the content of one map's files by path: those of the thesis, with a world for each simulator."""
    name, grid, poses = scenario.name, scenario.map, [scenario.start, scenario.goal]
    values = {"name": name, "actors": actors_of(scenario)}
    worlds: Files = {f"worlds/{name}.{WORLDS[one]}": render(f"{one}_world.sdf.j2", **values) for one in simulators}
    people: Files = {f"maps/{name}_people.yaml": people_yaml(scenario.bodies)} if scenario.bodies else {}
    return (
        worlds
        | people
        | {
            f"maps/{name}.pgm": map_server_pgm(grid),
            f"maps/{name}.yaml": map_server_yaml(grid, f"{name}.pgm"),
            f"models/{name}/model.config": _config(name, "1.6", "Walls of a map made by MapBench"),
            f"models/{name}/model.sdf": render("map_model.sdf.j2", name=name),
            f"models/{name}/mesh/map.dae": collada(wall_mesh(_with_edge(grid), wall_height)),
            f"params/{name}_poses.yaml": poses_yaml(poses),
            f"params/{name}_waypoints.yaml": waypoints_yaml(poses),
        }
    )


def _with_edge(grid: GridMap) -> GridMap:
    """Return a map whose edge is of occupied cells: MapBench's edge is a wall, and a simulator has no edge."""
    cells = grid.occupancy
    if cells[[0, -1]].all() and cells[:, [0, -1]].all():
        return grid
    x, y = grid.origin
    return GridMap(grid.framed, grid.resolution, (x - grid.resolution, y - grid.resolution))


def collada(mesh: Mesh) -> str:
    """Return a mesh as COLLADA 1.4.1, z up, in m."""
    vertex_and_normal = np.repeat(mesh.triangles.ravel(), 2)
    return render(
        "map.dae.j2",
        n_vertices=len(mesh.vertices),
        vertices=" ".join(f"{value:.9g}" for value in mesh.vertices.ravel().tolist()),
        normals=" ".join(f"{value:.6g}" for value in mesh.normals().ravel().tolist()),
        n_triangles=len(mesh.triangles),
        indices=" ".join(map(str, vertex_and_normal.tolist())),
    )


def _robot_files(model: RobotModel, simulator: str) -> Files:
    name, version = ROBOT_MODELS[simulator], SDF_VERSIONS[simulator]
    sdf = render("robot.sdf.j2", name=name, gz=simulator == "gz", sdf_version=version, robot=model)
    return {
        f"models/{name}/model.config": _config(name, version, "The robot that MapBench simulates"),
        f"models/{name}/model.sdf": sdf,
    }


def _config(name: str, sdf_version: str, description: str) -> str:
    return render("model.config.j2", name=name, sdf_version=sdf_version, description=description)
