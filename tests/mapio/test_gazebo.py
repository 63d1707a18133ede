from __future__ import annotations

import ast
import json
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from hypothesis import given, settings

from evolution.cli import build_parser
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import ShapeSettings, default_task, sample_map
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.mapio.gazebo import export_gazebo, map_files
from gym_mapbench.mapio.gazebo_navigation import BundledNavigation
from gym_mapbench.mapio.gazebo_robot import RobotModel
from gym_mapbench.mapio.gazebo_trees import tree_with_plugins
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import LidarSettings
from gym_mapbench.world.robot import LidarMount, RobotSpec, make_robot
from gym_mapbench.world.scenario import MapSet, Scenario
from tests.mapio.rasterise import rasterise_world, read_collada
from tests.mapio.samples import grids, scenario_on

PARAMS = {
    "controller_server": {"ros__parameters": {"controller_plugins": ["dwb", "mppi"], "dwb": {"max_vel_x": 0.26}}},
    "planner_server": {"ros__parameters": {"planner_plugins": ("GridBased",)}},
    "behavior_server": {"ros__parameters": {"behavior_plugins": ["spin", "backup", "wait"]}},
    "velocity_smoother": {"ros__parameters": {"max_velocity": (0.26, 0.0, 1.0)}},
}
TREE = {
    "replanning_frequency": 2.0,
    "number_of_retries": 4,
    "spin_dist": 1.2,
    "wait_duration": 3.0,
    "backup_dist": 0.4,
    "backup_speed": 0.06,
    "time_allowance": 9.0,
    "recoveries": True,
}
NAVIGATION = {"params": PARAMS, "controllers": ["dwb", "mppi"], "tree": TREE}
OPTIONS = {"navigation": BundledNavigation(**NAVIGATION), "robot": make_robot("turtlebot3_waffle")}


def navigation(**changes):
    return BundledNavigation(**(NAVIGATION | changes))


def thesis_scenario(seed, name):
    grid = GridMap(sample_map(np.random.default_rng(seed), ShapeSettings()))
    return Scenario(grid, *default_task(grid), name)


def frictions(robot):
    """Friction coefficients of every collision of a robot's model; None for those of the simulator."""
    found = {one.get("name"): one.find("surface/friction/ode") for one in robot.findall("model/link/collision")}
    return {name: ode if ode is None else (ode.findtext("mu"), ode.findtext("mu2")) for name, ode in found.items()}


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """Two maps of the thesis, exported."""
    folder = tmp_path_factory.mktemp("export") / "bundle"
    maps = MapSet((thesis_scenario(1, "map_0"), thesis_scenario(2, "map_1")))
    return maps, folder, export_gazebo(maps, folder, **OPTIONS)


@pytest.mark.parametrize("model", ["mapbench_robot", "mapbench_robot_gz"])
def test_the_chassis_slides_along_walls_and_the_wheels_hold(exported, model):
    robot = ElementTree.parse(exported[1] / "models" / model / "model.sdf").getroot()
    free = dict.fromkeys(("chassis_collision", "caster_front_collision", "caster_back_collision"), ("0", "0"))
    assert frictions(robot) == {**free, "wheel_left_collision": None, "wheel_right_collision": None}


def test_layout_of_the_framework(exported):
    _, folder, files = exported
    names = {str(file.relative_to(folder)) for file in files}
    for name in ("map_0", "map_1"):
        assert names >= {
            f"maps/{name}.pgm",
            f"maps/{name}.yaml",
            f"worlds/{name}.world",
            f"worlds/{name}.sdf",
            f"models/{name}/model.config",
            f"models/{name}/model.sdf",
            f"models/{name}/mesh/map.dae",
            f"params/{name}_poses.yaml",
            f"params/{name}_waypoints.yaml",
        }
    assert names >= {"nav2_params.yaml", "behavior_trees/dwb.xml", "behavior_trees/mppi.xml", "README.md"}
    assert names >= {"run_benchmark.py", "launch/benchmark.launch.py", "gazebo_tasks.json"}
    assert sorted(files) == sorted(path for path in folder.rglob("*") if path.is_file())


