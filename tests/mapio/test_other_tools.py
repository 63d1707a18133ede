"""Exported files through other people's programs."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gym_mapbench.mapio.gazebo import export_gazebo
from gym_mapbench.world.lidar import Lidar, LidarSettings
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import Pose
from gym_mapbench.world.world import World
from tests.mapio.test_actors import open_room, walker
from tests.mapio.test_gazebo import OPTIONS, navigation, thesis_scenario

SUN = "<sdf version='1.6'><light name='sun' type='directional'><direction>0 0 -1</direction></light></sdf>"
PLANE = "<sdf version='1.6'><model name='ground_plane'><static>true</static><link name='link'/></model></sdf>"
CONFIG = "<model><name>x</name><version>1</version><sdf version='1.6'>model.sdf</sdf></model>"


@pytest.fixture(scope="module", params=["turtlebot3_waffle", "jackal"])
def bundle(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("tools") / "bundle"
    scenario = thesis_scenario(5, "map_0")
    export_gazebo([scenario], folder, **(OPTIONS | {"robot": make_robot(request.param)}))
    for name, text in (("sun", SUN), ("ground_plane", PLANE)):  # models that come with the simulator
        (folder / "models" / name).mkdir()
        (folder / "models" / name / "model.config").write_text(CONFIG)
        (folder / "models" / name / "model.sdf").write_text(text)
    return scenario, folder


@pytest.fixture(scope="module")
def sdf_check(tmp_path_factory):
    """The path of a compiled program that checks SDF files with libsdformat, as ``sdf check`` does."""
    if not (shutil.which("g++") and shutil.which("pkg-config")):
        pytest.skip("no C++ compiler or pkg-config")
    listed = subprocess.run(["pkg-config", "--list-all"], capture_output=True, text=True, check=True).stdout
    versions = sorted(line.split()[0] for line in listed.splitlines() if line.startswith("sdformat"))
    if not versions:
        pytest.skip("libsdformat is not installed (Debian: libsdformat-dev)")
    flags = ["pkg-config", "--cflags", "--libs", versions[-1]]
    options = subprocess.run(flags, capture_output=True, text=True, check=True).stdout.split()
    program = tmp_path_factory.mktemp("sdf") / "sdf_check"
    source = Path(__file__).with_name("sdf_check.cc")
    subprocess.run(["g++", "-O0", str(source), "-o", str(program), *options], check=True)
    return program


def run_sdf_check(program, folder, files):
    command = [str(program), str(folder / "models"), *map(str, files)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.slow
def test_sdf_check_passes_worlds_and_models_without_a_word(bundle, sdf_check):
    _, folder = bundle
    files = sorted(folder.glob("worlds/*")) + sorted(folder.glob("models/m*/model.sdf"))
    assert len(files) == 5
    assert run_sdf_check(sdf_check, folder, files) == (0, "")


@pytest.mark.slow
@pytest.mark.parametrize("release", ["jazzy", "lyrical"])
def test_sdf_check_passes_packages_of_newer_releases(release, tmp_path, sdf_check):
    export_gazebo(
        [thesis_scenario(5, "map_0")], tmp_path / "bundle", **(OPTIONS | {"navigation": navigation(release=release)})
    )
    folder = tmp_path / "bundle"
    files = sorted(folder.glob("worlds/*")) + sorted(folder.glob("models/m*/model.sdf"))
    assert [file.suffix for file in files] == [".sdf"] * 3
    assert run_sdf_check(sdf_check, folder, files) == (0, "")


@pytest.mark.slow
def test_sdf_check_passes_worlds_with_people(tmp_path, sdf_check):
    people = (walker(phase=0.3), walker(loop=True))
    scenario = replace(open_room(), bodies=people)
    export_gazebo([scenario], tmp_path / "bundle", **OPTIONS)
    world = tmp_path / "bundle" / "worlds" / "room.sdf"
    assert run_sdf_check(sdf_check, tmp_path / "bundle", [world]) == (0, "")
    world.write_text(world.read_text().replace("person_1", "person_0"))
    assert run_sdf_check(sdf_check, tmp_path / "bundle", [world])[0] != 0


@pytest.mark.slow
def test_sdf_check_would_have_complained(bundle, sdf_check, tmp_path):
    _, folder = bundle
    model = (folder / "models" / "mapbench_robot" / "model.sdf").read_text()
    for old, new in (("chassis_visual", "chassis_collision"), ("<child>wheel_left", "<child>wheel_lost")):
        (tmp_path / "bad.sdf").write_text(model.replace(old, new))
        assert run_sdf_check(sdf_check, folder, [tmp_path / "bad.sdf"])[0] != 0
    world = (folder / "worlds" / "map_0.world").read_text()
    for old, new in (("model://map_0", "model://map_9"), ("</world>", ""), ('name="map_0"', "")):
        (tmp_path / "bad.world").write_text(world.replace(old, new))
        assert run_sdf_check(sdf_check, folder, [tmp_path / "bad.world"])[0] != 0


def test_trimesh_loads_the_exported_file_as_one_closed_solid(bundle):
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("collada", reason="trimesh reads COLLADA with pycollada")
    scenario, folder = bundle
    walls = trimesh.load(folder / "models" / "map_0" / "mesh" / "map.dae", force="mesh")
    assert walls.is_watertight
    assert walls.is_volume
    assert walls.volume == pytest.approx(scenario.map.occupancy.sum() * 0.05**2 * 0.5, rel=1e-5)
    assert walls.bounds == pytest.approx(np.array([[0, 0, 0], [7.5, 7.5, 0.5]]))


URDF = """<robot name="map"><link name="walls">
<inertial><mass value="0"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision concave="yes"><geometry><mesh filename="{mesh}"/></geometry></collision></link></robot>"""


@pytest.fixture
def bullet():
    pybullet = pytest.importorskip("pybullet")
    client = pybullet.connect(pybullet.DIRECT)
    yield pybullet
    pybullet.disconnect(client)


def test_pybullet_loads_the_model(bundle, bullet):
    _, folder = bundle
    bullet.setAdditionalSearchPath(str(folder / "models"))
    (body,) = bullet.loadSDF(str(folder / "models" / "map_0" / "model.sdf"))
    (shape,) = bullet.getCollisionShapeData(body, -1)
    assert shape[2] == bullet.GEOM_MESH
    assert shape[4].decode().endswith("map_0/mesh/map.dae")


def test_rays_against_the_mesh_agree_with_our_lidar(bundle, bullet, tmp_path):
    scenario, folder = bundle
    (tmp_path / "map.urdf").write_text(URDF.format(mesh=folder / "models" / "map_0" / "mesh" / "map.dae"))
    bullet.loadURDF(str(tmp_path / "map.urdf"), useFixedBase=True)
    settings = LidarSettings(range_max=15.0)
    lidar = Lidar(settings, World(scenario.map))
    rng = np.random.default_rng(0)
    free = np.argwhere(~scenario.map.occupancy)
    compared = disagreed = 0
    for row, col in free[rng.integers(len(free), size=20)]:
        pose = Pose(*scenario.map.cell_to_world(row, col), rng.uniform(-3, 3))
        nearest = np.stack([lidar.scan(pose._replace(yaw=pose.yaw + tilt)) for tilt in (-1e-3, 0, 1e-3)])
        theirs = bullet_scan(bullet, pose, settings)
        # A ray that grazes a corner may hit or miss it: then one a milliradian beside it does the same.
        agrees = (np.abs(theirs - nearest) < 0.01 + 0.03 * theirs).any(axis=0)
        compared += len(theirs)
        disagreed += (~agrees).sum()
        assert (np.abs(theirs - nearest[1]) < 1e-3).mean() > 0.99
    assert compared == 7200
    assert disagreed == 0


def bullet_scan(bullet, pose, settings):
    """Distances to the mesh at half its height, m."""
    angles = pose.yaw + settings.angles
    begin = np.tile([pose.x, pose.y, 0.25], (len(angles), 1))
    beam = settings.range_max * np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
    hits = bullet.rayTestBatch(begin.tolist(), (begin + beam).tolist())
    return settings.range_max * np.array([hit[2] for hit in hits])
