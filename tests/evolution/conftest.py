"""A whole study of fake runs, made once."""

from __future__ import annotations

import pytest

from evolution.studies import run_study
from tests.evolution.fake_study import small_study, use_fakes


@pytest.fixture(scope="session")
def study_path(tmp_path_factory):
    """Directory of a finished study; not to be changed."""
    path = tmp_path_factory.mktemp("study") / "small"
    with pytest.MonkeyPatch.context() as patch:
        use_fakes(patch)
        run_study(small_study(), path)
    return path


@pytest.fixture(scope="module")
def fake_driving():
    """Studies and pages drive nothing in the tests of a module."""
    with pytest.MonkeyPatch.context() as patch:
        use_fakes(patch)
        yield