def test_every_file_of_a_map_holds_the_same_map(exported):
    maps, folder, _ = exported
    assert [s.digest for s in load_scenarios(folder)] == [s.digest for s in maps]
    for scenario in maps:
        for world in (f"{scenario.name}.world", f"{scenario.name}.sdf"):
            cells = rasterise_world(folder / "worlds" / world, folder / "models", scenario.map)
            assert (cells == scenario.map.occupancy).all()
        poses = yaml.safe_load((folder / "params" / f"{scenario.name}_poses.yaml").read_text())
        assert poses == [list(scenario.start), list(scenario.goal)]
        waypoints = yaml.safe_load((folder / "params" / f"{scenario.name}_waypoints.yaml").read_text())
        assert waypoints == [{"waypoints": poses}]


@given(grid=grids(unknown=False))
@settings(max_examples=25, deadline=None)
def test_any_map_comes_back_from_its_mesh(tmp_path_factory, grid):
    if not grid.occupancy.any():
        return
    folder = tmp_path_factory.mktemp("drawn")
    for name, content in map_files(scenario_on(grid, "drawn"), 0.5, ("classic", "gz")).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    far = max(abs(grid.origin[0]), abs(grid.origin[1])) / grid.resolution
    if far < 1e5:  # beyond that the nine digits of the mesh cannot tell cells apart
        cells = rasterise_world(folder / "worlds" / "drawn.world", folder / "models", grid)
        assert (cells == grid.occupancy).all()
    vertices, _ = read_collada(folder / "models" / "drawn" / "mesh" / "map.dae")
    assert vertices[:, 2].max() == 0.5
    assert load_scenarios(folder)[0].map == grid


def test_parameters_are_written_as_given(exported):
    _, folder, _ = exported
    written = yaml.safe_load((folder / "nav2_params.yaml").read_text())
    assert written["velocity_smoother"]["ros__parameters"]["max_velocity"] == [0.26, 0.0, 1.0]
    assert written["controller_server"] == PARAMS["controller_server"]
    benchmark = json.loads((folder / "gazebo_tasks.json").read_text())
    assert benchmark["controllers"] == ["dwb", "mppi"]
    assert benchmark["velocity_smoother"] is True
    assert [entry["name"] for entry in benchmark["maps"]] == ["map_0", "map_1"]


def test_the_commands_of_the_readme_are_whole(exported):
    lines = (exported[1] / "README.md").read_text().splitlines()
    commands = [line.split()[1:] for line in lines if line.startswith("mapbench ")]
    assert [build_parser().parse_args(command).command for command in commands] == ["import-results"]


def test_trees_name_their_controller_and_planner(exported):
    _, folder, _ = exported
    tree = ElementTree.parse(folder / "behavior_trees" / "mppi.xml").getroot()
    assert tree.find(".//FollowPath").get("controller_id") == "mppi"
    assert tree.find(".//ComputePathToPose").get("planner_id") == "GridBased"
    assert [node.tag for node in tree.find(".//RoundRobin")] == ["Sequence", "Spin", "Wait", "BackUp"]
    assert "BTCPP_format" not in tree.attrib


def test_no_two_trees_have_the_same_id(exported):
    """Lyrical keeps the trees that it loads by their IDs."""
    roots = [ElementTree.parse(file).getroot() for file in sorted((exported[1] / "behavior_trees").iterdir())]
    names = [root.find("BehaviorTree").get("ID") for root in roots]
    assert names == [root.get("main_tree_to_execute") for root in roots] == ["MapBench_dwb", "MapBench_mppi"]


MAIN, SUB = '<BehaviorTree ID="A"><SubTree ID="go"/></BehaviorTree>', '<BehaviorTree ID="go"/>'
SUBTREES = f'<root main_tree_to_execute="A">{MAIN}{SUB}</root>'


@pytest.mark.parametrize(
    ("names", "xml", "expected"),
    [
        (["a.b", "a_b", "a_b_2"], "", ["MapBench_a_b", "MapBench_a_b_2", "MapBench_a_b_2_2"]),
        (["dwb", "dwb_go"], "", ["MapBench_dwb", "MapBench_dwb_go"]),
        (["dwb", "dwb_A"], SUBTREES, ["MapBench_dwb", "MapBench_dwb_A"]),
        (["dwb", "dwb_go"], SUBTREES, ["MapBench_dwb", "MapBench_dwb_go_2"]),
        (["dwb_go", "dwb"], SUBTREES, ["MapBench_dwb_go", "MapBench_dwb_2"]),
    ],
)
def test_names_that_are_alike_give_trees_of_different_ids(names, xml, expected):
    params = PARAMS | {"controller_server": {"ros__parameters": {"controller_plugins": names}}}
    given = navigation(params=params, controllers=names, tree={**TREE, "xml": xml})
    files = given.files("drawn")
    roots = [ElementTree.fromstring(files[f"behavior_trees/{name}.xml"]) for name in names]
    assert [root.get("main_tree_to_execute") for root in roots] == expected
    ids = [tree.get("ID") for root in roots for tree in root.findall("BehaviorTree")]
    assert len(ids) == len(set(ids))


