"""Settings of a study: its configurations, seeds and budget, read from YAML."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, JsonValue, field_validator, model_validator

from evolution.files import warn_of_versions
from evolution.search import SECTIONS, nested, nested_document, short_names
from gym_mapbench.errors import ConfigError, refuse_unknown, unknown_name
from gym_mapbench.files.bundled import bundled_names, read_bundled
from gym_mapbench.files.documents import read_yaml
from gym_mapbench.generator import Cellular
from gym_mapbench.quantities import Count, Few
from gym_mapbench.ros_params import overlay
from gym_mapbench.settings import Settings
from gym_mapbench.trust import refuse_code


def _file_name(name: str) -> str:
    """Refuse a name that cannot be a file name on every system."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,59}", name):
        raise ConfigError(f"expected up to 60 letters, digits and '_', '-', '.', got {name!r:.80}")
    return name


Name = Annotated[str, AfterValidator(_file_name)]
Method = Literal["ga", "random", "cellular", "path_length", "best_triple", "again"]
Document = dict[str, JsonValue]

LATER = ("best_triple", "again")
"""Methods without a search: they select from the results of another configuration."""

SEARCHES = ("ga", "random", "cellular")
"""Methods that run the controllers on all sampled maps."""
JUDGES = (
    "fitness",
    "metric",
    "aggregate",
    "failures",
    "maps_per_set",
    "cluster_scale",
    "base_cost",
    "timeout_cost",
    "pattern_weight",
    "unevenness_weight",
    "epsilon",
    "timeout_outcomes",
)
"""Options of a search that define its fitness."""
SAID_ELSEWHERE = {
    "evaluations": "the study's budget says how many map sets are evaluated",
    "algorithm": "the method of a configuration says it",
}
"""Options of a search that the experiment of a whole study cannot have, and what says it instead."""
MAX_SEED = 2**31


class Configuration(Settings):
    """One way to find maps, run with every seed of the study.

    Args:
        name: Its name in every table and figure.
        method: ``ga``: the search of the thesis; ``random``: sampling only; ``cellular``: maps of the family
            ``cellular``, BARN's automaton (sampling only, unless ``experiment.search.algorithm`` is ``ga``);
            ``path_length``: a GA whose fitness is the length of the global path; ``best_triple``: the exact best set
            of all maps of the configuration ``of``; ``again``: the best set of the configuration ``of``, to re-evaluate
            it in another world.
        runs: Seeds it is run with, the first of the study's; all of them if None.
        experiment: Differences from the study's experiment: sections ``search``, ``controllers``, ``run``.
        of: Configuration from whose maps ``best_triple`` selects, or whose best set ``again`` re-evaluates.
        fresh_noise: Noise of the re-evaluation; if None, that of the study's.
        pop_size_from: Earlier configurations; the population size of the one with the best mean fitness is used.
        cluster_scale_from: Earlier configurations; the cluster scale is the median gap over their driven maps.
        cellular: Options of the family ``cellular``.
    """

    name: Name
    method: Method = "ga"
    runs: Count | None = None
    experiment: Document = Field(default_factory=dict)
    of: str | None = None
    fresh_noise: str | Document | None = None
    pop_size_from: tuple[str, ...] = ()
    cluster_scale_from: tuple[str, ...] = ()
    cellular: Cellular = Cellular()

    @field_validator("experiment")
    @classmethod
    def _sections(cls, value: Document) -> Document:
        return checked_sections(value)

    @model_validator(mode="after")
    def _consistent(self) -> Configuration:
        if (self.method in LATER) != (self.of is not None):
            raise ConfigError(f"of: expected with method {' or '.join(LATER)} and with no other, got {self.of!r}")
        if self.method in LATER:
            self._check_judging_only()
        if self.method in ("ga", "random") and "algorithm" in search_of(self.experiment):
            raise ConfigError(f"experiment.search.ga.algorithm: expected none beside method {self.method}")
        return self

    def _check_judging_only(self) -> None:
        """Refuse options beyond the fitness: recorded runs can be judged by another fitness, but not repeated."""
        other = [name for name in self.experiment if name != "search"]
        other += [f"search.{name}" for name in search_of(self.experiment) if name not in JUDGES]
        if other or self.pop_size_from:
            what = f"experiment.{other[0]}" if other else "pop_size_from"
            raise ConfigError(f"{what}: {self.method} judges recorded runs; expected only {', '.join(JUDGES)}")

    @property
    def sampled(self) -> Document:
        """Options of the search that follow from the method."""
        if self.method != "cellular":
            return {}
        return {"families": [{"name": "cellular", "options": self.cellular.model_dump(mode="json")}]}

    @property
    def fixed(self) -> Document:
        """Options of the search that nothing else can set: a set that is selected or judged again is not validated."""
        anew = self.method == "again" and (search_of(self.experiment) or self.cluster_scale_from)
        return {"validation": None} if anew or self.method in ("path_length", "best_triple") else {}

    @property
    def needs(self) -> tuple[str, ...]:
        """Configurations that must be done before this one."""
        parent = () if self.of is None else (self.of,)
        return tuple(dict.fromkeys((*parent, *self.pop_size_from, *self.cluster_scale_from)))


