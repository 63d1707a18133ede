"""NavFn: potentials spread from the robot until they reach the goal, and the walk back down.

Source: nav2_navfn_planner/src/navfn.cpp (Humble). Cells are flat indices, ``cell = row * width + col``.
Potentials and offsets are float32 as in the original: the length of some paths depends on the last bit.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

COST_NEUTRAL = 50
COST_OBS = 254
POT_HIGH = np.float32(1e10)
LIST_CELLS = 10_000
MOST_LISTED = 4  # by one cell
THRESHOLD_INCREMENT = np.float32(100)
NEIGHBOUR_SHARE = 0.707106781
NEVER = np.float32(np.inf)
HALF = np.float32(0.5)
ONE = np.float32(1)


@kernel
def spread(costmap, cost_of, start, goal, use_astar, fused, list_cells):
    """Potentials ``(rows, cols)`` float32 around ``start``; POT_HIGH where the wave had not been when it met ``goal``.

    Args:
        costmap: ``(rows, cols)`` uint8.
        cost_of: ``(256,)`` uint8 NavFn's cost of every value of it, 254 on obstacles.
        start: Cell of the robot; free whatever the costmap says.
        goal: Cell at which to stop.
        use_astar: Whether cells nearer to the goal come first.
        fused: Whether a product and a sum are rounded once; see :func:`add_product`.
        list_cells: How many cells a list holds; those beyond are lost.
    """
    rows, width = costmap.shape
    costs = _framed_costs(costmap, cost_of, start)
    gain = _least_gains(costs)
    potential = np.full(len(costs), POT_HIGH)
    potential[start] = 0
    room = list_cells + MOST_LISTED
    lists, current, following, over = np.empty(3 * room, np.uint32), np.int64(0), room, 2 * room
    end, end_over = _push_first(gain, width, start, lists), over
    threshold = np.float32(COST_OBS)
    if use_astar:
        threshold += _straight_cost(start, goal, width)
    for _ in range(max(len(costs) // 20, width + rows)):
        if end == current:
            break
        end_next, end_over = _update_list(
            lists, current, end, following, over, end_over, list_cells,
            costs, gain, np.uint32(width), potential, threshold, goal, use_astar, fused,
        )  # fmt: skip
        current, end, following = following, end_next, current
        if end == current:
            threshold += THRESHOLD_INCREMENT
            current, end, over, end_over = over, end_over, current, current
        if potential[goal] < POT_HIGH:
            break
    return potential.reshape(rows, width)


@kernel
def _framed_costs(costmap, cost_of, start):
    """NavFn's costs ``(cells,)`` uint8, the start free and the map's whole border an obstacle."""
    rows, width = costmap.shape
    costs = np.full((rows, width), np.uint8(COST_OBS))
    for row in range(1, rows - 1):
        _look_up(costmap[row, 1 : width - 1], cost_of, costs[row, 1 : width - 1])
    row, col = start // width, start % width
    if 0 < row < rows - 1 and 0 < col < width - 1:
        costs[row, col] = COST_NEUTRAL
    return costs.ravel()


@kernel
def _look_up(values, cost_of, costs):
    for i in range(len(values)):
        costs[i] = cost_of[values[i]]


@kernel
def _least_gains(costs):
    """By how much ``(cells,)`` float32 a neighbour's potential must be lower to list a cell; inf on an obstacle."""
    gain = np.empty(len(costs), np.float32)
    for cell in range(len(costs)):
        gain[cell] = np.float32(NEIGHBOUR_SHARE * costs[cell]) if costs[cell] < COST_OBS else NEVER
    return gain


@kernel
def _push_first(gain, width, start, current):
    """List the free neighbours of ``start`` in Nav2's order; return how many there are."""
    count = 0
    for near in (start + 1, start - 1, start - width, start + width):
        if 0 <= near < len(gain) and gain[near] < NEVER:
            gain[near] = NEVER
            current[count] = near
            count += 1
    return count


