"""Feeds the parser and every handler random and mutated frames: fuzz.py FRAMES SEED.

No exception may escape, no frame with a wrong check may be acted on, no motion may start. Prints how many
frames went in, were acted on, and how often each handler got past the length check.
"""

import random
import sys
from binascii import crc32
from struct import calcsize, pack_into, unpack_from

import flash
import stand_in

stand_in.install()

from armtempo_board.app.app import App  # noqa: E402
from armtempo_board.link import frame_reader, serial_link  # noqa: E402
from armtempo_board.storage import motion_file, store  # noqa: E402
from armtempo_shared import wire  # noqa: E402
from armtempo_shared.table import rows  # noqa: E402

FRAMES, SEED = int(sys.argv[1]), int(sys.argv[2])
BATCH = 200
IDS = [row[1] for row in rows("C")]


def speed_up():
    """On CPython: the same as the viper functions in ``buffers``, by its own fast means."""

    def apply_crc(table, data, places, there):
        start, end = places & 0x7FFF, places >> 15
        crc = crc32(memoryview(data)[start:end])
        if not there:
            pack_into("<I", data, end, crc)
        return crc == unpack_from("<I", data, end)[0]

    def copy(target, source, places, count):
        to, at = places & 0x7FFF, places >> 15
        target[to : to + count] = source[at : at + count]

    frame_reader.apply_crc = serial_link.apply_crc = apply_crc
    frame_reader.copy = serial_link.copy = copy


class Stream:
    """Gives what it is fed, takes everything."""

    def __init__(self):
        self.data = b""
        self.at = 0

    def feed(self, data):
        self.data = data
        self.at = 0

    def readinto(self, buffer, count):
        piece = self.data[self.at : self.at + count]
        if not piece:
            return None
        buffer[: len(piece)] = piece
        self.at += len(piece)
        return len(piece)

    def write(self, buffer, offset, count):
        return count


def some_bytes(count):
    return bytes([random.getrandbits(8) for _ in range(count)])


def below(limit):
    return random.getrandbits(16) % limit


NAMES = (b"feed", b"", b"other", b"/arm", b"feedother", b"\xff", b"a" * 25)


def payload(number):
    """Payload for a command: right in size more often than not; a start never names the right record."""
    fixed = SIZES.get(number, 0)
    kind = below(8)
    if kind == 0:
        return some_bytes(below(40))
    if kind == 1:
        return bytes(fixed) + NAMES[below(len(NAMES))]
    return some_bytes(fixed) + (NAMES[below(len(NAMES))] if kind < 6 else some_bytes(below(12)))


def mutated(frame):
    """The frame with a byte changed, lost or doubled, its end cut off, or a piece of another in it."""
    at = below(len(frame))
    kind = below(5)
    if kind == 0:
        return frame[:at] + bytes((frame[at] ^ 1 << below(8),)) + frame[at + 1 :]
    if kind == 1:
        return frame[:at] + frame[at + 1 :]
    if kind == 2:
        return frame[: at + 1] + frame[at:]
    if kind == 3:
        return frame[:at]
    return frame[:at] + some_bytes(below(6)) + frame[at:]


def one():
    kind = below(8)
    if kind == 0:
        broken = mutated(START)
        return b"" if START in broken else broken  # unharmed with something after it: it would start
    if kind == 1:
        return bytes((wire.SYNC,)) + some_bytes(below(20))
    number = IDS[below(len(IDS))] if below(16) else below(256)
    frame = wire.frame(below(256), number, payload(number))
    return mutated(frame) if kind < 5 else frame


def board():
    """A configured and homed board with "feed" stored, on a flash in memory."""
    chip = flash.Flash()
    store.os = chip
    store.open = motion_file.open = chip.open
    port = stand_in.Port()
    app = App(port, "/flash")
    host = stand_in.Host(app, port)
    host.hello()
    host.upload("/arm", stand_in.arm())
    record = stand_in.record(stand_in.arm())
    assert host.upload("feed", record)[-1][0] == "ok"
    assert host.ask("home", (3,), bytes(8))[0] == "ok"
    return app, record


SIZES = {}
for _row in rows("C"):
    SIZES[_row[1]] = calcsize(_row[2])
app, record = board()
START = wire.frame(1, 0x21, wire.encode(wire.COMMAND["start"], (0, wire.record_crc(record)), "feed"))
if sys.implementation.name == "cpython":
    speed_up()
random.seed(SEED)
stream = app.link.stream = Stream()
acted = 0
reached = {}
given = 0
while given < FRAMES:
    count = min(BATCH, FRAMES - given)
    given += count
    stream.feed(b"".join([one() for _ in range(count)]))
    idle = 0
    while idle < 70:
        if app.link.poll():
            data, length = app.link.reader.data, app.link.reader.length()
            check = crc32(bytes(data[1 : 5 + length]))
            assert check == unpack_from("<I", data, 5 + length)[0], "a wrong check was accepted"
            app.commands.act()
            acted += 1
            reached[data[4]] = reached.get(data[4], 0) + 1
        if stream.at == len(stream.data):
            idle += 1
            stand_in.Clock.now_ms += 1
        app.link.flush()
    assert app.controller.board.engine.calls.count("start") == 0, "a motion started"
    assert app.controller.board.fault() == 0
print(given, acted, app.link.reader.bad)
print(len([n for n in IDS if reached.get(n)]) == len(IDS))
