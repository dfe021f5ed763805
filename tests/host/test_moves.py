"""Moves without a search, and motion records read back."""

from __future__ import annotations

import numpy as np
import pytest
from armtempo.basics.errors import InputError
from armtempo.model.arm import Arm
from armtempo.planning import point_to_point
from armtempo.records import decode, encode

ARM = Arm.paper()
START, END = np.array([0.0, -60.0, 40.0]), np.array([180.0, -38.0, -52.0])


@pytest.mark.parametrize("seed", range(20))
def test_straight_keeps_the_limits_and_uses_one_of_them(seed: int) -> None:
    numbers = np.random.default_rng(seed)
    low, high = np.array([joint.range_deg for joint in ARM.driven]).T
    start, end = numbers.uniform(low, high, (2, 3))
    if seed % 2:
        end = start + 0.01 * (end - start)
    motion = point_to_point.straight("x", start, end, ARM)
    np.testing.assert_allclose([motion(0.0), motion(motion.duration_s)], [start, end], atol=1e-9)
    times = np.linspace(0.0, motion.duration_s, 4001)
    limits = np.array([joint.limits.values for joint in ARM.driven if joint.limits]).T
    shares = [np.abs(motion(times, order)).max(axis=0) / limits[order - 1] for order in (1, 2, 3)]
    assert 0.99 < np.max(shares) <= 1.0
    for order in (1, 2):
        np.testing.assert_allclose(motion(np.array([0.0, motion.duration_s]), order), 0.0, atol=1e-7)


def test_straight_refuses_what_is_out_of_range() -> None:
    with pytest.raises(InputError, match="joint 1: 200 degrees is outside"):
        point_to_point.straight("x", START, [200.0, -60.0, 0.0], ARM)
    with pytest.raises(InputError, match="3 angles, not 2"):
        point_to_point.straight("x", START, [0.0, 0.0], ARM)


def test_backwards_mirrors_time() -> None:
    motion = point_to_point.straight("x", START, END, ARM)
    back = point_to_point.backwards(motion, "y")
    times = np.linspace(0.0, motion.duration_s, 101)
    np.testing.assert_allclose(back(times), motion(motion.duration_s - times), atol=1e-9)


def test_records_read_back() -> None:
    motion = point_to_point.straight("x", START, END, ARM)
    data = encode.motion_record(motion, ARM)
    found = decode.trajectory(data, ARM.driven, "x")
    times = np.linspace(0.0, motion.duration_s, 101)
    np.testing.assert_allclose(found(times), motion(times), atol=1e-7)
    with pytest.raises(InputError, match="not a motion record"):
        decode.trajectory(data[:-1], ARM.driven, "x")
