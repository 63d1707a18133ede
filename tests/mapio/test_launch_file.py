"""The exported launch file, loaded with stand-ins for ROS."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from gym_mapbench.mapio.gazebo import export_gazebo
from tests.mapio.fake_ros import install, load
from tests.mapio.test_gazebo import OPTIONS, PARAMS, navigation, thesis_scenario


@pytest.fixture(scope="module", params=["humble", "jazzy", "lyrical"])
def bundle(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runner") / "bundle"
    maps = [thesis_scenario(seed, f"map_{seed}") for seed in range(2)]
    export_gazebo(maps, folder, **(OPTIONS | {"navigation": navigation(release=request.param)}))
    return maps, folder, request.param


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
        },
        launch__substitutions={
            "LaunchConfiguration": lambda key: SimpleNamespace(perform=lambda context: arguments[key])
        },
        launch_ros={},
        launch_ros__actions={"Node": SimpleNamespace},
    )
    return load(folder / "launch" / "benchmark.launch.py", "exported_launch")


@pytest.mark.parametrize("simulator", ["classic", "gz"])
@pytest.mark.parametrize("headless", ["true", "false"])
def test_the_launch_file_starts_simulator_robot_and_nav2(bundle, monkeypatch, simulator, headless):
    maps, folder, release = bundle
    if release != "humble" and simulator == "classic":
        pytest.skip("there is none since Jazzy")
    launch = load_launch(monkeypatch, folder, simulator, headless)
    *declared, function = launch.generate_launch_description()
    choices = {name: fields.get("choices") for name, fields in declared}
    assert choices["simulator"] == (["classic", "gz"] if release == "humble" else ["gz"])
    started = function.function(None)
    first = started[0].cmd
    assert first[0] == ("gzserver" if simulator == "classic" else "gz")
    world = folder / "worlds" / ("map_1.world" if simulator == "classic" else "map_1.sdf")
    assert str(world) in first
    assert str(folder / "models") in next(iter(started[0].additional_env.values()))
    nodes = {vars(item).get("name", item.executable): item for item in started if hasattr(item, "executable")}
    assert {"map_server", "planner_server", "controller_server", "behavior_server", "bt_navigator"} <= set(nodes)
    assert nodes["lifecycle_manager"].parameters[0]["node_names"][-1] == "velocity_smoother"
    assert nodes["controller_server"].remappings == [("cmd_vel", "cmd_vel_nav")]
    assert nodes["map_server"].parameters[1]["yaml_filename"] == str(folder / "maps" / "map_1.yaml")
    place = {"x": -0.064, "y": 0.0, "z": 0.16, "yaw": 0.0}
    lidar = next(item for item in started if "base_scan" in getattr(item, "arguments", ()))
    assert lidar.arguments[:8] == [text for key in place for text in (f"--{key}", str(place[key]))]
    if simulator == "gz":
        topic = "/world/map_1/model/mapbench_robot/link/base_link/sensor/bumper/contact"
        assert nodes["parameter_bridge"].arguments[-1] == f"{topic}@ros_gz_interfaces/msg/Contacts[gz.msgs.Contacts"
        assert nodes["parameter_bridge"].remappings == [(topic, "/contacts")]
    spawn = nodes["spawn_entity.py" if simulator == "classic" else "create"]
    assert spawn.arguments[-8:] == [
        "-x", str(maps[1].start.x), "-y", str(maps[1].start.y), "-z", "0.01", "-Y", str(maps[1].start.yaw),
    ]  # fmt: skip


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
