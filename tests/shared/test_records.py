"""Records of arms, motions and sequences: what is packed is found again, damage is refused; versions of all formats."""

from __future__ import annotations

import random
import struct
from binascii import crc32
from dataclasses import dataclass
from pathlib import Path

import pytest
from armtempo.model import arm_json, plan_file
from armtempo.ports import claim_file
from armtempo.report import run_folder
from armtempo_shared import (
    armrecord,
    codes,
    limits,
    meanings,
    messages,
    motion,
    sequence,
    sequence_check,
    wire,
)
from armtempo_shared.sequence import SequenceData, SequenceError
from armtempo_shared.table import rows

from tests import sources
from tests.shared import stored_bytes

BITS = {"B": 8, "H": 16, "I": 32, "i": 31}
ARM_CRC = 0x12345678
RAMPS = tuple(range(1, 65)), tuple(range(1000, 65000, 2000)), 14, 0
Row = tuple[int, int, int, int, int]
LARGEST = {
    sequence.MOVE: (0, 0),
    sequence.OUTPUT: (65_535, 0),
    sequence.WAIT: (0, 3_600_000),
    sequence.WAIT_INPUT: (1 + 4, 3_600_000),
    sequence.REPEAT: (1, 1_000_000),
    sequence.END: (1, 0),
    sequence.COUNT: (0, 0),
}
"""The most that a row's value and amount may be."""


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


@pytest.mark.parametrize(("outputs", "inputs"), [(0, 0), (3, 2)])
def test_round_trip_with_backlash(outputs: int, inputs: int) -> None:
    head, rows = made(3)
    others = wired(outputs, inputs)
    backlash = [{"steps": steps, "on_motor": 1, "spare": 0, "pace": 70_000 * steps} for steps in (0, 40, 5)]
    data = armrecord.pack(head, rows, *others, backlash)
    assert armrecord.unpack(data)[:2] == (head, rows)
    assert armrecord.unpack_outputs(data) == others
    assert armrecord.unpack_backlash(data) == backlash
    assert armrecord.backlash_count(backlash) == 2
    assert armrecord.unpack_backlash(armrecord.pack(head, rows, *others)) == []
    with pytest.raises(armrecord.ArmRecordError, match="length"):
        armrecord.unpack(data[:-12] + data[-4:])


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
    assert len(flags) == 6
    assert sorted(flags) == [1 << bit for bit in range(len(flags))]


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
        (6, 32, "version"),
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


@dataclass(frozen=True)
class Record:
    """What the check asks of a record: its rows, one motion and one counter."""

    all_rows: tuple[Row, ...]
    motions: int = 1
    counters: int = 1

    @property
    def rows(self) -> int:
        return len(self.all_rows)

    def row(self, index: int) -> Row:
        return self.all_rows[index]

    def motion(self, index: int) -> tuple[str, int]:
        return "a", index

    def counter(self, index: int) -> str:
        return "parts"


def with_row(op: int, value: int, amount: int) -> Record:
    """A record around one row: what is repeated begins and ends."""
    before = ((sequence.REPEAT, 0, 0, 2, 1),) if op == sequence.END else ()
    after = ((sequence.END, 0, 0, 0, 1),) if op == sequence.REPEAT else ()
    return Record((*before, (op, 0, value, amount, 1), *after))


@pytest.mark.parametrize("op", LARGEST)
def test_values_and_amounts_have_their_bounds(op: int) -> None:
    value, amount = LARGEST[op]
    sequence_check.check(with_row(op, value, amount))  # type: ignore[arg-type]
    for beyond in ((value + 1, amount), (value, amount + 1)):
        with pytest.raises(SequenceError, match="row"):
            sequence_check.check(with_row(op, *beyond))  # type: ignore[arg-type]


@pytest.mark.parametrize("op", [0, max(LARGEST) + 1])
def test_other_ops_are_refused(op: int) -> None:
    with pytest.raises(SequenceError):
        sequence_check.check(with_row(op, 0, 0))  # type: ignore[arg-type]


@pytest.mark.parametrize(("magic", "said"), [(b"XXXX", "no sequence record"), (b"ATS1", "another version")])
def test_other_files_are_no_sequence(magic: bytes, said: str) -> None:
    with pytest.raises(SequenceError, match=said):
        SequenceData(magic + bytes(60))