def test_trees_that_nothing_uses_are_exported_as_they_are():
    used = '<BehaviorTree ID="Main"><FollowPath/></BehaviorTree>'
    unused = '<include path="gone.xml"/><BehaviorTree ID="Spare"><SubTree ID="Gone"/></BehaviorTree>'
    xml = f'<root main_tree_to_execute="Main">{used}{unused}</root>'
    root = ElementTree.fromstring(tree_with_plugins(xml, "Mine", {"planner_id": "Grid", "controller_id": "Slow"}))
    assert [tree.get("ID") for tree in root] == ["Mine", "Mine_Spare"]
    assert root.find(".//SubTree").get("ID") == "Gone"


def tree_of(**changes):
    return ElementTree.fromstring(navigation(**changes).files("drawn")["behavior_trees/dwb.xml"])


@pytest.mark.parametrize("release", ["humble", "jazzy", "lyrical"])
def test_the_numbers_of_the_tree_are_those_that_were_driven_with(release):
    tree = tree_of(release=release)
    assert tree.find(".//RateController").get("hz") == "2.0"
    assert tree.find(".//RecoveryNode[@name='NavigateRecovery']").get("number_of_retries") == "4"
    assert tree.find(".//Spin").attrib == {"spin_dist": "1.2", "time_allowance": "9.0"}
    assert tree.find(".//Wait").attrib == {"wait_duration": "3.0"}
    backup = {"backup_dist": "0.4", "backup_speed": "0.06", "time_allowance": "9.0"}
    assert tree.find(".//BackUp").attrib == backup


def test_jazzys_tree_asks_whether_a_recovery_would_help():
    tree = tree_of(release="jazzy")
    assert tree.get("BTCPP_format") == "4"
    errors = {"ComputePathToPose": "{compute_path_error_code}", "FollowPath": "{follow_path_error_code}"}
    assert {name: tree.find(f".//{name}").get("error_code_id") for name in errors} == errors
    guarded = [[child.tag for child in sequence] for sequence in tree.iter("Sequence")]
    assert guarded == [
        ["WouldAPlannerRecoveryHelp", "ClearEntireCostmap"],
        ["WouldAControllerRecoveryHelp", "ClearEntireCostmap"],
        ["Fallback", "ReactiveFallback"],
        ["ClearEntireCostmap", "ClearEntireCostmap"],
    ]
    assert "error_code" not in ElementTree.tostring(tree_of()).decode()


def test_lyricals_tree_keeps_a_valid_plan_near_the_goal():
    tree = tree_of(release="lyrical")
    keeps, plans = tree.find(".//Fallback[@name='FallbackComputePathToPose']")
    assert [node.tag for node in keeps] == ["Inverter", "IsGoalNearby", "TruncatePathLocal", "ValidatePath"]
    assert (keeps[0][0].tag, plans.tag, plans.get("planner_id")) == (
        "GlobalUpdatedGoal",
        "ComputePathToPose",
        "GridBased",
    )
    assert keeps[1].attrib == {"path": "{path}", "proximity_threshold": "4.0", "max_robot_pose_search_dist": "1.5"}
    assert keeps[2].get("output_path") == keeps[3].get("path") == "{remaining_path}"
    assert tree.find(".//RoundRobin").get("wrap_around") is None  # false by default: BackUp is the last recovery
    assert tree_of(release="jazzy").find(".//ValidatePath") is None


def test_lyricals_clears_can_name_layers():
    named = tree_of(release="lyrical", tree=TREE | {"local_clear_plugins": ("obstacle_layer", "voxel_layer")})
    clears = {node.get("service_name"): node.get("plugins") for node in named.iter("ClearEntireCostmap")}
    assert clears == {
        "local_costmap/clear_entirely_local_costmap": "obstacle_layer;voxel_layer",
        "global_costmap/clear_entirely_global_costmap": None,
    }


