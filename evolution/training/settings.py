"""Settings of a training: the algorithm and its hyperparameters, the world, the maps, and the evaluation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, JsonValue, field_validator, model_validator

from controllers.learned import EncodingSettings
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError, refuse_unknown
from gym_mapbench.files.bundled import bundled_names, read_bundled
from gym_mapbench.files.documents import read_yaml
from gym_mapbench.generator import PeopleSettings
from gym_mapbench.quantities import Count, Fraction, Natural, NonNegative, Positive
from gym_mapbench.ros_params import overlay
from gym_mapbench.settings import Settings
from gym_mapbench.trust import refuse_code


class Stage(Settings):
    """How many obstacles the random maps have from some point of the training on; in between it changes steadily.

    Args:
        after: Share of the training's steps, 0 to 1.
        fewest: Fewest obstacles on a map.
        most: Most obstacles on a map.
    """

    after: Fraction
    fewest: Natural
    most: Natural


class ShapingSettings(Settings):
    """Reward shaping and early ends of episodes in training; the evaluation has neither.

    Args:
        proximity: Penalty per second at contact with a wall; it decreases linearly with the distance.
        reach: Distance between the robot's outline and the nearest wall in the scan at which the penalty is 0, m.
        stall_time: Seconds without progress to the goal after which an episode ends; 0 for never. A policy that stands
            still in front of obstacles learns nothing more there.
        stall: Penalty of such an end.
        people: Penalty per second at contact with a person; it decreases linearly with the distance.
        personal_space: Distance between the outlines of the robot and the nearest observed person at which that penalty
            is 0, m.
        reverse: Penalty per metre of reverse motion. With a scanner that covers 360 degrees, a policy may otherwise
            learn to drive in reverse, at a lower speed.
    """

    proximity: NonNegative = 0.0
    reach: Positive = 0.3
    people: NonNegative = 0.0
    personal_space: Positive = 1.2
    stall_time: NonNegative = 0.0
    stall: NonNegative = 0.0
    reverse: NonNegative = 0.0


class ReplaySettings(Settings):
    """Replay of the levels of a curriculum (Jiang et al., Prioritized Level Replay, 2021).

    Args:
        probability: Fraction of the episodes that replay a level; the others are on new random maps.
        capacity: Largest number of levels; the level with the lowest score makes room.
        temperature: Temperature of the ranks: small values replay the best levels only, large ones all equally.
        staleness: Weight of the staleness of a level, beside its score.
        memory: Number of latest outcomes of a level that count.
    """

    probability: Fraction = 0.5
    capacity: Count = 1000
    temperature: Positive = 0.3
    staleness: Fraction = 0.2
    memory: Count = 8


class EvaluationSettings(Settings):
    """Evaluation of the policy during training: on held-out maps, without exploration.

    Args:
        every: Steps between two evaluations; each also writes a checkpoint.
        maps: Random maps for every number of obstacles.
        obstacles: Numbers of obstacles of these maps, one or more. Of the families of ``world.family``, only
            ``shapes`` has them; others need one number.
        time_limit: Simulated seconds an episode may take.
    """

    every: Count = 500_000
    maps: Count = 100
    obstacles: tuple[Natural, ...] = (15, 30)
    time_limit: Positive = 100.0

    @field_validator("obstacles")
    @classmethod
    def _some(cls, value: tuple[int, ...]) -> tuple[int, ...]:
        if not value:
            raise ConfigError("expected at least one number, by whose maps the best model is chosen, got none")
        return value


class NetworkSettings(Settings):
    """The networks of policy and value function, apart from each other.

    Args:
        hidden: Width of every hidden layer.
        activation: Between the layers.
    """

    hidden: tuple[Count, ...] = (256, 256)
    activation: Literal["tanh", "relu", "elu"] = "tanh"


class TrainSettings(Settings):
    """One training; equal settings give the same model on the same machine.

    Args:
        algorithm: ``ppo``, ``sac`` or ``td3``.
        steps: Decisions in all worlds together.
        envs: Worlds stepped together.
        seed: Root of all randomness.
        threads: CPU threads of the networks. More than one hardly helps networks as small as these; two trainings side
            by side use two cores better.
        world: The env. One decision a control step: ``control_hz`` is the rate at which the model decides.
        encoding: How observations become the input of the networks.
        obstacles: Curriculum of the random maps; the first stage begins at 0. Of the families of ``world.family``, only
            ``shapes`` has these obstacles.
        people: The people on random maps: 0 to ``count`` of them on a map of the training, ``count`` on a held-out map.
        anywhere: Share of the random maps with start and goal anywhere, and not where the world's tasks have them.
        reuse: Episodes per random map, on average.
        shaping: Reward shaping.
        network: The networks.
        learning_rate: At the beginning and at the end; in between it changes linearly.
        action_noise: Deviation of the noise on actions by which SAC and TD3 explore; TD3 does not explore without it.
        normalize_rewards: Whether rewards are divided by the running deviation of the return (VecNormalize).
        normalize_observations: Whether the encoded observations are normalised by running statistics, too.
        hyperparameters: Further arguments of the algorithm in Stable-Baselines3, under its names.
        policy: Further arguments of its policy class, under its names.
        evaluation: Evaluation during training.
        replay: Replay of the levels of a curriculum.
    """

    algorithm: Literal["ppo", "sac", "td3"]
    steps: Count
    envs: Count = 64
    seed: Natural = 0
    threads: Count = 1
    world: EnvConfig = EnvConfig()
    encoding: EncodingSettings = EncodingSettings()
    obstacles: tuple[Stage, ...] = (Stage(after=0.0, fewest=15, most=40),)
    people: PeopleSettings = PeopleSettings()
    anywhere: Fraction = 0.0
    reuse: Annotated[float, Field(ge=1)] = 6.0
    shaping: ShapingSettings = ShapingSettings()
    network: NetworkSettings = NetworkSettings()
    learning_rate: tuple[Positive, Positive] = (3e-4, 3e-4)
    action_noise: Annotated[float, Field(ge=0, le=2)] = 0.0
    normalize_rewards: bool = False
    normalize_observations: bool = False
    hyperparameters: dict[str, JsonValue] = Field(default_factory=dict)
    policy: dict[str, JsonValue] = Field(default_factory=dict)
    evaluation: EvaluationSettings = EvaluationSettings()
    replay: ReplaySettings = ReplaySettings()

    @field_validator("obstacles")
    @classmethod
    def _in_order(cls, value: tuple[Stage, ...]) -> tuple[Stage, ...]:
        shares = [stage.after for stage in value]
        if not value or shares[0] != 0 or shares != sorted(set(shares)):
            raise ConfigError(f"expected stages that begin at 0 and follow each other, got {shares}")
        for stage in value:
            if stage.fewest > stage.most:
                raise ConfigError(f"expected at most as many fewest as most obstacles, got {stage.fewest} {stage.most}")
        return value

    @field_validator("world")
    @classmethod
    def _can_be_trained_in(cls, value: EnvConfig) -> EnvConfig:
        if value.maps is not None:
            raise ConfigError("world.maps: expected none, the maps are given apart")
        if not value.goal_ends_episode:
            raise ConfigError("world.goal_ends_episode: expected true, as success is an end at the goal, got false")
        return value

    @model_validator(mode="after")
    def _observes_what_it_encodes(self) -> Self:
        if self.world.observation != self.encoding.keys or self.world.action != "normalized":
            world = self.world.replace(observation=self.encoding.keys, action="normalized")
            object.__setattr__(self, "world", world)
        return self

    @model_validator(mode="after")
    def _sees_what_is_shaped(self) -> Self:
        if self.shaping.proximity and "scan" not in self.encoding.keys:
            raise ConfigError("shaping.proximity: expected a feature of the scan in encoding.features, got none")
        if self.shaping.people and "people" not in self.encoding.keys:
            raise ConfigError("shaping.people: expected people among encoding.features, got none")
        if self.shaping.reverse and "velocity" not in self.encoding.keys:
            raise ConfigError("shaping.reverse: expected velocity among encoding.features, got none")
        if self.shaping.stall_time and not self.world.reward.progress:
            raise ConfigError("shaping.stall_time: expected a reward for progress, by which it is noticed, got none")
        return self

    @model_validator(mode="after")
    def _explores_by_itself(self) -> Self:
        if self.action_noise and self.algorithm == "ppo":
            raise ConfigError(f"action_noise: expected 0, as ppo samples its actions, got {self.action_noise:g}")
        return self

    def seed_after(self, steps: int) -> int:
        """Return the seed of a training that goes on after some steps: another one after each number of steps.

        The samples of exploration and of the worlds' noise would otherwise be those of the first steps again.
        """
        return self.seed if steps == 0 else int(np.random.SeedSequence((self.seed, steps)).generate_state(1)[0])

    @property
    def judged_world(self) -> EnvConfig:
        """The world of the evaluation."""
        return self.world.replace(time_limit=self.evaluation.time_limit)


def algorithm_names() -> tuple[str, ...]:
    """Names of the algorithms that the package has hyperparameters for."""
    return bundled_names("evolution.training", "algorithms")


def load_algorithm(name: str) -> dict[str, Any]:
    """Return the package's settings of an algorithm: the common settings, overlaid by its own.

    Raises:
        ConfigError: If there is no such algorithm.
    """
    refuse_unknown("algorithm", name, algorithm_names())
    common = read_bundled("evolution.training", "common.yaml")
    return overlay(common, read_bundled("evolution.training", "algorithms", f"{name}.yaml"))


def train_settings(
    algorithm: str | None = None, config: Mapping[str, Any] | str | Path | None = None, **options: Any
) -> TrainSettings:
    """Return the settings of a training: the algorithm's own, overlaid by a config, then by options.

    Args:
        algorithm: Its name; None for the config's, or ``ppo``.
        config: A YAML file, or the same as a mapping: fields of :class:`TrainSettings`.
        options: Such fields; those that are None are left out.

    Raises:
        ConfigError: Naming what cannot be used.
    """
    where, document = "config", config or {}
    if isinstance(document, str | Path):
        where, document = str(document), read_yaml(document)
        refuse_code(document, where)
    if not isinstance(document, Mapping):
        raise ConfigError(f"{where}: expected a mapping of options, got {type(document).__name__}")
    named = algorithm or str(document.get("algorithm", "ppo"))
    given = {name: value for name, value in options.items() if value is not None}
    whole = overlay(overlay(load_algorithm(named), document), {**given, "algorithm": named})
    return TrainSettings.from_mapping(whole, where)