@kernel
def _update_list(
    lists, first, end, following, over, end_over, list_cells,
    costs, gain, width, potential, threshold, goal, use_astar, fused,
):  # fmt: skip
    """Update a whole list, as many cells at a time as surely fit what they list; return where the two others end."""
    _release(lists, first, end, costs, gain)
    full_next, full_over, end_next = following + list_cells, over + list_cells, following
    while first < end:
        fits = min(full_next - end_next, full_over - end_over) // MOST_LISTED
        last = min(end, first + max(1, fits))
        end_next, end_over = _update(
            lists, first, last, end_next, end_over, costs, gain, width, potential, threshold, goal, use_astar, fused
        )
        end_next = _lose(lists, full_next, end_next, costs, gain)
        end_over = _lose(lists, full_over, end_over, costs, gain)
        first = last
    return end_next, end_over


@kernel
def _release(lists, first, end, costs, gain):
    """Let listed cells be listed again: while a cell is listed, no gain is enough."""
    for place in range(np.uint64(first), np.uint64(end)):
        cell = lists[place]
        gain[cell] = np.float32(NEIGHBOUR_SHARE * costs[cell])


@kernel
def _lose(lists, full, end, costs, gain):
    """Take cells beyond the end of a full list off it, as they are lost in Nav2, too; return where the list ends."""
    if end > full:
        _release(lists, full, end, costs, gain)
    return min(full, end)


@kernel
def _update(
    lists, first, last, end_next, end_over, costs, gain, width, potential, threshold, goal, use_astar, fused
):  # fmt: skip
    """Update listed cells in place and list the neighbours that may gain; return where the two other lists end.

    A branch on what a cell finds would be guessed wrong too often. A neighbour that does not gain is therefore written
    behind the end of a list. Indices are unsigned, for numba would otherwise check for negative ones.
    """
    one = np.uint32(1)
    end_next, end_over = np.uint64(end_next), np.uint64(end_over)
    for place in range(np.uint64(first), np.uint64(last)):
        cell = lists[place]
        left, right = potential[cell - one], potential[cell + one]
        down, up = potential[cell - width], potential[cell + width]
        before = potential[cell]
        value = cell_potential(min(left, right), min(down, up), np.float32(costs[cell]), fused)
        potential[cell] = min(value, before)
        value = value if value < before else NEVER
        if use_astar:
            value += _straight_cost(cell, goal, width)
        soon = value < threshold
        end = end_next if soon else end_over
        for near, other in ((cell - one, left), (cell + one, right), (cell - width, down), (cell + width, up)):
            least = gain[near]
            gains = other > value + least
            lists[end], gain[near] = near, NEVER if gains else least
            end += np.uint64(gains)
        end_next = end if soon else end_next
        end_over = end_over if soon else end
    return np.int64(end_next), np.int64(end_over)


@kernel
def add_product(term, factor, other, fused):
    """``term + factor * other`` in float32; with ``fused`` it is rounded once, as by a fused multiply-add.

    Lyrical's recordings were compiled with this instruction, which many robots' processors have. The last bit decides
    whether a pose still belongs to a local plan of 2.0 m.
    """
    if fused:
        return np.float32(np.float64(term) + np.float64(factor) * np.float64(other))
    return term + factor * other


@kernel
def cell_potential(across, along, cost, fused):
    """Potential of a cell from the lower neighbour of each axis and its own cost, all float32."""
    difference = abs(across - along)
    low = min(across, along)
    q = difference / cost
    share = np.float32(-0.2301 * q * q + 0.5307 * q + 0.7040)
    return add_product(low, cost, share if difference < cost else ONE, fused)