@pytest.mark.parametrize("release", ["humble", "jazzy", "lyrical"])
def test_a_tree_has_only_what_was_driven_with(release):
    behaviors = {"behavior_server": {"ros__parameters": {"behavior_plugins": ["wait"]}}}
    some = tree_of(release=release, params=PARAMS | behaviors)
    assert [node.tag for node in some.find(".//RoundRobin")] == ["Sequence", "Wait"]
    none = tree_of(release=release, tree=TREE | {"recoveries": False})
    tags = [node.tag for node in none.iter()]
    pipeline = ["PipelineSequence", "RateController", "ForceSuccess", "ComputePathToPose", "FollowPath"]
    assert tags == ["root", "BehaviorTree", *pipeline]


def test_what_no_parameter_of_nav2_says_is_a_comment():
    text = navigation(release="jazzy", besides={"mppi.noise": "nav2", "mppi.noise_seed": 7}).files("drawn")[
        "nav2_params.yaml"
    ]
    head = [line for line in text.splitlines() if line.startswith("#")]
    assert head[0] == "# Nav2 Jazzy."
    assert head[2:] == ['#   mppi.noise: "nav2"', "#   mppi.noise_seed: 7"]
    assert yaml.safe_load(text)["controller_server"] == PARAMS["controller_server"]


def test_the_edge_of_a_map_is_a_wall(tmp_path):
    grid = GridMap(np.eye(6, dtype=bool)[[1] * 6], 0.5, (-1.0, 2.0))
    export_gazebo([scenario_on(grid, "open")], tmp_path, **OPTIONS)
    framed = GridMap(grid.framed, 0.5, (-1.5, 1.5))
    cells = rasterise_world(tmp_path / "worlds" / "open.sdf", tmp_path / "models", framed)
    assert (cells == framed.occupancy).all()


def test_the_chassis_is_the_box_around_a_footprint_that_has_its_axle_behind():
    corners = ((0.4, 0.2), (-0.1, 0.2), (-0.1, -0.2), (0.4, -0.2))
    model = RobotModel.of(RobotSpec(footprint=corners), LidarSettings())
    assert (model.back, model.front, model.width) == (-0.1, 0.4, 0.4)
    assert model.chassis_x == pytest.approx(0.15)
    assert model.length == 0.5
    assert model.casters["back"] < 0 < model.casters["front"]


ASIDE = RobotSpec(footprint=((0.5, 0.1), (-0.1, 0.1), (-0.1, -0.3), (0.5, -0.3)))
"""A robot that reaches farther to the right than to the left."""


def test_the_chassis_is_the_box_around_a_footprint_that_reaches_farther_to_one_side(tmp_path):
    export_gazebo([thesis_scenario(1, "m")], tmp_path, **(OPTIONS | {"robot": ASIDE}))
    for name in ("mapbench_robot", "mapbench_robot_gz"):
        root = ElementTree.parse(tmp_path / "models" / name / "model.sdf").getroot()
        chassis = root.find(".//collision[@name='chassis_collision']")
        x, y = (float(value) for value in chassis.findtext("pose").split()[:2])
        length, width = (float(value) for value in chassis.findtext("geometry/box/size").split()[:2])
        assert [x - length / 2, x + length / 2] == pytest.approx([-0.1, 0.5])
        assert [y - width / 2, y + width / 2] == pytest.approx([-0.3, 0.1])


@pytest.mark.parametrize(
    "robot", [make_robot("turtlebot3_burger"), make_robot("jackal"), RobotSpec(radius=0.05), ASIDE]
)
def test_the_wheels_lie_inside_the_outline(robot):
    model = RobotModel.of(robot, LidarSettings())
    assert model.spec.wheel_separation / 2 + model.wheel_radius < min(model.left, -model.right)


@pytest.mark.parametrize("robot", ["turtlebot3_burger", "jackal"])
@pytest.mark.parametrize("model", ["mapbench_robot", "mapbench_robot_gz"])
def test_the_robot_has_outline_and_limits_of_its_spec(tmp_path, robot, model):
    spec = make_robot(robot)
    export_gazebo([thesis_scenario(1, "m")], tmp_path, **(OPTIONS | {"robot": spec}))
    root = ElementTree.parse(tmp_path / "models" / model / "model.sdf").getroot()
    chassis = root.find(".//collision[@name='chassis_collision']/geometry")
    if spec.footprint is None:
        assert float(chassis.findtext("cylinder/radius")) == spec.radius
    else:
        assert [float(v) for v in chassis.findtext("box/size").split()[:2]] == [0.42, 0.33]
    drive = next(plugin for plugin in root.iter("plugin") if "diff" in plugin.get("filename"))
    wheels = [link for link in root.iter("link") if link.get("name").startswith("wheel")]
    left, right = (float(link.findtext("pose").split()[1]) for link in wheels)
    assert float(drive.findtext("wheel_separation")) == pytest.approx(left - right)
    key = "max_linear_acceleration" if model.endswith("gz") else "max_wheel_acceleration"
    assert float(drive.findtext(key)) == spec.max_linear_acceleration


