"""What ten people cost in an env step: scripted, wandering and social-force people beside nobody, in the same run.

CPU time of one process, with 64 beams and random actions, on random maps of the thesis. The envs take turns; every turn
of an env takes the same steps, and is compared with nobody's turn beside it. Steps in which an episode begins count
only in the last column.
"""

from __future__ import annotations

import argparse
import itertools
import math
import statistics
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import gymnasium
import numpy as np

import gym_mapbench  # noqa: F401, registers the env
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenario
from gym_mapbench.generator import PeopleSettings, with_people
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.motions import MotionSpec
from gym_mapbench.world.scenario import Scenario

PEOPLE = 10
MAPS = 16
ACTIONS = 600
"""Number of different actions, and steps of the vector env in a turn; the single env takes ten times as many."""
OPTIONS: dict[str, Any] = {
    "observation": ("goal", "velocity", "scan"),
    "lidar": {"beams": 64, "range_max": 3.5},
    "action": "normalized",
}
COLUMNS = ("us, median", "us, min", "ratio, median", "ratio of min", "with resets")
Steps = Callable[[], bool]


@dataclass
class Turns:
    """Microseconds of a step of one world in every turn: without the steps in which an episode begins, and with them.

    Args:
        begin: Returns a function that takes a step of all worlds, from the first one on; it returns whether an episode
            began in the step.
        worlds: Number of worlds.
    """

    begin: Callable[[], Steps]
    worlds: int
    plain: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)

    def take(self, steps: int) -> None:
        """Time one turn."""
        spent: dict[bool, list[float]] = {False: [], True: []}
        step = self.begin()
        for _ in range(steps):
            began = time.process_time()
            resets = step()
            spent[resets].append(time.process_time() - began)
        self.plain.append(1e6 * statistics.fmean(spent[False]) / self.worlds)
        self.whole.append(1e6 * statistics.fmean(spent[False] + spent[True]) / self.worlds)

    def figures(self, nobody: Turns) -> tuple[float, ...]:
        """Return the figures of the table's columns, :data:`COLUMNS`."""
        plain, whole = (
            statistics.median(mine / other for mine, other in zip(own, others, strict=True))
            for own, others in ((self.plain, nobody.plain), (self.whole, nobody.whole))
        )
        return statistics.median(self.plain), min(self.plain), plain, min(self.plain) / min(nobody.plain), whole


def single(scenarios: list[Scenario]) -> Turns:
    """Steps of a single env."""
    env = gymnasium.make("MapBench-v0", scenarios=scenarios, disable_env_checker=True, **OPTIONS).unwrapped
    rng = np.random.default_rng(0)
    actions = itertools.cycle(list(rng.uniform(-1.0, 1.0, (ACTIONS, 2)).astype(np.float32)))
    over = False

    def step() -> bool:
        nonlocal over
        began = over
        if began:
            env.reset()
        *_, terminated, truncated, _ = env.step(next(actions))
        over = terminated or truncated
        return began

    def begin() -> Steps:
        nonlocal over
        env.reset(seed=0)
        over = False
        return step

    return Turns(begin, 1)


def together(scenarios: list[Scenario], worlds: int) -> Turns:
    """Steps of a vector env."""
    envs = gymnasium.make_vec("MapBench-v0", worlds, scenarios=scenarios, **OPTIONS)
    rng = np.random.default_rng(0)
    actions = itertools.cycle(list(rng.uniform(-1.0, 1.0, (ACTIONS, worlds, 2)).astype(np.float32)))
    over = False

    def step() -> bool:
        nonlocal over
        began = over
        _, _, terminated, truncated, _ = envs.step(next(actions))
        over = bool((terminated | truncated).any())
        return began

    def begin() -> Steps:
        nonlocal over
        envs.reset(seed=0)
        over = False
        return step

    return Turns(begin, worlds)


def sampled(wander: float, count: int = PEOPLE) -> Iterator[Scenario]:
    """Yield random maps among people, of whom a share wanders; the maps are the same for every share."""
    settings = PeopleSettings(count=count, wander=wander)
    for seed in itertools.count():
        rng = np.random.default_rng(seed)
        yield with_people(draw_scenario(EnvConfig(), rng), settings, rng)


def reacting(scenario: Scenario) -> Scenario:
    """Return the map with people who walk to the same waypoints by social forces, as many as start apart."""
    people, starts = list[Body](), list[tuple[float, float]]()
    for body in scenario.bodies:
        start = body.motion.options["waypoints"][0]
        if all(math.dist(start, other) > 2 * body.shape.radius for other in (*starts, scenario.start[:2])):
            options = {name: body.motion.options[name] for name in ("waypoints", "speed")}
            people.append(body.replace(motion=MotionSpec(name="social_force", options=options)))
            starts.append(start)
    return replace(scenario, bodies=tuple(people[:PEOPLE]))


def crowded(scenarios: Iterable[Scenario]) -> list[Scenario]:
    """Return the first maps that have room for ten people."""
    return list(itertools.islice((one for one in scenarios if len(one.bodies) == PEOPLE), MAPS))


def kinds() -> dict[str, list[Scenario]]:
    """Return what is timed: the scenarios by the people on them."""
    scripted = crowded(sampled(0.0))
    return {
        "nobody": [replace(one, bodies=()) for one in scripted],
        "scripted": scripted,
        "wander": crowded(sampled(1.0)),
        "social_force": crowded(map(reacting, sampled(0.0, 2 * PEOPLE))),
    }


def compare(title: str, timed: dict[str, Turns], steps: int, turns: int) -> None:
    """Take turns, and print the table: CPU time, and its ratio to nobody's in the same turn."""
    for one in timed.values():
        one.take(steps)
        one.plain.clear()
        one.whole.clear()
    for _ in range(turns):
        for one in timed.values():
            one.take(steps)
    for name, one in timed.items():
        print(f"{title:10s} {name:13s}", *(f"{number:13.2f}" for number in one.figures(timed["nobody"])), flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--envs", type=int, default=64, help="worlds stepped together (default 64)")
    parser.add_argument("--turns", type=int, default=7, help="turns of every env (default 7)")
    parser.add_argument("--only", choices=["single", "vector"], help="one of the two kinds of env")
    args = parser.parse_args()
    scenarios = kinds()
    print(
        f"{'env':12s} {'people':14s} {'us, median':>10s} {'us, min':>8s} {'ratio':>8s} {'ratio of min':>12s}", end=" "
    )
    print(f"{'with resets':>14s}")
    if args.only != "vector":
        compare("single", {name: single(maps) for name, maps in scenarios.items()}, 10 * ACTIONS, args.turns)
    if args.only != "single":
        vectors = {name: together(maps, args.envs) for name, maps in scenarios.items()}
        compare(f"{args.envs} worlds", vectors, ACTIONS, args.turns)


if __name__ == "__main__":
    main()
