"""Distances on a grid: straight to the nearest occupied cell, and around obstacles from one cell.

Sources: Felzenszwalb and Huttenlocher, Distance Transforms of Sampled Functions (2012), for the first;
for the second Dial, Algorithm 360 (1969): with no step shorter than 1, cells whose distances have the same whole
part cannot shorten each other, so they may be worked off in any order.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

DIAGONAL = math.sqrt(2.0)
BLOCKED = -1.0


@kernel
def squared_distance(occupied):
    """Exact squared distance ``(rows, cols)`` float64, cells^2, to the nearest occupied cell's centre; inf if none."""
    rows, cols = occupied.shape
    squared = _squared_along_columns(occupied)
    vertex, border, parabola = np.empty(cols, np.int64), np.empty(cols + 1), np.empty(cols)
    for row in range(rows):
        for col in range(cols):
            parabola[col] = squared[row, col]
        count = _lower_envelope(parabola, vertex, border)
        if count > 0:
            _read_envelope(parabola, vertex, border, squared[row])
    return squared


@kernel
def _squared_along_columns(occupied):
    """Squared distance ``(rows, cols)`` float64 to the nearest occupied cell of the same column."""
    rows, cols = occupied.shape
    distance = np.full((rows, cols), np.inf)
    for row in range(rows):
        for col in range(cols):
            if occupied[row, col]:
                distance[row, col] = 0.0
            elif row > 0:
                distance[row, col] = distance[row - 1, col] + 1.0
    for row in range(rows - 2, -1, -1):
        for col in range(cols):
            distance[row, col] = min(distance[row, col], distance[row + 1, col] + 1.0)
    return distance * distance


@kernel
def _lower_envelope(height, vertex, border):
    """Find which parabolas of a row lie lowest, and from where on; return how many do."""
    count = 0
    for col in range(len(height)):
        if height[col] == np.inf:
            continue
        start = -np.inf
        while count > 0:
            before = vertex[count - 1]
            start = (height[col] - height[before] + col * col - before * before) / (2.0 * (col - before))
            if start > border[count - 1]:
                break
            count -= 1
        if count == 0:
            start = -np.inf
        vertex[count], border[count] = col, start
        count += 1
    border[count] = np.inf
    return count


@kernel
def _read_envelope(height, vertex, border, squared):
    """Write the lowest parabola's value of every column."""
    k = 0
    for col in range(len(squared)):
        while border[k + 1] < col:
            k += 1
        squared[col] = height[vertex[k]] + (col - vertex[k]) * (col - vertex[k])


@kernel
def within(occupied, radius):
    """Whether an occupied cell's centre is at most ``radius`` (cells) from a cell's, ``(rows, cols)`` bool.

    Row by row of the disc: for small radii far quicker than :func:`squared_distance`, with the same result.
    """
    rows, cols = occupied.shape
    reach = int(radius)
    along = _distance_along_rows(occupied, reach + 1)
    near = np.zeros((rows, cols), np.bool_)
    for offset in range(-reach, reach + 1):
        half = 0
        while (half + 1) * (half + 1) + offset * offset <= radius * radius:
            half += 1
        for row in range(max(0, -offset), min(rows, rows - offset)):
            mark_below(along[row + offset], np.int32(half), near[row])
    return near


@kernel
def mark_below(values, most, marked):
    """Mark where values are at most ``most``; a function of rows, for then it is vectorised."""
    for i in range(len(values)):
        marked[i] |= values[i] <= most


@kernel
def _distance_along_rows(occupied, most):
    """Distance ``(rows, cols)`` int32, at most ``most``, to the nearest occupied cell of the same row, cells."""
    rows, cols = occupied.shape
    distance = np.empty((rows, cols), np.int32)
    for row in range(rows):
        run = most
        for col in range(cols):
            run = 0 if occupied[row, col] else min(run + 1, most)
            distance[row, col] = run
        for col in range(cols - 1, -1, -1):
            run = min(run + 1, most, distance[row, col])
            distance[row, col] = run
    return distance


@kernel
def geodesic_distance(blocked, row, col):
    """Length ``(rows, cols)`` float64, cells, of the shortest 8-connected path from one cell; inf where there is none.

    A diagonal step needs both cells beside it free. From a blocked cell nothing is reached but the cell itself.
    """
    rows, cols = blocked.shape
    framed = np.ones((rows + 2, cols + 2), np.bool_)
    for r in range(rows):
        for c in range(cols):
            framed[r + 1, c + 1] = blocked[r, c]
    distance = framed_distance(framed, row + 1, col + 1)
    reached = np.empty((rows, cols))
    for r in range(rows):
        for c in range(cols):
            length = distance[r + 1, c + 1]
            reached[r, c] = np.inf if length == BLOCKED else length
    return reached


