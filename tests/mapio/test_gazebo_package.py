"""A bundle for Gazebo as a ROS 2 package: manifest, build file, and what its README says."""

from __future__ import annotations

import re
import shutil
import subprocess
from xml.etree import ElementTree

import pytest

from gym_mapbench.mapio.gazebo import export_gazebo
from tests.mapio.test_gazebo import OPTIONS, PARAMS, navigation, thesis_scenario


@pytest.fixture(scope="module", params=["humble", "jazzy", "lyrical"])
def package(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("ws") / "My maps-2"
    options = OPTIONS | {"navigation": navigation(release=request.param)}
    return request.param, folder, export_gazebo([thesis_scenario(1, "map_0")], folder, **options)


def test_the_package_has_a_manifest(package):
    release, folder, _ = package
    root = ElementTree.parse(folder / "package.xml").getroot()
    assert (root.tag, root.get("format")) == ("package", "3")
    assert root.findtext("name") == "mapbench_my_maps_2"
    assert root.findtext("export/build_type") == root.findtext("buildtool_depend") == "ament_cmake"
    for tag in ("version", "description", "maintainer", "license"):
        assert root.findtext(tag)
    needed = {node.text for node in root.iter("exec_depend")}
    assert {"navigation2", "nav2_msgs", "rclpy", "launch_ros"} <= needed
    assert ({"gazebo_ros", "gazebo_plugins", "gazebo_msgs"} <= needed) is (release == "humble")
    assert ({"ros_gz_sim", "ros_gz_bridge", "ros_gz_interfaces"} <= needed) is (release != "humble")


def test_controllers_in_packages_of_their_own_are_installed(tmp_path):
    plugins = {"mppi": "nav2_mppi_controller::MPPIController", "dwb": "dwb_core::DWBLocalPlanner"}
    shim = "nav2_rotation_shim_controller::RotationShimController"
    graceful = {"plugin": shim, "primary_controller": "nav2_graceful_controller::GracefulController"}
    for number, (controllers, expected) in enumerate(
        [
            ({"dwb": {"plugin": plugins["dwb"]}}, set()),
            ({"mppi": {"plugin": plugins["mppi"]}, "turns": graceful}, {"mppi", "graceful"}),
        ]
    ):
        server = {"controller_plugins": list(controllers), **controllers}
        params = {**PARAMS, "controller_server": {"ros__parameters": server}}
        given = navigation(params=params, controllers=list(controllers), release="jazzy")
        folder = tmp_path / str(number)
        export_gazebo([thesis_scenario(1, "m")], folder, **(OPTIONS | {"navigation": given}))
        needed = {node.text for node in ElementTree.parse(folder / "package.xml").getroot().iter("exec_depend")}
        text = (folder / "README.md").read_text()
        for name in ("mppi", "graceful"):
            assert (f"nav2_{name}_controller" in needed) is (name in expected)
            assert (f" ros-jazzy-nav2-{name}-controller " in text) is (name in expected)


def test_the_manifest_is_as_ros_wants_it(package):
    catkin_pkg = pytest.importorskip("catkin_pkg.package")
    parsed = catkin_pkg.parse_package(package[1])
    parsed.validate(warnings=(warnings := []))
    assert (parsed.name, warnings) == ("mapbench_my_maps_2", [])


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("bundle", "mapbench_bundle"),
        ("Büro 3", "mapbench_b_ro_3"),
        ("mapbench_office", "mapbench_office"),
        ("___", "mapbench_bundle"),
    ],
)
def test_any_folder_gives_a_name_that_ros_takes(tmp_path, name, expected):
    export_gazebo([thesis_scenario(1, "m")], tmp_path / name, **OPTIONS)
    assert ElementTree.parse(tmp_path / name / "package.xml").findtext("name") == expected


def test_the_runner_alone_is_executable(package):
    """colcon build --symlink-install links to the file as it is."""
    _, folder, files = package
    assert [path for path in files if path.stat().st_mode & 0o111] == [folder / "run_benchmark.py"]


def test_cmake_does_not_call_the_minimum_too_old(package):
    """CMake 3.31 and later, as Lyrical has, warn of minimum versions below 3.10."""
    minimum = re.match(r"cmake_minimum_required\(VERSION (\d+)\.(\d+)\)", (package[1] / "CMakeLists.txt").read_text())
    assert (3, 10) <= tuple(map(int, minimum.groups())) <= (3, 22)  # 3.22 is Humble's


AMENT = """
macro(ament_package)
  install(FILES package.xml DESTINATION share/${PROJECT_NAME})
endmacro()
"""


def test_the_package_is_built_and_installed_whole(package, tmp_path):
    if shutil.which("cmake") is None:
        pytest.skip("no CMake")
    _, folder, files = package
    (tmp_path / "ament_cmakeConfig.cmake").write_text(AMENT)  # what ament_cmake does that matters here
    configure = ["cmake", "-S", folder, "-B", tmp_path / "build", f"-Dament_cmake_DIR={tmp_path}"]
    subprocess.run([*configure, f"-DCMAKE_INSTALL_PREFIX={tmp_path / 'install'}"], check=True)
    subprocess.run(["cmake", "--install", tmp_path / "build"], check=True)
    share, lib = (tmp_path / "install" / kind / "mapbench_my_maps_2" for kind in ("share", "lib"))
    runner = lib / "run_benchmark.py"
    assert runner.stat().st_mode & 0o111
    installed = {str(path.relative_to(share)) for path in share.rglob("*") if path.is_file()}
    assert installed == {str(path.relative_to(folder)) for path in files} - {"run_benchmark.py", "CMakeLists.txt"}


def test_a_bundle_holds_what_its_release_has_simulators_for(package):
    release, folder, _ = package
    endings = {path.suffix for path in (folder / "worlds").iterdir()}
    models = {path.name for path in (folder / "models").iterdir()} - {"map_0"}
    if release == "humble":
        assert (endings, models) == ({".world", ".sdf"}, {"mapbench_robot", "mapbench_robot_gz"})
    else:
        assert (endings, models) == ({".sdf"}, {"mapbench_robot_gz"})
        texts = [path.read_text() for path in folder.rglob("*") if path.suffix in (".py", ".md", ".xml", ".txt")]
        assert not any(word in text for text in texts for word in ("gazebo_ros", "gzserver", "gazebo_msgs", "humble"))


def test_the_readme_names_where_packages_come_from(package):
    release, folder, _ = package
    text = (folder / "README.md").read_text()
    assert "packages.ros.org" in text
    assert ("packages.osrfoundation.org" in text) is (release == "humble")
    assert ("a time may be off by 0.1 s" in text) is (release == "humble")  # DEFAULT_PUBLISH_FREQUENCY of gazebo_ros
    installed = set(re.findall(r"\bros-[a-z]+-[a-z0-9-]+", text))
    assert installed
    assert all(name.startswith(f"ros-{release}-") for name in installed)
    assert "ros2 run mapbench_my_maps_2 run_benchmark.py" in text
    same = "--robot turtlebot3_waffle --noise none --contact slides --time-limit 150 --out OURS"
    assert f"bench MAPS --params nav2_params.yaml {same}" in text
