"""The motion record: what is packed is found again, what is damaged is refused."""

from __future__ import annotations

import random
import struct

import pytest
from armtempo_shared import limits, motion

ARM_CRC = 0x12345678
RAMPS = tuple(range(1, 65)), tuple(range(1000, 65000, 2000)), 14


def packed(
    degree: int = 5, joints: int = 3, axes: int = 3, segments: int = 6, refine: int = 2, seed: int = 1
) -> bytes:
    rng = random.Random(seed)
    angles = [[rng.getrandbits(63) - 2**62 for _ in range(segments + degree)] for _ in range(joints)]
    times = [[rng.getrandbits(60) for _ in range(segments * refine + degree)] for _ in range(axes)]
    return motion.pack(degree, angles, times, refine, RAMPS, ARM_CRC)


@pytest.mark.parametrize(("joints", "axes"), [(1, 1), (2, 1), (2, 2), (3, 3), (6, 6), (3, 1), (6, 1)])
@pytest.mark.parametrize("degree", [3, 5])
def test_every_point_is_found_at_its_offset(degree: int, joints: int, axes: int) -> None:
    data = packed(degree, joints, axes)
    view = motion.Motion(data)
    assert (view.degree, view.joints, view.segments, view.refine) == (degree, joints, 6, 2)
    assert (view.can_brake, view.arm_crc, view.shared) == (True, ARM_CRC, axes == 1 and joints > 1)
    assert len(data) == motion.size(degree, joints, view.shared, 6, 2)
    rng = random.Random(1)
    for joint in range(joints):
        expected = [rng.getrandbits(63) - 2**62 for _ in range(6 + degree)]
        assert list(struct.unpack_from(f"<{6 + degree}q", data, view.angle_offset(joint))) == expected
    for axis in range(axes):
        expected = [rng.getrandbits(60) for _ in range(12 + degree)]
        assert list(struct.unpack_from(f"<{12 + degree}q", data, view.time_offset(axis))) == expected
    assert {view.time_offset(joint) for joint in range(joints)} == {
        view.time_offset(axis) for axis in range(axes)
    }


def test_any_changed_bit_is_refused() -> None:
    data = packed(joints=1, axes=1, segments=1, refine=1)
    for bit in range(8 * len(data)):
        broken = bytearray(data)
        broken[bit // 8] ^= 1 << bit % 8
        with pytest.raises(motion.MotionError):
            motion.Motion(bytes(broken))


def test_any_other_length_is_refused() -> None:
    data = packed()
    for size in [*range(40), *range(len(data) - 40, len(data))]:
        with pytest.raises(motion.MotionError):
            motion.Motion(data[:size])
    with pytest.raises(motion.MotionError):
        motion.Motion(data + b"\0")


@pytest.mark.parametrize(
    ("offset", "value", "complaint"),
    [
        (4, 4, "degree"),
        (5, 0, "degree"),
        (5, limits.MAX_JOINTS + 1, "degree"),
        (6, 2, "version"),
        (6, 4, "version"),
        (7, 5, "version"),
        (7, 20, "version"),
        (0, ord("B"), "version"),
        (8, 0, "segments"),
        (10, 0, "segments"),
        (9, 2, "segments"),
    ],
)
def test_unknown_kinds_are_refused_even_with_a_right_checksum(
    offset: int, value: int, complaint: str
) -> None:
    data = bytearray(packed()[:-4])
    data[offset] = value
    whole = bytes(data) + struct.pack("<I", motion.crc32(data))
    with pytest.raises(motion.MotionError, match=complaint):
        motion.Motion(whole)