def test_scripts_are_python(exported):
    _, folder, _ = exported
    for script in ("run_benchmark.py", "launch/benchmark.launch.py"):
        source = (folder / script).read_text()
        ast.parse(source)
        assert "{%" not in source


def test_an_occupied_folder_is_left_alone(exported, tmp_path):
    maps, *_ = exported
    (tmp_path / "mine.txt").write_text("keep")
    with pytest.raises(ConfigError, match="expected a new or empty folder"):
        export_gazebo(maps, tmp_path, **OPTIONS)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
    with pytest.raises(ConfigError, match="cannot be made"):
        export_gazebo(maps, tmp_path / "mine.txt", **OPTIONS)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"controllers": []}, "controller: expected at least one"),
        ({"controllers": ["rpp"]}, "controller 'rpp': expected a plugin"),
        ({"controllers": ["dwb", "dwb"]}, "expected every name once"),
        ({"controllers": ["../dwb"]}, "expected a name of up to 100 letters"),
        ({"params": {}}, "controller_server.ros__parameters.controller_plugins"),
        ({"params": PARAMS | {"planner_server": None}}, "planner_server"),
        ({"params": PARAMS | {"behavior_server": None}}, "behavior_server"),
    ],
)
def test_bad_navigation_writes_nothing(tmp_path, change, words):
    with pytest.raises(ConfigError, match=words):
        export_gazebo([thesis_scenario(1, "m")], tmp_path / "out", **(OPTIONS | {"navigation": navigation(**change)}))
    assert not (tmp_path / "out").exists()


def test_walls_that_the_lidar_looks_over_write_nothing(tmp_path):
    with pytest.raises(ConfigError, match=r"wall height: expected more than the lidar's 0\.16 m"):
        export_gazebo([thesis_scenario(1, "m")], tmp_path / "out", **OPTIONS, wall_height=0.1)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["a", "a"], "map 'a': expected every name once, got it again; rename its file"),
        (["a/b"], "a letter or digit first; rename its file"),
        ([".."], "a letter or digit first"),
        ([""], "a letter or digit first"),
        (["mapbench_robot"], "map 'mapbench_robot': expected another name"),
        (["world"], "map 'world': expected another name"),
        (["sun"], "map 'sun': expected another name"),
        (["physics"], "map 'physics': expected another name"),
        (["ground_plane"], "map 'ground_plane': expected another name"),
        (["x" * 101], "a name of up to 100 letters"),
        ([], "expected at least one, got none"),
    ],
)
def test_bad_map_names_write_nothing(tmp_path, names, words):
    with pytest.raises(ConfigError, match=words):
        export_gazebo([thesis_scenario(1, name) for name in names], tmp_path / "out", **OPTIONS)
    assert not (tmp_path / "out").exists()


def test_inertia_is_possible():
    for spec in (RobotSpec(radius=0.5), make_robot("jackal")):
        a, b, c = RobotModel.of(spec, LidarSettings()).moments
        assert min(a, b, c) > 0
        assert a + b >= c
        assert b + c >= a


def lidar_of(root, kind):
    sensor = root.find(".//sensor[@name='lidar']")
    place = [float(value) for value in sensor.findtext("pose").split()]
    block = sensor.find(kind)
    names = (
        "scan/horizontal/samples",
        "scan/horizontal/min_angle",
        "scan/horizontal/max_angle",
        "range/min",
        "range/max",
    )
    return place, [float(block.findtext(name)) for name in names], float(sensor.findtext("update_rate"))


