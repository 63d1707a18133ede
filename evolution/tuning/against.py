"""Maps against a set of values: evolved so that the tuned controller is slow or fails where another one is fast."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from statistics import fmean

from controllers.nav2_params.values import Value
from evolution.driving import ControllerSpec, Evaluator, JobPlan
from evolution.search import EvolveSettings, Experiment, Fitness, evolve
from evolution.tuning.objectives import scale_of
from evolution.tuning.plan import TuningPlan
from evolution.tuning.settings import AgainstSettings
from gym_mapbench.errors import ArgumentError, ConfigError
from gym_mapbench.generator import WITHOUT_ROUTE
from gym_mapbench.world.scenario import Scenario

REFERENCES = ("rpp", "dwb", "mppi", "graceful")
"""Controllers that show that a map can be driven: the first of another kind than the tuned one that there is."""
CONFIRMING = range(1, 3)
"""Repeats on which a hard map is confirmed."""
LEAST_REGRET = 0.1
"""Smallest regret, on the confirming repeats, with which a map joins the training maps: 10 % slower."""


def evolve_against(
    plan: TuningPlan, values: dict[str, Value], number: int, against: AgainstSettings, evaluator: Evaluator
) -> tuple[Scenario, ...]:
    """Return the hardest maps for some values that an evolution finds, the hardest first.

    Args:
        plan: The tuning.
        values: Values of the tuned parameters.
        number: Number of the round, from which seed and names of the maps are derived.
        against: Options of the evolution.
        evaluator: Drives the runs.
    """
    experiment = experiment_against(plan, values, number, against)
    found = evolve(experiment, evaluator)
    known = {one.digest for one in (*plan.train, *plan.test)}
    ranked = sorted(found.population, key=lambda one: one.judgement.rank_key)
    maps = {one.map_set[0].digest: one.map_set[0] for one in ranked if one.judgement.fitness < 0.0}
    new = [one for digest, one in maps.items() if digest not in known and _has_way(one, plan)]
    hardest = _confirmed(experiment.plan, found.fitness, new[: 2 * against.maps], evaluator)[: against.maps]
    return tuple(replace(one, name=f"round_{number}_map_{place}") for place, one in enumerate(hardest, start=1))


def experiment_against(plan: TuningPlan, values: dict[str, Value], number: int, against: AgainstSettings) -> Experiment:
    """Return the search for hard maps: sets of one map, judged by the regret of the tuned controller."""
    tuned = plan.jobs_with(values)
    search = EvolveSettings.from_mapping(
        {
            "seed": 1000 * plan.settings.seed + number,
            "evaluations": against.evaluations,
            "maps_per_set": 1,
            "ga": {"pop_size": min(against.pop_size, against.evaluations)},
            "judging": {"fitness": "regret", "failures": "par2"},
            "families": against.families or WITHOUT_ROUTE,
        },
        "against",
    )
    return Experiment(search, (*tuned.controllers, ControllerSpec(name=reference_for(plan))), tuned.settings)


def reference_for(plan: TuningPlan) -> str:
    """Return the controller that shows that a map can be driven."""
    navigation = plan.world.navigation
    kind = navigation.controller(plan.controller).kind
    for name in REFERENCES:
        try:
            if navigation.controller(name).kind != kind:
                return name
        except ConfigError:
            continue
    raise ArgumentError("against", f"expected a second controller beside {plan.controller}, got none")


def _has_way(scenario: Scenario, plan: TuningPlan) -> bool:
    """Whether costs can be computed for a map."""
    try:
        scale_of(scenario, plan.world)
    except ConfigError:
        return False
    return True


def _confirmed(jobs: JobPlan, fitness: Fitness, maps: Sequence[Scenario], evaluator: Evaluator) -> list[Scenario]:
    """Return the maps that are hard on further seeds, too, the hardest first."""
    wanted = [jobs.job(one, place, repeat) for one in maps for place in range(2) for repeat in CONFIRMING]
    results = iter(evaluator.run(wanted))
    regrets = []
    for _ in maps:
        first, other = ([next(results) for _ in CONFIRMING] for _ in range(2))
        regrets.append(fmean(-fitness((((one,), (two,)),)).fitness for one, two in zip(first, other, strict=True)))
    order = sorted(range(len(maps)), key=lambda place: -regrets[place])
    return [maps[place] for place in order if regrets[place] > LEAST_REGRET]
