"""Figures of the numbers of runs, searches and studies, drawn from plain data.

The types of figures are those of the thesis, figures 4.3 and 5.1, 5.2 and 5.4, and some more.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evolution.pictures.style import COLOURS, HATCHES, MARKERS, RING, colour_of, count_along_x, new_figure, round_of
from evolution.runs import OUTLIER

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def convergence_figure(series: Mapping[str, tuple[ArrayLike, ArrayLike]]) -> Figure:
    """Best fitness so far over the budget, one line per run or method, or a point of one value; lower is better."""
    figure, (axes,) = new_figure()
    for name, (x, y) in series.items():
        point = "o" if np.size(x) == 1 else ""
        axes.step(x, y, where="post", color=colour_of(list(series), name), label=name, marker=point)
    count_along_x(axes, "evaluations")
    axes.set_ylabel("best fitness (lower is better)")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return figure


def learning_figure(rows: Sequence[Mapping[str, Any]], groups: Sequence[str]) -> Figure:
    """Success over the steps of a training, a line for every group of held-out maps, with 95 % intervals.

    Args:
        rows: Evaluations: ``steps``, ``success_in_training``, and for every group its success, ``_low`` and ``_high``.
        groups: Names of the groups.
    """
    figure, (axes,) = new_figure()
    steps = [row["steps"] for row in rows]
    for name in groups:
        colour = colour_of(groups, name)
        axes.plot(steps, [row[name] for row in rows], ".-", color=colour, label=name.replace("_", " "))
        low, high = ([row[f"{name}_{end}"] for row in rows] for end in ("low", "high"))
        axes.fill_between(steps, low, high, color=colour, alpha=0.15, linewidth=0)
    seen = [np.nan if row["success_in_training"] is None else row["success_in_training"] for row in rows]
    axes.plot(steps, seen, "--", color="#888888", label="in training")
    axes.set(xlabel="steps", ylabel="runs at the goal", ylim=(0.0, 1.0))
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return figure


def spread_figure(
    groups: Mapping[str, tuple[ArrayLike, ArrayLike]],
    xlabel: str = "generation",
    highest: float = np.inf,
    names: Sequence[str] = (),
    baselines: Collection[str] = (),
) -> Figure:
    """Figure 5.1: mean and standard deviation over runs of the best fitness.

    Args:
        groups: By name the ``(generations,)`` places on the x axis and the ``(runs, generations)`` fitness; a
            single generation is drawn as a point with a bar.
        xlabel: What the x axis counts.
        highest: Means of this value or more are not drawn, nor are their bands.
        names: All names, which fixes their colours; those of ``groups`` if empty.
        baselines: Names that are drawn dashed.
    """
    figure, (axes,) = new_figure(width=7.4, height=4.8)
    shown: list[NDArray[np.float64]] = []
    for name, (x, values) in groups.items():
        table = np.atleast_2d(np.asarray(values, dtype=float))
        mean, spread = table.mean(axis=0), _deviation(table)
        on = mean < highest
        look = _look(names or list(groups), name)
        label = f"{name} (n = {len(table)})" + ("" if on.any() else f", {highest:g} or more")
        if table.shape[1] == 1:
            axes.errorbar(x, np.where(on, mean, np.nan), spread, capsize=4, linestyle="", label=label, **look)
        else:
            line = "--" if name in baselines else "-"
            every = max(1, table.shape[1] // 8)
            look |= {} if round_of(names or list(groups), name) else {"marker": ""}
            axes.plot(x, np.where(on, mean, np.nan), line, markevery=every, label=label, **look)
            alpha = 0.18 if len(groups) <= 3 else 0.07  # more bands than three hide each other
            low, high = mean - spread, np.minimum(mean + spread, highest)
            axes.fill_between(np.asarray(x), low, high, where=on, color=look["color"], alpha=alpha, linewidth=0)
        shown += [edge[on] for edge in (mean - spread, np.minimum(mean + spread, highest))]
    _limit(axes, np.concatenate([*shown, []]))
    count_along_x(axes, xlabel)
    axes.set_ylabel("best fitness, mean and SD (lower is better)")
    axes.grid(alpha=0.3)
    _legend_below(figure)
    return figure


def _deviation(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sample standard deviation over the rows; none for a single row."""
    return table.std(axis=0, ddof=1) if len(table) > 1 else np.zeros(table.shape[1])


def _look(names: Sequence[str], name: str) -> dict[str, Any]:
    """Colour and marker of a name."""
    return {"color": colour_of(names, name), "marker": MARKERS[round_of(names, name)]}


def _legend_below(figure: Figure, **entries: Any) -> None:
    """Add a legend below the axes, where it covers nothing however many names there are."""
    figure.legend(loc="outside lower center", frameon=False, fontsize=8, ncols=3, **entries)


EFFECTS = {
    "success": ("runs at the goal", None),
    "time_ratio": ("time / time in the first world", 1.0),
    "recoveries": ("recoveries a run", 0.0),
}
"""Quantities of a sweep: the label of the axis, and the value that means no effect, if there is one."""


