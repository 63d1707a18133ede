"""A whole study of fake runs, made once."""

from __future__ import annotations

import pytest
from PIL import Image

from evolution.studies import run_study
from tests.evolution.fake_study import small_study, use_fakes, use_no_workers


@pytest.fixture(scope="session")
def study_path(tmp_path_factory):
    """Directory of a finished study; not to be changed."""
    path = tmp_path_factory.mktemp("study") / "small"
    with pytest.MonkeyPatch.context() as patch:
        use_fakes(patch)
        use_no_workers(patch)
        run_study(small_study(), path)
    return path


@pytest.fixture
def blank_figures(monkeypatch):
    """Figures are made, but not rendered: each of their files is a small white picture."""

    def save(figure, path, **options):
        if path.suffix == ".png":
            Image.new("RGB", (4, 3), "white").save(path)
        else:
            path.write_text("<svg xmlns='http://www.w3.org/2000/svg'/>", encoding="utf-8")

    monkeypatch.setattr("evolution.pictures.once_rendered.OnceRenderedFigure.savefig", save)


@pytest.fixture(scope="module")
def fake_driving():
    """Studies and pages drive nothing in the tests of a module."""
    with pytest.MonkeyPatch.context() as patch:
        use_fakes(patch)
        use_no_workers(patch)
        yield
