"""Tunings without a robot."""

from __future__ import annotations

import pytest

from tests.evolution.tuning import fakes


@pytest.fixture(scope="module")
def fake_tuning():
    """Tunings of a module drive nothing."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("evolution.tuning.running.run_job", fakes.run_job)
        patch.setattr("evolution.runs.exclusive.preparation_of", lambda *_: None)
        patch.setattr("evolution.tuning.replays.drive", fakes.drive)
        yield
