"""The path handler and the controllers but MPPI against what Lyrical's own code recorded, single calls."""

from __future__ import annotations

import pytest

from evolution.validation import Oracle
from evolution.validation.units import dwb_measures, dynamic_window_measures, local_plan_measures, other_measures
from tests.oracle_data import LYRICAL_ORACLE, needs_lyrical_oracle

pytestmark = needs_lyrical_oracle


@pytest.fixture(scope="module")
def oracle():
    return Oracle(LYRICAL_ORACLE)


@pytest.mark.parametrize("take", [local_plan_measures, dynamic_window_measures, dwb_measures])
def test_single_calls(oracle, take):
    measures = take(oracle)
    assert measures
    assert all(measure.count == 100 for measure in measures)
    assert not [measure for measure in measures if measure.missed]


def test_the_shim_is_the_recorded_one_but_for_the_recorders_integer_bearing(oracle):
    graceful, shim, nav2s = other_measures(oracle)
    assert graceful.value < 1e-7
    # With the bearing cut off to an integer all commands are the recorded ones; with Nav2's own comparison those at
    # bearings between 0.785 and 1 rad, of which there are 5, are not.
    assert (shim.key, shim.count, shim.missed) == ("shim_cmd_abs_err_max", 100, False)
    assert nav2s.value == pytest.approx(0.95)
