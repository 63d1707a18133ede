"""Figures are drawn from what they say, the same to the byte."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from evolution.plots import _cliques, box_figure, critical_difference_figure, curse_figure, save_figure, spread_figure
from evolution.report.page import picture


def test_equal_figures_are_equal_files(tmp_path):
    for folder in ("a", "b"):
        figure = box_figure({"seen": {"ga": [1, 2, 3.0]}, "fresh": {"ga": [2, 3, 400.0]}}, highest=100.0)
        save_figure(figure, tmp_path / folder / "box")
    for name in ("box.png", "box.svg"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_what_is_off_the_scale_is_counted():
    (axes,) = box_figure({"seen": {"ga": [1, 2, 3.0, 20000.0], "random": [2.0]}}, highest=100.0).axes
    assert [label.get_text() for label in axes.get_xticklabels()] == ["ga\n(1 above)", "random"]
    assert axes.get_ylim()[1] < 100


def test_spread_is_mean_and_standard_deviation():
    table = np.array([[3.0, 1.0], [5.0, 1.0]])
    (axes,) = spread_figure({"ga": ([10, 20], table), "path": ([20], [[2.0], [4.0]])}, highest=100.0).axes
    assert axes.lines[0].get_ydata().tolist() == [4.0, 1.0]
    band = axes.collections[0].get_paths()[0].vertices
    assert (band[:, 1].min(), band[:, 1].max()) == (1.0, 5.0)
    assert axes.get_legend().get_texts()[0].get_text() == "ga (n = 2)"


def test_the_line_of_no_luck_goes_through_the_points():
    (axes,) = curse_figure({"ga": ([-8, -7.0], [-6, -7.0]), "none": ([20000.0], [1.0])}, highest=100.0).axes
    assert axes.lines[-1].get_xdata().tolist() == axes.lines[-1].get_ydata().tolist() == [-8.0, -6.0]


def test_cliques_by_hand():
    # 1.0 and 1.8 are closer than 1, so are 1.8 and 2.5, and all of 2.5 to 3.4; 5.0 stands alone.
    assert _cliques(np.array([1.0, 1.8, 2.5, 3.0, 3.4, 5.0]), 1.0) == [(1.0, 1.8), (1.8, 2.5), (2.5, 3.4)]
    assert _cliques(np.array([1.0, 3.0]), 1.0) == []
    (axes,) = critical_difference_figure(["a", "b"], [1.2, 1.8], 1.0).axes
    assert "1.00" in axes.get_title()


def test_pictures_shrink_and_keep_their_colours():
    figure = spread_figure({name: ([1, 2], [[i, i + 1.0]]) for i, name in enumerate("abcdefg")})
    content = io.BytesIO()
    figure.savefig(content, format="png")
    small = picture("a", content.getvalue())
    assert len(small.content) < 0.6 * len(content.getvalue())
    before, after = (
        np.asarray(Image.open(io.BytesIO(c)).convert("RGB"), dtype=int) for c in (content.getvalue(), small.content)
    )
    assert np.abs(before - after).mean() < 2.0
    with pytest.raises(OSError, match="cannot identify"):
        picture("a", b"no picture")