def test_a_record_has_all_that_its_header_says() -> None:
    """Also one whose checksum holds for less; the host may keep more at its end."""
    data = sequence.pack(0, [(sequence.WAIT, 0, 0, 100, 1)], [])
    longer = data[:-4] + bytes(9)
    found = SequenceData(longer + struct.pack("<I", crc32(longer)))
    assert (found.end, found.row(0)) == (len(data) - 4, (sequence.WAIT, 0, 0, 100, 1))
    shorter = data[:-5]
    with pytest.raises(SequenceError, match="length does not fit the header"):
        SequenceData(shorter + struct.pack("<I", crc32(shorter)))


def test_a_motions_name_is_text() -> None:
    head = struct.pack("<4sIHBB", sequence.MAGIC, 0, 1, 1, 0)
    rows = struct.pack("<BBHIH", sequence.MOVE, 0, 0, 0, 1)
    data = head + rows + struct.pack("<24sI", b"\xff" * 24, 0)
    with pytest.raises(SequenceError, match="a motion's name"):
        SequenceData(data + struct.pack("<I", crc32(data))).motion(0)


# versions of formats: a layout that changes gets another one, so that nothing is taken for something else


def test_versions_are_those_of_files_that_exist() -> None:
    versions = {
        "arm": arm_json.VERSION,
        "trajectory": plan_file.OF_JOB.versions[-1],
        "sequence": plan_file.OF_SEQUENCE.versions[-1],
        "run": run_folder.VERSION,
        "claim": claim_file.VERSION,
        "arm record": armrecord.VERSION,
        "protocol": messages.PROTOCOL_VERSION,
    }
    assert versions == {
        "arm": 1,
        "trajectory": 2,
        "sequence": 2,
        "run": 2,
        "claim": 1,
        "arm record": 2,
        "protocol": 8,
    }


# a layout that changes gets another version: what an older program wrote is not taken for something else


def test_each_version_has_the_bytes_that_it_had() -> None:
    kept = stored_bytes.kept()
    for name, made in stored_bytes.layouts().items():
        assert name in kept, f"{name} is new: 'python -m tests.shared.stored_bytes' keeps its bytes"
        assert made == kept[name], f"{name}: another layout needs another version"


def test_no_message_is_dropped_under_the_same_version() -> None:
    version = f"protocol {wire.PROTOCOL_VERSION}, "
    assert {name for name in stored_bytes.kept() if name.startswith(version)} <= stored_bytes.layouts().keys()


# the protocol page and the message table say the same


SCRIPT = Path(__file__).parents[2] / "shared" / "docs" / "make_protocol.py"


def test_page_is_current() -> None:
    script = sources.script(SCRIPT)
    text = script.PAGE.read_text()
    assert script.page(text) == text, "run: python shared/docs/make_protocol.py"


def test_every_message_and_code_has_its_words() -> None:
    commands = {row[0] for row in [*rows("C"), *rows("O"), *rows("S")]}
    assert set(meanings.COMMANDS) == commands == {row[0] for row in [*rows("A"), *rows("P"), *rows("T")]}
    assert set(meanings.EVENTS) == {row[0] for row in [*rows("E"), *rows("R")]}
    numbers = {name: value for name, value in vars(codes).items() if name.isupper()}
    assert {name.upper(): code for name, code in meanings.ERROR_CODES.items()} == numbers
    assert len(set(numbers.values())) == len(numbers)
    assert all(meaning and cure for _, meaning, cure in meanings.ERRORS.values())


def test_numbers_are_used_once_and_answers_match_their_commands() -> None:
    commands, answers = [*rows("C"), *rows("O"), *rows("S")], [*rows("A"), *rows("P"), *rows("T")]
    others = [*rows("E"), *rows("R")]
    numbers = [row[1] for row in commands + others]
    assert len(set(numbers)) == len(numbers)
    assert [row[:2] for row in commands] == [row[:2] for row in answers]


def test_flags_and_numbers_are_those_that_are_explained() -> None:
    assert f"`flags` {messages.START_HOMING}:" in meanings.COMMANDS["start"]
    assert f"`flags` {messages.SAMPLE_BRAKING}:" in meanings.EVENTS["sample"]
    for event in ("fault", "error"):
        assert f"`joint` {messages.NO_JOINT} if" in meanings.EVENTS[event]
    assert messages.ARM_RECORD_NAME in meanings.COMMANDS["put_begin"]
    assert f"`{messages.ONCE_NAME}`" in meanings.COMMANDS["start"]
