"""The campaign: ``python -m tests.faults --minutes N`` prints a table of counts; exit code 1 if anything is wrong."""

from __future__ import annotations

import argparse
import itertools
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from evolution.driving.pool import Processes, available_cores
from tests.faults import inputs, kills, workers
from tests.faults.inputs import End
from tests.faults.samples import write_samples

WANTED = ("accepted", "refused", "same bytes", "was too late", "no other run lost")
SHARES = {"inputs": 0.5, "workers": 0.1, "kills": 0.4}
"""Share of the time that each part of the campaign gets."""

BATCH_SECONDS = 1.0
"""Processor seconds for one kind of input before the next kind."""

Try = Callable[[int], End]
TrySome = Callable[[int, float], list[End]]
Counts = dict[str, Counter[str]]


def main() -> int:
    """Run the campaign."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--inputs", type=int, default=10**9, help="most damaged files to try (default: no limit)")
    parser.add_argument("--parts", nargs="+", choices=SHARES, default=list(SHARES), help="what to try (default: all)")
    parser.add_argument("--seed", type=int, default=0, help="number of the first of the inputs")
    parser.add_argument("--executor", default="processes", help="what runs the controllers of the part 'workers'")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        counts = campaign(
            Path(name), options.parts, options.inputs, 60 * options.minutes, options.seed, options.executor
        )
    print(table(counts))
    return 1 if any(how not in WANTED for ends in counts.values() for how in ends) else 0


def campaign(
    folder: Path, parts: Sequence[str], most: int, seconds: float, seed: int, executor: str = "processes"
) -> Counts:
    """Try the parts for some time; returns the number of each end for each kind."""
    share = {name: seconds * SHARES[name] / sum(SHARES[part] for part in parts) for name in parts}
    counts: Counts = {}
    if "inputs" in parts:
        samples = write_samples(folder / "samples")
        files = {name: partial(inputs.try_some, samples, name) for name in (*inputs.SETTINGS, *inputs.RESULTS)}
        counts |= tried_in_processes(files, most, share["inputs"], seed)
    if "workers" in parts:
        faults: dict[str, Try] = {
            f"controller: {name}": partial(workers.try_one, name, executor=executor) for name in workers.KINDS
        }
        counts |= tried(faults, share["workers"], seed)
    if "kills" in parts:
        searches: dict[str, Try] = {name: partial(kills.try_one, folder, name) for name in kills.KINDS}
        counts |= tried(searches, share["kills"], seed)
    return counts


def tried(kinds: dict[str, Try], seconds: float, seed: int) -> Counts:
    """Try the kinds in turn, each once at least, until the time is over."""
    counts: Counts = {name: Counter() for name in kinds}
    end = time.monotonic() + seconds
    for number in itertools.count(seed):
        for name, attempt in kinds.items():
            if time.monotonic() < end or number == seed:
                note(counts, name, number, attempt(number))
        if time.monotonic() > end:
            break
    return counts


def tried_in_processes(kinds: dict[str, TrySome], most: int, seconds: float, seed: int) -> Counts:
    """Try inputs in worker processes, all kinds for equally long in turn, until the time is over or they are enough."""
    counts: Counts = {name: Counter() for name in kinds}
    end = time.monotonic() + seconds
    pool = Processes(available_cores(), 2 * inputs.HANG_SECONDS, int)
    while time.monotonic() < end and sum(map(Counter.total, counts.values())) < most:
        first = {name: seed + counts[name].total() for name in kinds}
        batches = {name: pool.submit(attempt, first[name], BATCH_SECONDS) for name, attempt in kinds.items()}
        for name, future in batches.items():
            error = future.exception()
            ends = future.result() if error is None else [End(type(error).__name__, str(error))]
            for number, one in enumerate(ends, start=first[name]):
                note(counts, name, number, one)
    pool.shutdown()
    return counts


def note(counts: Counts, name: str, number: int, end: End) -> None:
    """Count the end of an attempt; print it if it is wrong."""
    counts[name][end.how] += 1
    if end.how not in WANTED:
        print(f"{name} {number}: {end.how}: {end.text}", flush=True)


def table(counts: Counts) -> str:
    """Return the counts as a table in Markdown."""
    lines = ["| what | tried | as wanted | otherwise |", "|---|---|---|---|"]
    for name, ends in counts.items():
        wanted = sum(ends[how] for how in WANTED)
        seen = ", ".join(f"{count} {how}" for how, count in ends.items() if how in WANTED)
        wrong = ", ".join(f"{count} {how}" for how, count in ends.items() if how not in WANTED)
        lines.append(f"| {name} | {sum(ends.values())} | {wanted} ({seen}) | {wrong or 'none'} |")
    return "\n".join(lines)


if __name__ == "__main__":
    raise SystemExit(main())
