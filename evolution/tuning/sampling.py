"""The only place that uses Optuna: samples values, decides which trials stop, and computes importances."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

from controllers.nav2_params.values import Value
from evolution.tuning.settings import TuneSettings
from evolution.tuning.space import ParameterRange, SearchSpace
from gym_mapbench.errors import ConfigError

LEAST_STEPS = 4
"""Fewest maps on which the Wilcoxon test is asked."""
LEAST_FOR_IMPORTANCE = 20
"""Fewest finished trials from which importances are computed."""


def optuna() -> Any:
    """Import Optuna, and let it report errors only.

    Raises:
        ConfigError: If it is not installed, with what to install.
    """
    try:
        module = importlib.import_module("optuna")
    except ImportError:
        raise ConfigError("tuning needs optuna (pip install 'gym-mapbench[tune]')") from None
    module.logging.set_verbosity(module.logging.ERROR)
    return module


class Sampling:
    """A study of Optuna in memory; the same calls in the same order give the same values.

    Args:
        space: The tuned parameters.
        own: The user's values of the sampled parameters, which the first trial has.
        settings: Options of the tuning.
        start: Values of the trials after the first.
        seed: Seed of the sampler.
    """

    def __init__(
        self,
        space: SearchSpace,
        own: Mapping[str, Value],
        settings: TuneSettings,
        start: Sequence[Mapping[str, Value]],
        seed: int,
    ) -> None:
        module = optuna()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", module.exceptions.ExperimentalWarning)
            samplers = {"tpe": module.samplers.TPESampler, "random": module.samplers.RandomSampler}
            self._study = module.create_study(
                directions=["minimize"] * len(settings.objectives),
                sampler=samplers[settings.sampler](seed=seed),
                pruner=module.pruners.WilcoxonPruner(p_threshold=settings.stop_p, n_startup_steps=LEAST_STEPS),
            )
        self._space = {name: _distribution(module, one) for name, one in space.sampled.items()}
        self._stops = settings.stop_p > 0 and len(settings.objectives) == 1
        for values in (own, *start):
            self._study.enqueue_trial({name: one.nearest(values[name]) for name, one in space.sampled.items()})
        self._trials: list[Any] = []

    def ask(self) -> dict[str, Value]:
        """Return the values of a new trial, whose number is the count of trials before it."""
        trial = self._study.ask(self._space)
        self._trials.append(trial)
        return dict(trial.params)

    def report(self, number: int, place: int, cost: float) -> None:
        """Report the cost of a trial on the map of some number."""
        if self._stops:
            self._trials[number].report(cost, place)

    def best(self) -> int | None:
        """Return the number of the best trial that meets all requirements; None before the first."""
        try:
            return int(self._study.best_trial.number)
        except ValueError:
            return None

    def should_stop(self, number: int) -> bool:
        """Whether the Wilcoxon test says that a trial is worse than the best."""
        return self._stops and bool(self._trials[number].should_prune())

    def tell(self, number: int, costs: Sequence[float] | None, violations: Mapping[str, float]) -> None:
        """Finish a trial with the value of each objective; with None where its values cannot be used."""
        trial = self._trials[number]
        if costs is None:
            self._study.tell(trial, state=optuna().trial.TrialState.FAIL)
            return
        for name, violation in violations.items():
            trial.set_constraint(name, violation)
        self._study.tell(trial, list(costs))

    def importances(self) -> list[dict[str, float]]:
        """Return the importance of each parameter, which sum to 1, for each objective; empty for too few trials.

        Source: PED-ANOVA (Watanabe, Bansal and Hutter 2023), which needs no further library, unlike fANOVA.
        """
        module = optuna()
        done = self._study.get_trials(deepcopy=False, states=(module.trial.TrialState.COMPLETE,))
        if len(done) < LEAST_FOR_IMPORTANCE:
            return [{} for _ in self._study.directions]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return [self._importance_for(module, place) for place in range(len(self._study.directions))]

    def _importance_for(self, module: Any, place: int) -> dict[str, float]:
        evaluator = module.importance.PedAnovaImportanceEvaluator()
        target = (lambda trial: trial.values[place]) if len(self._study.directions) > 1 else None
        found = module.importance.get_param_importances(self._study, evaluator=evaluator, target=target)
        return {name: float(value) for name, value in found.items()}


def _distribution(module: Any, one: ParameterRange) -> Any:
    """Return Optuna's distribution of a parameter."""
    if one.choices:
        return module.distributions.CategoricalDistribution(one.choices)
    if one.integer:
        return module.distributions.IntDistribution(int(one.low or 0), int(one.high or 0), log=one.log)
    return module.distributions.FloatDistribution(one.low, one.high, log=one.log)
