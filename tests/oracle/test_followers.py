"""The Graceful Controller and the Rotation Shim against what Jazzy's own code recorded; Humble's were not recorded."""

from __future__ import annotations

import pytest

from tests.oracle.recordings import each_jazzy_recording
from tests.oracle.test_rpp import check_runs, each_unit_vector


@pytest.mark.parametrize(("name", "column"), [("Graceful", "graceful"), ("RotationShim", "shim")])
@each_jazzy_recording
def test_unit_vectors(recorded, name, column):
    assert len(list(each_unit_vector(recorded, name, column))) > 0


@pytest.mark.parametrize("name", ["Graceful", "RotationShim"])
@each_jazzy_recording
def test_closed_loop_runs_come_out_the_same(recorded, name):
    check_runs(recorded, name, "default", "full")