class ReevaluationSettings(Settings):
    """Re-evaluation of the best set of every run.

    Args:
        seeds: Runs of every controller on every map, each with a seed that no search used; 0 for no re-evaluation.
        noise: Noise of these runs (``none``, ``nominal``, ``rough``, or settings); if None, that of the search.
    """

    seeds: Annotated[int, Field(ge=0, le=10_000)] = 10
    noise: str | Document | None = "nominal"


class StudySettings(Settings):
    """All options of a study.

    Args:
        name: Name of the study.
        runs: Runs of every configuration; all configurations have the same seeds.
        first_seed: Seed of the first run; the others follow.
        budget: Map sets evaluated in each run, unless a configuration says otherwise.
        experiment: Options that all configurations share: sections ``search``, ``controllers``, ``run``.
        configurations: The configurations that are compared, in order; each may build on those before it.
        reevaluation: Re-evaluation of the best sets.
    """

    name: Name
    runs: Few = 24
    first_seed: Annotated[int, Field(ge=0, lt=MAX_SEED - 10_000)] = 0
    budget: Count = 600
    experiment: Document = Field(default_factory=dict)
    configurations: tuple[Configuration, ...]
    reevaluation: ReevaluationSettings = ReevaluationSettings()

    @field_validator("experiment")
    @classmethod
    def _sections(cls, value: Document) -> Document:
        for name, instead in SAID_ELSEWHERE.items():
            if name in search_of(value):
                raise ConfigError(f"search.{name}: expected none for the whole study; {instead}")
        return checked_sections(value)

    @model_validator(mode="after")
    def _consistent(self) -> StudySettings:
        if not self.configurations:
            raise ConfigError("configurations: expected at least one, got none")
        earlier: dict[str, Configuration] = {}
        for configuration in self.configurations:
            if configuration.name in earlier:
                raise ConfigError(f"configurations: expected different names, got {configuration.name!r} twice")
            _check_needs(configuration, earlier)
            _check_runs(configuration, earlier, self.runs)
            earlier[configuration.name] = configuration
        return self

    @property
    def seeds(self) -> range:
        """Seeds of the configurations' runs, all that there are."""
        return range(self.first_seed, self.first_seed + self.runs)

    def seeds_of(self, configuration: Configuration) -> range:
        """Return the seeds of one configuration's runs."""
        return self.seeds[: configuration.runs]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the configurations, in order."""
        return tuple(configuration.name for configuration in self.configurations)

    def reevaluation_noise(self, configuration: Configuration) -> str | Document | None:
        """Return the noise of the re-evaluation of a configuration; None for the noise of the search."""
        return self.reevaluation.noise if configuration.fresh_noise is None else configuration.fresh_noise

    def configuration(self, name: str) -> Configuration:
        """Return a configuration by name.

        Raises:
            ConfigError: If there is none of that name.
        """
        for configuration in self.configurations:
            if configuration.name == name:
                return configuration
        raise unknown_name("configuration", name, self.names)

    def document(self, configuration: Configuration, seed: int, taken: Mapping[str, Document]) -> dict[str, Any]:
        """Return the experiment of one run.

        Args:
            configuration: One of the study's.
            seed: Seed of the run.
            taken: By configuration, the options of its search that were taken from earlier ones.
        """
        if configuration.of is None:
            algorithm = "random" if configuration.method in ("random", "cellular") else "ga"
            sampled = nested({"evaluations": self.budget, "algorithm": algorithm, **configuration.sampled})
            below = overlay(self.experiment, {"search": sampled})
        else:
            below = self.document(self.configuration(configuration.of), seed, taken)
        search = nested({**taken.get(configuration.name, {}), **configuration.fixed, "seed": seed})
        return overlay(overlay(below, configuration.experiment), {"search": search})


def checked_sections(document: Document) -> Document:
    """Refuse unknown sections of an experiment, a world that is none, and a seed: the study has its own."""
    for name in document:
        refuse_unknown("section", name, SECTIONS)
    if not isinstance(run := document.get("run", {}), Mapping):
        raise ConfigError(f"run: expected a mapping of options, got {type(run).__name__}")
    if "seed" in search_of(document):
        raise ConfigError("search.seed: expected none; first_seed and runs of the study say which seeds are used")
    return nested_document(document)


def search_of(document: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the options of the section ``search`` by their short names, empty if there is none.

    Raises:
        ConfigError: If it is not a mapping.
    """
    search = document.get("search", {})
    if not isinstance(search, Mapping):
        raise ConfigError(f"search: expected a mapping of options, got {type(search).__name__}")
    return short_names(nested(search))


