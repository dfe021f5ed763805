"""Sequences whose next motion is prepared while one moves: the pins do what they do without that.

Random ones of the motions in the flash, which lead from each of some postures to each other: rows, and pulses to the
tick. What comes between is in soak.py. Arguments: see ``whole_board.arguments``.
"""

# all cases: not emulated, not on CPython, not compiled

import cases
import machine_state
import whole_board
from armtempo_shared import sequence, wire
from chip.flash import real_open
from chip.processor import TICKS_PER_MS
from firmware.external_interrupts import set_level

FLASHES, PROGRAM, HOME, _, FEWER = whole_board.arguments()
FLASH = FLASHES + "/legs"
SEED = 20267
POSTURES = 3
LEGS = {}  # number of the motion from one posture to another
for here in range(POSTURES):
    for there in range(POSTURES):
        if here != there:
            LEGS[here, there] = len(LEGS)
ROOT = FLASH + "/armtempo/"
MOTIONS = [
    ("leg%d" % number, wire.record_crc(whole_board.read(ROOT + "leg%d.atm" % number)))
    for number in range(len(LEGS))
]
ESTOP, PRESSED = "E15", 0


class Pin:
    """All edges of STEP of one joint since its list was emptied: board's time, level of STEP, level of DIR."""

    def __init__(self, board, step, direction):
        self._dir = board.pins.line(direction)
        self.seen = []
        board.pins.line(step).sinks.append(self)

    def edges(self, line, before, count, times, origin):
        """STEP toggled."""
        for time in times:
            before ^= 1
            self.seen.append((origin + time, before, self._dir.level))


class Watch:
    """What a board does: the motions that it starts, and their edges."""

    def __init__(self, world):
        board = machine_state.board
        self.world = world
        self.pins = [Pin(board, *names) for names in whole_board.STEP_AND_DIR]
        self.leads = []
        self._zeros = []
        self._generators = []  # of the first joint at each start, after the one before
        board.observers.append(self)

    def counting(self, timer, now):
        """TIM2 starts before a motion."""
        if timer.number == 2 and timer.running and timer.count(0) >= 1 << 31:
            self.leads.append(timer.modulus - timer.count(0))
            self._zeros.append(now + self.leads[-1])
            self._generators.append(whole_board.generators()[0])

    def passed(self, now):
        """Nothing to do."""

    def input_changed(self, line, level, now):
        """Nothing to do."""

    def begin(self):
        """Forget what was."""
        self.leads.clear()
        self._zeros.clear()
        self._generators[:] = whole_board.generators()[:1]
        for pin in self.pins:
            pin.seen.clear()

    def motions(self):
        """Of each motion since then the edges of each joint, by the motion's time."""
        found = []
        for number, zero in enumerate(self._zeros):
            first = zero - self.leads[number]
            last = self._zeros[number + 1] - self.leads[number + 1] if self._zeros[number + 1 :] else 1 << 60
            found.append(
                [
                    [(at - zero, up, way) for at, up, way in pin.seen if first <= at < last]
                    for pin in self.pins
                ]
            )
        return found

    def prepared(self):
        """How many motions were prepared while another one moved: each has another generator than the one before."""
        pairs = zip(self._generators, self._generators[1:])
        return len([before for before, now in pairs if now != before])


def some_rows(numbers, at=0, depth=0):
    """Rows (op, number, value, amount, step) that begin and end at a posture, at random; how many motions in all."""
    rows, motions, here = [], 0, at
    for _ in range(numbers.randrange(2, 4)):
        what = numbers.randrange(0, 6)
        if what == 0 and depth < 2:
            times = numbers.randrange(1, 4)
            inner, count = some_rows(numbers, here, depth + 1)
            rows += [(sequence.REPEAT, 0, 0, times, 1)] + inner + [(sequence.END, 0, 0, 0, 1)]
            motions += times * count
        elif what == 1:
            rows.append((sequence.WAIT, 0, 0, numbers.randrange(1, 60), 1))
        elif what == 2:
            rows.append((sequence.COUNT, 0, 0, 0, 1))
        there = (here + numbers.randrange(1, POSTURES)) % POSTURES
        rows.append((sequence.MOVE, LEGS[here, there], 0, 0, 1))
        here = there
        motions += 1
    if here != at:
        rows.append((sequence.MOVE, LEGS[here, at], 0, 0, 1))
        motions += 1
    return rows, motions


def store(rows):
    """Put a sequence into the flash, behind the board's back; its checksum."""
    arm_crc = wire.record_crc(whole_board.read(ROOT + "arm.ata"))
    record = sequence.pack(arm_crc, rows, MOTIONS, ["many"])
    with real_open(ROOT + "seq.atm", "wb") as file:
        file.write(record)
    return wire.record_crc(record)


