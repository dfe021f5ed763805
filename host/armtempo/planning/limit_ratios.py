"""Speed, acceleration and jerk over their limits, with derivatives by the shapes of angle and time.

At a point of u let q', q'', q''' be the derivatives of an angle and t', t'', t''' those of time. Then (Eqs. 17
to 19, the last as differentiation gives it)

    speed         q' / t'
    acceleration  (q'' t' - q' t'') / t'^3
    jerk          (q''' t'^2 - 3 q'' t' t'' + 3 q' t''^2 - q' t' t''') / t'^5

Arrays: ``angle`` (3, P, J) holds q', q'', q''' of J joints at P points, ``time`` (3, P) t', t'', t''',
``limits`` (J, 3) speed, acceleration, jerk. The six derivatives are counted q' q'' q''' t' t'' t''' from 0.
"""

from __future__ import annotations

import numpy as np

from armtempo.basics.arrays import Array


def ratios(angle: Array, time: Array, limits: Array) -> Array:
    """Signed ratios of speed, acceleration and jerk to their limits: (3, P, J)."""
    q1, q2, q3 = angle
    t1, t2, t3 = time[:, :, None]
    inverse = 1.0 / t1
    speed = q1 * inverse
    acceleration = (q2 - speed * t2) * inverse**2
    jerk = (q3 - 3.0 * acceleration * t1 * t2 - speed * t3) * inverse**3
    return np.asarray(np.stack([speed, acceleration, jerk]) / limits.T[:, None, :])


def gradient(angle: Array, time: Array, limits: Array) -> Array:
    """Derivatives of each ratio by the six derivatives: (3, 6, P, J)."""
    q1, q2, q3 = angle
    t1, t2, t3 = time[:, :, None]
    i1 = 1.0 / t1
    i2, i3, i4, i5, i6 = (i1**power for power in range(2, 7))
    result = np.zeros((3, 6, *q1.shape))
    result[0, 0] = i1
    result[0, 3] = -q1 * i2
    result[1, 0] = -t2 * i3
    result[1, 1] = i2
    result[1, 3] = 3.0 * q1 * t2 * i4 - 2.0 * q2 * i3
    result[1, 4] = -q1 * i3
    result[2, 0] = 3.0 * t2**2 * i5 - t3 * i4
    result[2, 1] = -3.0 * t2 * i4
    result[2, 2] = i3
    result[2, 3] = -3.0 * q3 * i4 + 12.0 * q2 * t2 * i5 - 15.0 * q1 * t2**2 * i6 + 4.0 * q1 * t3 * i5
    result[2, 4] = 6.0 * q1 * t2 * i5 - 3.0 * q2 * i4
    result[2, 5] = -q1 * i4
    return np.asarray(result / limits.T[:, None, None, :])


def curvature(angle: Array, time: Array, limits: Array, weights: Array) -> Array:
    """Second derivatives by the six derivatives of the sum of ``weights`` (3, P, J) times ratios: (6, 6, P, J)."""
    q1, q2, q3 = angle
    t1, t2, t3 = time[:, :, None]
    i1 = 1.0 / t1
    i2, i3, i4, i5, i6, i7 = (i1**power for power in range(2, 8))
    v, a, j = weights / limits.T[:, None, :]
    result = np.zeros((6, 6, *q1.shape))
    result[0, 3] = -i2 * v + 3.0 * t2 * i4 * a + (4.0 * t3 * i5 - 15.0 * t2**2 * i6) * j
    result[0, 4] = -i3 * a + 6.0 * t2 * i5 * j
    result[0, 5] = -i4 * j
    result[1, 3] = -2.0 * i3 * a + 12.0 * t2 * i5 * j
    result[1, 4] = -3.0 * i4 * j
    result[2, 3] = -3.0 * i4 * j
    result[3, 4] = 3.0 * q1 * i4 * a + (12.0 * q2 * i5 - 30.0 * q1 * t2 * i6) * j
    result[3, 5] = 4.0 * q1 * i5 * j
    result += result.swapaxes(0, 1)
    result[3, 3] = 2.0 * q1 * i3 * v + (6.0 * q2 * i4 - 12.0 * q1 * t2 * i5) * a
    result[3, 3] += (12.0 * q3 * i5 - 60.0 * q2 * t2 * i6 + 90.0 * q1 * t2**2 * i7 - 20.0 * q1 * t3 * i6) * j
    result[4, 4] = 6.0 * q1 * i5 * j
    return result
