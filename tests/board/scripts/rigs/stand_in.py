"""Stand-ins for hardware and engine, to test the program above the engine alone, on any interpreter."""

import gc
import os
import sys
import time

from armtempo_shared import armrecord, engine_memory, motion, wire


class Module:
    pass


class Clock:
    """Milliseconds that pass only when a test says so."""

    now_ms = 1000


def ilistdir(path):
    """As MicroPython's, for CPython."""
    return [(name, os.stat(path + "/" + name)[0] & 0xF000, 0) for name in os.listdir(path)]


def _install_quick():
    """The host's memory and disk are its own: to collect and to write all of them takes a tenth of a second each."""
    for module, slow in ((gc, "collect"), (os, "sync")):
        fake = Module()
        fake.__dict__.update(module.__dict__)
        setattr(fake, slow, lambda: None)
        if module is os:
            fake.ilistdir = ilistdir
        sys.modules[module.__name__] = fake


def _install_time():
    fake = Module()
    fake.ticks_ms = lambda: Clock.now_ms
    fake.ticks_diff = lambda end, start: end - start
    fake.time = time.time
    return fake


class Pin:
    IN, OUT_PP, PULL_DOWN, PULL_UP = 0, 1, 2, 3
    levels: "dict[str, int]" = {}

    def __init__(self, name, mode=0, pull=0):
        self.name = name

    def init(self, mode, value=None):
        if value is not None:
            Pin.levels[self.name] = value
        elif mode == Pin.IN:
            Pin.levels.pop(self.name, None)

    def value(self, level=None):
        if level is None:
            return Pin.levels.get(self.name, 0)
        Pin.levels[self.name] = int(level)
        return None


class Timer:
    """A timer whose pulse widths are the levels of its pins."""

    PWM = 0
    made: "dict[int, tuple]" = {}

    def __init__(self, number, prescaler, period):
        self._number = number
        Timer.made[number] = (prescaler, period)

    def channel(self, number, mode, pin, pulse_width):
        pin.value(pulse_width)
        return Channel(pin)

    def deinit(self):
        del Timer.made[self._number]


class Channel:
    def __init__(self, pin):
        self.pulse_width = pin.value


def install():
    """Put the stand-ins where the board program imports them from."""
    if sys.implementation.name == "cpython":
        _install_quick()
    machine = Module()
    machine.unique_id = lambda: b"\x01\x02\x03"
    machine.idle = lambda: None
    pyb = Module()
    pyb.Pin = Pin
    pyb.Timer = Timer
    engine = Module()
    engine.Engine = Engine
    parts = Module()
    parts.EngineParts = lambda *parts: parts
    memory_shares = Module()
    memory_shares.for_engine = EngineMemory
    memory_shares.sample_bytes = lambda: 4096
    memory_shares.resize = lambda made, joints, with_backlash=0: None
    ends = Module()
    ends.duration_ticks = lambda motion: 84000
    ends.start_offset = lambda motion, joint, position: 7 - position
    ends.at_start = lambda motion, joint: 7 * 64
    ends.at_end = lambda motion, joint: 8 * 64
    ahead = Module()
    ahead.NextMotion = NextMotion
    sys.modules["machine"] = machine
    sys.modules["pyb"] = pyb
    sys.modules["armtempo_board.motion.engine"] = engine
    sys.modules["armtempo_board.motion.engine_parts"] = parts
    sys.modules["armtempo_board.app.memory_shares"] = memory_shares
    sys.modules["armtempo_board.motion.endpoints"] = ends
    sys.modules["armtempo_board.motion.next_motion"] = ahead
    sys.modules["time"] = _install_time()
    if not hasattr(sys, "print_exception"):
        sys.print_exception = lambda error, file: file.write(repr(error))


class EngineMemory:
    """Says only how large it is."""

    size = engine_memory.LARGEST_BYTES
    is_short = False


class Rates:
    """How fast, and until when."""

    duration_ticks = 84000
    wanted = 1000


