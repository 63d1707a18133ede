from __future__ import annotations

import copy
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from gym_mapbench.errors import ConfigError, MapFormatError, UntrustedError
from gym_mapbench.generator import FamilySpec, ShapeSettings, build_genome, default_task, draw_from
from gym_mapbench.mapio import load_map_set, load_maps, load_scenarios, save_map_set, write_map_file, write_maps
from gym_mapbench.mapio.formats import WRITTEN
from gym_mapbench.mapio.map_set_file import BEST_MAP_SET, map_set_document, parse_map_set
from gym_mapbench.mapio.tasked_map import group_scenarios
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import MapSet, Pose, Scenario
from tests.mapio.samples import map_sets
from tests.worlds import among, line

GRID = GridMap.from_rows(["#####", "#..?#", "#####"], 0.5, origin=(-1.0, 0.25))
MAPS = MapSet(
    (
        Scenario(GRID, Pose(-0.25, 1.0, 0.3), Pose(0.25, 1.0), "there"),
        Scenario(GRID, Pose(0.25, 1.0), Pose(-0.25, 1.0, 3.0), "back"),
        Scenario(GridMap.from_rows([".."]), Pose(0.01, 0.01), Pose(0.09, 0.01), "other"),
    )
)


@given(map_set=map_sets())
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_saved_map_sets_come_back_bit_by_bit(tmp_path, map_set):
    path = tmp_path / "drawn.mapset.json"
    save_map_set(map_set, path)
    back = load_map_set(path)
    assert [s.digest for s in back] == [s.digest for s in map_set]
    assert [s.name for s in back] == [s.name for s in map_set]
    assert list(tmp_path.iterdir()) == [path]


def test_the_file_reads_without_this_package(tmp_path):
    save_map_set(MAPS, tmp_path / "m.mapset.json")
    document = json.loads((tmp_path / "m.mapset.json").read_text())
    assert document["format"] == "mapbench-mapset"
    first, second = document["maps"]
    assert first["rows"] == ["#####", "#..?#", "#####"]
    assert first["origin"] == [-1.0, 0.25]
    assert first["tasks"][0] == {"name": "there", "start": [-0.25, 1.0, 0.3], "goal": [0.25, 1.0, 0.0]}
    assert [task["name"] for task in first["tasks"]] == ["there", "back"]
    assert second["rows"] == [".."]


def test_tasks_of_one_map_share_it(tmp_path):
    save_map_set(MAPS, tmp_path / BEST_MAP_SET)
    there, back, _ = load_map_set(tmp_path)
    assert there.map is back.map


def test_an_existing_file_is_replaced_in_one_step(tmp_path):
    path = tmp_path / "m.json"
    path.write_text("old")
    save_map_set(MAPS, path)
    assert load_map_set(path).digest == MAPS.digest


def broken_documents():
    """Documents with one fault each."""
    good = map_set_document(group_scenarios(MAPS))

    def change(*keys, value):
        document = copy.deepcopy(good)
        place = document
        for key in keys[:-1]:
            place = place[key]
        place[keys[-1]] = value
        return document

    yield [], "expected the keys"
    yield {**good, "more": 1}, "expected the keys"
    yield change("version", value=2), "of version 1"
    yield change("format", value="zip"), "expected format 'mapbench-mapset'"
    yield change("maps", value=[]), "at least one map"
    yield change("maps", value={}), "expected a list"
    yield change("maps", 0, value=5), r"maps\[0\]"
    yield change("maps", 0, "rows", value=[]), "expected a map of 1 to"
    yield change("maps", 0, "rows", value=["##", "#"]), "equally long"
    yield change("maps", 0, "rows", value=["#x"]), "got 'x'"
    yield change("maps", 0, "rows", value=[1]), "lines of text"
    yield change("maps", 0, "rows", value="##"), "expected a list"
    yield change("maps", 0, "origin", value=[0]), "origin: expected a list of 2 numbers"
    yield change("maps", 0, "resolution", value=0), "resolution"
    yield change("maps", 0, "name", value=""), "expected a name"
    yield change("maps", 0, "tasks", 0, "start", value=[1, 2]), r"tasks\[0\]: start"
    yield change("maps", 0, "tasks", 0, "goal", value=[1, 2, None]), r"tasks\[0\]: goal"


@pytest.mark.parametrize(("document", "words"), list(broken_documents()))
def test_broken_documents_are_refused(document, words):
    with pytest.raises(MapFormatError, match=words):
        parse_map_set(document, "m.json")