def effects_figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Success, time and recoveries of every controller in every world of a sweep, with 95 % intervals.

    Args:
        rows: One per world and controller, with ``world``, ``controller``, each quantity of :data:`EFFECTS`, and the
            ends of its interval under the quantity's name with ``_low`` and ``_high``.
    """
    worlds = list(dict.fromkeys(row["world"] for row in rows))
    names = list(dict.fromkeys(row["controller"] for row in rows))
    step = min(0.2, 0.8 / len(names))
    height = 1.3 + max(0.42, 0.1 * len(names)) * len(worlds)
    figure, panels = new_figure(len(EFFECTS), width=3.7 * len(EFFECTS), height=height, sharey=True)
    for axes, (quantity, (label, neutral)) in zip(panels, EFFECTS.items(), strict=True):
        for place, name in enumerate(names):
            own = [row for row in rows if row["controller"] == name]
            at = [worlds.index(row["world"]) + step * (place - (len(names) - 1) / 2) for row in own]
            _intervals(axes, own, quantity, at, **_look(names, name), label=name)
        if neutral is not None:
            axes.axvline(neutral, color="#999999", linewidth=0.8, zorder=0)
        axes.set_xlabel(label)
        axes.grid(axis="y", color="#eeeeee")
    panels[0].set_yticks(range(len(worlds)), worlds)
    panels[0].invert_yaxis()
    _legend_below(figure, handles=panels[0].get_legend_handles_labels()[0])
    return figure


def _intervals(axes: Axes, rows: Sequence[Mapping[str, Any]], quantity: str, at: Sequence[float], **look: Any) -> None:
    """Draw one quantity of some rows along x, with its intervals where there are any."""
    values = np.array([row[quantity] for row in rows], dtype=float)
    low, high = (np.array([row[f"{quantity}_{end}"] for row in rows], dtype=float) for end in ("low", "high"))
    reach = np.nan_to_num(np.maximum([values - low, high - values], 0.0))
    axes.errorbar(values, at, xerr=reach, linestyle="none", markersize=5, elinewidth=1.2, capsize=2, **look)


def box_figure(panels: Mapping[str, Mapping[str, ArrayLike]], highest: float = np.inf) -> Figure:
    """Figure 5.2: box plots of one number per run, the single runs drawn on them.

    Args:
        panels: By title, the groups of one panel: by name, one number per run.
        highest: Numbers of this value or more are not drawn but counted below the name.
    """
    widest = max(map(len, panels.values()))
    figure, columns = new_figure(len(panels), width=(1.3 + 0.75 * widest) * len(panels), height=4.8, sharey=True)
    for axes, (title, groups) in zip(columns, panels.items(), strict=True):
        whole = [np.asarray(group, dtype=float) for group in groups.values()]
        values = [group[group < highest] for group in whole]
        labels = [
            name if len(kept) == len(group) else f"{name}\n({len(group) - len(kept)} at {highest:g} or more)"
            for name, kept, group in zip(groups, values, whole, strict=True)
        ]
        axes.boxplot(values, tick_labels=labels, widths=0.5, medianprops={"color": COLOURS[1]}, showfliers=False)
        for position, group in enumerate(values, start=1):
            offsets = np.linspace(-0.14, 0.14, len(group)) if len(group) > 1 else np.zeros(len(group))
            axes.plot(position + offsets, group, ".", color=COLOURS[0], alpha=0.6)
        axes.set_title(title, fontsize=10)
        for label in axes.get_xticklabels():  # a name ends below its box, however long it is
            label.set(rotation=35, ha="right", rotation_mode="anchor")
        axes.grid(axis="y", alpha=0.3)
    columns[0].set_ylabel("fitness (lower is better)")
    return figure


def curse_figure(
    groups: Mapping[str, tuple[ArrayLike, ArrayLike]], highest: float = np.inf, names: Sequence[str] = ()
) -> Figure:
    """Held-out fitness over the reported fitness; above the line: worse than reported.

    Args:
        groups: By name, the ``(runs,)`` reported fitness and the held-out fitness.
        highest: Runs with a value of this or more are drawn as triangles at the edge and counted in the legend.
        names: All names, which fixes their colours; those of ``groups`` if empty.
    """
    figure, (axes,) = new_figure(width=6.2, height=5.8)
    points = {name: np.column_stack([np.asarray(one, dtype=float) for one in pair]) for name, pair in groups.items()}
    on = {name: (of_name < highest).all(axis=1) for name, of_name in points.items()}
    drawn = np.concatenate([*[points[name][on[name]] for name in points], np.empty((0, 2))])
    low, high = (drawn.min(), drawn.max()) if len(drawn) else (0.0, 1.0)
    edge = high + 0.08 * ((high - low) or 1.0)
    for name, of_name in points.items():
        look, off = _look(names or list(groups), name), of_name[~on[name]]
        label = f"{name} ({len(off)} off the scale)" if len(off) else name
        axes.plot(*of_name[on[name]].T, linestyle="", alpha=0.75, label=label, **look)
        for marker, beyond in (("^", off[:, 1] >= highest), (">", off[:, 1] < highest)):
            axes.plot(*np.minimum(off[beyond], edge).T, linestyle="", color=look["color"], marker=marker, alpha=0.75)
    axes.plot([low, high], [low, high], color="#888888", linewidth=1, linestyle="--")
    axes.set(xlabel="reported fitness (seeds of the search)", ylabel="median held-out fitness")
    axes.grid(alpha=0.3)
    _legend_below(figure)
    return figure


def critical_difference_figure(names: Sequence[str], ranks: ArrayLike, difference: float) -> Figure:
    """Mean ranks on a line, 1 is best; bars join ranks that do not differ significantly (Demsar 2006)."""
    values = np.asarray(ranks, dtype=float)
    order = np.argsort(values, kind="stable")
    figure, (axes,) = new_figure(width=7.2, height=1.6 + 0.34 * len(names))
    for level, place in enumerate(order, start=1):
        axes.plot([values[place]] * 2, [0, -level], color="#666666", linewidth=1)
        axes.plot([values[place], len(names) + 0.3], [-level, -level], color="#666666", linewidth=1)
        axes.text(len(names) + 0.35, -level, f"{names[place]} ({values[place]:.2f})", va="center", fontsize=9)
    for level, (low, high) in enumerate(_cliques(values[order], difference)):
        axes.plot([low, high], [0.35 + 0.25 * level] * 2, color=COLOURS[0], linewidth=4, solid_capstyle="round")
    axes.axhline(0, color="#222222", linewidth=1.2)
    axes.set(xlim=(0.8, len(names) + 0.3), xticks=range(1, len(names) + 1))
    axes.xaxis.set_ticks_position("top")
    axes.set_yticks([])
    axes.spines[:].set_visible(False)
    axes.set_title(f"mean rank over the seeds; ranks closer than {difference:.2f} cannot be told apart", fontsize=10)
    return figure


def _cliques(ranks: NDArray[np.float64], difference: float) -> list[tuple[float, float]]:
    """Return the longest runs of ascending ranks that are closer than the critical difference."""
    ends = [int(np.searchsorted(ranks, rank + difference)) - 1 for rank in ranks]
    return [
        (float(ranks[start]), float(ranks[end]))
        for start, end in enumerate(ends)
        if end > start and (start == 0 or ends[start - 1] < end)
    ]


def _limit(axes: Axes, values: NDArray[np.float64]) -> None:
    """Fit the y axis to some values, with a margin."""
    if len(values):
        air = 0.05 * float(np.ptp(values)) or 1.0
        axes.set_ylim(float(values.min()) - air, float(values.max()) + air)


def lorenz_figure(times: Sequence[ArrayLike], titles: Sequence[str]) -> Figure:
    """Figure 4.3: Lorenz curve of the controllers' times on each map; the further from the diagonal, the less alike."""
    figure, (axes,) = new_figure(width=4.8, height=4.6)
    axes.plot([0, 1], [0, 1], color="#888888", linewidth=1, linestyle="--")
    for values, title in zip(times, titles, strict=True):
        ordered = np.sort(np.asarray(values, dtype=float))
        share = np.concatenate([[0.0], np.cumsum(ordered) / ordered.sum()])
        axes.plot(np.linspace(0, 1, len(share)), share, linestyle="-", label=title, **_look(titles, title))
    axes.set(xlabel="share of controllers", ylabel="share of travel time")
    axes.legend(frameon=False)
    return figure


