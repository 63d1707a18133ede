"""The control sequence within the limits, from the speed at the start of the rollout on (Lyrical).

Source: nav2_mppi_controller/src/optimizer.cpp (Lyrical): applyControlSequenceInterIterationConstraints and
applyControlSequenceConstraints.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.elementary import ZERO
from controllers.mppi.kernels.update import clip_turns
from gym_mapbench.kernels.jit import inlined, kernel


@inlined
def _within(value, lowest, highest):
    """The nearest value between two limits; the highest if they contradict each other."""
    raised = lowest if value < lowest else value
    return highest if highest < raised else raised


@inlined
def _reachable(speed, before, gain, loss):
    """The speed nearest to a wanted one that can be reached; from zero, forwards is away from zero.

    Args:
        speed: The wanted speed.
        before: The speed before.
        gain: Largest change away from zero.
        loss: Largest change towards zero, negative.
    """
    lowest = before + loss if before >= ZERO else before - gain
    highest = before + gain if before >= ZERO else before - loss
    return _within(speed, lowest, highest)


@kernel
def _changes(tuning, period):
    """Largest changes of v (gain, loss) and of w within a period."""
    dt = np.float32(period)
    return dt * np.float32(tuning.ax_max), dt * np.float32(tuning.ax_min), dt * np.float32(tuning.az_max)


@kernel
def start_sequence(tuning_of, call_of, v, w):
    """Begin the control sequence at the speeds of the start, or within their reach if it is not shifted.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        call_of: ``(1,)`` record of the call.
        v: ``(time_steps,)`` control sequence, m/s; the first value is updated.
        w: The same, rad/s.
    """
    tuning, v_0, w_0 = tuning_of[0], np.float32(call_of[0].v), np.float32(call_of[0].w)
    if tuning.shifts:
        v[0], w[0] = v_0, w_0
    else:
        gain, loss, change = _changes(tuning, tuning.control_period)
        v[0], w[0] = _reachable(v[0], v_0, gain, loss), _reachable(w[0], w_0, change, -change)


@kernel
def limit_from_start(tuning_of, call_of, v, w):
    """Bring every control within the limits and within reach of the one before, the first of the speeds of the start.

    Arguments as in :func:`start_sequence`; all values are updated.
    """
    tuning, v_before, w_before = tuning_of[0], np.float32(call_of[0].v), np.float32(call_of[0].w)
    slowest, fastest, turn = tuning.lowest_speed, tuning.highest_speed, np.float32(tuning.fastest_turn)
    radius = tuning.AckermannConstraints.min_turning_r
    if tuning.ackermann:
        clip_turns(v, w, radius)
    if tuning.shifts:
        v[0], w[0] = v_before, w_before
    for t in range(len(v)):
        gain, loss, change = _changes(tuning, tuning.control_period if t == 0 else tuning.model_dt)
        speed = _within(v[t], np.float32(slowest), np.float32(fastest))
        v[t] = v_before = _reachable(speed, v_before, gain, loss)
        w[t] = w_before = _reachable(_within(w[t], -turn, turn), w_before, change, -change)
    if tuning.ackermann:
        clip_turns(v, w, radius)
