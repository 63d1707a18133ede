"""Figures are drawn from what they say, the same to the byte."""

from __future__ import annotations

import io
import itertools

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from evolution.pictures.once_rendered import OnceRenderedFigure
from evolution.pictures.parameter_figures import sweep_figure
from evolution.pictures.plots import (
    _cliques,
    box_figure,
    convergence_figure,
    critical_difference_figure,
    curse_figure,
    effects_figure,
    spread_figure,
    times_figure,
)
from evolution.pictures.style import COLOURS, new_figure, save_figure
from evolution.pictures.tuning_figures import history_figure
from evolution.report.page import picture


def test_equal_figures_are_equal_files(tmp_path):
    for folder in ("a", "b"):
        figure = box_figure({"seen": {"ga": [1, 2, 3.0]}, "fresh": {"ga": [2, 3, 400.0]}}, highest=100.0)
        save_figure(figure, tmp_path / folder / "box")
    for name in ("box.png", "box.svg"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_a_figure_is_drawn_once_for_a_file_of_the_same_bytes(tmp_path, monkeypatch):
    def saved(folder):
        figure, axes = new_figure(columns=2)
        axes[0].plot([1, 2, 30000], [1, 3, 2], label="a long name")
        axes[0].set_ylabel("above\nand below")
        axes[1].imshow([[1, 2], [3, 4]])
        axes[1].set_title("two\nlines")
        figure.legend(loc="outside lower center")
        return [path.read_bytes() for path in save_figure(figure, tmp_path / folder / "one")]

    drawn, draw = [], Axes.draw
    monkeypatch.setattr(Axes, "draw", lambda axes, renderer: (drawn.append(axes), draw(axes, renderer)))
    once = saved("once")
    assert len(drawn) == 2 * 2
    monkeypatch.setattr(OnceRenderedFigure, "draw", Figure.draw)
    assert saved("twice") == once


def test_a_canvas_draws_a_figure_that_is_not_saved():
    figure, (axes,) = new_figure()
    axes.plot([1, 2], [1, 3], color="red")
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    red, green, _ = np.moveaxis(np.asarray(canvas.buffer_rgba())[..., :3], 2, 0)
    assert ((red > 200) & (green < 50)).any()


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_what_is_off_the_scale_is_counted():
    # 100 is a set on which every run failed: it would squeeze everything else as 20000 does.
    (axes,) = box_figure({"seen": {"ga": [1, 2, 3.0, 100.0, 20000.0], "random": [2.0]}}, highest=100.0).axes
    assert [label.get_text() for label in axes.get_xticklabels()] == ["ga\n(2 at 100 or more)", "random"]
    assert axes.get_ylim()[1] < 100


@pytest.mark.parametrize("values", [1, 2])
def test_a_single_value_is_a_point_as_a_line_needs_two(values):
    (axes,) = convergence_figure({"best": (range(values), [-0.5] * values)}).axes
    assert axes.lines[0].get_marker() == ("o" if values == 1 else "")


def test_spread_is_mean_and_standard_deviation():
    table = np.array([[3.0, 1.0], [5.0, 1.0]])
    figure = spread_figure({"ga": ([10, 20], table), "path": ([20], [[2.0], [4.0]])}, highest=100.0)
    (axes,) = figure.axes
    assert axes.lines[0].get_ydata().tolist() == [4.0, 1.0]
    band = axes.collections[0].get_paths()[0].vertices
    assert (band[:, 1].min(), band[:, 1].max()) == pytest.approx((1.0, 4.0 + np.sqrt(2)))  # as in Table 5.2: n - 1
    assert legend(figure)[0] == "ga (n = 2)"


def test_no_band_where_the_mean_is_off_the_figure():
    table = np.array([[20000.0, 100.0, 4.0, 2.0], [20000.0, 100.0, 2.0, 2.0]])
    figure = spread_figure({"ga": ([1, 2, 3, 4], table), "none": ([1, 2], [[500.0, 100.0]])}, highest=100.0)
    (axes,) = figure.axes
    assert np.isnan(axes.lines[0].get_ydata()).tolist() == [True, True, False, False]
    band = np.concatenate([path.vertices for path in axes.collections[0].get_paths()])
    assert band[:, 0].min() == 3
    assert axes.get_ylim()[1] < 10
    assert legend(figure) == ["ga (n = 2)", "none (n = 1), 100 or more"]


def test_lines_differ_when_the_colours_are_used_up():
    names = [f"n{i}" for i in range(len(COLOURS) + 2)]
    curves = {name: ([1, 2, 3], [[3.0, 2.0, 1.0]]) for name in names}
    (axes,) = spread_figure(curves, baselines={"n1", "n8"}).axes
    looks = [(line.get_color(), line.get_marker(), line.get_linestyle()) for line in axes.lines]
    assert len({(colour, marker) for colour, marker, _ in looks}) == len(names)
    assert [line for _, _, line in looks] == ["-", "--", "-", "-", "-", "-", "-", "-", "--"]
    part = spread_figure({name: curves[name] for name in names[3:5]}, names=names).axes[0]
    assert [line.get_color() for line in part.lines] == [COLOURS[3], COLOURS[4]]


def test_long_names_end_below_their_boxes():
    figure = box_figure({"seen": {f"a_configuration_with_a_long_name_{i}": [1.0, 2.0] for i in range(4)}})
    FigureCanvasAgg(figure).draw()
    (axes,) = figure.axes
    for place, label in enumerate(axes.get_xticklabels(), start=1):
        tick = axes.transData.transform((place, 0.0))[0]
        assert label.get_window_extent().x1 == pytest.approx(tick, abs=10.0)


@pytest.mark.parametrize("count", [3, 9])
def test_the_effects_of_a_world_stay_in_its_row(count):
    values = {"success": 0.5, "time_ratio": 1.0, "recoveries": 0.0}
    values |= {f"{name}_{end}": value for name, value in values.items() for end in ("low", "high")}
    rows = [{"world": world, "controller": f"c{i}", **values} for world in ("a", "b") for i in range(count)]
    axes = effects_figure(rows).axes[0]
    places = [line.get_ydata().tolist() for line in axes.lines if line.get_marker() in ("o", "s")]
    assert len(places) == count
    assert all(max(abs(one - 0.0), abs(two - 1.0)) < 0.5 for one, two in places)


@pytest.mark.parametrize("highest", [1.9, 9.0, 16.0, 120.0])
def test_labels_of_costs_do_not_overlap(highest):
    trials = [{"trial": i, "state": "complete", "cost": cost} for i, cost in enumerate((1.0, highest))]
    figure = history_figure(trials, "cost")
    FigureCanvasAgg(figure).draw()
    (axes,) = figure.axes
    boxes = [label.get_window_extent() for label in axes.yaxis.get_ticklabels(which="both") if label.get_text()]
    low, high = axes.bbox.intervaly
    shown = sorted((box.y0, box.y1) for box in boxes if low <= (box.y0 + box.y1) / 2 <= high)
    assert len(shown) > 2
    assert all(below[1] <= above[0] for below, above in itertools.pairwise(shown))


def test_counts_have_whole_ticks():
    trials = [{"trial": number, "state": "complete", "cost": 1.0 + number} for number in range(3)]
    for figure in (history_figure(trials, "cost"), convergence_figure({"ga": ([0, 1, 2], [3.0, 2.0, 1.0])})):
        assert all(float(tick).is_integer() for tick in figure.axes[0].get_xticks())


def test_times_of_many_controllers_are_told_apart():
    names = [f"c{i}" for i in range(len(COLOURS) + 2)]
    figure = times_figure({name: [[1.0, 2.0], []] for name in names}, ["map_1", "map_2"])
    (axes,) = figure.axes
    assert legend(figure) == names
    bars = [(patch.get_facecolor(), patch.get_hatch()) for patch in axes.patches]
    assert len(set(bars)) == len(bars) == len(names)


def test_what_is_off_the_scale_stands_at_the_edge():
    groups = {"ga": ([-8, -7.0], [-6, -7.0]), "none": ([20000.0, -7.0], [1.0, 100.0])}
    figure = curse_figure(groups, highest=100.0)
    (axes,) = figure.axes
    assert axes.lines[-1].get_xdata().tolist() == axes.lines[-1].get_ydata().tolist() == [-8.0, -6.0]
    assert legend(figure) == ["ga", "none (2 off the scale)"]
    above, beside = (
        line.get_xydata().tolist()
        for marker in "^>"
        for line in axes.lines
        if line.get_marker() == marker and len(line.get_xdata())
    )
    assert above == [[-7.0, pytest.approx(-5.84)]]
    assert beside == [[pytest.approx(-5.84), pytest.approx(-5.84)]]


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


@pytest.mark.parametrize("values", [[(0, 0), (0, 1), (1, 0), (1, 1)], [(0, 0), (0.3, 0.8), (0.7, 0.1), (1, 1)]])
def test_the_colours_of_a_sweep_end_at_100_percent(values):
    rows = [{"a": a, "b": b, "success": 1.0, "mean s": 20.0} for a, b in values]
    figure = sweep_figure(rows, ["a", "b"], {"a": 0, "b": 0})
    low, high = next(axes for axes in figure.axes if axes.get_label() == "<colorbar>").get_ylim()
    assert (low, high) == (0.0, 100.0)


def test_a_cell_of_a_sweep_of_three_parameters_has_the_mean_over_the_third():
    rows = [
        {"a": a, "b": b, "c": c, "success": c, "mean s": 10.0 + 20.0 * c}
        for a, b, c in itertools.product((0, 1), (0, 1), (0.0, 1.0))
    ]
    figure = sweep_figure(rows, ["a", "b", "c"], {"a": 0, "b": 0, "c": 0})
    texts = [[text.get_text() for text in axes.texts] for axes in figure.axes if axes.texts]
    assert texts == [["50"] * 4, ["20"] * 4]
