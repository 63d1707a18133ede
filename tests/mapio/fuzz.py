"""Damaged map files by the thousand: every one must load or be refused in one clear line.

By hand, with the published samples where they are at hand::

    python -m tests.mapio.fuzz --seconds 600 --seed 1
"""

from __future__ import annotations

import argparse
import collections
import json
import resource
import shutil
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image

from gym_mapbench.errors import MapBenchError
from gym_mapbench.mapio import load_maps, save_map_set
from gym_mapbench.mapio.barn import read_barn_path, read_dwa_reference
from gym_mapbench.mapio.runner_results import COLUMNS, read_runner_results
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Pose, Scenario
from tests.faults.damage import damaged_bytes
from tests.mapio import samples
from tests.oracle_data import DATA

LONGEST_LINE = 2000
STRANGE = [b"0", b"-1", b"99999999999", b"1e309", b"nan", b"inf", b"null", b"[]", b"{}", b'"', b"'", b"\x00", b"\xff"]
STRANGE += [
    b"../",
    b"/etc/passwd",
    b"!!python/name:os.system",
    b"&a [*a]",
    b"<!ENTITY a 'b'>",
    b"&a;",
    b"\r\n",
    b"9" * 5000,
]


def write_samples(folder):
    """Write one small file of every kind; return what to load, and the file to damage, for each."""
    white = np.full((6, 6), 254)
    (folder / "maze").mkdir()
    samples.map_server_files(folder, white)
    (folder / "office_poses.yaml").write_text("- [-0.95, 2.05, 0.5]\n- [-0.55, 2.45, 0.7]\n")
    plain = folder / "plain.pgm"
    plain.write_text("P2 # hand\n3 2\n255\n0 1 2\n200 254 255\n")
    Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(folder / "plan.png")
    grid = GridMap.from_rows(["####", "#..#", "#?.#", "####"])
    save_map_set(MapSet((Scenario(grid, Pose(0.06, 0.11, 0.3), Pose(0.12, 0.12)),)), folder / "m.json")
    (folder / "tiny.map").write_text(samples.MOVINGAI_MAP)
    (folder / "tiny.map.scen").write_text(samples.MOVINGAI_SCEN)
    (folder / "world_7.world").write_text(samples.barn_world([*samples.barn_border()[::9], (40, 12), (63, 3)]))
    np.save(folder / "path_7.npy", np.array([[17, 0], [17, 1], [18, 1]]))
    samples.map_server_files(folder / "maze", white, name="map")
    (folder / "maze" / "config.txt").write_text(samples.MRPB_CONFIG)
    test = {"start": [-0.85, 2.15, 1.5], "goal": [-0.75, 2.25, -3.1]}
    (folder / "tasks.json").write_text(json.dumps({"maze": {"tests": [test]}}))
    (folder / "times.csv").write_text(",".join(COLUMNS) + "\nm,dwb,0,goal,12.5,3.5,1,,,,\n")
    head = "world,runs,success,collision,timeout,mean_time_success,std_time_success,official_path_m\n"
    (folder / "dwa.csv").write_text(head + "7,10,8,1,1,35.3,9.0,13.4\n")
    return sample_cases(folder)


def sample_cases(folder):
    """Return what to load, and the file to damage, for each of the samples in a folder."""
    yaml, mrpb = folder / "office.yaml", folder / "maze" / "map.yaml"
    names = ["plan.png", "m.json", "tiny.map", "tiny.map.scen", "world_7.world", "plain.pgm", "tasks.json"]
    cases = [(folder / name, folder / name) for name in names]
    cases += [(yaml, yaml), (yaml, folder / "office.pgm"), (yaml, folder / "office_poses.yaml")]
    cases += [(mrpb, folder / "maze" / "config.txt"), (folder / "tiny.map", folder / "tiny.map.scen")]
    return [*cases, *((folder / name, folder / name) for name in ("path_7.npy", "times.csv", "dwa.csv"))]


def copy_published(folder):
    """Copy the published samples that are small enough to be damaged often."""
    cases = []
    for kind, names in {
        "barn": ["world_42.world", "path_42.npy", "dwa_reference.csv"],
        "movingai": ["arena.map", "arena.map.scen"],
        "mrpb": ["tasks.json", "narrow_graph/map.yaml", "narrow_graph/map.pgm"],
        "map_server": ["100by100_15.yaml", "100by100_15.pgm"],
    }.items():
        shutil.copytree(DATA / kind, folder / kind, copy_function=shutil.copyfile)
        (folder / kind).chmod(0o755)
        cases += [(folder / kind / name, folder / kind / name) for name in names]
    pgm, arena = folder / "mrpb" / "narrow_graph" / "map.pgm", folder / "movingai" / "arena.map"
    return [*cases, (pgm.with_suffix(".yaml"), pgm), (arena.with_name("arena.map.scen"), arena)]


def load(path):
    """Read a file as its kind; return the number of tasks."""
    if path.suffix == ".npy":
        return read_barn_path(path.with_name(path.name.replace("path", "world")).with_suffix(".world")) is not None
    if path.suffix == ".csv":
        return len(read_runner_results(path) if path.name == "times.csv" else read_dwa_reference(path))
    return sum(len(tasked.scenarios()) for tasked in load_maps(path))


def try_one(path, victim, rng):
    """Damage a file, load it, put it back; say how it ended. Whatever is no one-line refusal is raised."""
    original = victim.read_bytes()
    victim.write_bytes(damaged_bytes(original, rng, STRANGE))
    try:
        load(path)
    except MapBenchError as error:
        check_refusal(error)
        return "refused"
    except BaseException:
        shutil.copy(victim, Path(tempfile.gettempdir()) / f"fuzz_{victim.name}")
        raise
    finally:
        victim.write_bytes(original)
    return "loaded"


def check_refusal(error):
    """A refusal is one line of readable length."""
    assert len(str(error).splitlines()) == 1, error
    assert len(str(error)) < LONGEST_LINE, error


def fuzz(cases, rng, seconds, most):
    """Damage the cases in turn, for some seconds or until ``most`` were tried; return how they ended."""
    ends = collections.Counter()
    begin = time.monotonic()
    while time.monotonic() - begin < seconds and sum(ends.values()) < most:
        path, victim = cases[sum(ends.values()) % len(cases)]
        ends[try_one(path, victim, rng)] += 1
    return ends


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "own").mkdir()
        cases = write_samples(Path(name) / "own")
        if DATA.is_dir():
            (Path(name) / "published").mkdir()
            cases += copy_published(Path(name) / "published")
        ends = fuzz(cases, np.random.default_rng(options.seed), options.seconds, most=10**9)
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{sum(ends.values())} inputs from {len(cases)} samples: {dict(ends)}; at most {megabytes:.0f} MB")


if __name__ == "__main__":
    main()
