"""A whole virtual board in this process: boot.py, main.py, the prompt, resets; a story plays host and world.

A story is a generator that gets a ``World``. Each ``yield`` lets up to a millisecond of the board's time pass,
which nothing but the board's own calls move on, so every run of it is the same.
"""

import builtins
import sys

if sys.implementation.name != "micropython":
    import additions  # noqa: F401
import machine_state
import pace
import power_cycles
from armtempo_shared import armrecord, wire
from bare_board import DEFAULTS
from chip.flash import real_open
from chip.processor import TICKS_PER_MS, print_exception
from firmware import builtin_modules
from firmware.external_interrupts import set_level
from firmware.usb_serial import Serial, SilentPort

builtin_modules.replace_sys()
pace.Pace._elapsed_us = lambda self: 0  # no real time comes in

TICK_HZ = 84_000_000
BUTTON = "A0"
LEDS = {"D12": "idle", "D13": "unhomed", "D14": "fault", "D15": "moving"}
STEP_AND_DIR = (("A15", "E7"), ("A1", "E8"), ("B10", "E10"))  # of the shipped arm's joints
REPEAT_MS = 200  # as the host does it
ANSWERS = 20
say = print
_stock = (builtins.print, builtins.open)
_ROOT = __file__.rsplit("/tests/", 1)[0]
SOURCES = [
    _ROOT + "/board",
    _ROOT + "/shared",
]  # from which the world knows the board, whatever program it has
_before = [name for name in sys.modules if not name.startswith("armtempo_")]
_path = list(sys.path)


class Counter:
    """What a joint's pins did: ``steps`` taken, forward less backward, and the board's time of the last edge."""

    def __init__(self, board, step, direction, inverted):
        self._dir = board.pins.line(direction)
        self._inverted = inverted
        self.steps = 0
        self.last = 0
        board.pins.line(step).sinks.append(self)

    def edges(self, line, before, count, times, origin):
        """STEP toggled."""
        rises = (count + 1 - before) // 2
        self.steps += rises if self._dir.level ^ self._inverted else -rises
        self.last = origin + times[count - 1]