@kernel
def framed_distance(blocked, row, col):
    """What :func:`geodesic_distance` returns, of a grid in a frame of blocked cells; blocked cells hold BLOCKED.

    The frame makes bounds checks unnecessary. A large grid takes no more memory than this one array.
    """
    rows, cols = blocked.shape
    distance = np.empty((rows, cols))
    for r in range(rows):
        for c in range(cols):
            distance[r, c] = BLOCKED if blocked[r, c] else np.inf
    distance[row, col] = 0.0
    if not blocked[row, col]:
        _spread(distance.ravel(), cols, row * cols + col)
    return distance


@kernel
def distance_along_columns(occupied):
    """Distance ``(rows, cols)`` int32, cells, to the nearest occupied cell of the same column, which must have one."""
    rows, cols = occupied.shape
    distance = np.empty((rows, cols), np.int32)
    for col in range(cols):
        distance[0, col] = 0 if occupied[0, col] else rows
    for row in range(1, rows):
        for col in range(cols):
            distance[row, col] = 0 if occupied[row, col] else distance[row - 1, col] + 1
    for row in range(rows - 2, -1, -1):
        for col in range(cols):
            distance[row, col] = min(distance[row, col], distance[row + 1, col] + 1)
    return distance


@kernel
def nearest_occupied(along_columns, row, col):
    """Distance from one cell's centre to the nearest occupied one's, cells, by :func:`distance_along_columns`.

    For the cells of a path far less work than :func:`squared_distance` for all cells, with the same result.
    """
    cols = along_columns.shape[1]
    nearest, away = np.int64(along_columns[row, col]) ** 2, 1
    while away * away < nearest:
        for side in (col - away, col + away):
            if 0 <= side < cols:
                nearest = min(nearest, away * away + np.int64(along_columns[row, side]) ** 2)
        away += 1
    return math.sqrt(nearest)


@kernel
def _spread(distance, width, start):
    """Work off bucket after bucket: of the cells whose distances have the same whole part, none shortens another.

    Steps lead into the next bucket or the one after it. A cell that was listed again nearer is passed over later.
    """
    cells = len(distance)
    bucket, following, after = np.empty(cells, np.int32), np.empty(cells, np.int32), np.empty(cells, np.int32)
    bucket[0] = start
    none, one = np.int64(0), np.int64(1)
    count, n_following, n_after, whole = one, none, none, 0.0
    while count + n_following + n_after > 0:
        for i in range(count):
            cell = np.uint64(bucket[i])  # unsigned, for numba would otherwise check for negative indices
            if distance[cell] >= whole:
                n_following, n_after = _leave(distance, width, cell, whole, following, n_following, after, n_after)
        bucket, following, after = following, after, bucket
        count, n_following, n_after, whole = n_following, n_after, none, whole + 1.0


@kernel
def _leave(distance, width, cell, whole, following, n_following, after, n_after):
    """Shorten the ways to the neighbours of a cell, and list them in their buckets, unless these have them already.

    Args:
        distance: ``(cells,)`` in and out.
        width: Cells of a row.
        cell: Whose neighbours.
        whole: Whole part of its distance.
        following: Cells of the next bucket, in and out.
        n_following: How many they are.
        after: Cells of the bucket after it, in and out.
        n_after: How many they are.

    Returns:
        How many cells both buckets have now.
    """
    one, row = np.uint64(1), np.uint64(width)
    straight, diagonal = distance[cell] + 1.0, distance[cell] + DIAGONAL
    left, right, below, above = distance[cell - one], distance[cell + one], distance[cell - row], distance[cell + row]
    for near, before in ((cell - one, left), (cell + one, right), (cell - row, below), (cell + row, above)):
        if before > straight:
            distance[near] = straight
            if before >= whole + 2.0:
                following[n_following] = near
                n_following += 1
    for near, along, across in (
        (cell - row - one, below, left),
        (cell - row + one, below, right),
        (cell + row - one, above, left),
        (cell + row + one, above, right),
    ):
        before = distance[near]
        if before > diagonal and min(along, across) != BLOCKED:
            distance[near] = diagonal
            if diagonal >= whole + 2.0 and before >= whole + 3.0:
                after[n_after] = near
                n_after += 1
            elif diagonal < whole + 2.0 <= before:
                following[n_following] = near
                n_following += 1
    return n_following, n_after
