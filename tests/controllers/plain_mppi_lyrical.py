"""Lyrical's MPPI once more, slowly, as the specification tells it: the twin of its kernels and of its optimizer."""

from __future__ import annotations

import numpy as np

from tests.controllers.plain_mppi import PlainMppi, f4, smooth_copy

MEAN = np.full(9, 1 / 9, dtype=f4)


class PlainLyrical(PlainMppi):
    """One call; after :meth:`run` also the sequences ``softmax``, ``filtered`` and ``limited``, each of v and w."""

    def __init__(self, params, setup, pose, velocity, path, costmap, controls, noise, goal=None, last=(0.0, 0.0)):
        self.last, self.sent = last, (np.zeros(0), np.zeros(0))
        self.length = float(np.hypot(*np.diff(np.asarray(path)[:, :2], axis=0).T).sum())
        super().__init__(params, setup, pose, velocity, path, costmap, controls, noise, tuple(path[-1, :2]))

    def roll_out(self, velocity):
        p, dt_c = self.p, self.setup.control_period
        self.shifts = abs(dt_c - p.model_dt) < 1e-6
        self.start = self.last if p.open_loop else (
            min(max(self.last[0], velocity[0] + dt_c * p.ax_min), velocity[0] + dt_c * p.ax_max),
            min(max(self.last[1], velocity[1] - dt_c * p.az_max), velocity[1] + dt_c * p.az_max),
        )  # fmt: skip
        v_0, w_0 = self.start
        self.v[0] = v_0 if self.shifts else self.rule_a(self.v[0], v_0, dt_c)
        self.w[0] = w_0 if self.shifts else np.clip(self.w[0], w_0 - dt_c * p.az_max, w_0 + dt_c * p.az_max)
        self.cv, self.cw = self.v + self.noise_v, self.w + self.noise_w
        self.vx, self.wz = np.empty_like(self.cv), np.empty_like(self.cw)
        self.vx[:, 0], self.wz[:, 0] = self.start
        for k in range(self.K):
            for t in range(1, self.N):
                self.vx[k, t] = self.reachable_v(self.cv[k, t - 1], self.vx[k, t - 1])
                self.wz[k, t] = self.reachable_w(self.cw[k, t - 1], self.wz[k, t - 1])
        if p.clamp_raw_controls:
            self.cv[:, :-1], self.cw[:, :-1] = self.vx[:, 1:], self.wz[:, 1:]
        self.integrate()

    def integrate(self):
        dt = f4(self.p.model_dt)
        self.yaw = sums(self.pose.yaw, self.wz * dt)
        heading = np.concatenate([np.full((self.K, 1), f4(self.pose.yaw)), self.yaw[:, :-1]], axis=1).astype(float)
        self.x = sums(self.pose.x, self.vx * np.cos(heading).astype(f4) * dt)
        self.y = sums(self.pose.y, self.vx * np.sin(heading).astype(f4) * dt)

    def delay(self, queues):
        """Let velocities come later, by Nav2's rule for columns; ``queues`` are the last commands of v and of w."""
        for velocities, queue in zip((self.vx, self.wz), queues, strict=True):
            offset, before = len(queue), velocities.copy()
            for column in range(1, self.N) if offset else ():
                of_queue = column < offset
                velocities[:, column] = queue[column] if of_queue else before[:, column - offset + 1]
        self.integrate()
        return self

    def rule_a(self, speed, before, period):
        low, high = (self.p.ax_min, self.p.ax_max) if before >= 0 else (-self.p.ax_max, -self.p.ax_min)
        return min(max(speed, before + period * low), before + period * high)

    def update(self, weights):
        self.softmax = np.array([weights @ self.cv, weights @ self.cw], dtype=f4)
        shape = MEAN if self.p.sgf_order == 1 else None
        self.filtered = np.array([smooth_copy(u, np.zeros(4), shape) for u in self.softmax])
        self.v, self.w = self.filtered.astype(float)
        self.limit()
        self.limited = np.array([self.v, self.w])

    def limit(self):
        p, (v_before, w_before) = self.p, self.start
        self.turn_no_tighter()
        if self.shifts:
            self.v[0], self.w[0] = self.start
        for t in range(self.N):
            period = self.setup.control_period if t == 0 else p.model_dt
            self.v[t] = v_before = self.rule_a(np.clip(self.v[t], p.vx_min, p.vx_max), v_before, period)
            turn = np.clip(self.w[t], -p.wz_max, p.wz_max)
            self.w[t] = w_before = np.clip(turn, w_before - period * p.az_max, w_before + period * p.az_max)
        self.turn_no_tighter()

    def turn_no_tighter(self):
        if self.p.motion_model == "Ackermann":
            most = np.abs(self.v) / self.p.AckermannConstraints.min_turning_r
            self.w = np.clip(self.w, -most, most)

    def near(self, distance):
        return self.length < distance

    def looks(self, step):
        return (self.N - 1) // step + 1

    def ConstraintCritic(self, own):
        p = self.p
        out = np.maximum(self.vx - p.vx_max, 0) + np.maximum(p.vx_min - self.vx, 0)
        if p.motion_model == "Ackermann":
            radius = np.abs(self.vx) / np.maximum(np.abs(self.wz), 1e-6)
            out = out + np.maximum(p.AckermannConstraints.min_turning_r - radius, 0)
        return own.cost_weight * p.model_dt * out.sum(axis=1)

    def reached(self):
        arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(self.px), np.diff(self.py)))])
        self.furthest = 0
        for k in range(self.K):
            length = np.hypot(np.diff(self.x[k]), np.diff(self.y[k])).sum()
            reach = next((i for i in range(len(arc)) if arc[i] >= length), len(arc) - 1)
            away = (self.px - self.x[k, -1]) ** 2 + (self.py - self.y[k, -1]) ** 2
            self.furthest = max(self.furthest, int(away[: reach + 1].argmin()))
        return self.furthest


def sums(first, steps):
    """Running sums of each row in float32, from a first value that is left out."""
    begun = np.concatenate([np.full((len(steps), 1), f4(first)), steps.astype(f4)], axis=1)
    return np.cumsum(begun, axis=1, dtype=f4)[:, 1:]