class World(SilentPort):
    """The host at the end of the line, and everything else outside of the board."""

    def __init__(self, story, boot, flash):
        self._story = story(self)
        self._boot = boot
        self.arm = armrecord.unpack(read(flash + "/armtempo/arm.ata"))[:2]
        self.error = None
        self.what = ""  # is being tried, for the message of what fails
        self.counters = []
        self.zero = None
        super().__init__()

    def reset(self):
        """The board was powered up or reset."""
        super().reset()
        self.printed = bytearray()
        self.frames = []
        self.events = []
        self._parser = wire.Parser()
        self._sequence = 0
        self._planned = None
        if machine_state.board:
            self.counters = [
                Counter(machine_state.board, *pins, joint["dir_inverted"])
                for pins, joint in zip(STEP_AND_DIR, self.arm[1])
            ]
            machine_state.board.observers.append(self)
            if self._boot:
                self._boot(self)

    def pump(self):
        """The line is looked at, once a millisecond: the story continues."""
        if self.ended:
            return
        try:
            next(self._story)
        except StopIteration:
            self.ended = True
        except Exception as error:  # raised from here it would be the board's
            self.error = error
            self.ended = True

    def put(self, data):
        """The board sends."""
        if self.attached:
            self.printed.extend(data)
        else:
            self._hear(bytes(data))
        return len(data)

    def _hear(self, data):
        self._parser.feed(data)
        frame = self._parser.next()
        while frame:
            entry = wire.EVENT_BY_ID[frame[1]]
            values, tail = wire.decode(entry, frame[2])
            if entry[0] in ("ok", "error"):
                self.frames.append((frame[0], entry[0], values, tail))
            else:
                self.events.append((entry[0], values, tail))
            frame = self._parser.next()

    # a world for the board

    def counting(self, timer, now):
        """TIM2 starts before a motion: time 0 is when it comes round."""
        if timer.number == 2 and timer.running and timer.count(0) >= 1 << 31:
            self.zero = now + timer.modulus - timer.count(0)
            if self._planned:
                planned, self._planned = self._planned, None
                machine_state.board.at(self.zero + planned[0], planned[1])

    def input_changed(self, line, level, now):
        """Nothing to do."""

    def plan(self, ticks, action):
        """Call ``action()`` when the next motion's time is ``ticks``."""
        self._planned = (ticks, action)

    def steps(self):
        """Where the pins have moved the joints, counted from power-up."""
        return [counter.steps for counter in self.counters]

    def led(self):
        """What the LEDs show; one alone must be lit."""
        lit = [name for name in LEDS if machine_state.board.pins.line(name).level]
        assert len(lit) == 1, lit
        return LEDS[lit[0]]

    # for stories

    def wait(self, ms):
        """Let time pass."""
        end = machine_state.board.now + ms * TICKS_PER_MS
        while machine_state.board.now < end:
            yield

    def until(self, condition, ms=3000):
        """Wait until it holds."""
        end = machine_state.board.now + ms * TICKS_PER_MS
        while not condition():
            assert machine_state.board.now < end, "waited in vain"
            yield

    def type(self, data):
        """Send bytes; Ctrl-C interrupts if the prompt has the port."""
        Serial._take_in(self, data, 1 << 30)

    def press(self, level=1):
        """Press the board's button, or release it."""
        set_level(BUTTON, level)

    def ask(self, name, values=(), tail=b""):
        """The answer's fields and tail; AssertionError if the board refuses."""
        kind, fields, rest = yield from self.answer(name, values, tail)
        assert kind == "ok", (name, fields)
        return fields, rest

    def refused(self, name, values=(), tail=b""):
        """Name of the code with which the board refuses."""
        kind, fields, _ = yield from self.answer(name, values, tail)
        assert kind == "error", (name, fields)
        return wire.ERRORS[fields[1]][0]

    def answer(self, name, values=(), tail=b""):
        """(ok or error, fields, tail)."""
        self._sequence = (self._sequence + 1) & 0xFF
        entry = wire.COMMAND[name]
        data = wire.frame(self._sequence, entry[1], wire.encode(entry, values, tail))
        self.frames.clear()  # a command that was repeated while the flash was written is answered twice
        for _ in range(ANSWERS):
            self.type(data)
            end = machine_state.board.now + REPEAT_MS * TICKS_PER_MS
            while not self._answered() and machine_state.board.now < end:
                yield
            if self.frames:
                break
        assert self.frames, name + " is not answered; tried: " + self.what
        sequence, kind, fields, rest = self.frames.pop(0)
        assert sequence == self._sequence and fields[0] == entry[1], (name, kind, fields)
        if kind == "ok":
            fields, rest = wire.decode(wire.ANSWER[name], rest)
        return kind, fields, rest

    def _answered(self):
        while self.frames and self.frames[0][0] != self._sequence:
            self.frames.pop(0)
        return self.frames

    def hello(self, session=1):
        """Wait for the program and greet it."""
        yield from self.until(lambda: not self.attached)
        answer = yield from self.ask("hello", (wire.PROTOCOL_VERSION, session))
        return answer

    def status(self):
        """{field: value} of the status; ``state`` and ``fault`` by name, ``steps`` of each joint."""
        fields, tail = yield from self.ask("status")
        found = dict(zip(wire.ANSWER["status"][3], fields))
        found["state"] = wire.STATES[found["state"]]
        found["fault"] = wire.ERRORS[found["fault"]][0] if found["fault"] else ""
        found["steps"] = [to_int(tail[8 * joint : 8 * joint + 4]) for joint in range(len(tail) // 8)]
        return found

    def home(self, steps):
        """Declare the arm's position."""
        tail = b"".join([value.to_bytes(4, "little") if value >= 0 else (value + (1 << 32)).to_bytes(4, "little")
                         for value in steps])  # fmt: skip
        yield from self.ask("home", ((1 << len(steps)) - 1,), tail)

    def still(self):
        """Wait until no counter runs."""
        yield from self.until(lambda: not machine_state.board.timers[2].running, 30_000)


class Numbers:
    """The same numbers on every interpreter."""

    def __init__(self, seed):
        self._state = seed

    def randrange(self, low, high):
        """One of low, …, high - 1."""
        self._state = (self._state * 1103515245 + 12345) & 0x3FFFFFFF
        return low + (self._state >> 12) % (high - low)


def arguments():
    """FLASHES PROGRAM HOME [FEWER] [CASE …]: a folder of flashes, the packages' folders, steps at home.

    ``FEWER``: by which the moments that a case tries are divided. Gives the flashes, the packages' folders, the
    steps, how many ticks the motion ``go`` in the flashes lasts, and the divisor.
    """
    flashes, program, home = places()
    ticks = int(read(flashes + "/ticks"))
    fewer = int(sys.argv[4]) if sys.argv[4:] and sys.argv[4].isdigit() else 1
    return flashes, program, home, ticks, fewer


def places():
    """The first arguments: a folder of flashes or a flash, the packages' folders, the steps at home."""
    flashes, program, home = sys.argv[1:4]
    return flashes, program.split(":"), [int(steps) for steps in home.split(",")]


def generators():
    """Step generators of the joints, and the queues that the interrupt reads; from within a story."""
    from armtempo_board.app import program
    from armtempo_board.hardware import isr

    engine = program.app.controller.board.engine
    queues = [joint.ring.state[isr.QUEUE_AT : isr.QUEUE_AT + 2] for joint in engine.drives]
    return [id(joint.generator) for joint in engine.drives] + [list(words) for words in queues]


def to_int(data):
    """A signed number of four bytes."""
    value = int.from_bytes(data, "little")
    return value - (1 << 32) if value >> 31 else value


def run(story, flash, program, boot=None):
    """Power a board up and play a story to its end. ``boot`` is called at every power-up and reset.

    ``flash``: the folder that is its flash; ``program``: where the board's packages are.
    """
    machine_state.board = machine_state.arm = machine_state.flash = machine_state.edges = None
    machine_state.serial = world = World(story, boot, flash)
    try:
        power_cycles.run(dict(DEFAULTS, flash=flash, sources=SOURCES, program=program), [])
    finally:
        sys.path[:] = _path
        builtins.print, builtins.open = _stock
        for name in list(sys.modules):
            if name not in _before:
                del sys.modules[name]
    if world.error:
        print_exception(world.error)
        raise SystemExit(1)


def read(path):
    """A file of this machine's."""
    with real_open(path, "rb") as file:
        return file.read()
