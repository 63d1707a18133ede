"""Sine, cosine, arc tangent and exponential in float32 arithmetic that compilers can vectorise.

A call of libm inside a loop keeps the loop scalar; these are polynomials without branches. Their errors against float64
are 0.6 units of the last place for sine and cosine, 2 for the exponential, and 2e-7 rad for the angle.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import inlined

F32 = np.float32
ZERO, HALF, ONE, TWO = F32(0.0), F32(0.5), F32(1.0), F32(2.0)
PI, HALF_PI = F32(np.pi), F32(np.pi / 2)
BIT_0, BIT_1 = np.int32(1), np.int32(2)

# Adding and taking away 1.5 * 2^23 rounds a float32 to the nearest integer.
ROUNDER = F32(12582912.0)

# pi/2 in two parts, the first short enough that its multiples are exact for angles up to about 50 rad.
HALF_PI_HIGH = F32(round(np.pi / 2 * 2**19) / 2**19)
HALF_PI_LOW = F32(np.pi / 2 - float(HALF_PI_HIGH))
PER_HALF_PI = F32(2.0 / np.pi)
# Minimax coefficients on [-pi/4, pi/4] (Cephes).
SIN_3, SIN_5, SIN_7 = F32(-1.6666654611e-1), F32(8.3321608736e-3), F32(-1.9515295891e-4)
COS_4, COS_6, COS_8 = F32(4.166664568298827e-2), F32(-1.388731625493765e-3), F32(2.443315711809948e-5)

# Arc tangent on [0, 1]: Abramowitz and Stegun 4.4.49, error 2e-8.
ATAN = tuple(
    F32(c)
    for c in (
        -0.3333314528, 0.1999355085, -0.1420889944, 0.1065626393, -0.0752896400, 0.0429096138, -0.0161657367,
        0.0028662257,
    )
)  # fmt: skip
ATAN_3, ATAN_5, ATAN_7, ATAN_9, ATAN_11, ATAN_13, ATAN_15, ATAN_17 = ATAN

LOG2_E = F32(np.log2(math.e))
LN2_HIGH = F32(0.693359375)
LN2_LOW = F32(np.log(2.0) - 0.693359375)
EXP_2, EXP_3, EXP_4, EXP_5, EXP_6 = (F32(c) for c in (1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720))
EXP_FLOOR = F32(-87.0)
EXPONENT_BIAS, MANTISSA_BITS = np.int32(127), np.int32(23)


@inlined
def sin_cos(angle):
    """Sine and cosine of ``angle`` (rad), float32."""
    turns = (angle * PER_HALF_PI + ROUNDER) - ROUNDER
    coarse = angle - turns * HALF_PI_HIGH
    correction = turns * HALF_PI_LOW
    r = coarse - correction
    rest = (coarse - r) - correction
    z = r * r
    sin = r + ((r * z) * (SIN_3 + z * (SIN_5 + z * SIN_7)) + rest)
    half = HALF * z
    cos = ONE - half
    cos += ((ONE - cos) - half) + ((z * z) * (COS_4 + z * (COS_6 + z * COS_8)) - r * rest)
    quadrant = np.int32(turns)
    swapped = (quadrant & BIT_0) != 0
    s = cos if swapped else sin
    c = sin if swapped else cos
    return (-s if (quadrant & BIT_1) != 0 else s), (-c if ((quadrant + BIT_0) & BIT_1) != 0 else c)


@inlined
def angle_of(x, y):
    """Angle between the x axis and ``(x, y)`` for y >= 0, in [0, pi]; 0 at the origin."""
    a = -x if x < ZERO else x
    high = a if a > y else y
    low = y if a > y else a
    q = low / (high if high > ZERO else ONE)
    z = q * q
    p = ATAN_9 + z * (ATAN_11 + z * (ATAN_13 + z * (ATAN_15 + z * ATAN_17)))
    r = q + q * (z * (ATAN_3 + z * (ATAN_5 + z * (ATAN_7 + z * p))))
    r = HALF_PI - r if y > a else r
    return PI - r if x < ZERO else r


@inlined
def exp_negative(x):
    """``exp(x)`` for x <= 0; 0 below -87, where float32 ends."""
    clipped = x if x > EXP_FLOOR else EXP_FLOOR
    n = (clipped * LOG2_E + ROUNDER) - ROUNDER
    r = (clipped - n * LN2_HIGH) - n * LN2_LOW
    p = ONE + (r + (r * r) * (EXP_2 + r * (EXP_3 + r * (EXP_4 + r * (EXP_5 + r * EXP_6)))))
    scale = np.int32((np.int32(n) + EXPONENT_BIAS) << MANTISSA_BITS).view(np.float32)
    return p * scale if x >= EXP_FLOOR else ZERO