@pytest.mark.parametrize("text", ["", "[" * 100_000, "{", "NaN", '{"format": NaN}', "\xff", "1" * 5000])
def test_other_files_are_refused_in_one_line(tmp_path, text):
    (tmp_path / "m.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(MapFormatError) as failure:
        load_maps(tmp_path / "m.json")
    assert len(str(failure.value).splitlines()) == 1


def test_a_task_off_the_map_is_named(tmp_path):
    document = map_set_document(group_scenarios(MAPS))
    document["maps"][0]["tasks"][1]["goal"] = [50, 50, 0]
    (tmp_path / "m.json").write_text(json.dumps(document))
    with pytest.raises(ConfigError, match=r"m.json: task 'back': goal: expected a point on the map"):
        load_map_set(tmp_path / "m.json")


DOCUMENT = map_set_document(group_scenarios(MAPS))
MOVING = MapSet((among(), among(line((0.5, 1.5), (2.5, 1.5), 0.3), start=(0.8, 0.7, 0.0)), MAPS[2]))


def test_moving_bodies_come_back_with_their_task(tmp_path):
    save_map_set(MOVING, tmp_path / "m.mapset.json")
    back = load_map_set(tmp_path / "m.mapset.json")
    assert [one.bodies for one in back] == [one.bodies for one in MOVING]
    assert back.digest == MOVING.digest
    (tasked, _) = load_maps(tmp_path / "m.mapset.json")
    assert [bool(task.bodies) for task in tasked.renamed("other").tasks] == [False, True]
    save_map_set(MapSet((MOVING[1],)), tmp_path / "one.mapset.json")
    (given,) = load_scenarios(tmp_path / "one.mapset.json", start=(0.9, 0.7, 0.0))
    assert given.bodies == MOVING[1].bodies


def test_tasks_without_bodies_say_nothing_of_them():
    assert all(set(task) == {"name", "start", "goal"} for entry in DOCUMENT["maps"] for task in entry["tasks"])


def of_gates():
    """A map of gates with its genome, and a map without one."""
    shapes = ShapeSettings()
    drawn = draw_from(np.random.default_rng(0), [FamilySpec(name="gates")], shapes, make_robot("turtlebot3_waffle"))
    grid = GridMap(drawn.cells)
    return MapSet((Scenario(grid, *default_task(grid), "gates", genome=drawn.genome), MAPS[2]))


def test_a_genome_comes_back_with_its_map_and_is_no_part_of_its_identity(tmp_path):
    maps = of_gates()
    save_map_set(maps, tmp_path / "m.mapset.json")
    back = load_map_set(tmp_path / "m.mapset.json")
    assert [one.genome for one in back] == [maps[0].genome, None]
    assert np.array_equal(build_genome(back[0].genome, ShapeSettings()), back[0].map.occupancy)
    bare = MapSet(tuple(replace(one, genome=None) for one in maps))
    assert bare == maps
    assert bare.digest == maps.digest
    assert all("genome" not in entry for entry in map_set_document(group_scenarios(bare))["maps"])


def test_formats_of_cells_have_the_genomes_beside_them(tmp_path):
    maps = group_scenarios(of_gates())
    write_maps(maps, tmp_path / "maps", "map_server")
    written = json.loads((tmp_path / "maps" / "genes.json").read_text())
    assert written == {"gates": maps[0].genome.model_dump(mode="json")}
    write_maps(maps[1:], tmp_path / "bare", "map_server")
    assert not (tmp_path / "bare" / "genes.json").exists()


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"family": "gate"}, MapFormatError, r"maps\[0\]: genome: .*did you mean 'gates'"),
        ({"family": "doors"}, MapFormatError, "expected a family of motifs along a route, got 'doors'"),
        ({"genes": 3}, MapFormatError, "genes: expected a mapping, got 3"),
        ({"extra": 3}, MapFormatError, "unknown key 'extra'"),
        ({"family": "theirs:Motif"}, UntrustedError, "would run code"),
    ],
)
def test_bad_genomes_in_a_file_are_one_clear_line(change, error, message):
    document = map_set_document(group_scenarios(of_gates()))
    document["maps"][0]["genome"].update(change)
    with pytest.raises(error, match=message):
        parse_map_set(document, "m.json")


@pytest.mark.parametrize(
    ("bodies", "message"),
    [
        (3, "bodies: expected a list, got 3"),
        ([3], r"bodies\[0\]: expected a mapping"),
        ([{"shape": {"radius": 0.2}}], r"bodies\[0\]: missing key 'motion'"),
        ([{"shape": {"radius": -1}, "motion": {"name": "line"}}], r"bodies\[0\]: shape\.radius: expected"),
        ([{"shape": {"radius": 0.2}, "motion": {"name": "lines"}}], "did you mean 'line'"),
    ],
)
def test_bad_bodies_in_a_file_are_one_clear_line(bodies, message):
    document = copy.deepcopy(DOCUMENT)
    document["maps"][0]["tasks"][0]["bodies"] = bodies
    with pytest.raises(MapFormatError, match=rf"^file: maps\[0\]: tasks\[0\]: .*{message}") as caught:
        parse_map_set(document, "file")
    assert "\n" not in str(caught.value)


def test_a_map_set_whose_bodies_name_code_is_refused():
    document = copy.deepcopy(DOCUMENT)
    document["maps"][0]["tasks"][0]["bodies"] = [{"shape": {"radius": 0.2}, "motion": {"name": "other:Motion"}}]
    with pytest.raises(UntrustedError, match=r"bodies: .*'other:Motion' would run code"):
        parse_map_set(document, "file")


@pytest.mark.parametrize("form", sorted(set(WRITTEN) - {"mapset", "map_server"}))
def test_formats_without_room_for_bodies_refuse_them(tmp_path, form):
    with pytest.raises(ConfigError, match="cannot hold the moving bodies of 'room'"):
        write_maps(group_scenarios(MOVING)[:1], tmp_path / "out", form)


def test_one_file_refuses_bodies_too(tmp_path):
    with pytest.raises(ConfigError, match=r"m\.png: cannot hold the moving bodies"):
        write_map_file(group_scenarios([MOVING[1]]), tmp_path / "m.png")
    assert not list(tmp_path.iterdir())
