"""The delay of the base: sampled velocities come later, and commands sent before come first (Lyrical).

Source: nav2_mppi_controller (Lyrical): motion_models.hpp (applyDelayShift).
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.accelerations import limit_samples
from gym_mapbench.kernels.jit import kernel


@kernel
def limit_batch(tuning_of, call_of, noise_v, noise_w, v, w, limited):
    """Write the sampled controls within the limits of the acceleration; see :func:`limit_samples`.

    ``limited`` is ``(2, blocks, time_steps, samples)``.
    """
    longest, fastest = limit_samples(tuning_of[0], call_of[0], noise_v, noise_w, v, w, limited[0], limited[1])
    return np.float64(longest), np.float64(fastest)


@kernel
def delay(velocities, sent):
    """Let the sampled velocities of one axis come later.

    Args:
        velocities: ``(blocks, time_steps, samples)`` m/s or rad/s, updated; row t holds the velocities of point t + 1,
            the last row those of none.
        sent: ``(steps,)`` the last commands, oldest first, as many as the delay has steps, at least one. The oldest has
            had its effect.
    """
    blocks, steps, samples = velocities.shape
    later = len(sent) - 1
    for b in range(blocks):
        for t in range(steps - 2, later - 1, -1):
            for k in range(samples):
                velocities[b, t, k] = velocities[b, t - later, k]
        for t in range(min(later, steps - 1)):
            for k in range(samples):
                velocities[b, t, k] = sent[t + 1]
