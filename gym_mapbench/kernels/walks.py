"""Where a person is who walks along a course."""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.jit import kernel


@kernel
def walk_round(corners, marks, headings, begin, speed, times, poses):
    """Write the poses of a body that walks round and round at a constant speed.

    Args:
        corners: ``(n, 2)`` corners of the round, m, the first one again at the end.
        marks: ``(n,)`` distance along the round at every corner, m, from 0 on.
        headings: ``(n - 1,)`` heading on every leg, rad.
        begin: Distance along the round at time 0, m.
        speed: Speed, m/s.
        times: ``(k,)`` s, from 0 on.
        poses: ``(k, 3)`` x, y (m), yaw (rad), out.
    """
    leg, last = 0, len(headings) - 1
    for i in range(len(times)):
        along = np.fmod(begin + speed * times[i], marks[last + 1])
        if along < marks[leg]:
            leg = 0
        while leg < last and along >= marks[leg + 1]:
            leg += 1
        for axis in range(2):
            here, there = corners[leg, axis], corners[leg + 1, axis]
            poses[i, axis] = (there - here) / (marks[leg + 1] - marks[leg]) * (along - marks[leg]) + here
        poses[i, 2] = headings[leg]
