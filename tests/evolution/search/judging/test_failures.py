"""Failure policies: what a failed run counts, also by a policy of one's own."""

from __future__ import annotations

import pytest

from evolution.driving import RunResult
from evolution.search.judging import FAILURES, FailurePolicy, Fitness, JudgingSettings
from gym_mapbench.errors import ConfigError, PluginError
from tests.evolution.search.test_loop import ROBUST, with_search

HERE = "tests.evolution.search.judging.test_failures"
FAILED = RunResult("collision", 12.0, 3.0)


class PathSoFar(FailurePolicy):
    """Twice the path that was driven, for any metric."""

    def value(self, run, time_limit):
        return 2.0 * run.path_length_m


class NoValue(FailurePolicy):
    excludes = True


class Stumbles(FailurePolicy):
    def value(self, run, time_limit):
        raise LookupError("nothing at hand")


class Endless(FailurePolicy):
    def value(self, run, time_limit):
        return float("nan")


class Unmade(FailurePolicy):
    def __init__(self):
        raise LookupError("no value")


def values(failures, metric="time"):
    fitness = Fitness.of(JudgingSettings(failures=failures, metric=metric), 150.0)
    return fitness.values_of(((RunResult("goal", 20.0, 5.0),), (FAILED,)))


@pytest.mark.parametrize(
    ("failures", "expected"),
    [
        ("exclude", None),
        ("censor", (20.0, 150.0)),
        ("par2", (20.0, 300.0)),
        (f"{HERE}:PathSoFar", (20.0, 6.0)),
        (f"{HERE}:NoValue", None),
    ],
)
def test_what_a_failed_run_counts(failures, expected):
    assert values(failures) == expected


def test_a_policy_may_go_with_any_metric_or_with_one():
    assert values(f"{HERE}:PathSoFar", metric="path_length") == (5.0, 6.0)
    for name in ("censor", "par2"):
        with pytest.raises(
            ConfigError, match=f"^failures: expected 'exclude' with metric 'path_length' .{name} counts"
        ):
            values(name, metric="path_length")


def test_a_policy_that_excludes_maps_goes_with_roles_and_costly_controllers_last():
    with_search(**{**ROBUST, "failures": f"{HERE}:NoValue", "fitness": "roles"})
    with pytest.raises(ConfigError, match=r"^judging\.failures: expected 'exclude' with fitness 'roles'"):
        with_search(failures=f"{HERE}:PathSoFar", fitness="roles")


def test_what_is_no_policy_is_one_line():
    with pytest.raises(ConfigError, match=r"^failures: unknown failure policy 'par3'; did you mean 'par2'\?"):
        JudgingSettings(failures="par3")
    with pytest.raises(ConfigError, match=r"expected a subclass of .*FailurePolicy, got"):
        JudgingSettings(failures=f"{HERE}:values")
    with pytest.raises(PluginError, match=r"failure policy '.*Stumbles': LookupError: nothing at hand, test_failures"):
        values(f"{HERE}:Stumbles")
    with pytest.raises(PluginError, match=r"failure policy '.*Endless': expected a finite number, got nan"):
        values(f"{HERE}:Endless")
    with pytest.raises(PluginError, match=r"failure policy '.*Unmade': LookupError: no value, test_failures"):
        values(f"{HERE}:Unmade")
    assert FAILURES.built_in == ("exclude", "censor", "par2")