@pytest.mark.parametrize(("model", "kind"), [("mapbench_robot", "ray"), ("mapbench_robot_gz", "lidar")])
def test_the_lidar_sits_where_the_robot_has_it(tmp_path, model, kind):
    robots = {
        "preset": (make_robot("turtlebot3_waffle"), LidarSettings()),
        "turned": (RobotSpec(lidar=LidarMount(x=0.1, y=-0.05, yaw=0.5, range_min=0.3)), LidarSettings(range_max=8.0)),
        "own": (RobotSpec(lidar=LidarMount(x=0.1)), LidarSettings(x=0.0, y=0.02, beams=5, angle_min=-1.0)),
        "narrow": (RobotSpec(), LidarSettings(beams=3, angle_min=-0.5, angle_increment=0.5, scan_rate=5.0)),
    }
    found = {}
    for name, (robot, lidar) in robots.items():
        export_gazebo([thesis_scenario(1, "m")], tmp_path / name, **(OPTIONS | {"robot": robot}), lidar=lidar)
        found[name] = lidar_of(ElementTree.parse(tmp_path / name / "models" / model / "model.sdf").getroot(), kind)
        transform = json.loads((tmp_path / name / "gazebo_tasks.json").read_text())["robot"]["lidar"]
        assert [transform[key] for key in ("x", "y", "z", "yaw")] == [found[name][0][i] for i in (0, 1, 2, 5)]
    assert found["preset"][0] == [-0.064, 0.0, 0.16, 0.0, 0.0, 0.0]
    assert found["preset"][1:] == ([360, 0.0, pytest.approx(359 * np.pi / 180), 0.12, 3.5], 10.0)
    assert found["turned"][0] == [0.1, -0.05, 0.16, 0.0, 0.0, 0.5]
    assert found["turned"][1][3:] == [0.3, 8.0]
    assert found["own"][0][:2] == [0.0, 0.02]
    assert found["own"][1][:3] == [5, -1.0, pytest.approx(-1.0 + 4 * 2 * np.pi / 5)]
    assert found["narrow"][1:] == ([3, -0.5, 0.5, 0.05, 3.5], 5.0)


def test_no_name_is_given_twice_beside_each_other(exported):
    for file in (*exported[1].glob("models/*/model.sdf"), *exported[1].glob("worlds/*")):
        for element in ElementTree.parse(file).iter():
            names = [child.get("name") for child in element if child.get("name") is not None]
            assert len(names) == len(set(names)), f"{file}: {names}"


@pytest.mark.parametrize(("model", "plugin"), [("mapbench_robot", True), ("mapbench_robot_gz", False)])
def test_the_bumper_feels_the_chassis(exported, model, plugin):
    root = ElementTree.parse(exported[1] / "models" / model / "model.sdf").getroot()
    bumper = root.find(".//sensor[@type='contact']")
    assert bumper.findtext("contact/topic") == (None if plugin else "/contacts")
    assert root.find(f".//collision[@name='{bumper.findtext('contact/collision')}']") is not None
    assert (bumper.find("plugin") is not None) is plugin


def test_a_users_tree_is_exported_with_the_plugins_of_the_package():
    follow = '<FollowPath path="{path}" controller_id="FollowPath" goal_checker_id="precise"/>'
    main = '<Sequence><ComputePathToPose goal="{goal}" path="{path}"/><SubTree ID="Go" path="path"/></Sequence>'
    trees = f'<BehaviorTree ID="Main">{main}</BehaviorTree><BehaviorTree ID="Go">{follow}</BehaviorTree>'
    server = {"controller_plugins": ["dwb", "mppi"], "goal_checker_plugins": ["goal_checker"]}
    params = PARAMS | {"controller_server": {"ros__parameters": server}}
    root = tree_of(params=params, tree={**TREE, "xml": f'<root main_tree_to_execute="Main">{trees}</root>'})
    assert root.get("main_tree_to_execute") == "MapBench_dwb"
    assert [tree.get("ID") for tree in root] == ["MapBench_dwb", "MapBench_dwb_Go"]
    assert root.find(".//SubTree").get("ID") == "MapBench_dwb_Go"
    assert root.find(".//ComputePathToPose").get("planner_id") == "GridBased"
    ids = {"controller_id": "dwb", "goal_checker_id": "goal_checker"}
    assert root.find(".//FollowPath").attrib == {"path": "{path}", **ids}
    assert root.find(".//Sequence").attrib == {}


@pytest.mark.parametrize(
    ("release", "xml", "expected"), [("humble", "", False), ("jazzy", "", True), ("jazzy", "<root/>", False)]
)
def test_only_the_default_trees_of_releases_with_error_codes_report_all_of_them(release, xml, expected):
    assert navigation(release=release, tree={**TREE, "xml": xml}).reports_codes is expected