@kernel
def _straight_cost(cell, goal, width):
    """Cost of the straight line between two cells of free space."""
    return np.float32(math.hypot(cell % width - goal % width, cell // width - goal // width) * COST_NEUTRAL)


@kernel
def descend(potentials, start, goal, most, fused):
    """Walk down the potential from ``goal`` to ``start``: ``(n, 2)`` float32 col, row, and whether it came there.

    A walk that does not come there ended where it could not go on, or after ``most`` points. ``fused`` as in
    :func:`add_product`.
    """
    width = potentials.shape[1]
    potential, cells = potentials.ravel(), potentials.size
    points = np.empty((most, 2), np.float32)
    cell = goal
    dx, dy = np.float32(0), np.float32(0)
    for n in range(most):
        near = cell + _round(dx) + width * _round(dy)
        if potential[max(0, min(cells - 1, near))] < COST_NEUTRAL:
            points[n, 0], points[n, 1] = start % width, start // width
            return points[: n + 1], True
        if cell < width or cell > cells - width:
            return points[:n], False
        points[n, 0], points[n, 1] = cell % width + dx, cell // width + dy
        if _swings(points, n) or _meets_the_unknown(potential, cell, width):
            cell = _lowest_neighbour(potential, cell, width)
            dx, dy = np.float32(0), np.float32(0)
            if potential[cell] >= POT_HIGH:
                return points[: n + 1], False
        else:
            x, y = _slope(potential, cell, width, dx, dy)
            if x == 0 and y == 0:
                return points[: n + 1], False
            scale = HALF / _norm(x, y)
            cell, dx = _carry(cell, add_product(dx, x, scale, fused), np.int64(1))
            cell, dy = _carry(cell, add_product(dy, y, scale, fused), width)
    return points, False


@kernel
def _round(offset):
    """Nearest whole number of an offset in [-1, 1], half away from zero."""
    return int(offset + HALF) if offset >= 0 else -int(HALF - offset)


@kernel
def _carry(cell, offset, stride):
    """Move to the next cell once the offset is more than one cell."""
    if offset > ONE:
        return cell + stride, offset - ONE
    if offset < -ONE:
        return cell - stride, offset + ONE
    return cell, offset


@kernel
def _swings(points, n):
    """Whether the walk is back where it was two points ago."""
    return n >= 2 and points[n, 0] == points[n - 2, 0] and points[n, 1] == points[n - 2, 1]


@kernel
def _meets_the_unknown(potential, cell, width):
    """Whether the wave has not come to one of the nine cells around."""
    for row in (cell - width, cell, cell + width):
        for near in range(row - 1, row + 2):
            if potential[near] >= POT_HIGH:
                return True
    return False


@kernel
def _lowest_neighbour(potential, cell, width):
    """Lowest of the eight neighbours; the running minimum is a whole number, as in Nav2."""
    lowest, least = cell, int(potential[cell])
    for row in (cell - width, cell, cell + width):
        for near in range(row - 1, row + 2):
            if near != cell and potential[near] < least:
                lowest, least = near, int(potential[near])
    return lowest


@kernel
def _slope(potential, cell, width, dx, dy):
    """Descent direction at an offset from a cell, interpolated between four cells."""
    x0, y0 = _gradient(potential, cell, width)
    x1, y1 = _gradient(potential, cell + 1, width)
    x2, y2 = _gradient(potential, cell + width, width)
    x3, y3 = _gradient(potential, cell + width + 1, width)
    x = _blend(_blend(x0, x1, dx), _blend(x2, x3, dx), dy)
    y = _blend(_blend(y0, y1, dx), _blend(y2, y3, dx), dy)
    return x, y


@kernel
def _blend(here, there, share):
    return np.float32((1.0 - share) * here + share * there)


@kernel
def _gradient(potential, cell, width):
    """Unit vector downhill at a cell the wave has reached; (0, 0) in the first and last row and on level ground."""
    if cell < width or cell > len(potential) - width:
        return np.float32(0), np.float32(0)
    x = _difference(potential[cell - 1], potential[cell], potential[cell + 1])
    y = _difference(potential[cell - width], potential[cell], potential[cell + width])
    norm = _norm(x, y)
    if norm == 0:
        return x, y
    scale = ONE / norm
    return x * scale, y * scale


@kernel
def _norm(x, y):
    return np.float32(math.sqrt(np.float64(x) * x + np.float64(y) * y))


@kernel
def _difference(before, here, after):
    """Fall from one neighbour to the other; a neighbour the wave has not reached does not count."""
    fall = np.float32(0)
    if before < POT_HIGH:
        fall += before - here
    if after < POT_HIGH:
        fall += here - after
    return fall
