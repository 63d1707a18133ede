"""How well trajectories follow the path: each of their points is compared with the path point as far along.

A length along the path is turned into an index by a table of slots; only in slots in which the index changes is it
searched for.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.controls import ALIGNED
from controllers.mppi.kernels.elementary import ONE, TWO, ZERO
from controllers.mppi.kernels.rollout import BLOCK
from gym_mapbench.kernels.geometry import normalize_angle
from gym_mapbench.kernels.jit import inlined, kernel

FAR = np.float32(np.inf)

# Slots of the arc-length index: the more there are, the fewer lengths need a search. One more slot, the last, stands
# for the path's first point.
SLOTS = 4096
LAST_SLOT, FIRST_POINT = np.float32(SLOTS - 1), np.float32(SLOTS)

# Rows of a block: length of each trajectory so far and of the path up to the point found last, the point found, sum and
# number of the distances.
LENGTH, PREVIOUS, FOUND_X, FOUND_Y, SUM, COUNT = (BLOCK * row for row in range(6))
ROWS_SIZE = 6 * BLOCK


@kernel
def measure_path(x, y, arc):
    """Write the length along the path up to each point, summed in float32 as in Nav2."""
    arc[0] = ZERO
    for i in range(1, len(arc)):
        dx, dy = x[i] - x[i - 1], y[i] - y[i - 1]
        arc[i] = arc[i - 1] + np.sqrt(dx * dx + dy * dy)


@kernel
def too_many_invalid(valid, first, furthest, largest_ratio):
    """Whether more than two points, and more than the largest ratio, of the path ahead are blocked."""
    invalid = 0
    for i in range(first, furthest):
        invalid += 0 if valid[i] else 1
        if invalid > 2 and np.float32(invalid) / np.float32(furthest - first) > largest_ratio:
            return True
    return False


@kernel
def _nearer_of(arc, i, length):
    """``i - 1`` or ``i``, whichever is nearer in length along the path; ties upward."""
    return i - 1 if i > 0 and length - arc[i - 1] < arc[i] - length else i


@kernel
def closest_by_length(arc, length, first, beyond):
    """Index of the point of ``arc`` nearest to ``length``, not before ``first``; ``beyond`` past its end."""
    i = first
    while i < len(arc) and arc[i] < length:
        i += 1
    return beyond if i == len(arc) else _nearer_of(arc, i, length)


@kernel
def build_slots(arc, beyond, slots):
    """Tabulate :func:`closest_by_length`.

    Each slot gets the index for its lengths, or, if the index changes within the slot, the bitwise complement of its
    first index.

    Returns:
        Slots per metre.
    """
    per_metre = np.float32(np.float32(len(slots) - 8) / max(arc[len(arc) - 1], np.float32(1e-6)))
    margin = np.float32(0.05)
    s, begin, last = 0, -TWO, len(arc) - 1
    for i in range(len(arc)):
        while s < int(begin + margin) + 1:
            slots[s] = ~(i - 1)
            s += 1
        end = (arc[i] if i == last else (arc[i] + arc[i + 1]) / 2) * per_metre
        while s < int(end - margin):
            slots[s] = i
            s += 1
        begin = end
    while s < len(slots):
        slots[s] = ~last if s < int(begin + margin) + 1 else beyond
        s += 1
    return per_metre


@kernel
def prepare_targets(path, valid, arc, targets):
    """Write x, y, length and yaw of the path points that ``targets`` has room for; x is infinite for invalid ones."""
    for i in range(targets.shape[1]):
        targets[0, i] = path[0, i] if valid[i] else FAR
        targets[1, i] = path[1, i]
        targets[2, i] = arc[i] if i < len(arc) else FAR
        targets[3, i] = path[2, i]


@kernel
def _start(rows, previous):
    """Begin a block: nothing driven, nothing found."""
    for k in range(BLOCK):
        rows[LENGTH + k] = rows[SUM + k] = rows[COUNT + k] = ZERO
        rows[PREVIOUS + k] = previous


@inlined
def _advance(x, y, i, b, per_metre, rows, slot):
    """Add the way between two kept steps to each sample's length, and find its slot.

    Humble's defect is copied: a sample that is not past the point found last (``rows[PREVIOUS]``) is compared with the
    first point.
    """
    for k in range(BLOCK):
        dx, dy = x[i, b, k] - x[i - 1, b, k], y[i, b, k] - y[i - 1, b, k]
        length = rows[LENGTH + k] + np.sqrt(dx * dx + dy * dy)
        at = length * per_metre
        at = at if at < LAST_SLOT else LAST_SLOT
        slot[k] = np.uint32(np.int32(at if length > rows[PREVIOUS + k] else FIRST_POINT))
        rows[LENGTH + k] = length


@inlined
def _look_up(slots, slot, arc, beyond, targets, rows, found):
    """Find every sample's closest path point; write its x and y, and its length along the path."""
    for k in range(BLOCK):
        j = slots[slot[k]]
        if j < 0:
            j = np.int32(closest_by_length(arc, rows[LENGTH + k], ~j, beyond))
        at = np.uint32(j)
        found[k] = at
        rows[FOUND_X + k] = targets[0, at]
        rows[FOUND_Y + k] = targets[1, at]


