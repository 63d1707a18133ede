"""Which points of a map have room around them, and whether two points connect through such points.

The points lie on a lattice of half cells: ``[i, j]`` is ``i / 2`` cells above and ``j / 2`` cells right of the map's
lower-left corner. The nearest point of a wall to a point of the lattice is on the lattice, too, so squared distances in
half cells are whole numbers. A row of points is a row of bits, 64 to a word, so that a map of 5000 x 5000 cells takes
13 MB and one operation works on 64 points; the map's edge is a wall, and so are the bits beyond the last column.

Which points are connected is found row by row: neighbouring points of a row are a run, and runs that touch are joined
in a disjoint-set forest (Rosenfeld and Pfaltz, Sequential Operations in Digital Picture Processing, 1966).
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

NOTHING, ALL, ONE, LAST_BIT = np.uint64(0), np.uint64(2**64 - 1), np.uint64(1), np.uint64(63)

_DE_BRUIJN, _DE_BRUIJN_SHIFT = np.uint64(0x03F79D71B4CB0A89), np.uint64(58)
_PLACES = np.zeros(64, np.int64)
_PLACES[[(0x03F79D71B4CB0A89 << place) % 2**64 >> 58 for place in range(64)]] = np.arange(64)


@kernel
def wall_points(occupied):
    """Return the points on walls, ``(2 * rows + 1, words)`` uint64, of a ``(rows, cols)`` bool occupancy."""
    rows, cols = occupied.shape
    walls = np.zeros((2 * rows + 1, 2 * cols // 64 + 1), np.uint64)
    for row in range(rows):
        _mark_cells(occupied[row], walls[2 * row + 1])
    for row in range(1, rows):
        for word in range(walls.shape[1]):
            walls[2 * row, word] = walls[2 * row - 1, word] | walls[2 * row + 1, word]
    walls[0], walls[2 * rows] = ALL, ALL
    return walls


@kernel
def _mark_cells(occupied, points):
    """Mark the three points of every occupied cell in the row of points through the cells' middles, and both ends."""
    cols = len(occupied)
    carried = ONE
    for word in range(len(points)):
        first = 32 * word
        cells = NOTHING
        for col in range(first, min(first + 32, cols)):
            cells |= np.uint64(occupied[col]) << np.uint64(2 * (col - first))
        points[word] = cells | cells << ONE | cells << np.uint64(2) | carried
        carried = cells >> np.uint64(62)
    points[-1] |= ALL << np.uint64(2 * cols % 64)


@kernel
def close_row(walls, row, square, closed, spare):
    """Find which points of a row are nearer to a wall than the root of ``square``.

    What the walls of a row close is as wide as a circle of that radius is at that distance. Going away from the row,
    all that was found so far is widened by as much as the circle narrows.

    Args:
        walls: ``(points, words)`` from :func:`wall_points`.
        row: Which row of points.
        square: Square of the room that a point must have around it, half cells squared.
        closed: ``(words,)`` uint64, overwritten.
        spare: The same.

    Returns:
        ``(words,)`` uint64, one of the last two arguments.
    """
    last = len(walls) - 1
    closed[:] = NOTHING
    half, away = 0, 0
    while away * away < square:
        narrower = math.ceil(math.sqrt(square - away * away)) - 1
        if away > 0 and narrower < half:
            closed, spare = _widened(closed, half - narrower, spare)
        _add(closed, walls[max(row - away, 0)], walls[min(row + away, last)])
        half, away = narrower, away + 1
    return _widened(closed, half, spare)[0]


@kernel
def _add(closed, below, above):
    """Add the points of two rows."""
    for word in range(len(closed)):
        closed[word] |= below[word] | above[word]


@kernel
def _widened(closed, by, spare):
    """Add all points within ``by`` points of a closed one; return the array that holds them, and the other."""
    done = 0
    while done < by:
        step = min(by - done, 2 * done + 1, 63)
        _shift(closed, np.uint64(step), np.uint64(64 - step), spare)
        closed, spare = spare, closed
        done += step
    return closed, spare


@kernel
def _shift(closed, step, rest, wider):
    """Write the closed points and those that lie ``step`` to the left or right of one; both ends are closed anyway."""
    last = len(closed) - 1
    wider[0], wider[last] = closed[0] | closed[0] << step | closed[0] >> step, closed[last]
    wider[last] |= closed[last] << step | closed[last] >> step
    if last > 0:
        wider[0] |= closed[1] << rest
        wider[last] |= closed[last - 1] >> rest
    for word in range(1, last):
        own, left, right = closed[word], closed[word + 1], closed[word - 1]
        wider[word] = own | own << step | own >> step | left << rest | right >> rest


