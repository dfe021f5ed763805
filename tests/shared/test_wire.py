"""Frames: every single fault is noticed, nothing after it is lost, and the board finds the same frames."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import pytest
from armtempo_shared import table, wire

from tests import interpreters

SCRIPT = Path(__file__).parent / "scripts" / "frames.py"


def frames(data: bytes, piece: int = 0) -> list[tuple[int, int, bytes]]:
    """All frames in the bytes, fed in pieces; what is incomplete at the end is given up byte by byte."""
    parser = wire.Parser()
    found = []
    for at in range(0, len(data), piece or len(data)):
        parser.feed(data[at : at + (piece or len(data))])
        while (frame := parser.next()) is not None:
            found.append(frame)
    while parser.pending():
        parser.drop()
        while (frame := parser.next()) is not None:
            found.append(frame)
    return found


def test_a_row_is_found_by_its_number() -> None:
    """And no other number, such as 0xfa, which begins the name of a field, 'fault'."""
    for kind in "CAOPSTER":
        known = {row[1]: row for row in table.rows(kind)}
        for number in range(256):
            if number in known:
                assert table.row_of(kind, number) == known[number]
                continue
            with pytest.raises(KeyError):
                table.row_of(kind, number)


def test_layout() -> None:
    """As the page describes it, byte for byte; the crc32 of "123456789" is the published check value."""
    frame = wire.frame(7, 0x21, b"ab")
    assert frame[:5] == bytes((0xA5, 2, 0, 7, 0x21))
    assert frame[5:7] == b"ab"
    assert len(frame) == 2 + wire.OVERHEAD
    assert int.from_bytes(frame[7:], "little") == wire.crc32(frame[1:7])
    assert wire.crc32(b"123456789") == 0xCBF43926


@pytest.mark.parametrize("size", [0, 1, 17, 255, 256, wire.MAX_PAYLOAD])
def test_round_trip_in_pieces(size: int) -> None:
    payload = random.Random(size).randbytes(size)
    stream = b"noise" + wire.frame(3, 4, payload) + wire.frame(5, 6, b"") + b"\xa5"
    for piece in (0, 1, 2, 7):
        assert frames(stream, piece) == [(3, 4, payload), (5, 6, b"")]


def test_any_changed_bit_is_noticed_and_the_next_frame_found() -> None:
    frame, follower = wire.frame(1, 2, b"payload"), wire.frame(9, 9, b"next")
    for bit in range(8 * len(frame)):
        broken = bytearray(frame)
        broken[bit // 8] ^= 1 << bit % 8
        assert frames(bytes(broken) + follower) == [(9, 9, b"next")], bit


def test_any_lost_or_doubled_byte_is_noticed() -> None:
    frame, follower = wire.frame(1, 2, b"payload"), wire.frame(9, 9, b"next")
    for at in range(len(frame)):
        assert frames(frame[:at] + frame[at + 1 :] + follower) == [(9, 9, b"next")], at
        doubled = frames(frame[: at + 1] + frame[at:] + follower)
        harmless = at in (0, len(frame) - 1)  # the first or last byte twice: the frame itself is whole
        assert doubled == [(1, 2, b"payload")] * harmless + [(9, 9, b"next")], at


def test_a_frame_right_behind_a_stray_start_byte_is_found() -> None:
    """With it the frame's own first bytes make a length that is possible."""
    first, second = wire.frame(1, 2, b""), wire.frame(2, 3, bytes(200))
    assert frames(first[:1] + first + second) == [(1, 2, b""), (2, 3, bytes(200))]


def test_bad_counts_stretches_once() -> None:
    parser = wire.Parser()
    parser.feed(b"xyz" + wire.frame(1, 2, b"") + b"\xa5\xff\xffq" + wire.frame(1, 3, b"") + b"z")
    assert [frame[1] for frame in iter(parser.next, None)] == [2, 3]
    assert parser.bad == 3


@pytest.mark.parametrize("name", list(wire.COMMAND))
def test_fields_survive(name: str) -> None:
    entry = wire.COMMAND[name]
    rng = random.Random(name)
    sizes = {"B": 8, "H": 16, "I": 32, "Q": 64}
    values = tuple(rng.getrandbits(sizes[kind]) for kind in entry[2][1:])
    tail = {"": b"", "text": "naïve", "bytes": b"\xff\x00"}[entry[4]]
    payload = wire.encode(entry, values, tail)
    assert wire.decode(entry, payload) == (values, tail)
    if payload and entry[2] != "<":
        with pytest.raises(wire.WireError, match="length"):
            wire.decode(entry, payload[: len(entry[2]) - 2])


def test_decode_refuses_what_does_not_fit() -> None:
    with pytest.raises(wire.WireError, match="length"):
        wire.decode(wire.COMMAND["status"], b"x")
    with pytest.raises(wire.WireError, match="text"):
        wire.decode(wire.COMMAND["remove"], b"\xff\xfe")


def test_a_field_that_there_is_not_has_no_offset() -> None:
    assert table.offset("C", "hello", "session") == 1
    with pytest.raises(KeyError):
        table.offset("C", "hello", "nothing")


def test_record_crc_names_a_record() -> None:
    body = b"something"
    record = body + wire.crc32(body).to_bytes(4, "little")
    assert wire.record_crc(record) == wire.crc32(body)
    assert wire.crc32(record) == 0x2144DF1C  # the same for all records: no name


@pytest.mark.parametrize("name", interpreters.EACH)
def test_the_board_finds_the_same_frames(name: str, tmp_path: Path) -> None:
    """Host's and board's parser over the same broken stream."""
    seed = 5
    rng = random.Random(seed)
    stream = bytearray()
    for _ in range(400):
        frame = wire.frame(rng.randrange(256), rng.randrange(256), rng.randbytes(rng.randrange(40)))
        if rng.random() < 0.4:
            at = rng.randrange(len(frame))
            frame = frame[:at] + rng.randbytes(rng.randrange(3)) + frame[at + 1 :]
        stream += frame
    (tmp_path / "stream").write_bytes(stream)
    lines = interpreters.run(name, SCRIPT, str(tmp_path / "stream")).splitlines()
    expected = [
        f"{sequence} {number} {payload.hex()}".rstrip() for sequence, number, payload in frames(bytes(stream))
    ]
    assert [line.rstrip() for line in lines] == expected, f"seed {seed}"
    assert len(expected) > 150


def test_module_runs_without_the_host_packages() -> None:
    """shared imports neither side."""
    code = "import sys, armtempo_shared.wire; print([m for m in sys.modules if m in ('armtempo', 'numpy')])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
