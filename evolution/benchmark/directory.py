"""The directory of a benchmark: it is written run by run, and can be continued.

::

    benchmark.json    maps, controllers, world and seed, and the versions it was begun with
    results.sqlite    every run, as it ends
    bench.json        the digests of the maps, all runs, and the metrics of --metric, after the last one
    bench.csv         the same as a table
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from evolution.driving import ControllerSpec, JobPlan, model_digest
from evolution.files import DirectoryKind
from gym_mapbench.world.scenario import Scenario

BENCHMARK = DirectoryKind("benchmark", "benchmark.json", format_version=1, remade=True)


def begin_benchmark(path: Path, benchmark: Mapping[str, Any], *, resume: bool) -> None:
    """Begin a directory, or continue one; errors as for :meth:`~evolution.files.DirectoryKind.begin_or_resume`.

    Args:
        path: The directory.
        benchmark: Everything that the results depend on, as :func:`benchmark_document` returns it.
        resume: Whether to continue a benchmark that was begun there.
    """
    BENCHMARK.begin_or_resume(path, {"benchmark": benchmark}, _options, resume=resume)


def benchmark_document(scenarios: Sequence[Scenario], plan: JobPlan) -> dict[str, Any]:
    """Return everything that the results depend on; maps and controllers by name, as errors name them."""
    maps = {f"{number} {scenario.name}": scenario.digest for number, scenario in enumerate(scenarios, start=1)}
    controllers = {spec.name: _controller_document(spec) for spec in plan.controllers}
    settings = plan.settings.model_dump(mode="json")
    return {
        "maps": maps,
        "controllers": controllers,
        "repeats": plan.repeats,
        "seed": plan.root_seed,
        "metrics": list(plan.metrics),
        "settings": settings,
    }


def _options(document: Mapping[str, Any]) -> object:
    """Return the options of a document, as errors name them: what a user lists comes first, by name."""
    options = document["benchmark"]
    if not isinstance(options, dict):
        return options
    lists = {f"list of {key}": ", ".join(sorted(_named(options, key))) for key in ("controllers", "configurations")}
    return {
        **map_options(_named(options, "maps")),
        **lists,
        **{key: value for key, value in options.items() if key != "maps"},
    }


def map_options(maps: Mapping[str, Any], kind: str = "map") -> dict[str, Any]:
    """Return the digests of maps by number and name as options that errors name: how many, which, and the digests.

    Args:
        maps: The digests by number and name, such as ``1 hall``.
        kind: What a map is called.
    """
    places = [entry.partition(" ") for entry in maps]
    return {
        f"number of {kind}s": len(maps),
        **{f"{kind} {number}": name for number, _, name in places},
        **{f"digest of {kind} {entry} with start and goal": digest for entry, digest in maps.items()},
    }


def _named(options: Mapping[str, Any], key: str) -> dict[str, Any]:
    """Return a mapping of a document by names; an empty one of a damaged document."""
    value = options.get(key)
    return value if isinstance(value, dict) else {}


def _controller_document(spec: ControllerSpec) -> dict[str, Any]:
    """Return what defines a controller besides its name."""
    document: dict[str, Any] = spec.model_dump(mode="json", exclude={"name"})
    digest = model_digest(spec)
    return document if digest is None else {**document, "model": digest}
