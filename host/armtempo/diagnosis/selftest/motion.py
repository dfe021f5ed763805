"""The motions of the self-test: a few steps of the arm's joints, from rest to rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from armtempo_shared import motion as motion_record
from armtempo_shared.limits import STEP_FRACTION_BITS, TICK_FRACTION_BITS, TICK_HZ

from armtempo.basics.arrays import Array
from armtempo.splines import bspline, time_axis
from armtempo.splines.trajectory import JointSpline

_DEGREE = 5
_MOST_STEPS = 200
_FEWER = 15
"""Each joint makes this many steps fewer than the previous one, so that they step at different times."""
DURATION_S = 0.06
_PEAK = 1.875
"""Peak speed of 10 u³ - 15 u⁴ + 6 u⁵ over u in 0..1."""
_ABOVE = 1.01
"""Ratio of a joint's limit to its rate, so that rounding does not exceed it."""
_GENTLE = 0.5
_LONG_RATE = 5000
_SLOT = _DEGREE + 1
"""Segments for each joint that moves alone: those of a control point, and one at rest."""
_LOOKS = 1000
"""Number of times at which the speed of a motion is computed."""
_COUNTS, _LEAST_STEPS = 8, 20
"""Counts of an encoder, or steps of a joint without one, in a gentle motion."""


@dataclass(frozen=True)
class TestMotion:
    """Start in steps; record; times of each joint's steps, seconds; highest step rates."""

    start_steps: list[int]
    record: bytes
    steps_s: list[Array]
    rates: list[int]

    __test__ = False  # for pytest


def limit(rate: float) -> int:
    """The limit in the arm record of a joint that reaches ``rate``."""
    return math.ceil(rate * _ABOVE)


def make(joints: Sequence[dict[str, Any]]) -> TestMotion:
    """A fast motion for disabled drivers, above the joints' limits. ``joints``: rows of the arm record."""
    ends = _about_middle(joints, _quick(joints))
    return _of(joints, [bspline.fit(end, _DEGREE) for end in ends], ends, [DURATION_S])


def back_in_turn(joints: Sequence[dict[str, Any]]) -> TestMotion:
    """Back, one joint after the other, so that only one channel steps."""
    ends = [(end, start) for start, end in _about_middle(joints, _quick(joints))]
    size = _SLOT * len(joints) + _DEGREE
    points = []
    for number, (start, end) in enumerate(ends):
        before = _SLOT * number + _DEGREE  # control points; the joint moves in the segments with some of both
        points.append(np.array([start] * before + [end] * (size - before), dtype=float))
    return _of(joints, points, ends, [DURATION_S / _SLOT] * (_SLOT * len(joints)))


def gentle(joints: Sequence[dict[str, Any]]) -> TestMotion:
    """A motion so slow and small that it does no harm if the drivers are on: upwards, within the joints' ranges."""
    counts = [min(_steps_to_see(joint), joint["max_steps"] - joint["min_steps"]) for joint in joints]
    slowest = min(joint["max_rate"] / max(count, 1) for joint, count in zip(joints, counts, strict=True))
    ends = _about_middle(joints, counts)
    return _of(
        joints,
        [bspline.fit(end, _DEGREE) for end in ends],
        ends,
        [max(DURATION_S, _PEAK / (_GENTLE * slowest))],
    )


def _quick(joints: Sequence[dict[str, Any]]) -> list[int]:
    return [_MOST_STEPS - _FEWER * number for number in range(len(joints))]


def _steps_to_see(joint: dict[str, Any]) -> int:
    """Steps that turn the encoder noticeably."""
    needed = _COUNTS * joint["counts_den"] // max(abs(joint["counts_num"]), 1)
    return int(min(max(needed, _LEAST_STEPS), _MOST_STEPS))


def _about_middle(joints: Sequence[dict[str, Any]], counts: Sequence[int]) -> list[tuple[int, int]]:
    """Start and end of each joint, ``counts`` steps apart, around the middle of its range."""
    lows = [
        (joint["max_steps"] + joint["min_steps"] - count) // 2
        for joint, count in zip(joints, counts, strict=True)
    ]
    return [(low, low + count) for low, count in zip(lows, counts, strict=True)]


def _of(
    joints: Sequence[dict[str, Any]],
    points: Sequence[Array],
    ends: Sequence[tuple[int, int]],
    intervals_s: Sequence[float],
) -> TestMotion:
    """``points``: control points of each joint, steps; ``ends``: first and last step; ``intervals_s``: of segments."""
    times = time_axis.control_points(intervals_s, _DEGREE)
    splines = [JointSpline(_DEGREE, 1, one, times) for one in points]
    angles = [_fixed(spline.angle_points_deg, STEP_FRACTION_BITS) for spline in splines]
    axis = _fixed(times * TICK_HZ, TICK_FRACTION_BITS)
    record = motion_record.pack(_DEGREE, angles, [axis], 1, motion_record.no_ramps(), 0)
    duration_s = sum(intervals_s)
    steps = [_crossings_s(spline, *end, duration_s) for spline, end in zip(splines, ends, strict=True)]
    looks = np.linspace(0.0, duration_s, _LOOKS)
    rates = [
        max(joint["max_rate"], limit(float(np.max(np.abs(spline(looks, 1))))))
        for joint, spline in zip(joints, splines, strict=True)
    ]
    return TestMotion([end[0] for end in ends], record, steps, rates)


def at_rates(rates: Sequence[int], duration_s: float) -> bytes:
    """The record of a motion from step 0 in which all joints reach these rates, steps/s, in the middle."""
    times = time_axis.control_points([duration_s], _DEGREE)
    ends = [rate * duration_s / _PEAK for rate in rates]
    angles = [_fixed(bspline.fit((0.0, end), _DEGREE), STEP_FRACTION_BITS) for end in ends]
    axis = _fixed(times * TICK_HZ, TICK_FRACTION_BITS)
    return motion_record.pack(_DEGREE, angles, [axis], 1, motion_record.no_ramps(), 0)


def evaluated() -> bytes:
    """The record of the motion of ``board: selftest/cycles.py``: about 1000 steps of one joint."""
    return at_rates([20_000], 0.1)


def long(joints: Sequence[dict[str, Any]], duration_s: float) -> TestMotion:
    """From step 0, slow enough to capture all steps; their times are not computed."""
    rates = [_LONG_RATE] * len(joints)
    limits = [max(joint["max_rate"], limit(_LONG_RATE)) for joint in joints]
    return TestMotion([0] * len(joints), at_rates(rates, duration_s), [], limits)


def long_steps(duration_s: float) -> int:
    """Number of steps of each joint in ``long``."""
    return int(_LONG_RATE * duration_s / _PEAK + 0.5)


def _fixed(points: Array, bits: int) -> list[int]:
    return [int(value) for value in np.rint(points * 2.0**bits)]


def _crossings_s(spline: JointSpline, start: int, end: int, duration_s: float) -> Array:
    """Times at which the spline crosses each half step, by bisection: (|end - start|,)."""
    sign = 1 if end > start else -1
    halves = start + sign * (np.arange(abs(end - start)) + 0.5)
    low, high = np.zeros(len(halves)), np.full(len(halves), duration_s)
    for _ in range(30):  # to 0.1 ns
        middle = (low + high) / 2
        before = sign * (spline(middle) - halves) < 0
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.asarray(high)
