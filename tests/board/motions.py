"""Motion records for tests of the evaluator, made straight from via points and intervals."""

from __future__ import annotations

import numpy as np
from armtempo.splines import bspline, time_axis
from armtempo_shared import limits, motion
from numpy.typing import NDArray

Array = NDArray[np.float64]

VIA_DEG = np.array(
    [
        [0.0, -60.0, 40.0],
        [20.0, -75.0, 50.0],
        [40.0, -110.0, 70.0],
        [90.0, -85.0, 40.0],
        [130.0, -60.0, 10.0],
        [160.0, -45.0, -20.0],
        [180.0, -38.0, -52.0],
    ]
)
"""Table 3 of the paper, joint 3's P5 corrected."""

INTERVALS_S = (
    (1.514, 0.502, 1.628, 0.722, 0.253, 1.413),
    (1.030, 1.834, 1.854, 0.245, 0.447, 1.000),
    (0.770, 1.201, 1.591, 0.556, 0.986, 1.690),
)
STEPS_PER_DEG = np.array([6400.0, 16000.0 * 2, 6400.0]) * 2 / 360 / np.array([1, 2, 1])


def record(via_steps: list[Array], intervals_s: list[Array], degree: int, refine: int = 1) -> bytes:
    """A motion record: via points of each joint, and intervals (n * refine) of each joint or one for all."""
    angles = [_fixed(bspline.fit(via, degree), limits.STEP_FRACTION_BITS) for via in via_steps]
    times = [
        _fixed(time_axis.control_points(row, degree) * limits.TICK_HZ, limits.TICK_FRACTION_BITS)
        for row in intervals_s
    ]
    return motion.pack(degree, angles, times, refine, motion.no_ramps(), 0)


def feeding(degree: int = 5, slower: float = 1.0, finer: float = 1.0, refine: int = 1) -> bytes:
    """The paper's motion; ``refine`` > 1 wobbles the parts of each interval."""
    vias = [finer * STEPS_PER_DEG[joint] * VIA_DEG[:, joint] for joint in range(3)]
    rows = []
    for joint in range(3):
        parts = np.repeat(np.array(INTERVALS_S[joint]) * slower / refine, refine)
        rows.append(parts * (1 + 0.3 * np.sin(np.arange(len(parts)) * 2.1)) if refine > 1 else parts)
    return record(vias, rows, degree, refine)


def cruise(rate: float, joints: int = 1, ramp_s: float = 0.5, total_s: float = 2.0) -> bytes:
    """Up to ``rate`` steps/s, a long way at that rate, down again."""
    interval = 0.1
    times = np.arange(round(total_s / interval) + 1) * interval
    grid = np.linspace(0.0, total_s, 20001)
    up, down = np.clip(grid / ramp_s, 0, 1), np.clip((total_s - grid) / ramp_s, 0, 1)
    least = np.minimum(up, down)
    speed = rate * least**3 * (10 - 15 * least + 6 * least**2)
    way = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2)]) * grid[1]
    via = np.interp(times, grid, way)
    via[-1] = np.rint(via[-1])
    return record([via] * joints, [np.full(len(times) - 1, interval)], 5)


def steady(rate: float) -> bytes:
    """One second at about ``rate`` steps/s from beginning to end, for measuring: it does not start from rest."""
    places = np.arange(15) - 2.0
    angles = rate / 10 * (places + 0.004 * np.sin(np.arange(15)))
    times = _fixed(places * limits.TICK_HZ / 10, limits.TICK_FRACTION_BITS)
    return motion.pack(5, [_fixed(angles, limits.STEP_FRACTION_BITS)], [times], 1, motion.no_ramps(), 0)


def chance(rng: np.random.Generator) -> bytes:
    """One joint, everything random: degree, segments, refinement, distances, speeds, where it begins."""
    degree = int(rng.choice([3, 5]))
    segments = int(rng.integers(1, 6))
    refine = int(rng.choice([1, 1, 2, 3, 4, 8]))
    size = 10 ** rng.uniform(-0.5, 3.5)
    via = rng.uniform(-size, size, segments + 1) + rng.uniform(-1000, 1000)
    if rng.random() < 0.3:
        via[-1] = via[0]
    if rng.random() < 0.3:
        via = np.rint(via)
    speed = 10 ** rng.uniform(1.0, 4.8)
    typical_s = max(size / speed, 0.004)
    intervals = typical_s / refine * rng.uniform(0.3, 2.0, segments * refine)
    return record([via], [intervals], degree, refine)


def _fixed(values: Array, bits: int) -> list[int]:
    return [int(value) for value in np.rint(values * 2.0**bits)]


NAMED = {
    "feeding": feeding,
    "refined": lambda: feeding(refine=8, slower=1.1),
    "refined by three": lambda: feeding(refine=3),
    "cubic": lambda: feeding(degree=3),
    "cubic refined": lambda: feeding(degree=3, refine=8),
    "ten minutes": lambda: feeding(slower=88.3, finer=4.0),
    "333 000 steps/s": lambda: cruise(333_000),
    "thirtyfold microsteps": lambda: feeding(finer=30.0),
    "two steps": lambda: record([np.array([0.0, 2.0])], [np.array([0.01])], 5),
    "less than a step": lambda: record([np.array([0.2, 0.45, 0.1])], [np.array([0.1, 0.1])], 5),
    "no way at all": lambda: record([np.array([7.0, 7.0])], [np.array([0.5])], 5),
    "20 ms": lambda: record([np.array([0.0, 700.0])], [np.array([0.02])], 5),
    "to half steps": lambda: record([np.array([0.0, 12.5, -3.5, 0.5])], [np.full(3, 0.2)], 5),
}
