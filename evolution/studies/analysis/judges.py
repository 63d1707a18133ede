"""Judges: groups of configurations with comparable fitness, and the meaning of its values."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from evolution.files import counted, differences
from evolution.runs import RecordedExperiment
from evolution.search import EvolveSettings, short_names
from evolution.studies.analysis.results import StudyResults, StudyRun
from evolution.studies.settings import JUDGES

Groups = dict[str, list[StudyRun]]
NAMED_DIFFERENCES = 3


@dataclass(frozen=True)
class Judge:
    """Configurations with the same options of the fitness, controllers and world, so that their fitness is comparable.

    Args:
        name: The fitness in words.
        groups: The runs of each configuration.
        scales: The cluster scales of the runs, ascending; none for Gini, and more than one where every
            run calibrated its own: such values are on different scales and cannot be compared.
    """

    name: str
    groups: Groups
    scales: tuple[float, ...]

    @property
    def comparable(self) -> bool:
        """Whether all values are on one scale."""
        return len(self.scales) < 2

    @property
    def runs(self) -> list[StudyRun]:
        """All runs."""
        return [run for runs in self.groups.values() for run in runs]

    @property
    def experiment(self) -> RecordedExperiment:
        """Experiment of the first run; all others have the same fitness."""
        return self.runs[0].experiment

    @property
    def meaning(self) -> str:
        """Meaning of a fitness value, in words (thesis, Eq. 4.5)."""
        search, controllers = self.experiment.search, len(self.experiment.controllers)
        pattern, judging = search.judging.pattern, search.judging
        drives = search.maps_per_set * controllers
        drive = counted(controllers, "controller drives", "controllers drive")
        once = f"{drive} {counted(search.maps_per_set, 'map')}"
        words = (
            f"What the {self.name} means: lower is better. A set gains up to {judging.pattern_weight:g} for maps whose "
            f"{pattern.wanted}; a failed run costs its share of {judging.base_cost:g} "
            f"({judging.base_cost / drives:.1f} if {once} once), a "
            f"timeout {judging.timeout_cost:g} more, so {judging.base_cost:g} to "
            f"{judging.base_cost + judging.timeout_cost * drives:g} is a set on which every run failed"
        )
        if pattern.nothing >= 0:
            return f"{words}."
        return (
            f"{words}; a set without a pattern (fewer than two maps with a value, or two with the same score) costs "
            f"{-pattern.nothing * judging.pattern_weight:g} times its success rate (thesis, Alg. 2)."
        )


def judges_of(results: StudyResults) -> list[Judge]:
    """Return the configurations that have runs, in groups with the same fitness."""
    groups: dict[str, Groups] = {}
    for name, runs in results.by_configuration.items():
        groups.setdefault(repr(_decisive(runs)), {})[name] = runs
    found = list(groups.values())
    names = _names([next(iter(group.values())) for group in found])
    return [
        Judge(name, group, _scales(itertools.chain(*group.values()))) for name, group in zip(names, found, strict=True)
    ]


def name_of(search: EvolveSettings, scales: Sequence[float] = ()) -> str:
    """Return the options of a fitness in words; options at their defaults are left out.

    Args:
        search: The options.
        scales: Cluster scales that its runs recorded.
    """
    used, usual = (short_names(one.model_dump()) for one in (search, EvolveSettings()))
    options = [name for name in JUDGES[1:] if name != "cluster_scale" and used[name] != usual[name]]
    words = [f"{name} {_short(used[name])}" for name in options]
    if len(scales) == 1:
        words.append(f"cluster_scale {_short(scales[0])}")
    elif scales:
        words.append("cluster_scale calibrated by every search")
    return f"{search.judging.fitness} fitness" + (f" ({', '.join(words)})" if words else "")


def _decisive(runs: Sequence[StudyRun]) -> dict[str, Any]:
    """Return everything that defines the fitness of these runs."""
    experiment = runs[0].experiment
    document, scales = experiment.document(), _scales(runs)
    search = short_names(document["search"])
    judging = {name: search[name] for name in JUDGES if name != "cluster_scale"}
    return {
        **judging,
        "cluster_scale": scales if len(scales) < 2 else "different",
        "fresh_noise": runs[0].configuration.fresh_noise,
        "controllers": ", ".join(experiment.names),
        "controller": {spec["name"]: spec for spec in document["controllers"]},
        **document["run"],
    }


def _scales(runs: Iterable[StudyRun]) -> tuple[float, ...]:
    found = {run.best_results["cluster_scale"] for run in runs}
    return tuple(sorted(scale for scale in found if scale is not None))


def _names(firsts: Sequence[Sequence[StudyRun]]) -> list[str]:
    """Return a name for each judge; where the fitness is the same, world and controllers tell them apart."""
    plain = [name_of(runs[0].experiment.search, _scales(runs)) for runs in firsts]
    names: list[str] = []
    for place, runs in enumerate(firsts):
        others = [other for at, other in enumerate(firsts) if plain[at] == plain[place] and at != place]
        apart = [list(differences(_decisive(other), _decisive(runs))) for other in others]
        options = {name: now for changed in apart for name, was, now in changed if not isinstance(was or now, dict)}
        words = [f"{name} {_short(value)}" for name, value in options.items()]
        shown = [*words[:NAMED_DIFFERENCES], *(["..."] if len(words) > NAMED_DIFFERENCES else [])]
        name = f"{plain[place]}, {', '.join(shown)}" if shown else plain[place]
        names.append(f"{name}, {place + 1}" if name in names else name)
    return names


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