class NextMotion:
    """Is ready after three pieces of work, while the engine has time for them."""

    def __init__(self, engine):
        if engine.no_memory:
            raise MemoryError
        self.engine = engine
        self.expected = [0] * engine.joints
        self.close()

    def close(self):
        self.is_ready = False
        self.motion = None

    def pieces(self, rate, opened, stands_at):
        self.close()
        self.engine.calls.append("prepare")
        yield 1
        motion = opened()
        for joint in range(self.engine.joints):
            yield 1
            self.expected[joint] = stands_at(motion, joint)
        if self.engine.no_memory:
            raise MemoryError
        self.motion = motion
        self.rate = rate
        self.is_ready = True

    def give_back(self):
        assert not self.engine.moving
        self.close()
        self.engine.calls.append("give back")

    def has_time(self):
        return self.engine.has_time

    def starts_from_here(self):
        return self.is_ready and self.expected == self.engine.steps


class Engine:
    """Moves when told, ends when told; remembers what was asked of it."""

    def __init__(self, parts):
        _, joints, _, _ = parts
        self.joints = len(joints)
        self.limits = joints
        self.known = 0
        self.moving = False
        self.fault = 0
        self.fault_joint = 255
        self.calls = []
        self.steps = [0] * self.joints
        self.pending = []
        self.refusal = None
        self.explode = None
        self.rates = Rates()
        self.ticks = 0
        self.skip_check = False
        self.withdrawn = 0
        self.drives = self
        self.unfit = None
        self.has_time = True
        self.no_memory = False

    def check_splines(self, motion):
        self.calls.append("check")
        if self.unfit:
            from armtempo_board.errors import Refused

            raise Refused(*self.unfit)

    def load(self, motion, rate=1000, ready=None, homing=0, seeks=False):
        if ready:
            assert ready.is_ready and ready.motion is motion and ready.rate == rate
        self.calls.append("load ready" if ready else "load unchecked" if self.skip_check else "load")
        self.rates.wanted = rate
        self.homing, self.seeks = homing, seeks
        if self.refusal:
            from armtempo_board.errors import Refused

            raise Refused(*self.refusal)

    def start(self):
        self.calls.append("start")
        self.moving = True
        self.ticks = 0
        self.sample()

    def refill(self):
        """Nothing to do."""

    def service(self):
        if self.explode:
            error, self.explode = self.explode, None
            raise error

    def brake(self):
        self.calls.append("brake")

    def rest_ms(self):
        return 1234

    def change_rate(self, rate):
        self.calls.append("rate")
        self.rates.wanted = rate

    def freeze(self):
        self.calls.append("freeze")
        self.moving = False

    def clear(self):
        self.calls.append("clear")
        self.fault = 0
        return True

    def close(self):
        self.calls.append("close")

    def drivers(self, on):
        self.calls.append("on" if on else "off")
        if not on:
            self.known = 0

    def home(self, mask, steps):
        self.calls.append("home")
        self.known |= mask
        for joint in range(self.joints):
            if mask >> joint & 1:
                self.steps[joint] = steps[joint]

    def commanded(self, joint):
        return self.steps[joint]

    def snapshot(self, raw):
        low = self.ticks & 0xFFFFFFFF
        raw[0] = low - (1 << 32) if low >> 31 else low
        raw[1] = self.ticks >> 32
        raw[2:4] = raw[:2]
        for joint in range(self.joints):
            raw[4 + joint] = self.steps[joint]
            raw[4 + self.joints + joint] = 10 * self.steps[joint]

    def next_sample(self, raw):
        if not self.pending:
            return False
        for i, value in enumerate(self.pending.pop(0)):
            raw[i] = value
        return True

    # for tests

    def sample(self):
        raw = [0] * (4 + 2 * self.joints)
        self.snapshot(raw)
        self.pending.append(raw)

    def advance(self, samples):
        for _ in range(samples):
            self.ticks += 8400000
            self.steps = [step + 1 for step in self.steps]
            self.sample()

    def finish(self):
        self.moving = False


