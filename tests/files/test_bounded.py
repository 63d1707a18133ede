"""Files that may be anything: each is refused in one line and soon, or read."""

from __future__ import annotations

import os
import threading
import time
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from controllers.model_files import model_data
from controllers.nav2_params import read_nav2_params
from controllers.nav2_params.migration import migrate_file
from evolution.driving import DriveSettings
from evolution.files import csv_of, npz_of, read_csv, read_json, read_npz, write_bytes
from evolution.runs import LoadedRun
from evolution.search import EvolveSettings, read_document
from evolution.studies.kinds import load_definition
from evolution.training import train_settings
from evolution.validation.recorded import read_arrays as read_recorded
from evolution.validation.recorded import read_json as read_recorded_json
from gym_mapbench.costmap import CostmapParams
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError, MapBenchError, MapFormatError, RunError
from gym_mapbench.files import bounded
from gym_mapbench.files.bounded import read_arrays, read_bytes
from gym_mapbench.files.documents import MAX_NODES, parse_yaml, read_yaml
from gym_mapbench.mapio import load_maps
from gym_mapbench.mapio.poses import read_poses
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Pose, Scenario
from tests.faults.damage import bomb


def refusal(read, *args):
    """Return the one line that a reader refuses something with; to read it all would take minutes or hours."""
    began = time.process_time()
    with pytest.raises(MapBenchError) as caught:
        read(*args)
    assert time.process_time() - began < 30
    assert str(caught.value).isprintable()
    return str(caught.value)


def read_recorded_list(path):
    return read_recorded_json(path, list)


@pytest.mark.parametrize("read", [read_yaml, load_maps, read_json, read_csv, model_data, read_recorded_list])
@pytest.mark.parametrize("device", ["/dev/zero", "/dev/urandom"])
def test_a_file_without_end_is_not_read(read, device, tmp_path):
    link = tmp_path / "link.png"
    link.symlink_to(device)
    assert "link.png" in refusal(read, link)


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    path = tmp_path / "large"
    with path.open("wb") as file:
        file.truncate(10**12)
    assert refusal(read_bytes, path, 1000, RunError).endswith(f"expected at most 1000 bytes, got {10**12} or more")
    for read in (read_yaml, read_json, read_csv):
        assert "expected at most" in refusal(read, path)


def merge_bomb(levels=10, width=10):
    """Return YAML whose merge keys unfold to ``width ** levels`` mappings."""
    lines = ["a0: &a0 {x: 1}"]
    lines += [f"a{n}: &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * width)}]}}" for n in range(1, levels)]
    return "\n".join(lines) + "\n"


YAML = {
    bomb(): "aliases unfolded",
    merge_bomb(): "aliases unfolded",
    "&a [*a]": "aliases unfolded",
    "a: &a {b: *a}": "aliases unfolded",
    "[" + "1," * MAX_NODES + "]": "expected at most 20000 values",
    "[" * 100_000: "not a YAML file",
    "9" * 5000: "not a YAML file",
    "0x" + "f" * 5000: "expected integers of at most 64 bits",
    "!!binary aGk=": "could not determine a constructor",
    "!!timestamp 2001-01-01": "could not determine a constructor",
    "!!python/name:os.system": "could not determine a constructor",
    "!!set {a}": "could not determine a constructor",
    "? [a, b]\n: 1": "expected names as keys",
    '"\\ud800"': "surrogates not allowed",
}


@pytest.mark.parametrize("text", YAML, ids=lambda text: text[:12])
def test_yaml_that_is_no_parameter_file(text):
    assert YAML[text] in refusal(parse_yaml, text, "a.yaml")


def test_texts_and_numbers_are_read_as_ros_reads_them():
    text = "[1:30, 190:20:30, 1:1.5, 2001-01-01, 1e3, 1.5, .5, 012, 0x1f, 1_000, true, ~, .inf, -3, 1e400]"
    values, _ = parse_yaml(text, "a.yaml")
    assert values[:4] == ["1:30", "190:20:30", "1:1.5", "2001-01-01"]
    assert values[4:] == [1000.0, 1.5, 0.5, 10, 31, 1000, True, None, float("inf"), -3, float("inf")]


def test_keys_are_names_and_aliases_and_merges_are_read():
    text = "base: &b {1: one, on: two}\nother: {<<: *b, null: three}\nlist: [*b]"
    values, _ = parse_yaml(text, "a.yaml")
    assert values["other"] == {"1": "one", "on": "two", "null": "three"}
    assert values["list"] == [{"1": "one", "on": "two"}]