@kernel
def open_cells(walls, square, cols):
    """Return which cells' middles have room around them, ``(rows, cols)`` bool.

    Args:
        walls: ``(points, words)`` from :func:`wall_points`.
        square: Square of the room that there must be, half cells squared.
        cols: Columns of the map.
    """
    rows, words = len(walls) // 2, walls.shape[1]
    closed, spare = np.empty(words, np.uint64), np.empty(words, np.uint64)
    cells = np.empty((rows, cols), np.bool_)
    for row in range(rows):
        points = close_row(walls, 2 * row + 1, square, closed, spare)
        for col in range(cols):
            point = 2 * col + 1
            cells[row, col] = not points[point // 64] >> np.uint64(point % 64) & ONE
    return cells


@kernel
def ends_are_open(walls, square, ends):
    """Whether two points have room around them; see :func:`joins`."""
    closed, spare = np.empty(walls.shape[1], np.uint64), np.empty(walls.shape[1], np.uint64)
    for end in range(2):
        near = close_row(walls, ends[end, 0], square, closed, spare)
        if near[ends[end, 1] // 64] >> np.uint64(ends[end, 1] % 64) & ONE:
            return False
    return True


@kernel
def joins(walls, square, ends):
    """Whether two points connect through points that have room around them, each next to the one before or diagonal.

    Args:
        walls: ``(points, words)`` from :func:`wall_points`.
        square: Square of the room that every point must have, both ends included, half cells squared; 1 or more.
        ends: ``(2, 2)`` int64 row and col of the two points.
    """
    if not ends_are_open(walls, square, ends):
        return False
    points, words = walls.shape
    closed, spare = np.empty(words, np.uint64), np.empty(words, np.uint64)
    runs, before, count = np.empty((32 * words, 3), np.int32), np.empty((32 * words, 3), np.int32), 0
    parents, made = np.empty(16 * words * (points + 1), np.int32), 0
    labels = np.full(2, -1, np.int32)
    for row in range(points):
        near = close_row(walls, row, square, closed, spare)
        runs, before, count_before = before, runs, count
        count = _find_runs(near, runs)
        made = _label_runs(runs[:count], before[:count_before], parents, made)
        for end in range(2):
            if ends[end, 0] == row:
                labels[end] = _label_at(runs[:count], ends[end, 1])
        if labels.min() >= 0 and _root(parents, labels[0]) == _root(parents, labels[1]):
            return True
    return False


@kernel
def _find_runs(closed, runs):
    """Write the runs of open points of a row: the first column, and the one behind the last; return how many."""
    found, inside = 0, 0
    before = ONE
    for word in range(len(closed)):
        changes = closed[word] ^ (closed[word] << ONE | before)
        before = closed[word] >> LAST_BIT
        while changes != NOTHING:
            lowest = changes & (~changes + ONE)
            runs[found, inside] = 64 * word + _PLACES[lowest * _DE_BRUIJN >> _DE_BRUIJN_SHIFT]
            found, inside = found + inside, 1 - inside
            changes ^= lowest
    return found


@kernel
def _label_runs(runs, before, parents, made):
    """Give each run of a row the label of a run that it touches in the row before, and join those that it touches.

    Args:
        runs: ``(n, 3)`` int32 first column, column behind the last, and label, which is written.
        before: ``(m, 3)`` The same of the row before.
        parents: The disjoint-set forest of the labels, in and out.
        made: How many labels there are.

    Returns:
        How many labels there are now.
    """
    first = 0
    for run in range(len(runs)):
        while first < len(before) and before[first, 1] < runs[run, 0]:
            first += 1
        label, near = np.int32(-1), first
        while near < len(before) and before[near, 0] <= runs[run, 1]:
            label = _join(parents, label, before[near, 2])
            near += 1
        if label < 0:
            label = np.int32(made)
            parents[made] = made
            made += 1
        runs[run, 2] = label
    return made


@kernel
def _join(parents, label, other):
    """Join two sets, of which the first may be none yet; return the label of the whole."""
    other = _root(parents, other)
    if label < 0 or label == other:
        return other
    older, newer = min(label, other), max(label, other)
    parents[newer] = older
    return older


@kernel
def _root(parents, label):
    """Find the label that stands for a set; every other label on the way is hung one higher."""
    while parents[label] != label:
        parents[label] = parents[parents[label]]
        label = parents[label]
    return label


@kernel
def _label_at(runs, col):
    """Return the label of the run that a column is in."""
    for run in range(len(runs)):
        if runs[run, 0] <= col < runs[run, 1]:
            return runs[run, 2]
    return np.int32(-1)
