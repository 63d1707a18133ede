"""The runs on the test maps that a page replays: the maps on which the own and the tuned values differ most."""

from __future__ import annotations

from dataclasses import replace

from controllers.nav2_params.values import with_values
from evolution.driving import ControllerSpec, DriveSettings, JobPlan, drive
from evolution.files import advising
from evolution.tuning.plan import digests
from evolution.tuning.results import TEST_MAPS, TUNING, Tuning
from evolution.tuning.validation import OWN, TUNED
from gym_mapbench.errors import RunError
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.metrics.episode import Episode


def drive_test(tuning: Tuning, count: int) -> list[list[Episode]]:
    """Re-run the own and the tuned values on the test maps on which their costs differ most.

    Args:
        tuning: A finished tuning.
        count: Largest number of maps.

    Returns:
        For each map the recorded runs, of the first repeat.

    Raises:
        RunError: If the test maps are damaged, or those of another tuning.
    """
    with advising():
        scenarios = load_scenarios(tuning.path / TEST_MAPS)
        if digests(scenarios) != tuning.config["tuning"]["test"]:
            raise RunError(f"{tuning.path / TEST_MAPS}: expected the test maps of {TUNING.mark}, got others")
    plans = _plans(tuning)
    chosen = sorted(scenarios, key=lambda one: -_difference(tuning, one.name))[:count]
    return [[replace(drive(plan.job(one, 0, 0)), controller=name) for name, plan in plans.items()] for one in chosen]


def _difference(tuning: Tuning, name: str) -> float:
    costs: list[float] = [row["cost"] for row in tuning.summary.test if row["map"] == name and row["repeat"] == 0]
    return max(costs) - min(costs)


def _plans(tuning: Tuning) -> dict[str, JobPlan]:
    """Return the runs with the own and with the tuned values."""
    begun, summary = tuning.config["tuning"], tuning.summary
    world = DriveSettings.from_mapping(begun["world"], "world")
    tuned = {row["parameter"]: row["after"] for row in summary.changes}
    worlds = {OWN: world}
    if tuned:
        worlds[TUNED] = world.replace(navigation=with_values(world.navigation, summary.controller, tuned))
    spec, seed = ControllerSpec(name=summary.controller), begun["settings"]["seed"]
    return {name: JobPlan((spec,), one, seed) for name, one in worlds.items()}
