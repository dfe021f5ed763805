"""What the cases of sequences share: motions, outputs and inputs, a board with a sequence on it."""

import sys

import stand_in
from app_rig import connected
from armtempo_shared import armrecord, motion, sequence, wire

del sys.modules["armtempo_board.motion.endpoints"]  # the real one
from armtempo_board.motion import endpoints  # noqa: E402, F401

MOVE, OUTPUT, WAIT, INPUT = sequence.MOVE, sequence.OUTPUT, sequence.WAIT, sequence.WAIT_INPUT
REPEAT, END, COUNT = sequence.REPEAT, sequence.END, sequence.COUNT
ARM_CRC = armrecord.unpack(stand_in.arm())[2]
ONE_STEP = 1 << 28
ONE_TICK = 1 << 16


class Outputs:
    """Remembers what was set."""

    def __init__(self, count=2):
        self.values = [0] * count
        self.log = []

    def set(self, number, value):
        self.log.append((number, value))
        self.values[number] = value

    def safe(self):
        pass

    def close(self):
        pass


class Inputs:
    """Levels as a case sets them."""

    count = 1

    def __init__(self):
        self.levels = 0

    def level(self, number):
        return self.levels >> number & 1

    def poll(self, now_ms):
        pass


def leg(first, last, arm_crc=ARM_CRC):
    """A motion of both joints from one step to another."""
    points = [first * ONE_STEP] * 5 + [(first + last) * ONE_STEP // 2] + [last * ONE_STEP] * 5
    times = [1000 * ONE_TICK * index for index in range(len(points))]
    return motion.pack(
        5,
        [points, points],
        [times],
        1,
        ((6,) * motion.REST_ENTRIES, (6,) * motion.OTHER_ENTRIES, 14, 0),
        arm_crc,
    )


LEGS = {"there": leg(0, 10), "back": leg(10, 0), "on": leg(10, 20)}


def ready(rows, legs=LEGS, outputs=2, counters=()):
    """A board with these motions and the sequence "seq", homed at 0; app and host."""
    app, host = connected()
    app.controller.board.outputs = Outputs(outputs) if outputs else None
    app.controller.board.inputs = Inputs() if outputs else None
    for name in sorted(legs):
        assert host.upload(name, legs[name])[-1][0] == "ok"
    put(host, rows, legs, counters=counters)
    return app, host


def put(host, rows, legs=LEGS, name="seq", counters=()):
    """Store a sequence of rows (op, number, value, amount); MOVE's number is the name of a motion."""
    names = sorted(legs)
    numbered = [
        (row[0], names.index(row[1]) if row[0] == MOVE else row[1], row[2], row[3], step)
        for step, row in enumerate(rows, 1)
    ]
    motions = [(leg, wire.record_crc(legs[leg])) for leg in names]
    host.seq = sequence.pack(ARM_CRC, numbered, motions, counters)
    answer = host.upload(name, host.seq)[-1]
    assert answer[0] == "ok", answer


def begin(host, name="seq"):
    return host.ask("start", (0, wire.record_crc(host.seq)), name)


def stands(host):
    """(ending, code, step, row, cycle) of the sequence."""
    host.turn(5)
    kind, fields, name = host.ask("sequence")
    assert kind == "ok" and name in ("seq", b"seq"), name
    return (sequence.ENDINGS[fields[0]],) + fields[1:]


def arrive(app, host, at):
    """The leg that is under way ends at these steps."""
    engine = app.controller.board.engine
    assert engine.moving
    engine.steps = [at, at]
    engine.finish()
    host.turn(5)


def runs(app):
    return app.controller.board.engine.calls.count("start")


def counters_of(host):
    """{name: value} of the counters, and that after the last there is none."""
    found = {}
    count = host.ask("counter", (0,))[1][0]
    for index in range(count):
        _, fields, name = host.ask("counter", (index,))
        assert fields[0] == count
        found[name] = fields[1]
    assert host.ask("counter", (count,)) == host.ask("counter", (255,)) == ("ok", (count, 0), "")
    return found
