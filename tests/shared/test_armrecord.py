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


def wired(outputs: int, inputs: int, seed: int = 5) -> tuple[list[dict[str, int]], list[dict[str, int]]]:
    rng = random.Random(seed)
    fields = ((armrecord.OUTPUT, outputs), (armrecord.INPUT, inputs))
    first, second = (
        [{name: rng.getrandbits(BITS[kind]) for name, kind in table} for _ in range(count)]
        for table, count in fields
    )
    return first, second


@pytest.mark.parametrize(
    ("outputs", "inputs"), [(1, 0), (0, 1), (3, 2), (limits.MAX_OUTPUTS, limits.MAX_INPUTS)]
)
def test_round_trip_with_outputs_and_inputs(outputs: int, inputs: int) -> None:
    head, rows = made(3)
    data = armrecord.pack(head, rows, *wired(outputs, inputs))
    assert armrecord.unpack(data)[:2] == (head, rows)
    assert armrecord.unpack_outputs(data) == wired(outputs, inputs)


def test_an_arm_without_has_the_bytes_that_it_always_had() -> None:
    """Layout of version 2, written out here: a board of that version takes it."""
    head, rows = made(2)
    wanted = struct.pack("<4sBBHHHHHHI", b"ATA1", 2, 2, *head.values())
    wanted += b"".join(struct.pack("<BBBBiiiiIIBBBB", *row.values()) for row in rows)
    assert armrecord.pack(head, rows) == wanted + struct.pack("<I", armrecord.crc32(wanted))
    assert armrecord.unpack_outputs(armrecord.pack(head, rows)) == ([], [])


def test_a_program_from_before_refuses_what_it_does_not_know() -> None:
    """It takes version 2 only, and the record with outputs is of version 3."""
    assert armrecord.pack(*made(1))[4] == 2
    assert armrecord.pack(*made(1), *wired(1, 0))[4] == 3


@pytest.mark.parametrize(("place", "count"), [(0, 9), (0, 2), (1, 9), (1, 0), (0, 0)])
def test_wrong_counts_are_refused_even_with_a_right_checksum(place: int, count: int) -> None:
    plain = armrecord.pack(*made(1))
    data = bytearray(armrecord.pack(*made(1), *wired(1, 1))[:-4])
    data[len(plain) - 4 + place] = count
    with pytest.raises(armrecord.ArmRecordError, match="length"):
        armrecord.unpack(bytes(data) + struct.pack("<I", armrecord.crc32(data)))


@pytest.mark.parametrize("outputs", [0, 2])
def test_any_changed_bit_or_length_is_refused(outputs: int) -> None:
    data = armrecord.pack(*made(2), *wired(outputs, outputs))
    for bit in range(8 * len(data)):
        broken = bytearray(data)
        broken[bit // 8] ^= 1 << bit % 8
        with pytest.raises(armrecord.ArmRecordError):
            armrecord.unpack(bytes(broken))
    for size in range(len(data)):
        with pytest.raises(armrecord.ArmRecordError):
            armrecord.unpack(data[:size])


@pytest.mark.parametrize(
    ("offset", "value"), [(4, armrecord.VERSION + 2), (4, armrecord.VERSION - 1), (5, 0), (5, 7), (0, 0)]
)
def test_other_versions_are_refused_even_with_a_right_checksum(offset: int, value: int) -> None:
    data = bytearray(armrecord.pack(*made(2))[:-4])
    data[offset] = value
    with pytest.raises(armrecord.ArmRecordError):
        armrecord.unpack(bytes(data) + struct.pack("<I", armrecord.crc32(data)))


def test_each_flag_is_a_bit_of_its_own() -> None:
    flags = [value for name, value in vars(armrecord).items() if name.startswith("FLAG_")]
    assert len(flags) == 5
    assert sorted(flags) == [1 << bit for bit in range(len(flags))]
