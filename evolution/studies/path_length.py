"""Baseline without runs: the longer the global path, the better the map.

Path length is the usual measure of difficulty without runs of controllers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from evolution.driving import ControllerSpec, Job, RunResult, SetResults, run_job
from evolution.search import Experiment, Fitness, Judgement
from gym_mapbench.costmap import build_static_costmap
from gym_mapbench.errors import NoPathError
from gym_mapbench.planners import make_planner

PLANNER = ControllerSpec(name="global_planner", kind="global_planner")
"""The controller of a job whose result is a planned path."""


def planned(experiment: Experiment) -> Experiment:
    """Return the same search over planned paths, without runs of controllers.

    A path is the same with every seed, so nothing is planned twice: there is no elite and no validation stage. The
    fitness ``gini`` stands for the one that is replaced: it accepts a single controller.
    """
    once = {"repeats": 1, "archive": False, "elite_seeds": 0, "parents": False, "validation": None, "fitness": "gini"}
    return replace(experiment, search=experiment.search.replace(**once), controllers=(PLANNER,))


def plan_job(job: Job) -> RunResult:
    """Return a result with the length of the global path; no controller runs."""
    navigation, robot = job.settings.navigation, job.settings.environment.robot
    scenario, params = job.scenario, navigation.global_costmap
    costmap = build_static_costmap(scenario.map, params, params.make_footprint(robot))
    planner = make_planner(navigation.planner.name, **navigation.planner.params)
    try:
        path = planner.plan(costmap, scenario.start, scenario.goal)
    except NoPathError as error:
        return RunResult("planner_failure", 0.0, 0.0, reason=str(error))
    length = float(np.hypot(*np.diff(path[:, :2], axis=0).T).sum())
    return RunResult("goal", 0.0, length)


def run_study_job(job: Job) -> RunResult:
    """Return the result of a job of a study: of a run, or of a planned path."""
    return plan_job(job) if job.controller == PLANNER else run_job(job)


class PathLengthFitness(Fitness):
    """Minus the mean length of a set's global paths, m; a map without a path counts as 0 m.

    Of maps with paths of equal length, one counts: a set gains nothing by the same map twice.

    The lengths are also the scores of the maps.
    """

    @property
    def needs_scale(self) -> bool:
        """Nothing is calibrated."""
        return False

    def calibrated(self, results: Sequence[SetResults]) -> PathLengthFitness:
        """Return itself."""
        return self

    def __call__(self, results: SetResults) -> Judgement:
        """Judge one map set by its planned paths."""
        runs = [of_map[0][0] for of_map in results]
        lengths = tuple(run.path_length_m if run.success else 0.0 for run in runs)
        mean = float(np.sum(list(dict.fromkeys(lengths))) / len(lengths))
        return Judgement(
            objectives=(-mean,),
            success_rate=sum(run.success for run in runs) / len(runs),
            timeouts=0.0,
            pattern=mean,
            scores=lengths,
            values=tuple((length,) for length in lengths),
        )