def _check_runs(configuration: Configuration, earlier: Mapping[str, Configuration], seeds: int) -> None:
    """Refuse more runs than the study has ``seeds``, or than a configuration has that it builds on.

    Raises:
        ConfigError: Naming both.
    """
    if configuration.runs is not None and configuration.runs > seeds:
        raise ConfigError(f"{configuration.name}: runs: expected at most {seeds}, as many as the study has")
    for name in configuration.needs:
        if (most := earlier[name].runs) is not None and (configuration.runs is None or configuration.runs > most):
            raise ConfigError(f"{configuration.name}: runs: expected at most {most}, as many as {name} has")


def _check_needs(configuration: Configuration, earlier: Mapping[str, Configuration]) -> None:
    """Refuse a configuration that builds on later ones, or on one without maps of its own."""
    for name in configuration.needs:
        if name not in earlier:
            raise ConfigError(f"{configuration.name}: {unknown_name('earlier configuration', name, earlier)}")
    driven = configuration.cluster_scale_from + (() if configuration.of is None else (configuration.of,))
    for name in driven:
        if earlier[name].method not in SEARCHES:
            raise ConfigError(f"{configuration.name}: {name} has no maps of its own")


def study_names() -> tuple[str, ...]:
    """Names of the studies that come with the package."""
    return bundled_names("evolution.studies", "definitions")


def load_study(name_or_file: str | Path) -> StudySettings:
    """Read a study by name or from a YAML file.

    Raises:
        ConfigError: If there is no such study, or it cannot be used.
    """
    return StudySettings.from_mapping(read_definition(name_or_file), str(name_or_file))


def read_definition(name_or_file: str | Path) -> Any:
    """Read the YAML of a study of the package by its name, or of a file, laid over the study that is its ``base``.

    The ``study.json`` of a study and the ``sweep.json`` of a sweep are such files, too.

    Raises:
        ConfigError: If there is none, or it names code.
        RunError: If it is a damaged ``study.json`` or ``sweep.json``.
    """
    path = Path(name_or_file)
    if str(name_or_file) in study_names():
        return read_bundled("evolution.studies", "definitions", f"{name_or_file}.yaml")
    if not path.exists() and path.suffix not in (".yaml", ".yml"):
        raise unknown_name("study", name_or_file, study_names())
    definition = read_yaml(path)
    refuse_code(definition, path)
    if isinstance(definition, Mapping) and "format" in definition:
        warn_of_versions(definition, path)
        definition = definition.get("study", definition.get("sweep"))
    try:
        return _over_base(definition)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None


def _over_base(definition: Any) -> Any:
    """Return a study laid over the study of the package that it names as its ``base``, if it does.

    Raises:
        ConfigError: If there is no such study, or an option of a search is given twice, by two names.
    """
    if not isinstance(definition, Mapping) or "base" not in definition:
        return definition
    refuse_unknown("study", definition["base"], study_names())
    own = {name: value for name, value in definition.items() if name != "base"}
    return overlay(_in_sections(read_definition(definition["base"])), _in_sections(own))


def _in_sections(definition: Mapping[str, Any]) -> dict[str, Any]:
    """Return a study with the options of the search that its configurations share in their sections."""
    experiment = definition.get("experiment")
    if not isinstance(experiment, Mapping):
        return dict(definition)
    return {**definition, "experiment": nested_document(experiment)}
