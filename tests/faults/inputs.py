"""Files that may be anything: each kind is written, damaged and read as its command does.

The readers stop where driving would begin, so that thousands of inputs can be tried.
"""

from __future__ import annotations

import copy
import json
import tempfile
import time
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np
import yaml
from PIL import Image

from controllers.nav2_params import read_nav2_params
from controllers.rl import load_sb3
from evolution.api import compose
from evolution.benchmark import read_bench
from evolution.pictures import drive_best
from evolution.runs import load_run
from evolution.search import check_experiment, experiment_of, read_document
from evolution.studies import NAV2, SweepSettings, load_results, load_sweep
from evolution.studies.kinds import load_definition
from evolution.studies.tasks import check_study
from gym_mapbench.config import EnvConfig
from gym_mapbench.errors import MapBenchError
from gym_mapbench.mapio import load_maps
from tests.faults.damage import as_json, as_yaml, damaged, damaged_bytes

MOST_LETTERS = 2100
SLOW = 2.0
"""Processor seconds after which a refusal comes late; most of it is the loading of kernels."""

REPOSITORY = Path(__file__).parents[2]


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Args:
        write: Writes a damaged one into a new folder; returns what to read.
        read: Reads it as a command does, up to the point where driving would begin.
    """

    write: Callable[[Path, np.random.Generator], Path]
    read: Callable[[Path], object]


def read_experiment(path: Path) -> None:
    """As ``mapbench evolve --config``."""
    check_experiment(experiment_of(compose(config=read_document(path)), str(path)))


def read_study(path: Path) -> None:
    """As ``mapbench study``."""
    settings = load_definition(path)
    if isinstance(settings, SweepSettings):
        for name in settings.worlds:
            settings.plan(name)
    else:
        check_study(settings, NAV2)


def read_environment(path: Path) -> None:
    """As ``gymnasium.make("MapBench-v0", config=FILE)``."""
    EnvConfig.build(path).load_scenarios()


def read_run(path: Path) -> None:
    """As ``mapbench report``, without driving."""
    run = load_run(path)
    run.table()
    assert run.maps
    drive_best(run, experiment_of, lambda job: job)  # type: ignore[arg-type,return-value]


@cache
def documents(kind: str) -> list[object]:
    """Return documents without a fault: with few options, and with all there are."""
    if kind == "experiment":
        own = [yaml.safe_load(_text("evolution.search", f"presets/{name}.yaml")) for name in ("quick", "thesis")]
        return [*own, *(experiment_of(compose(config=one)).document() for one in own)]
    if kind == "study":
        names = ("quick", "thesis", "noise")
        return [yaml.safe_load(_text("evolution.studies", f"definitions/{name}.yaml")) for name in names]
    assert kind == "environment"
    rows = ["#" * 40, *["#" + "." * 38 + "#"] * 30, "#" * 40]
    few = {"maps": rows, "start": [0.5, 0.5, 0.0], "goal": [1.0, 1.0, 0.0], "noise": "nominal"}
    return [few, EnvConfig.build(few).model_dump(mode="json")]


def _text(package: str, name: str) -> str:
    return resources.files(package).joinpath(name).read_text(encoding="utf-8")


def write_yaml(kind: str, folder: Path, rng: np.random.Generator) -> Path:
    """Write a damaged document, or the damaged text of one, as YAML."""
    options = documents(kind)
    document = options[rng.integers(len(options))]
    path = folder / f"{kind}.yaml"
    if rng.integers(3):
        path.write_bytes(as_yaml(damaged(document, rng)))
    else:
        path.write_bytes(damaged_bytes(as_yaml(document), rng))
    return path


def write_params(folder: Path, rng: np.random.Generator) -> Path:
    """Write a damaged ``nav2_params.yaml``."""
    text = (REPOSITORY / "examples" / "nav2_params.yaml").read_bytes()
    path = folder / "params.yaml"
    if rng.integers(2):
        path.write_bytes(as_yaml(damaged(yaml.safe_load(text), rng)))
    else:
        path.write_bytes(damaged_bytes(text, rng))
    return path


def write_picture(folder: Path, rng: np.random.Generator) -> Path:
    """Write a damaged picture of a map."""
    grey = np.kron(rng.integers(0, 2, (6, 6)), np.ones((4, 4))).astype(np.uint8) * 254
    path = folder / f"map{('.png', '.pgm', '.bmp', '.jpg')[rng.integers(4)]}"
    Image.fromarray(grey).save(path)
    path.write_bytes(damaged_bytes(path.read_bytes(), rng))
    return path


def write_model(folder: Path, rng: np.random.Generator) -> Path:
    """Write a damaged model file as Stable-Baselines3 writes them."""
    path = folder / "model.zip"
    data = {"policy_class": {"__module__": "stable_baselines3.common.policies"}, "clip_range": 0.2, "n_steps": 8}
    way = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)[rng.integers(4)]
    with zipfile.ZipFile(path, "w", way) as archive:
        archive.writestr("data", as_json(damaged(data, rng)))
        archive.writestr("policy.pth", rng.bytes(200))
        archive.writestr("pytorch_variables.pth", rng.bytes(20))
    path.write_bytes(damaged_bytes(path.read_bytes(), rng))
    return path


def write_results(sample: Path, folder: Path, rng: np.random.Generator) -> Path:
    """Copy a directory of results, or a file of them, with damage in one of its files."""
    copy_of = folder / sample.name
    files = [sample] if sample.is_file() else sorted(path for path in sample.rglob("*") if path.is_file())
    texts = [path for path in files if path.suffix in (".json", ".csv", ".jsonl", ".npz")]
    victim = texts[rng.integers(len(texts))]
    for path in files:
        target = copy_of / path.relative_to(sample) if sample.is_dir() else copy_of
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(_spoilt(path, rng) if path == victim else path.read_bytes())
    return copy_of


def _spoilt(path: Path, rng: np.random.Generator) -> bytes:
    """Return the content of a result file with a few faults."""
    data = path.read_bytes()
    if path.suffix == ".json" and rng.integers(3):
        return as_json(damaged(copy.deepcopy(json.loads(data)), rng))
    return damaged_bytes(data, rng)


SETTINGS = ("experiment", "study", "environment", "parameters", "picture", "model")
RESULTS = ("run", "study results", "sweep results", "benchmark")


@dataclass(frozen=True)
class End:
    """How one input ended.

    Args:
        how: ``accepted``, ``refused``, or what is wrong.
        text: What was said.
    """

    how: str
    text: str = ""


def try_one(samples: Path, name: str, seed: int) -> End:
    """Write an input, read it, and say how that ended.

    Args:
        samples: As for :func:`kinds`.
        name: The kind of file.
        seed: Which of the inputs of this kind.
    """
    kind, rng = kinds(samples)[name], np.random.default_rng([seed, *name.encode()])
    with tempfile.TemporaryDirectory() as folder:
        path = kind.write(Path(folder), rng)
        began = time.process_time()
        try:
            kind.read(path)
        except MapBenchError as error:
            text, seconds = str(error), time.process_time() - began
        except Exception as error:
            return End("traceback", f"{type(error).__name__}: {error}"[:300])
        else:
            return End("accepted")
    if not text.isprintable() or len(text) > MOST_LETTERS:
        return End("not one line", text[:300])
    return End("refused" if seconds < SLOW else "refused late", text)


def kinds(samples: Path) -> dict[str, Kind]:
    """Return every kind of file by name.

    Args:
        samples: Folder with results to damage: ``run``, ``study``, ``sweep`` and ``bench.json``.
    """

    def results(name: str, read: Callable[[Path], object]) -> Kind:
        return Kind(lambda folder, rng: write_results(samples / name, folder, rng), read)

    def settings(name: str, read: Callable[[Path], object]) -> Kind:
        return Kind(lambda folder, rng: write_yaml(name, folder, rng), read)

    return {
        "experiment": settings("experiment", read_experiment),
        "study": settings("study", read_study),
        "environment": settings("environment", read_environment),
        "parameters": Kind(write_params, read_nav2_params),
        "picture": Kind(write_picture, load_maps),
        "model": Kind(write_model, lambda path: load_sb3(path, "model")),
        "run": results("run", read_run),
        "study results": results("study", load_results),
        "sweep results": results("sweep", load_sweep),
        "benchmark": results("bench.json", read_bench),
    }