def without_space(world):
    """From here on the heap has no space to prepare a motion in."""
    from armtempo_board import memory
    from armtempo_shared import engine_memory

    whole = engine_memory.GENERATOR_WORDS
    taken = memory.Memory.__init__

    def take(self, blocks, *others):
        if blocks and blocks[0] == whole:
            raise MemoryError
        taken(self, blocks, *others)

    memory.Memory.__init__ = take


def ended(world, ms=60_000):
    """Wait for the sequence's end: (ending, code, step, row, cycle)."""
    end = machine_state.board.now + ms * TICKS_PER_MS
    while True:
        fields, _ = yield from world.ask("sequence")
        if sequence.ENDINGS[fields[0]] != "running":
            assert whole_board.generators() == world.generators, "what the joints had before is theirs again"
            return (sequence.ENDINGS[fields[0]],) + tuple(fields[1:])
        assert machine_state.board.now < end, "it does not end"
        yield from world.wait(50)


def ready(world):
    """The board is greeted, its E-stop is not pressed; what watches it."""
    yield from world.hello()
    set_level(ESTOP, 1 - PRESSED)
    yield from world.ask("clear")
    return Watch(world)


def begin(world, watch, crc):
    """Start it from home."""
    yield from world.home(HOME)
    watch.begin()
    world.generators = whole_board.generators()
    yield from world.ask("start", (0, crc), "seq")


def said(world):
    """(passed, row, value) of the rows that were reported; they are forgotten."""
    found = [(fields[0], fields[2], fields[5]) for name, fields, _ in world.events if name == "row"]
    world.events.clear()
    return found


def whole(world, watch, crc):
    """Run it to its end: the motions' edges, rows told, counter."""
    world.events.clear()
    yield from begin(world, watch, crc)
    end = yield from ended(world)
    assert end[0] == "finished", end
    (_, counted), _ = yield from world.ask("counter", (0,))
    status = yield from world.status()
    assert status["steps"] == HOME and status["state"] == "idle", status
    return watch.motions(), said(world), counted


def case_the_pins_do_the_same(world):  # on CPython, slow
    """With and without a motion that is prepared; nested repeats, waits and counters between."""
    watch = yield from ready(world)
    numbers = whole_board.Numbers(SEED)
    trials = []
    for _ in range(max(18 // FEWER, 1)):
        rows, motions = some_rows(numbers)
        crc = store(rows)
        found = yield from whole(world, watch, crc)
        assert len(found[0]) == motions, (rows, motions)
        assert watch.prepared() == motions - 1
        trials.append((rows, found))
    without_space(world)
    for rows, before in trials:
        found = yield from whole(world, watch, store(rows))
        assert watch.prepared() == 0
        assert found[0] == before[0], rows
        assert found[1:] == before[1:], (rows, found[1:], before[1:])
    return sum([len(found[0]) for _, found in trials])


THERE_AND_BACK = [
    (sequence.REPEAT, 0, 0, 0, 1),
    (sequence.MOVE, LEGS[0, 1], 0, 0, 2),
    (sequence.MOVE, LEGS[1, 2], 0, 0, 3),
    (sequence.WAIT, 0, 0, 30, 4),
    (sequence.MOVE, LEGS[2, 0], 0, 0, 5),
    (sequence.END, 0, 1, 0, 6),
]


def case_motion_away(world):
    """What was changed in the flash since the sequence began is refused, prepared or not."""
    watch = yield from ready(world)
    crc = store(THERE_AND_BACK)
    yield from begin(world, watch, crc)
    yield from world.until(lambda: watch.leads)
    kept = whole_board.read(ROOT + "leg%d.atm" % LEGS[1, 2])
    with real_open(ROOT + "leg%d.atm" % LEGS[1, 2], "wb") as file:
        file.write(kept[:-4] + b"\x00\x00\x00\x00")
    end = yield from ended(world)
    assert end[0] == "refused" and wire.ERRORS[end[1]][0] == "bad_record", end
    assert len(watch.leads) == 1
    with real_open(ROOT + "leg%d.atm" % LEGS[1, 2], "wb") as file:
        file.write(kept)
    return end


def case_compiled_files_refuse_it(world):  # compiled
    """They are without what runs one; a motion runs."""
    watch = yield from ready(world)
    crc = store(THERE_AND_BACK)
    yield from world.home(HOME)
    refused = yield from world.refused("start", (0, crc), "seq")
    assert refused == "needs_firmware" and not watch.leads
    name, crc = MOTIONS[LEGS[0, 1]]
    yield from world.ask("start", (0, crc), name)
    yield from world.still()
    status = yield from world.status()
    assert status["state"] == "idle" and status["steps"] != HOME, status
    return refused


def told(case, found):
    """The case as a story; what it gives goes into ``found``."""

    def story(world):
        found.append((yield from case(world)))

    return story


for name in cases.wanted(globals()):
    found = []
    whole_board.run(told(globals()[name], found), FLASH, PROGRAM)
    print(name, *found)
