"""What an upgrade of Nav2 changes: the same maps and noise under Humble, Jazzy and Lyrical, controller by controller.

``python benchmarks/releases.py [--maps N] [--seeds R] [--sets FILE ...] [--out FILE] [--plot FILE]`` samples maps of
the families without a route, takes the maps of evolved sets, and runs DWB, MPPI and RPP with the presets ``fair``,
``jazzy_fair`` and ``lyrical_fair``. It prints shares with Wilson intervals, paired ratios and means with bootstrap
intervals over maps, McNemar's exact test over maps, outcomes, and whether evolved maps still tell controllers apart.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.stats
from run_tables import compared, is_goal, of, over_maps, read_runs, share, share_and_ends, write_runs
from sampled_maps import sampled

from evolution import bench
from evolution.driving import DriveSettings
from evolution.files import Row
from evolution.pictures import colour_of, new_figure
from evolution.search import load_preset
from evolution.search.judging.patterns.gini import gini
from gym_mapbench.mapio import load_map_set
from gym_mapbench.world.scenario import Scenario

PRESETS = {"humble": "fair", "jazzy": "jazzy_fair", "lyrical": "lyrical_fair"}
CONTROLLERS = ("dwb", "mppi", "rpp")
FIRST_SEED = 7000
SEED = 17
HEADER = "maps | controller | release | runs | goal, % | goal in one only | time ratio | clearance, m | recoveries"
COLUMNS = ("maps", "map", "release", "controller", "repeat", "outcome", "time_s", "path_length_m")
COUNTED = ("maps", "controller", "release", "outcome")
MEASURES = ("min_clearance", "n_recoveries")


def distinct_maps(sets: Sequence[Path]) -> list[Scenario]:
    """Return the maps of some sets, each once: searches with one seed share their first maps."""
    found: dict[str, Scenario] = {}
    for number, path in enumerate(sets):
        for one in load_map_set(path):
            found.setdefault(one.world_digest, replace(one, name=f"{number}_{one.name}"))
    return list(found.values())


def driven(groups: Mapping[str, Sequence[Scenario]], seeds: Mapping[str, int], workers: int, out: Path) -> list[Row]:
    """Run everything that a file of earlier runs lacks, and return all runs; they are written after each part."""
    rows = read_runs(out) if out.exists() else []
    done = {(row["maps"], row["release"], row["controller"]) for row in rows}
    for release, preset in PRESETS.items():
        run = {**load_preset("robust")["run"], "navigation": preset}
        settings = DriveSettings.from_mapping(run, "run")
        for maps, scenarios in groups.items():
            for controller in CONTROLLERS:
                if (maps, release, controller) in done:
                    continue
                options = {"settings": settings, "seed": SEED, "repeats": seeds[maps], "workers": workers}
                found = bench(list(scenarios), [controller], **options).rows
                rows += [{**row, "maps": maps, "release": release} for row in found]
                write_runs(out, rows, (*COLUMNS, *MEASURES))
    return read_runs(out)


def cells(rows: Sequence[Row], before: Sequence[Row]) -> list[str]:
    """Return the table cells of one controller in one release.

    Args:
        rows: Its runs.
        before: The same runs in Humble.
    """
    goals = [row for row in rows if is_goal(row)]
    found = [share(rows)]
    paired = compared(before, rows)
    found.append(f"+{paired.wins} -{paired.losses} (p = {paired.p_success:.2g})")
    found.append(f"{paired.time_ratio:.3f} ({paired.ratio_low:.3f} to {paired.ratio_high:.3f})")
    clearance = [(str(row["map"]), float(row["min_clearance"])) for row in goals]
    recoveries = [(str(row["map"]), float(row["n_recoveries"] or 0)) for row in rows]
    return [*found, over_maps(clearance, np.mean, 3), over_maps(recoveries, np.mean, 2)]


def mean_times(rows: Sequence[Row]) -> dict[str, dict[str, float]]:
    """Return the mean time of each controller on each map, over its runs that reached the goal."""
    times: dict[str, dict[str, list[float]]] = {}
    for row in filter(is_goal, rows):
        times.setdefault(str(row["map"]), {}).setdefault(str(row["controller"]), []).append(float(row["time_s"]))
    return {name: {one: float(np.mean(some)) for one, some in of_map.items()} for name, of_map in times.items()}


def still_apart(rows: Sequence[Row], release: str) -> str:
    """Return a sentence on the Gini coefficients of evolved maps in Humble and in another release."""
    times = [mean_times(of(rows, maps="evolved", release=name)) for name in ("humble", release)]
    common = [name for name in times[0] if all(len(some.get(name, {})) == len(CONTROLLERS) for some in times)]
    before, after = (np.array([gini(list(some[name].values())) for name in common]) for some in times)
    rank = scipy.stats.spearmanr(before, after).statistic
    means = f"{before.mean():.3f} in Humble, {after.mean():.3f} in {release}"
    return f"{len(common)} evolved maps: mean Gini coefficient {means}; Spearman {rank:.2f}"


def plot(rows: Sequence[Row], path: Path) -> None:
    """Draw shares of goals and paired ratios of times by release, for each controller; sampled maps."""
    releases = list(PRESETS)
    figure, panels = new_figure(columns=2, width=8.0, height=3.4)
    for number, name in enumerate(CONTROLLERS):
        own = [of(rows, maps="sampled", release=release, controller=name) for release in releases]
        places = np.arange(len(releases)) + 0.12 * (number - 1)
        _points(panels[0], places, np.array([share_and_ends(some) for some in own]), name)
        pairs = [compared(own[0], some) for some in own]
        ratios = np.array([[one.time_ratio, one.ratio_low, one.ratio_high] for one in pairs])
        _points(panels[1], places, ratios, name)
    panels[0].set(ylabel="runs at the goal, % (95 %, Wilson)", xticks=range(3), xticklabels=releases)
    panels[1].set(ylabel="time / time in Humble (95 %)", xticks=range(3), xticklabels=releases)
    panels[1].legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=110)


def _points(axes: object, places: object, values: np.ndarray, name: str) -> None:
    """Draw values with their intervals."""
    middle, low, high = values.T
    spread = np.stack([middle - low, high - middle])
    axes.errorbar(places, middle, spread, color=colour_of(CONTROLLERS, name), label=name, marker="o", markersize=4)


def main() -> None:
    """Run or read, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", type=int, default=200)
    parser.add_argument("--seeds", type=int, default=2, help="seeds for each sampled map")
    parser.add_argument("--sets", type=Path, nargs="*", default=[Path("docs/gallery/quick/best_map_set.json")])
    parser.add_argument("--set-seeds", type=int, default=20, help="seeds for each map of an evolved set")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("releases.csv"), help="file of runs; it is continued")
    parser.add_argument("--plot", type=Path, help="picture to draw")
    args = parser.parse_args()
    groups = {"sampled": sampled(args.maps, FIRST_SEED), "evolved": distinct_maps(args.sets)}
    rows = driven(groups, {"sampled": args.seeds, "evolved": args.set_seeds}, args.workers, args.out)
    print(f"| {HEADER} |\n|{'---|' * 9}")
    for maps in groups:
        for controller in CONTROLLERS:
            before = of(rows, maps=maps, release="humble", controller=controller)
            for release in PRESETS:
                own = of(rows, maps=maps, release=release, controller=controller)
                print(f"| {maps} | {controller} | {release} | {len(own)} | " + " | ".join(cells(own, before)) + " |")
    for run, count in sorted(Counter(tuple(str(row[name]) for name in COUNTED) for row in rows).items()):
        print(*run, count)
    for release in list(PRESETS)[1:]:
        print(still_apart(rows, release))
    if args.plot:
        plot(rows, args.plot)


if __name__ == "__main__":
    main()
