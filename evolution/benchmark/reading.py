"""Reads a finished benchmark, or a finished comparison of parameter sets, back from its file."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from pydantic import FiniteFloat

from evolution.benchmark.configurations import ParameterComparison
from evolution.benchmark.directory import BENCHMARK
from evolution.benchmark.runs import BENCH, Benchmark
from evolution.files import Document, advising, check_rows, read_json
from gym_mapbench.errors import RunError
from gym_mapbench.metrics.episode import Outcome


class BenchRow(Document):
    """One run in ``bench.json``, without its measures."""

    map: str
    controller: str
    outcome: Outcome
    time_s: FiniteFloat


class ComparedRow(BenchRow):
    """One run in the ``bench.json`` of a comparison."""

    configuration: str


def read_bench(path: str | Path) -> Benchmark | ParameterComparison:
    """Return what is in a ``bench.json``, or in the directory that holds one.

    Raises:
        RunError: If there is none, it holds something else, or the benchmark was not finished.
    """
    path = Path(path)
    path = path / BENCH if (path / BENCH).is_file() else path
    if BENCHMARK.holds(path):
        raise RunError(f"{path}: the benchmark was not finished; continue it with --resume")
    if not path.is_file():
        raise RunError(f"{path}: expected a {BENCH} or the directory of one")
    with advising() if BENCHMARK.holds(path.parent) else nullcontext():
        return _read(path)


def _read(path: Path) -> Benchmark | ParameterComparison:
    """Return what is in a ``bench.json``."""
    document = read_json(path)
    rows = document.get("runs")
    if not isinstance(rows, list):
        raise RunError(f"{path}: expected the runs of a benchmark, got {type(rows).__name__}")
    metrics = _metrics(document, path)
    if "parameters" not in document:
        check_rows(BenchRow, rows, path)
        return Benchmark(tuple(rows), metrics, digests=_digests(document, path))
    check_rows(ComparedRow, rows, path)
    parameters = document["parameters"]
    if not isinstance(parameters, list) or not all(isinstance(row, dict) and "key" in row for row in parameters):
        raise RunError(f"{path}: expected the parameters that differ, each with its key")
    return ParameterComparison(tuple(rows), tuple(parameters), bool(document.get("against_first")), metrics=metrics)


def _metrics(document: Mapping[str, Any], path: Path) -> tuple[str, ...]:
    """Return the metrics that the tables show; none of a file that an earlier version wrote."""
    metrics = document.get("metrics", [])
    if not isinstance(metrics, list) or not all(isinstance(name, str) for name in metrics):
        raise RunError(f"{path}: metrics: expected a list of names")
    return tuple(metrics)


def _digests(document: Mapping[str, Any], path: Path) -> Mapping[str, str]:
    """Return the digests of the maps; none of a file that an earlier version wrote."""
    digests = document.get("maps", {})
    if not isinstance(digests, dict) or not all(isinstance(value, str) for value in digests.values()):
        raise RunError(f"{path}: maps: expected the digest of each map by name")
    return digests
