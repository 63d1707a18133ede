"""How well trajectories follow the path: each of their points against the path point as far along.

A length along the path is turned into an index by looking up its slot; only lengths near a change are searched.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.elementary import ONE, ZERO
from gym_mapbench.kernels.geometry import normalize_angle
from gym_mapbench.kernels.jit import kernel

FAR = np.float32(np.inf)

# Slots of the arc-length index: the share of lengths that need a search falls with their number.
SLOTS = 4096
SEARCH = np.int32(-1)


@kernel
def measure_path(x, y, arc):
    """Write the length along the path up to each point, float32 sums as in Nav2."""
    arc[0] = ZERO
    for i in range(1, len(x)):
        dx, dy = x[i] - x[i - 1], y[i] - y[i - 1]
        arc[i] = arc[i - 1] + np.sqrt(dx * dx + dy * dy)


@kernel
def too_many_invalid(valid, first, furthest, largest_ratio):
    """Whether so much of the path ahead is blocked that following it makes no sense."""
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
def closest_by_length(arc, length, beyond):
    """Index of the point of ``arc`` nearest to ``length``; ``beyond`` past its end."""
    low, high = 0, len(arc)
    while low < high:
        middle = (low + high) // 2
        if arc[middle] < length:
            low = middle + 1
        else:
            high = middle
    return beyond if low == len(arc) else _nearer_of(arc, low, length)


@kernel
def build_slots(arc, beyond, slots):
    """Prepare :func:`closest_by_length` for look-up: write the answer of each slot, or SEARCH where it varies.

    Returns:
        Slots per metre.
    """
    per_metre = np.float32(len(slots) - 8) / max(arc[len(arc) - 1], np.float32(1e-6))
    margin = np.float32(0.05)
    for s in range(len(slots)):
        slots[s] = SEARCH
    begin = ZERO
    for i in range(len(arc)):
        end = (arc[i] + arc[i + 1]) / 2 * per_metre if i + 1 < len(arc) else arc[i] * per_metre
        for s in range(int(begin + margin) + 1 if i > 0 else 0, int(end - margin)):
            slots[s] = i
        begin = end
    for s in range(int(begin + margin) + 1, len(slots)):
        slots[s] = beyond
    return per_metre


@kernel
def prepare_targets(path, valid, arc, beyond, targets):
    """Write x, y, length and yaw of each path point up to ``beyond``; x is infinite where the point is invalid."""
    for i in range(targets.shape[1]):
        targets[0, i] = path[0, i] if valid[i] else FAR
        targets[1, i] = path[1, i]
        targets[2, i] = arc[i] if i < len(arc) else FAR
        targets[3, i] = path[2, i]


@kernel
def _advance(x, y, i, b, per_metre, last_slot, length, slot):
    """Add the way between two kept steps to each sample's length, and find its slot."""
    for k in range(len(length)):
        dx, dy = x[i, b, k] - x[i - 1, b, k], y[i, b, k] - y[i - 1, b, k]
        length[k] += np.sqrt(dx * dx + dy * dy)
        at = length[k] * per_metre
        slot[k] = np.uint32(np.int32(at if at < last_slot else last_slot))


@kernel
def _look_up(slots, slot, arc, beyond, length, targets, found):
    """Read x, y and length along the path of every sample's closest path point."""
    for k in range(len(length)):
        j = np.int32(slots[slot[k]])
        if j < 0:
            j = np.int32(closest_by_length(arc, length[k], beyond))
        at = np.uint32(j)
        found[0, k] = targets[0, at]
        found[1, k] = targets[1, at]
        found[2, k] = targets[2, at]


@kernel
def _look_up_yaw(arc, beyond, length, targets, found):
    for k in range(len(length)):
        found[3, k] = targets[3, closest_by_length(arc, length[k], beyond)]


@kernel
def _restart(length, targets, previous, found):
    """Humble's defect: a sample that is not past the point found last is compared with the first point instead."""
    first_x, first_y, first_yaw = targets[0, 0], targets[1, 0], targets[3, 0]
    for k in range(len(length)):
        again = length[k] <= previous[k]
        found[0, k] = first_x if again else found[0, k]
        found[1, k] = first_y if again else found[1, k]
        found[3, k] = first_yaw if again else found[3, k]
        previous[k] = ZERO if again else found[2, k]


@kernel
def _add_offsets(x, y, i, b, found, sums, counts):
    for k in range(len(sums)):
        dx, dy = found[0, k] - x[i, b, k], found[1, k] - y[i, b, k]
        distance = np.sqrt(dx * dx + dy * dy)
        counted = distance < FAR
        sums[k] += distance if counted else ZERO
        counts[k] += ONE if counted else ZERO


@kernel
def _add_poses(x, y, yaw, i, b, found, sums, counts):
    for k in range(len(sums)):
        if found[0, k] < FAR:
            dx, dy = found[0, k] - x[i, b, k], found[1, k] - y[i, b, k]
            turn = np.float32(normalize_angle(np.float64(yaw[i, b, k] - found[3, k])))
            sums[k] += np.sqrt(dx * dx + dy * dy + turn * turn)
            counts[k] += ONE


@kernel
def score_align(kept, steps, arc, beyond, targets, slots, per_metre, defects, rows, slot, scores):
    """Write each sample's mean distance from the path point as far along the path as it has come itself.

    Args:
        kept: ``(2 or 3, kept steps, blocks, samples)`` x, y and, to compare headings as well, yaw.
        steps: How many of the kept steps count.
        arc: ``(furthest,)`` length along the path, m.
        beyond: Index of the path point that stands for lengths beyond the last.
        targets: ``(4, beyond + 1)`` from :func:`prepare_targets`.
        slots, per_metre: From :func:`build_slots`.
        defects: Whether Humble's wrong search is copied.
        rows: ``(8, samples)`` float32 scratch.
        slot: ``(samples,)`` uint32 scratch.
        scores: ``(blocks, samples)``, written.
    """
    x, y = kept[0], kept[1]
    length, previous, sums, counts, found = rows[0], rows[1], rows[2], rows[3], rows[4:]
    last_slot = np.float32(len(slots) - 1)
    for b in range(scores.shape[0]):
        rows[:4] = ZERO
        for i in range(1, steps):
            _advance(x, y, i, b, per_metre, last_slot, length, slot)
            _look_up(slots, slot, arc, beyond, length, targets, found)
            if len(kept) > 2:
                _look_up_yaw(arc, beyond, length, targets, found)
            if defects:
                _restart(length, targets, previous, found)
            if len(kept) > 2:
                _add_poses(x, y, kept[2], i, b, found, sums, counts)
            else:
                _add_offsets(x, y, i, b, found, sums, counts)
        for k in range(len(sums)):
            scores[b, k] = sums[k] / counts[k] if counts[k] > ZERO else ZERO