def times_figure(times: Mapping[str, Sequence[ArrayLike]], maps: Sequence[str]) -> Figure:
    """Travel times per map and controller: every run a dot, the median a bar, every outlier in a ring."""
    names = list(times)
    figure, (axes,) = new_figure(width=max(1.9, 0.3 * len(names)) * len(maps) + 2.2)
    width = 0.8 / len(names)
    for position, name in enumerate(names):
        for column, values in enumerate(times[name]):
            runs = np.asarray(values, dtype=float)
            if len(runs) == 0:
                continue
            x, median = column + (position - (len(names) - 1) / 2) * width, np.median(runs)
            axes.bar(x, median, width * 0.9, **_filling(names, name))
            axes.plot(np.full(len(runs), x), runs, ".", color="#222222", markersize=4)
            outliers = runs[runs > OUTLIER * median]
            axes.plot(np.full(len(outliers), x), outliers, **RING)
    axes.set_xticks(range(len(maps)), maps)
    axes.set_ylabel("travel time, s")
    _legend_below(figure, handles=[_patch(names, name) for name in names])
    return figure


def _filling(names: Sequence[str], name: str) -> dict[str, Any]:
    """Colour and hatch of a name's bars."""
    hatch = HATCHES[round_of(names, name)]
    return {"facecolor": colour_of(names, name), "edgecolor": "#ffffff", "hatch": hatch, "alpha": 0.55}


def _patch(names: Sequence[str], name: str) -> Any:
    from matplotlib.patches import Patch

    return Patch(label=name, **_filling(names, name))
