"""TuningPlan: everything that the result of a tuning depends on, and the jobs of one set of values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from controllers.nav2_params.values import Value, Values, values_of, with_values
from evolution.driving import ControllerSpec, DriveSettings, Job, JobPlan
from evolution.tuning.objectives import Requirement, Scale, read_requirement, scale_of
from evolution.tuning.settings import TuneSettings
from evolution.tuning.space import SearchSpace
from gym_mapbench.errors import ArgumentError, ConfigError
from gym_mapbench.world.scenario import Scenario


@dataclass(frozen=True)
class TuningPlan:
    """A tuning before it begins.

    Args:
        controller: The controller, by its name or kind.
        world: World and navigation with the user's own values.
        space: The tuned parameters.
        train: Maps of the search.
        test: Maps of the final comparison.
        settings: Options.

    Raises:
        ConfigError: If training and test maps overlap, there are none, or the controller refuses the values of the
            search space.
    """

    controller: str
    world: DriveSettings
    space: SearchSpace
    train: tuple[Scenario, ...]
    test: tuple[Scenario, ...]
    settings: TuneSettings

    def __post_init__(self) -> None:
        check_maps(self.train, self.test)
        for name in self.space.sampled:
            self._check_accepted(name)

    def _check_accepted(self, name: str) -> None:
        """Refuse a parameter for which the controller accepts no value of the space, such as bounds of a switch."""
        refused = ConfigError(f"{name}: expected a parameter with one value, got {self.own[name]!r:.80}")
        values = self.space.parameters[name].examples() if isinstance(self.own[name], bool | int | float | str) else []
        for value in values:
            try:
                with_values(self.world.navigation, self.controller, {name: value})
            except ConfigError as error:
                refused = error
            else:
                return
        raise ArgumentError("space", f"the controller accepts no value of the search space: {refused}")

    @cached_property
    def own(self) -> dict[str, Value]:
        """The user's values of the tuned parameters."""
        known = values_of(self.world.navigation, self.controller)
        return {name: known[name] for name in self.space.parameters}

    @cached_property
    def scales(self) -> Mapping[str, Scale]:
        """What costs are measured by, for each map by its digest."""
        return {one.digest: scale_of(one, self.world) for one in (*self.train, *self.test)}

    def check_ways(self) -> None:
        """Refuse maps on which no way leads to the goal, as they have no scale.

        Raises:
            ConfigError: Naming the first of them.
        """
        _ = self.scales

    @cached_property
    def requirements(self) -> tuple[Requirement, ...]:
        """The conditions that the runs of a trial must meet."""
        return tuple(read_requirement(text) for text in self.settings.requirements)

    def jobs_with(self, values: Values) -> JobPlan:
        """Return the plan of the runs with some values.

        All plans have the same seeds, so that runs on a map are paired.

        Raises:
            ConfigError: If the controller refuses the values.
        """
        world = self.world
        if values != self.own:
            world = world.replace(navigation=with_values(world.navigation, self.controller, values))
        return JobPlan((ControllerSpec(name=self.controller),), world, self.settings.seed)

    def document(self) -> dict[str, Any]:
        """Return everything that the results depend on, JSON-able; maps by name, as errors name them."""
        return {
            "controller": self.controller,
            "settings": self.settings.model_dump(mode="json"),
            "space": self.space.model_dump(mode="json")["parameters"],
            "train": digests(self.train),
            "test": digests(self.test),
            "world": self.world.model_dump(mode="json"),
        }


def check_maps(train: Sequence[Scenario], test: Sequence[Scenario]) -> None:
    """Refuse a training or a test without maps, and a map that is in both.

    Raises:
        ConfigError: Naming the first map that is in both.
    """
    for name, maps in (("train", train), ("test", test)):
        if not maps:
            raise ArgumentError(name, "expected at least one map, got none")
    known = {one.digest: one.name for one in train}
    for one in test:
        if one.digest in known:
            same = f"{one.name} is the training map {known[one.digest]}"
            raise ArgumentError("test", f"expected maps that are not among the training maps, but {same}")


def jobs_on(plan: JobPlan, scenarios: Sequence[Scenario], repeats: range) -> list[Job]:
    """Return a job for each map and repeat."""
    return [plan.job(scenario, 0, repeat) for scenario in scenarios for repeat in repeats]


def digests(scenarios: Sequence[Scenario]) -> dict[str, str]:
    """Return the digest of each map with its task, by number and name."""
    return {f"{number} {one.name}": one.digest for number, one in enumerate(scenarios, start=1)}