BOMBS = {
    "aliases": bomb(),
    "merges": merge_bomb(),
    "parameters": f"{bomb()}controllers: [dwb, {{name: rpp, params: {{a: *a11}}}}]\n",
    "without end": "search: &a {search: *a}",
}
READERS = {
    "experiment": read_document,
    "study": load_definition,
    "environment": EnvConfig.build,
    "training": lambda path: train_settings(config=path),
    "parameters": read_nav2_params,
    "navigation": lambda path: DriveSettings(navigation=str(path)),
    "conversion": lambda path: migrate_file(path, "jazzy"),
    "map": load_maps,
    "poses": read_poses,
}


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("name", BOMBS)
def test_no_reader_unfolds_a_bomb(kind, name, tmp_path):
    (tmp_path / "a.yaml").write_text(BOMBS[name])
    assert "a.yaml" in refusal(READERS[kind], tmp_path / "a.yaml")


def test_a_long_number_to_the_base_of_60_is_a_text():
    long = "1" + ":1" * 20_000
    assert parse_yaml(f"a: {long}", "a.yaml")[0] == {"a": long}


@pytest.mark.parametrize("kind", READERS)
def test_no_reader_waits_for_a_pipe_that_nobody_writes_to(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(bounded, "NOBODY_SECONDS", 0.05)
    os.mkfifo(tmp_path / "a.yaml")
    assert "a pipe that nobody writes to" in refusal(READERS[kind], tmp_path / "a.yaml")


def test_a_pipe_is_read_to_its_end(tmp_path):
    os.mkfifo(tmp_path / "pipe")

    def write():
        with (tmp_path / "pipe").open("wb", buffering=0) as pipe:
            for part in (b"a", b"b" * 100_000, b"c"):
                time.sleep(0.05)
                pipe.write(part)

    writer = threading.Thread(target=write)
    writer.start()
    try:
        assert read_bytes(tmp_path / "pipe", 10**6, RunError) == b"a" + b"b" * 100_000 + b"c"
    finally:
        writer.join()


@pytest.mark.parametrize(("device", "what"), [("/dev/zero", "expected a file, got a device"), ("/dev/null", "device")])
def test_a_device_is_called_a_device(device, what):
    assert what in refusal(read_bytes, device, 1000, MapFormatError)


def archive(path, way=zipfile.ZIP_DEFLATED, **members):
    with zipfile.ZipFile(path, "w", way) as file:
        for name, content in members.items():
            file.writestr(name, content)
    return path


def test_archives_are_refused_before_they_are_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr("controllers.model_files.MAX_MODEL_BYTES", 10**6)
    archive(tmp_path / "bomb.zip", **{"data": "{}", "a.pth": bytes(10**7)})
    assert "bytes in the archive" in refusal(model_data, tmp_path / "bomb.zip")
    assert "not supported" in refusal(model_data, archive(tmp_path / "lzma.zip", zipfile.ZIP_LZMA, data="{}"))
    assert "not a JSON file" in refusal(model_data, archive(tmp_path / "deep.zip", data="[" * 100_000))
    assert "no 'data'" in refusal(model_data, archive(tmp_path / "other.zip", other=""))
    assert "expected an object" in refusal(model_data, archive(tmp_path / "list.zip", data="[]"))
    data = bytearray(archive(tmp_path / "key.zip", data="{}").read_bytes())
    data[data.index(b"PK\x01\x02") + 8] |= 1
    (tmp_path / "key.zip").write_bytes(data)
    assert "not encrypted" in refusal(model_data, tmp_path / "key.zip")
    stored = archive(tmp_path / "crc.zip", zipfile.ZIP_STORED, data='{"steps": 1}').read_bytes()
    (tmp_path / "crc.zip").write_bytes(stored.replace(b'{"steps": 1}', b'{"steps": 2}'))
    assert "cannot be read as an archive" in refusal(model_data, tmp_path / "crc.zip")
    assert "expected an array" in refusal(read_npz, archive(tmp_path / "a.npz", **{"a.npy": "no array"}), 0.05)


def npy(shape, dtype="<f8", content=b""):
    """Return an ``.npy`` file whose header claims a shape."""
    header = f"{{'descr': {dtype!r}, 'fortran_order': False, 'shape': {shape!r}}}".encode()
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + content


ARRAYS = {
    "terabytes": npy((10**12,)),
    "more than there are numbers": npy((10**30,)),
    "negative": npy((-1, 5)),
    "half of it": npy((10**9,), content=bytes(1000)),
    "nothing, many times": npy((10**12,), "<U0"),
    "many axes": npy((1,) * 100),
    "objects": npy((1,), "|O", b"\x80\x04cos\nsystem\n."),
    "a long header": b"\x93NUMPY\x02\x00\xff\xff\xff\x7f{" + b" " * 1000,
    "no array": b"import os",
    "an empty file": b"",
    "a deep header": b"\x93NUMPY\x01\x00" + (9000).to_bytes(2, "little") + b"[" * 9000,
}


@pytest.mark.parametrize("content", ARRAYS.values(), ids=ARRAYS)
def test_arrays_that_claim_anything(content, tmp_path):
    path = tmp_path / "maps.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("map.npy", content)
    assert "maps.npz" in refusal(read_arrays, path, 10**9, RunError)
    assert "maps.npz" in refusal(read_npz, path, 0.05)
    assert "maps.npz" in refusal(read_recorded, path, ["map"])


def test_an_archive_whose_directory_claims_terabytes(tmp_path):
    path = tmp_path / "maps.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("map.npy", npy((2, 2), "|b1", bytes(4)))
    whole = path.read_bytes()
    at = whole.rindex(b"PK\x01\x02") + 24
    path.write_bytes(whole[:at] + (2**32 - 2).to_bytes(4, "little") + whole[at + 4 :])
    assert "expected at most 2000000000 bytes in the archive, got 4294967294" in refusal(read_npz, path, 0.05)
    path.write_bytes(b"\x93NUMPY" + whole)
    refusal(read_npz, path, 0.05)


MAP_SET = MapSet((Scenario(GridMap.from_rows([".."]), Pose(0.02, 0.02), Pose(0.07, 0.02)),))


def test_all_maps_of_a_run_together_are_limited(tmp_path, monkeypatch):
    (tmp_path / "maps").mkdir()
    for number in range(3):
        grid = GridMap(np.eye(100, dtype=bool), 0.1 + number)
        write_bytes(tmp_path / "maps" / f"{number}.npz", npz_of({f"{number}": grid}))
    run = LoadedRun(tmp_path, {"search": {"shapes": {"resolution": 0.1}}}, {}, [], [], [], MAP_SET, {}, [])
    assert len(run.maps) == 3
    monkeypatch.setattr("evolution.runs.loading.MOST_MAP_BYTES", 25_000)
    assert "2.npz: expected at most 5000 bytes" in refusal(lambda: replace(run).maps)


def test_a_table_is_harmless_in_a_spreadsheet_and_comes_back(tmp_path):
    texts = ["=1+1", "+1", "-1", "@SUM(A1)", "'quoted'", "plain", "a=b", "\tx", ""]
    rows = [{"controller": text, "=cmd": -1.5, "n": -2} for text in texts]
    (tmp_path / "a.csv").write_text(csv_of(rows))
    for line in csv_of(rows).splitlines():
        assert not line.startswith(("=", "+", "-", "@"))
        assert ",=" not in line
    assert read_csv(tmp_path / "a.csv") == rows


def test_every_error_is_one_line_of_readable_length():
    assert str(ConfigError("a\nb\x1b[31m\ud800")) == "a\\nb\\x1b[31m\\ud800"
    assert len(str(ConfigError("x" * 10**6))) < 2100


def test_numbers_that_no_machine_could_drive_are_refused():
    for make in (
        lambda: CostmapParams(width=100_000, height=10_000),
        lambda: EvolveSettings(shapes={"n_obstacles": [1, 10**9]}),
        lambda: EvolveSettings(shapes={"circle_radius": [1, 10**6]}),
        lambda: EvolveSettings(pop_size=10**9),
        lambda: EvolveSettings(maps_per_set=10**9),
    ):
        assert "expected" in refusal(make)


def test_the_first_byte_that_is_no_text_is_named_with_its_line(tmp_path):
    path = tmp_path / "params.yaml"
    path.write_bytes("a: 1\n# Räder\n".encode("latin-1"))
    with pytest.raises(ConfigError, match=r"params\.yaml: line 2: expected text in UTF-8, got the byte 0xe4$"):
        bounded.read_text(path, 100, ConfigError)
