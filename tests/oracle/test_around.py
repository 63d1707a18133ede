"""What Nav2 does around its controllers: our tree, servers, behaviours and smoother replay the recordings."""

from __future__ import annotations

import pytest

from evolution.validation import AroundOracle, around_measures
from evolution.validation.around.tree import TreeReplay
from tests.controllers.trees import default_xml
from tests.oracle_data import AROUND_ORACLE, needs_around_oracle

pytestmark = needs_around_oracle
EXACT = {
    "tree_events_identical": 1.0,
    "tree_end_time_err_ms_max": 0.0,
    "costmap_wait_end_time_err_s_median": 0.0,
    "behavior_commands_identical": 1.0,
    "controller_server_identical": 1.0,
    "smoother_identical": 1.0,
}


def test_everything_recorded_is_replayed_exactly():
    measures = around_measures(AroundOracle(AROUND_ORACLE))
    assert {one.key: one.value for one in measures} == EXACT
    assert min(one.count for one in measures) > 40


@pytest.mark.parametrize("release", ["humble", "jazzy"])
def test_the_default_tree_read_from_its_xml_does_what_nav2_did(release):
    scenarios = AroundOracle(AROUND_ORACLE).tree(release).scenarios
    assert len(scenarios) > 20
    for scenario in scenarios:
        ours, read = TreeReplay(scenario, release), TreeReplay(scenario, release, default_xml(release))
        assert (read.run().events, read.runs) == (ours.run().events, ours.runs), scenario["id"]