@inlined
def _remember(arc, found, rows):
    """Remember the length along the path of the points found."""
    for k in range(BLOCK):
        rows[PREVIOUS + k] = arc[found[k]]


@inlined
def _add_offsets(x, y, i, b, rows):
    for k in range(BLOCK):
        dx, dy = rows[FOUND_X + k] - x[i, b, k], rows[FOUND_Y + k] - y[i, b, k]
        distance = np.sqrt(dx * dx + dy * dy)
        counted = distance < FAR
        rows[SUM + k] += distance if counted else ZERO
        rows[COUNT + k] += ONE if counted else ZERO


@kernel
def _add_poses(x, y, yaw, i, b, targets, found, rows):
    for k in range(BLOCK):
        if rows[FOUND_X + k] < FAR:
            dx, dy = rows[FOUND_X + k] - x[i, b, k], rows[FOUND_Y + k] - y[i, b, k]
            turn = np.float32(normalize_angle(np.float64(yaw[i, b, k] - targets[3, found[k]])))
            rows[SUM + k] += np.sqrt(dx * dx + dy * dy + turn * turn)
            rows[COUNT + k] += ONE


@kernel
def score_align(call_of, path, valid, kept, steps, defects, collected):
    """Write each sample's mean distance from the path point as far along the path as it has come itself.

    Args:
        call_of: ``(1,)`` record of the call; points of the path up to ``furthest`` are looked at.
        path: ``(3, points)`` x, y, yaw.
        valid: ``(points,)`` whether each point counts.
        kept: ``(2 or 3, kept steps, blocks, samples)`` x, y and, to compare headings as well, yaw.
        steps: How many of the kept steps count.
        defects: Whether Humble's wrong search is copied.
        collected: ``(12, blocks, samples)``; row ALIGNED is written.
    """
    furthest = call_of[0].furthest
    beyond = furthest if defects else furthest - 1
    arc, slots = np.empty(furthest, dtype=np.float32), np.empty(SLOTS + 1, dtype=np.int32)
    targets = np.empty((4, beyond + 1), dtype=np.float32)
    measure_path(path[0], path[1], arc)
    prepare_targets(path, valid, arc, targets)
    per_metre = build_slots(arc, beyond, slots[:SLOTS])
    slots[SLOTS] = 0
    x, y = kept[0], kept[1]
    rows, slot, found = np.empty(ROWS_SIZE, dtype=np.float32), np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.uint32)
    for b in range(collected.shape[1]):
        _start(rows, ZERO if defects else -ONE)
        for i in range(1, steps):
            _advance(x, y, i, b, per_metre, rows, slot)
            _look_up(slots, slot, arc, beyond, targets, rows, found)
            if defects:
                _remember(targets[2], found, rows)
            if len(kept) > 2:
                _add_poses(x, y, kept[2], i, b, targets, found, rows)
            else:
                _add_offsets(x, y, i, b, rows)
        for k in range(BLOCK):
            counted = rows[COUNT + k]
            collected[ALIGNED, b, k] = rows[SUM + k] / counted if counted > ZERO else ZERO
