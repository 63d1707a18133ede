"""A whole study of fake runs, made once."""

from __future__ import annotations

import pytest

from evolution.studies import run_study
from tests.evolution.fake_study import ENGINE, small_study


@pytest.fixture(scope="session")
def study_path(tmp_path_factory):
    """Directory of a finished study; not to be changed."""
    path = tmp_path_factory.mktemp("study") / "small"
    run_study(small_study(), path, engine=ENGINE)
    return path
