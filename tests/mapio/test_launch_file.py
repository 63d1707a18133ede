"""The exported launch file, loaded with stand-ins for ROS."""

from __future__ import annotations

import argparse
from types import SimpleNamespace

import pytest

from gym_mapbench.mapio.gazebo import export_gazebo
from gym_mapbench.mapio.gazebo_package import SIMULATORS
from tests.mapio.fake_ros import install, load
from tests.mapio.test_gazebo import OPTIONS, PARAMS, navigation, thesis_scenario


def load_launch(monkeypatch, folder, simulator="gz", headless="true"):
    """Load an exported launch file with stand-ins for ROS."""
    arguments = {"map": "map_1", "simulator": simulator, "headless": headless}
    install(
        monkeypatch,
        ament_index_python={},
        ament_index_python__packages={"get_package_share_directory": {"mapbench_bundle": str(folder)}.__getitem__},
        launch={"LaunchDescription": list},
        launch__actions={
            "DeclareLaunchArgument": lambda name, **fields: (name, fields),
            "ExecuteProcess": SimpleNamespace,
            "OpaqueFunction": SimpleNamespace,
            "Shutdown": lambda: "the launch ends",
        },
        launch__substitutions={
            "LaunchConfiguration": lambda key: SimpleNamespace(perform=lambda context: arguments[key])
        },
        launch_ros={},
        launch_ros__actions={"Node": SimpleNamespace},
    )
    return load(folder / "launch" / "benchmark.launch.py", "exported_launch")


@pytest.mark.parametrize(
    ("bundle", "simulator"),
    [(release, simulator) for release, simulators in SIMULATORS.items() for simulator in simulators],
    indirect=["bundle"],
)
@pytest.mark.parametrize("headless", ["true", "false"])
def test_the_launch_file_starts_simulator_robot_and_nav2(bundle, monkeypatch, simulator, headless):
    maps, folder, release = bundle
    launch = load_launch(monkeypatch, folder, simulator, headless)
    *declared, function = launch.generate_launch_description()
    choices = {name: fields.get("choices") for name, fields in declared}
    assert choices["map"] == ["map_0", "map_1"]
    assert choices["simulator"] == (["classic", "gz"] if release == "humble" else ["gz"])
    started = function.function(None)
    first = started[0].cmd
    assert first[0] == ("gzserver" if simulator == "classic" else "gz")
    world = folder / "worlds" / ("map_1.world" if simulator == "classic" else "map_1.sdf")
    assert str(world) in first
    assert str(folder / "models") in next(iter(started[0].additional_env.values()))
    assert started[0].on_exit == "the launch ends"
    nodes = {vars(item).get("name", item.executable): item for item in started if hasattr(item, "executable")}
    assert {"map_server", "planner_server", "controller_server", "behavior_server", "bt_navigator"} <= set(nodes)
    assert nodes["lifecycle_manager"].parameters[0]["node_names"][-1] == "velocity_smoother"
    assert nodes["controller_server"].remappings == [("cmd_vel", "cmd_vel_nav")]
    assert nodes["map_server"].parameters[1]["yaml_filename"] == str(folder / "maps" / "map_1.yaml")
    place = {"x": -0.064, "y": 0.0, "z": 0.16, "yaw": 0.0}
    lidar = next(item for item in started if "base_scan" in getattr(item, "arguments", ()))
    assert lidar.arguments[:8] == [text for key in place for text in (f"--{key}", str(place[key]))]
    if simulator == "gz":
        # Topics without the name of the map, which is no name of a topic in ROS if it has a dash.
        assert nodes["parameter_bridge"].arguments[-1] == "/contacts@ros_gz_interfaces/msg/Contacts[gz.msgs.Contacts"
        assert not any("map_1" in argument for argument in nodes["parameter_bridge"].arguments)
    spawn = nodes["spawn_entity.py" if simulator == "classic" else "create"]
    assert spawn.arguments[-8::2] == ["-x", "-y", "-z", "-Y"]
    assert "-world" not in spawn.arguments  # with it, Humble's `create` waits 5 s for Gazebo and no longer
    x, y, yaw = maps[1].start
    assert [float(value) for value in spawn.arguments[-7::2]] == pytest.approx([x, y, 0.01, yaw])


def test_the_spawners_get_no_exponents(bundle, monkeypatch):
    launch = load_launch(monkeypatch, bundle[1])
    arguments = launch.start_arguments({"start": [0.5, -2e-5, -1.2e-16]})
    parser = argparse.ArgumentParser()
    for name in "xyzY":
        parser.add_argument(f"-{name}", type=float)
    parsed = parser.parse_args(arguments)
    assert (parsed.x, parsed.y, parsed.Y) == (0.5, -2e-5, 0.0)


