"""Passes of the loop while moving with the heap locked: MicroPython raises MemoryError if anything allocates.

Samples come and go, the host asks for status and samples, sets outputs and reads inputs; prints what was done that way.
"""

import sys

import micropython
import stand_in

stand_in.install()

from armtempo_board.app.app import App  # noqa: E402
from armtempo_shared import messages, wire  # noqa: E402
from pin_rows import GRIPPER, PART, PUMP  # noqa: E402

TURNS = 2000


class Still:
    """An engine whose own work allocates nothing, and which has a sample every 40th time."""

    def __init__(self):
        self.moving = True
        self.fault = 0
        self.fault_joint = 255
        self.known = 3
        self.rates = stand_in.Rates()
        self.turns = 0
        self.due = False

    def service(self):
        self.turns += 1
        self.due = self.due or self.turns % 40 == 0

    def refill(self):
        pass

    def next_sample(self, raw):
        due = self.due
        self.due = False
        raw[0] = self.turns
        return due

    def snapshot(self, raw):
        raw[0] = self.turns

    def brake(self):  # if the last hold is more than 300 ms ago
        pass

    freeze = brake

    def rest_ms(self):
        return 1000


class Port:
    """Gives one prepared frame after the other, one every 20 turns; takes everything and counts it."""

    def __init__(self, frames):
        self.frames = frames
        self.frame = 0
        self.at = 0
        self.taken = 0
        self.open = False

    def readinto(self, buffer, count):
        if not self.open:
            return None
        data = self.frames[self.frame]
        given = 0
        while given < count and self.at < len(data):
            buffer[given] = data[self.at]
            self.at += 1
            given += 1
        if self.at == len(data):
            self.at = 0
            self.frame = (self.frame + 1) % len(self.frames)
            self.open = False
        return given

    def write(self, buffer, start, count):
        self.taken += count
        return count


def command(sequence, name, *values):
    entry = wire.COMMAND[name]
    return wire.frame(sequence, entry[1], wire.encode(entry, values))


def prepared():
    port = stand_in.Port()
    app = App(port, sys.argv[1])
    host = stand_in.Host(app, port)
    host.hello()
    arm = stand_in.arm(outputs=(PUMP, GRIPPER), inputs=(PART,))
    assert host.upload("/arm", arm)[-1][0] == "ok"
    record = stand_in.record(arm)
    host.upload("feed", record)
    host.ask("home", (3,), bytes(8))
    assert host.ask("start", (messages.START_HELD, wire.record_crc(record)), "feed")[0] == "ok"
    return app


app = prepared()
frames = []
for number in range(40):
    others = ("hold",) if number % 4 else ("status",)
    frames.append(command(number, "samples", 5 * number, 3) if number % 2 else command(number, *others))
for number in range(8):
    frames.append(command(50 + 2 * number, "output", number % 3, 9000 * number))  # there are two
    frames.append(command(51 + 2 * number, "inputs"))
frames.append(b"noise" + frames[0][:-1] + b"x")
frames.append(command(200, "home", 0) + command(201, "list", 0))
app.link.stream = port = Port(frames)
app.controller.board.engine = Still()
app.run_once()
stand_in.Pin.levels["D1"] = 1
micropython.heap_lock()
for turn in range(TURNS):
    if turn % 20 == 0:
        port.open = True
    stand_in.Clock.now_ms += 1
    stand_in.Pin.levels["D1"] = turn // 100 % 2
    app.run_once()
micropython.heap_unlock()
assert app.controller.board.fault() == 0, app.controller.board.fault()
assert app.controller.board.samples.next > TURNS // 10 - 5
assert port.taken > TURNS
assert app.controller.board.outputs.values[1] and app.controller.board.inputs.levels == 0
print(app.controller.board.samples.next, app.controller.board.samples.first, port.taken)
