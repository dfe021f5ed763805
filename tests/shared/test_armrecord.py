"""The arm record: what is packed is found again, what is damaged is refused."""

from __future__ import annotations

import random
import struct

import pytest
from armtempo_shared import armrecord, limits

BITS = {"B": 8, "H": 16, "I": 32, "i": 31}


def made(joints: int, seed: int = 3) -> tuple[dict[str, int], list[dict[str, int]]]:
    rng = random.Random(seed)
    head = {name: rng.getrandbits(BITS[kind]) for name, kind in armrecord.HEAD}
    rows = [{name: rng.getrandbits(BITS[kind]) for name, kind in armrecord.JOINT} for _ in range(joints)]
    rows[0]["min_steps"] = -(2**31)
    return head, rows


@pytest.mark.parametrize("joints", range(1, limits.MAX_JOINTS + 1))
def test_round_trip(joints: int) -> None:
    head, rows = made(joints)
    data = armrecord.pack(head, rows)
    found_head, found_rows, crc = armrecord.unpack(data)
    assert found_head == head
    assert found_rows == rows
    assert crc == int.from_bytes(data[-4:], "little") == armrecord.crc32(data[:-4])


def test_any_changed_bit_or_length_is_refused() -> None:
    data = armrecord.pack(*made(2))
    for bit in range(8 * len(data)):
        broken = bytearray(data)
        broken[bit // 8] ^= 1 << bit % 8
        with pytest.raises(armrecord.ArmRecordError):
            armrecord.unpack(bytes(broken))
    for size in range(len(data)):
        with pytest.raises(armrecord.ArmRecordError):
            armrecord.unpack(data[:size])


@pytest.mark.parametrize(("offset", "value"), [(4, armrecord.VERSION + 1), (5, 0), (5, 7), (0, 0)])
def test_other_versions_are_refused_even_with_a_right_checksum(offset: int, value: int) -> None:
    data = bytearray(armrecord.pack(*made(2))[:-4])
    data[offset] = value
    with pytest.raises(armrecord.ArmRecordError):
        armrecord.unpack(bytes(data) + struct.pack("<I", armrecord.crc32(data)))