def test_the_default_trees_are_of_the_package(bundle, monkeypatch):
    """Nav2's own trees name a controller FollowPath and ask for all behaviours; without one, nothing starts."""
    _, folder, _ = bundle
    *_, function = load_launch(monkeypatch, folder).generate_launch_description()
    nodes = {node.name: node for node in function.function(None) if hasattr(node, "name")}
    tree = str(folder / "behavior_trees" / "dwb.xml")
    given = nodes["bt_navigator"].parameters[1]
    assert {given["default_nav_to_pose_bt_xml"], given["default_nav_through_poses_bt_xml"]} == {tree}


def test_recoveries_take_the_way_that_they_have_in_the_release(bundle, monkeypatch):
    """Humble's bring-up sends their commands to the robot at once, later ones through the smoother."""
    _, folder, release = bundle
    *_, function = load_launch(monkeypatch, folder).generate_launch_description()
    nodes = {node.name: node for node in function.function(None) if hasattr(node, "name")}
    expected = [] if release == "humble" else [("cmd_vel", "cmd_vel_nav")]
    assert nodes["behavior_server"].remappings == expected


def test_a_server_without_behaviours_is_not_launched(monkeypatch, tmp_path):
    params = {**PARAMS, "behavior_server": {"ros__parameters": {"behavior_plugins": []}}}
    folder = tmp_path / "bundle"
    maps = [thesis_scenario(seed, f"map_{seed}") for seed in range(2)]
    export_gazebo(maps, folder, **(OPTIONS | {"navigation": navigation(params=params)}))
    *_, function = load_launch(monkeypatch, folder).generate_launch_description()
    nodes = {node.name: node for node in function.function(None) if hasattr(node, "name")}
    assert "behavior_server" not in nodes
    assert "behavior_server" not in nodes["lifecycle_manager"].parameters[0]["node_names"]


@pytest.mark.parametrize("smooths", [True, False])
def test_the_collision_monitor_stands_in_front_of_the_base(monkeypatch, tmp_path, smooths):
    params = {**PARAMS, "collision_monitor": {"ros__parameters": {"polygons": []}}}
    if not smooths:
        del params["velocity_smoother"]
    folder = tmp_path / "bundle"
    maps = [thesis_scenario(seed, f"map_{seed}") for seed in range(2)]
    export_gazebo(maps, folder, **(OPTIONS | {"navigation": navigation(params=params, release="jazzy")}))
    *_, function = load_launch(monkeypatch, folder).generate_launch_description()
    nodes = {node.name: node for node in function.function(None) if hasattr(node, "name")}
    assert nodes["lifecycle_manager"].parameters[0]["node_names"][-1] == "collision_monitor"
    assert nodes["controller_server"].remappings == [("cmd_vel", "cmd_vel_nav")]
    if smooths:
        assert nodes["velocity_smoother"].remappings == [("cmd_vel", "cmd_vel_nav")]


def test_the_servers_of_costmap_filters_are_launched_with_their_masks(monkeypatch, tmp_path):
    info, mask = {"type": 0, "mask_topic": "a_mask"}, {"topic_name": "a_mask", "yaml_filename": "maps/masks/a.yaml"}
    servers = {"a_filter_info_server": {"ros__parameters": info}, "a_filter_mask_server": {"ros__parameters": mask}}
    masks = {"maps/masks/a.yaml": "image: a.pgm\n"}
    folder, maps = tmp_path / "bundle", [thesis_scenario(seed, f"map_{seed}") for seed in range(2)]
    given = navigation(params={**PARAMS, **servers}, release="jazzy", masks=masks)
    export_gazebo(maps, folder, **(OPTIONS | {"navigation": given}))
    *_, function = load_launch(monkeypatch, folder).generate_launch_description()
    nodes = {node.name: node for node in function.function(None) if hasattr(node, "name")}
    assert nodes["lifecycle_manager"].parameters[0]["node_names"][-2:] == list(servers)
    assert nodes["a_filter_info_server"].executable == "costmap_filter_info_server"
    assert nodes["a_filter_mask_server"].executable == "map_server"
    written = folder / "maps" / "masks" / "a.yaml"
    assert nodes["a_filter_mask_server"].parameters[1]["yaml_filename"] == str(written)
    assert written.read_text() == masks["maps/masks/a.yaml"]


@pytest.mark.parametrize("smooths", [True, False])
def test_the_smoother_server_is_launched_if_there_is_one(monkeypatch, tmp_path, smooths):
    params = PARAMS | ({"smoother_server": {"ros__parameters": {"smoother_plugins": ["a"]}}} if smooths else {})
    folder = tmp_path / "bundle"
    maps = [thesis_scenario(seed, f"map_{seed}") for seed in range(2)]
    export_gazebo(maps, folder, **(OPTIONS | {"navigation": navigation(params=params)}))
    *_, function = load_launch(monkeypatch, folder).generate_launch_description()
    nodes = {node.name: node for node in function.function(None) if hasattr(node, "name")}
    assert ("smoother_server" in nodes) == smooths
    assert ("smoother_server" in nodes["lifecycle_manager"].parameters[0]["node_names"]) == smooths
