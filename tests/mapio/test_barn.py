from __future__ import annotations

import math

import numpy as np
import pytest

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio import load_maps, load_scenarios
from gym_mapbench.mapio.barn import read_barn_path, read_dwa_reference
from tests.mapio.samples import barn_border, barn_world
from tests.oracle_data import DATA, needs_data

FIELD = [(40, 12), (63, 3), (34, 28)]


@pytest.fixture
def world(tmp_path):
    path = tmp_path / "world_7.world"
    path.write_text(barn_world(barn_border() + FIELD))
    return path


def test_cylinders_before_the_state_are_the_map(world):
    (scenario,) = load_scenarios(world)
    expected = np.zeros((96, 30), bool)
    for cell in barn_border() + FIELD:
        expected[cell] = True
    assert (scenario.map.occupancy == expected).all()
    assert scenario.map.cell_to_world(0, 29) == pytest.approx((-0.075, 0.075))
    assert scenario.start == (-2.0, 3.0, 1.57)
    assert scenario.goal[:2] == (-2.0, 13.0)
    assert scenario.name == "world_7"


def test_a_folder_is_read_by_number(world):
    world.with_name("world_10.world").write_text(barn_world(barn_border()))
    for path in (world.parent, f"barn:{world.parent}"):
        assert [s.name for s in load_scenarios(path)] == ["world_7", "world_10"]
    with pytest.raises(MapFormatError, match="/nowhere: no such file or folder"):
        load_scenarios("barn:/nowhere")


@pytest.mark.parametrize("folder", [".", "path_files"])
def test_paths_lie_in_the_middle_of_field_cells(world, folder):
    place = world.parent / folder
    place.mkdir(exist_ok=True)
    assert read_barn_path(world) is None
    np.save(place / "path_7.npy", np.array([[17, 0], [17, 1], [18, 1]]))
    points, length = read_barn_path(world)
    assert points == pytest.approx(np.array([[-1.875, 5.175], [-1.875, 5.325], [-1.725, 5.325]]))
    # The challenge's own points: (-2.025, 5.075), (-2.025, 5.225), (-1.875, 5.225).
    assert length == pytest.approx(math.hypot(0.025, 2.075) + 0.3 + math.hypot(0.125, 7.775))


@pytest.mark.parametrize(
    "array", [np.zeros((2, 3), int), np.zeros((0, 2), int), np.ones((2, 2)), np.full((1, 2), 30), np.array([{}] * 2)]
)
def test_bad_paths(world, array):
    np.save(world.with_name("path_7.npy"), array, allow_pickle=True)
    with pytest.raises(MapFormatError):
        read_barn_path(world)
    world.with_name("path_7.npy").write_bytes(b"\x93NUMPY\x01\x00\x10\x00{'descr': oops}")
    with pytest.raises(MapFormatError, match="expected a NumPy file"):
        read_barn_path(world)


BOMB = (
    """<!DOCTYPE sdf [<!ENTITY a "xxxxxxxxxx"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]><sdf><world>&b;</world></sdf>"""
)
EXTERNAL = """<!DOCTYPE sdf [<!ENTITY a SYSTEM "file:///etc/hostname">]><sdf><world>&a;</world></sdf>"""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not an XML file"),
        (BOMB, "without entities"),
        (EXTERNAL, "without entities"),
        ("<sdf><world></world></sdf>", "found none"),
        ("<urdf/>", "found none"),
        (barn_world(FIELD)[:-30], "not an XML file"),
        (barn_world([(64, 3)]), "on BARN's 0.15 m lattice"),
        (barn_world([(5.4, 3)]), "on BARN's 0.15 m lattice"),
        (barn_world(FIELD).replace("0.075000</r", "0.1</r"), "on BARN's 0.15 m lattice"),
        (barn_world(FIELD).replace("radius", "side"), "radius: expected a number, got None"),
        (barn_world(FIELD).replace(" 0 0 0 0<", " 0<"), "expected a pose of 6 numbers"),
        (barn_world(FIELD).replace("'>-", "'>x"), "pose: expected a number"),
    ],
)
def test_bad_worlds(tmp_path, text, words):
    (tmp_path / "world_1.world").write_text(text)
    with pytest.raises(MapFormatError, match=words) as failure:
        load_maps(tmp_path / "world_1.world")
    assert len(str(failure.value).splitlines()) == 1


def test_reference_runs(tmp_path):
    path = tmp_path / "dwa_reference.csv"
    head = "world,runs,success,collision,timeout,mean_time_success,std_time_success,official_path_m\n"
    path.write_text(head + "7,10,8,1,1,35.3,9.0,13.4\n9,10,0,0,10,,,12.0\n")
    reference = read_dwa_reference(path)
    assert reference["world_7"] == (10, 8, 1, 1, 35.3, 9.0, 13.4)
    assert math.isnan(reference["world_9"].mean_time)
    path.write_text(head + "7,10,8,1,1,,9.0,13.4\n")
    with pytest.raises(MapFormatError, match="line 2: mean_time_success: expected a number"):
        read_dwa_reference(path)


@needs_data
def test_published_worlds_agree_with_their_published_grids():
    published = np.load(DATA / "barn" / "grids_0_149.npz")
    for number in (0, 42):
        world = DATA / "barn" / f"world_{number}.world"
        (scenario,) = load_scenarios(world)
        assert (scenario.map.occupancy[:64] == published["grids"][number]).all()
        points, length = read_barn_path(world)
        assert length == pytest.approx(published["official_path_length_m"][number])
        assert not any(scenario.map.occupancy[scenario.map.world_to_cell(*point)] for point in points)
