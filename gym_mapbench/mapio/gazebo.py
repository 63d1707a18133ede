"""Export for Gazebo and Nav2: worlds, models, maps, parameters, behaviour trees, and a runner that drives it all.

The layout is that of the thesis' framework (section 4.2): ``maps/``, ``worlds/``, ``models/NAME/``,
``params/``. The same walls and poses run in Gazebo Classic (SDF 1.6) and in a current gz-sim.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio.gazebo_robot import RobotModel
from gym_mapbench.mapio.map_server import map_server_pgm, map_server_yaml
from gym_mapbench.mapio.mesh import Mesh, wall_mesh
from gym_mapbench.mapio.output import Files, check_names, write_new_folder
from gym_mapbench.mapio.poses import poses_yaml, waypoints_yaml
from gym_mapbench.mapio.runner_results import COLUMNS
from gym_mapbench.robot import RobotSpec
from gym_mapbench.scenario import Scenario

ROBOT_MODEL = "mapbench_robot"
GZ_ROBOT_MODEL = "mapbench_robot_gz"


def export_gazebo(
    scenarios: Iterable[Scenario],
    out_dir: str | Path,
    *,
    navigation_params: Mapping[str, Any],
    controllers: Sequence[str],
    robot: RobotSpec,
    wall_height: float = 0.5,
    time_limit: float = 150.0,
    lidar_range: float = 3.5,
) -> list[Path]:
    """Write everything needed to drive the scenarios in Gazebo under Nav2.

    Args:
        scenarios: A map set, or any scenarios; their names become file names.
        out_dir: A folder that is new or empty.
        navigation_params: The mapping of a ``nav2_params.yaml`` (Humble), written as it is.
        controllers: Names of the controller plugins in it that are compared; one behaviour tree each.
        robot: Shape and limits of the robot.
        wall_height: Height of the walls, m.
        time_limit: Simulated seconds the runner gives a run.
        lidar_range: Range of the robot's lidar, m.

    Returns:
        The files, as written.

    Raises:
        ConfigError: If the folder holds something, a name cannot be a file name or comes twice, the
            walls do not reach the lidar, or ``navigation_params`` has no plugin for a controller.
    """
    scenarios = list(scenarios)
    model = RobotModel.of(robot, lidar_range)
    check_names("map", [scenario.name for scenario in scenarios], reserved=(ROBOT_MODEL, GZ_ROBOT_MODEL))
    check_names("controller", controllers)
    _check_plugins(navigation_params, controllers)
    if wall_height <= model.lidar_z:
        raise ConfigError(f"wall height: expected more than the lidar's {model.lidar_z:g} m, got {wall_height:g}")
    files: Files = {}
    for scenario in scenarios:
        files |= map_files(scenario, wall_height)
    files |= _robot_files(model)
    files |= _navigation_files(navigation_params, controllers)
    files |= _runner_files(scenarios, navigation_params, controllers, model, time_limit, wall_height)
    return write_new_folder(files, Path(out_dir))


def map_files(scenario: Scenario, wall_height: float = 0.5) -> Files:
    """Return the content of one map's files by path: the thesis' seven kinds, and the world for gz-sim."""
    name, grid, poses = scenario.name, scenario.map, [scenario.start, scenario.goal]
    return {
        f"maps/{name}.pgm": map_server_pgm(grid),
        f"maps/{name}.yaml": map_server_yaml(grid, f"{name}.pgm"),
        f"worlds/{name}.world": _render("classic.world.j2", name=name),
        f"worlds/{name}.sdf": _render("gz_world.sdf.j2", name=name),
        f"models/{name}/model.config": _config(name, "1.6", "Walls of a map made by MapBench"),
        f"models/{name}/model.sdf": _render("map_model.sdf.j2", name=name),
        f"models/{name}/mesh/map.dae": collada(wall_mesh(grid, wall_height)),
        f"params/{name}_poses.yaml": poses_yaml(poses),
        f"params/{name}_waypoints.yaml": waypoints_yaml(poses),
    }


def collada(mesh: Mesh) -> str:
    """Return a mesh as COLLADA 1.4.1, z up, in m."""
    vertex_and_normal = np.repeat(mesh.triangles.ravel(), 2)
    return _render(
        "map.dae.j2",
        n_vertices=len(mesh.vertices),
        vertices=" ".join(f"{value:.9g}" for value in mesh.vertices.ravel().tolist()),
        normals=" ".join(f"{value:.6g}" for value in mesh.normals().ravel().tolist()),
        n_triangles=len(mesh.triangles),
        indices=" ".join(map(str, vertex_and_normal.tolist())),
    )


def _robot_files(model: RobotModel) -> Files:
    files: Files = {}
    for name, gz, version in ((ROBOT_MODEL, False, "1.6"), (GZ_ROBOT_MODEL, True, "1.8")):
        files[f"models/{name}/model.config"] = _config(name, version, "The robot that MapBench simulates")
        files[f"models/{name}/model.sdf"] = _render("robot.sdf.j2", name=name, gz=gz, sdf_version=version, robot=model)
    return files


def _navigation_files(params: Mapping[str, Any], controllers: Sequence[str]) -> Files:
    planner = _plugins(params, "planner_server", "planner_plugins")[0]
    trees: Files = {
        f"behavior_trees/{name}.xml": _render("behavior_tree.xml.j2", controller=name, planner=planner)
        for name in controllers
    }
    # Through JSON: tuples become lists, and what YAML could only write with a tag is refused.
    plain = json.loads(json.dumps(params))
    return trees | {"nav2_params.yaml": yaml.safe_dump(plain, sort_keys=False)}


def _runner_files(
    scenarios: Sequence[Scenario],
    params: Mapping[str, Any],
    controllers: Sequence[str],
    model: RobotModel,
    time_limit: float,
    wall_height: float,
) -> Files:
    """Return what launches and drives it, and the README."""
    benchmark = {
        "maps": [{"name": s.name, "start": list(s.start), "goal": list(s.goal)} for s in scenarios],
        "controllers": list(controllers),
        "time_limit": time_limit,
        "velocity_smoother": "velocity_smoother" in params,
        "robot": {"name": model.spec.name, "lidar_z": model.lidar_z},
    }
    names = [scenario.name for scenario in scenarios]
    readme = _render(
        "README.md.j2",
        n_maps=len(names),
        maps=names,
        controllers=list(controllers),
        columns=COLUMNS,
        robot=model.spec.name,
        outline=model.describe(),
        wall_height=wall_height,
    )
    return {
        "benchmark.json": json.dumps(benchmark, indent=1) + "\n",
        "launch/benchmark.launch.py": _render("benchmark.launch.py.j2", first_map=names[0]),
        "run_benchmark.py": _render("run_benchmark.py.j2"),
        "README.md": readme,
    }


def _config(name: str, sdf_version: str, description: str) -> str:
    return _render("model.config.j2", name=name, sdf_version=sdf_version, description=description)


def _render(template: str, **values: object) -> str:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        # The names that go into the files are checked; nothing in them needs escaping.
        autoescape=False,
    )
    return environment.get_template(template).render(values)


def _check_plugins(params: Mapping[str, Any], controllers: Sequence[str]) -> None:
    known = _plugins(params, "controller_server", "controller_plugins")
    for name in controllers:
        if name not in known:
            raise ConfigError(f"controller {name!r}: expected a plugin of controller_server, which has {known}")


def _plugins(params: Mapping[str, Any], server: str, key: str) -> list[str]:
    """Return the plugins that a server section names."""
    try:
        plugins = params[server]["ros__parameters"][key]
    except (KeyError, TypeError):
        raise ConfigError(f"nav2 parameters: expected {server}.ros__parameters.{key}, which is missing") from None
    if not isinstance(plugins, (list, tuple)) or not plugins:
        raise ConfigError(f"nav2 parameters: {server}.{key}: expected a list of names, got {plugins!r}")
    return [str(plugin) for plugin in plugins]