class Port:
    """A serial port: ``inbox`` is what the host sent, ``outbox`` what the board wrote."""

    def __init__(self):
        self.inbox = bytearray()
        self.outbox = bytearray()
        self.space = 1 << 30  # bytes that the host takes before it stalls

    def readinto(self, buffer, count):
        count = min(count, len(self.inbox))
        if not count:
            return None
        buffer[:count] = self.inbox[:count]
        self.inbox = self.inbox[count:]
        return count

    def write(self, buffer, offset, count):
        count = min(count, self.space, 64)
        if not count:
            return None
        self.space -= count
        self.outbox.extend(bytes(buffer[offset : offset + count]))
        return count


class Host:
    """Speaks to an App over a Port, turning the App's loop meanwhile."""

    def __init__(self, app, port):
        self.app = app
        self.port = port
        self.parser = wire.Parser()
        self.sequence = 0
        self.events = []

    def send(self, name, values=(), tail=b"", sequence=None):
        """Put a command into the port; returns its sequence number."""
        if sequence is None:
            self.sequence = sequence = (self.sequence + 1) & 0xFF
        entry = wire.COMMAND[name]
        self.port.inbox.extend(wire.frame(sequence, entry[1], wire.encode(entry, values, tail)))
        return sequence

    def turn(self, turns=50):
        """Let the board's loop run; (sequence, id, payload) of all frames that came; keeps events."""
        frames = []
        for _ in range(turns):
            Clock.now_ms += 1
            self.app.run_once()
        self.parser.feed(bytes(self.port.outbox))
        self.port.outbox = bytearray()
        frame = self.parser.next()
        while frame:
            frames.append(frame)
            self._note(frame)
            frame = self.parser.next()
        return frames

    def ask(self, name, values=(), tail=b""):
        """("ok", fields, tail) or ("error", code name, joint, value) of the answer."""
        sequence = self.send(name, values, tail)
        answer = None
        for got, number, payload in self.turn():
            entry = wire.EVENT_BY_ID[number]
            if entry[0] in ("ok", "error") and got == sequence:
                answer = self._answer(name, entry[0], *wire.decode(entry, payload))
        return answer

    def _note(self, frame):
        entry = wire.EVENT_BY_ID[frame[1]]
        if entry[0] not in ("ok", "error"):
            self.events.append((entry[0],) + wire.decode(entry, frame[2]))

    def _answer(self, name, kind, fields, rest):
        assert fields[0] == wire.COMMAND[name][1]
        if kind == "error":
            return ("error", wire.ERRORS[fields[1]][0]) + fields[2:]
        return ("ok",) + wire.decode(wire.ANSWER[name], rest)

    def hello(self, session=1):
        return self.ask("hello", (wire.PROTOCOL_VERSION, session))

    def upload(self, name, record, piece=100):
        """The answers to begin, pieces and commit."""
        answers = [self.ask("put_begin", (len(record), wire.record_crc(record)), name)]
        for at in range(0, len(record), piece):
            answers.append(self.ask("put_data", (at,), record[at : at + piece]))
        answers.append(self.ask("put_commit", (wire.record_crc(record),)))
        return answers


def arm(joints=2, flags=0, low=0, outputs=(), inputs=()):
    """An arm record."""
    head = {name: 1 for name, _ in armrecord.HEAD}
    head["flags"] = flags
    head["link_timeout_ms"] = 200
    rows = []
    for joint in range(joints):
        row = {name: 1 for name, _ in armrecord.JOINT}
        row.update(channel=joint, encoder=joint, min_steps=low - 1000, max_steps=1000)
        rows.append(row)
    return armrecord.pack(head, rows, outputs, inputs)


def record(arm_record, joints=2, segments=3):
    """A motion record for that arm; its numbers mean nothing."""
    angles = [list(range(segments + 5)) for _ in range(joints)]
    crc = armrecord.unpack(arm_record)[2]
    return motion.pack(
        5, angles, angles, 1, ((6,) * motion.REST_ENTRIES, (6,) * motion.OTHER_ENTRIES, 14, 0), crc
    )
