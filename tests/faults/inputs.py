"""Files that may be anything: each kind is written, damaged and read as its command does.

The readers stop before the first run, so that thousands of inputs can be tried.
"""

from __future__ import annotations

import copy
import json
import shutil
import signal
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from controllers.nav2_params import read_nav2_params
from controllers.rl import load_sb3
from evolution.api import compose
from evolution.benchmark import read_bench
from evolution.pictures import drive_best
from evolution.runs import load_run
from evolution.search import check_experiment, experiment_of, read_document
from evolution.studies import SweepSettings, load_results, load_sweep
from evolution.studies.kinds import load_definition
from evolution.studies.tasks import check_study
from evolution.training import TrainingDir, train_settings
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import MapBenchError
from gym_mapbench.mapio import load_maps
from tests.faults.damage import as_json, as_yaml, damaged, damaged_bytes
from tests.mapio import fuzz

MOST_LETTERS = 2100
HANG_SECONDS = 60.0
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
        check_study(settings)


def read_environment(path: Path) -> None:
    """As ``gymnasium.make("MapBench-v0", config=FILE)``."""
    EnvConfig.build(path).load_scenarios()


def read_training(path: Path) -> None:
    """As ``mapbench train --resume``, without learning."""
    directory = TrainingDir.open(path)
    assert directory.settings
    assert directory.state
    directory.read_maps()
    directory.read_curve()


def read_run(path: Path) -> None:
    """Read a directory as ``mapbench report`` does, without runs."""
    run = load_run(path)
    run.table()
    assert run.maps
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("evolution.pictures.run_figures.drive", lambda job: job)
        drive_best(run)


@cache
def documents(kind: str) -> list[object]:
    """Return documents without a fault: with few options, and with all there are."""
    if kind == "experiment":
        own = [yaml.safe_load(_text("evolution.search", f"presets/{name}.yaml")) for name in ("quick", "thesis")]
        return [*own, *(experiment_of(compose(config=one)).document() for one in own)]
    if kind == "study":
        names = ("quick", "thesis", "noise")
        return [yaml.safe_load(_text("evolution.studies", f"definitions/{name}.yaml")) for name in names]
    if kind == "training":
        return [train_settings(name).model_dump(mode="json") for name in ("ppo", "sac")]
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
    text, document = _parameters()
    path = folder / "params.yaml"
    path.write_bytes(as_yaml(damaged(document, rng)) if rng.integers(2) else damaged_bytes(text, rng))
    return path


@cache
def _parameters() -> tuple[bytes, object]:
    text = (REPOSITORY / "examples" / "nav2_params.yaml").read_bytes()
    return text, yaml.safe_load(text)


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
    if sample.is_file():
        copy_of.write_bytes(_spoilt(sample, rng))
        return copy_of
    shutil.copytree(sample, copy_of, ignore=shutil.ignore_patterns("*.svg", "*.png", "*.html", "*.sqlite*"))
    texts = sorted(path for path in copy_of.rglob("*") if path.suffix in (".json", ".csv", ".jsonl", ".npz"))
    victim = texts[rng.integers(len(texts))]
    victim.write_bytes(_spoilt(victim, rng))
    return copy_of


def write_map(sample: Path, folder: Path, rng: np.random.Generator) -> Path:
    """Copy the files of a map, with damage in one of them; returns the one to load."""
    cases = fuzz.sample_cases(shutil.copytree(sample, folder / sample.name))
    path, victim = cases[rng.integers(len(cases))]
    victim.write_bytes(damaged_bytes(victim.read_bytes(), rng, fuzz.STRANGE))
    return path


def _spoilt(path: Path, rng: np.random.Generator) -> bytes:
    """Return the content of a result file with a few faults."""
    data = path.read_bytes()
    if path.suffix == ".json" and rng.integers(3):
        return as_json(damaged(copy.deepcopy(json.loads(data)), rng))
    return damaged_bytes(data, rng)


SETTINGS = ("experiment", "study", "environment", "training", "parameters", "picture", "model")
RESULTS = ("map", "run", "study results", "sweep results", "benchmark", "training results")


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
            with _limited():
                kind.read(path)
        except MapBenchError as error:
            text, seconds = str(error), time.process_time() - began
        except HangError:
            return End("hang")
        except Exception as error:
            return End("traceback", f"{type(error).__name__}: {error}"[:300])
        else:
            return End("accepted")
    if not text.isprintable() or len(text) > MOST_LETTERS:
        return End("not one line", text[:300])
    return End("refused" if seconds < SLOW else "refused late", text)


class HangError(BaseException):
    """An input was read for too long."""


@contextmanager
def _limited() -> Iterator[None]:
    """Raise :class:`HangError` where the ``with`` block takes longer than :data:`HANG_SECONDS`."""

    def stop(*_: object) -> None:
        raise HangError

    signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, HANG_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def try_some(samples: Path, name: str, first: int, seconds: float) -> list[End]:
    """Try inputs of a kind, from a number on, for some processor seconds, and say how each ended."""
    ends, until = [], time.process_time() + seconds
    while time.process_time() < until:
        ends.append(try_one(samples, name, first + len(ends)))
    return ends


def kinds(samples: Path) -> dict[str, Kind]:
    """Return every kind of file by name.

    Args:
        samples: Folder with files to damage: those of :func:`tests.faults.samples.write_samples`.
    """

    def results(name: str, read: Callable[[Path], object]) -> Kind:
        return Kind(lambda folder, rng: write_results(samples / name, folder, rng), read)

    def settings(name: str, read: Callable[[Path], object]) -> Kind:
        return Kind(lambda folder, rng: write_yaml(name, folder, rng), read)

    return {
        "experiment": settings("experiment", read_experiment),
        "study": settings("study", read_study),
        "environment": settings("environment", read_environment),
        "training": settings("training", lambda path: train_settings(config=path)),
        "parameters": Kind(write_params, read_nav2_params),
        "picture": Kind(write_picture, load_maps),
        "model": Kind(write_model, lambda path: load_sb3(path, "model")),
        "map": Kind(lambda folder, rng: write_map(samples / "maps", folder, rng), fuzz.load),
        "run": results("run", read_run),
        "study results": results("study", load_results),
        "sweep results": results("sweep", load_sweep),
        "benchmark": results("bench.json", read_bench),
        "training results": results("training", read_training),
    }
