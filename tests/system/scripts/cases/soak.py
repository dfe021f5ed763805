"""Sequences that repeat, at every speed, with whatever a user does meanwhile: the pins make the steps of the records.

Pauses, speeds, stops, questions, hosts that die, an E-stop and a loop that is away, at seeded random moments, above all
close to the ends of motions and to rows. Of each motion the edges on the pins are compared with the steps that
``tests/system/sequences.py`` found in its record. Arguments: FLASH PROGRAM HOME as ``whole_board.places`` has them;
``legs=N``: how many motions at least; ``seed=N``.
"""

import json
import sys

import machine_state
import whole_board
from armtempo_shared import sequence, wire
from armtempo_shared.messages import RESUME
from chip.flash import real_open
from chip.processor import TICKS_PER_MS
from firmware.external_interrupts import set_level

FLASH, PROGRAM, HOME = whole_board.places()
ROOT = FLASH + "/armtempo/"
MOTIONS = json.loads(whole_board.read(ROOT + "motions").decode())
KEYS = [(name, wire.record_crc(whole_board.read(ROOT + name + ".atm"))) for name, _, _, _ in MOTIONS]
ARM_CRC = wire.record_crc(whole_board.read(ROOT + "arm.ata"))
ESTOP, PRESSED = "E15", 0
LOST_MS = 2000
KNOWN = 7
SLOW_WAY = 0  # the motion into the pick and place, whose motions last eight times as long as the others


def given(name, default):
    """A number among the arguments."""
    found = [word[len(name) + 1 :] for word in sys.argv if word.startswith(name + "=")]
    return int(found[0]) if found else default


SEED = given("seed", 20268)
LEGS = given("legs", 100)


class Pin:
    """STEP of a joint since a motion began: steps in one direction, in the other, ...; below 0: down."""

    def __init__(self, board, step, direction, inverted):
        self._dir = board.pins.line(direction)
        self._inverted = inverted
        self.runs = []
        board.pins.line(step).sinks.append(self)

    def edges(self, line, before, count, times, origin):
        """STEP toggled."""
        rises = (count + 1 - before) // 2
        steps = rises if self._dir.level ^ self._inverted else -rises
        if self.runs and (self.runs[-1] > 0) == (steps > 0):
            self.runs[-1] += steps
        elif steps:
            self.runs.append(steps)


class Watch:
    """What the pins do, checked against the records as each motion ends."""

    def __init__(self, world):
        board = machine_state.board
        rows = world.arm[1]
        self.pins = [
            Pin(board, *names, row["dir_inverted"]) for names, row in zip(whole_board.STEP_AND_DIR, rows)
        ]
        self.motions = 0  # since the sequence began
        self._order = None
        board.observers.append(self)

    def begin(self, rows):
        """A sequence of these rows begins."""
        self._order = order(rows)
        self.motions = 0
        self.position = list(HOME)

    def counting(self, timer, now):
        """TIM2 starts before a motion."""
        if timer.number == 2 and timer.running and timer.count(0) >= 1 << 31:
            if self.motions:
                self.end(True)
            self.motions += 1
            self.motion = next(self._order)

    def passed(self, now):
        """Nothing to do."""

    def input_changed(self, line, level, now):
        """Nothing to do."""

    def end(self, is_whole):
        """The motion has ended: its steps are the record's, or the first of them."""
        name, _, _, expected = MOTIONS[self.motion]
        for joint, pin in enumerate(self.pins):
            runs, pin.runs = pin.runs, []
            self.position[joint] += sum(runs)
            assert runs == expected[joint] or (not is_whole and is_part(runs, expected[joint])), (
                "motion %d of this sequence, %s, joint %d: steps %s, in the record %s"
                % (self.motions, name, joint + 1, runs, expected[joint])
            )


def is_part(runs, expected):
    """Whether these are the first of the steps."""
    if not runs:
        return True
    last = len(runs) - 1
    return (
        last < len(expected)
        and runs[:last] == expected[:last]
        and (runs[last] > 0) == (expected[last] > 0)
        and abs(runs[last]) <= abs(expected[last])
    )


def order(rows):
    """Numbers of the motions that a sequence runs, in their order."""
    at, repeats = 0, []
    while at < len(rows):
        op, number, _, amount, _ = rows[at]
        at += 1
        if op == sequence.MOVE:
            yield number
        elif op == sequence.REPEAT:
            repeats.append([at, amount])
        elif op == sequence.END:
            repeats[-1][1] -= 1
            if repeats[-1][1]:
                at = repeats[-1][0]
            else:
                repeats.pop()


def some_rows(numbers, here=0, depth=0):
    """Rows (op, number, value, amount, step) that lead from a place back to it."""
    rows, first = [], here
    moves = numbers.randrange(2, 5)
    while moves > 0 or here != first:
        what = numbers.randrange(0, 8)
        if what == 0 and depth < 2:
            inner = some_rows(numbers, here, depth + 1)
            rows += (
                [(sequence.REPEAT, 0, 0, numbers.randrange(1, 4), 1)] + inner + [(sequence.END, 0, 0, 0, 1)]
            )
        elif what == 1:
            rows.append((sequence.WAIT, 0, 0, numbers.randrange(1, 60), 1))
        elif what == 2:
            rows.append((sequence.COUNT, 0, 0, 0, 1))
        moves -= 1
        ways = [
            n for n, (_, start, end, _) in enumerate(MOTIONS) if start == here and (moves > 0 or end == first)
        ]
        # else, as within the pick and place, any way on
        ways = ways or [n for n, (_, start, _, _) in enumerate(MOTIONS) if start == here]
        number = ways[numbers.randrange(0, len(ways))]
        if number == SLOW_WAY and numbers.randrange(0, 4):
            number = ways[-1]
        here = MOTIONS[number][2]
        rows.append((sequence.MOVE, number, 0, 0, 1))
    return rows


def for_ever(rows):
    """Repeated until it is stopped."""
    return [(sequence.REPEAT, 0, 0, 0, 1)] + rows + [(sequence.END, 0, 1, 0, 1)]


PICK_AND_PLACE = [(sequence.MOVE, 0, 0, 0, 1)] + for_ever([(sequence.MOVE, n, 0, 0, 1) for n in range(1, 7)])
"""Its motions as it repeats them."""


def store(rows):
    """Put a sequence into the flash; its checksum."""
    record = sequence.pack(ARM_CRC, rows, KEYS, ["many"])
    with real_open(ROOT + "seq.atm", "wb") as file:
        file.write(record)
    return wire.record_crc(record)


def controller():
    """What the board does with its arm."""
    from armtempo_board.app import program

    return program.app.controller


class Soak:
    """One sequence after the other until ``LEGS`` motions were made; ``seen``: what was done, and how often."""

    def __init__(self, world):
        self.world = world
        self.numbers = whole_board.Numbers(SEED)
        self.session = 1
        self.legs = 0
        self.seen = {}

    def run(self):
        """The whole of it."""
        world = self.world
        yield from world.hello()
        set_level(ESTOP, 1 - PRESSED)
        yield from world.ask("clear")
        self.watch = Watch(world)
        while self.legs < LEGS:
            yield from self.sequence()
        return self.legs, machine_state.board.now // TICKS_PER_MS // 1000, sorted(self.seen.items())

    def count(self, what):
        """One more."""
        self.seen[what] = self.seen.get(what, 0) + 1

    def rate(self):
        """A speed: mostly some, often the one that was planned."""
        return 1000 if self.numbers.randrange(0, 4) == 0 else self.numbers.randrange(350, 1001)

    def sequence(self):
        """A sequence from its start to its end."""
        world, numbers = self.world, self.numbers
        rows = some_rows(numbers)
        while len(rows) > sequence.MAX_ROWS - 2:  # a walk that found its way back late
            rows = some_rows(numbers)
        if numbers.randrange(0, 3):
            rows = for_ever(rows)
        if not self.legs or numbers.randrange(0, 12) == 0:
            rows = PICK_AND_PLACE
        yield from world.home(HOME)
        self.watch.begin(rows)
        generators = whole_board.generators()
        yield from world.ask("speed", (self.rate() if self.legs else 900,))
        yield from world.ask("start", (0, store(rows)), "seq")
        fault = ""
        # Motions at the beginning to which nothing is done: a cycle, and what follows it
        calm = 0 if self.legs else 9
        left = numbers.randrange(3, 40)  # things that are done before it is stopped
        while (yield from self.ending()) == "running":
            if self.watch.motions < calm or left < 0:
                yield from world.wait(20)
                continue
            yield from self.moment()
            if left:
                yield from self.something()
            else:
                fault = yield from self.stop()
            left -= 1
        yield from self.check(fault)
        assert whole_board.generators() == generators, "what the joints had before is not theirs again"

    def ending(self):
        """How the sequence has ended, or "running"."""
        fields, _ = yield from self.world.ask("sequence")
        return sequence.ENDINGS[fields[0]]

    def moment(self):
        """Wait: for some time, for the end of the motion under way, or the beginning of the next."""
        world, numbers = self.world, self.numbers
        what = numbers.randrange(0, 4)
        if what == 0 or controller().board.engine.rates.wanted == 0:
            yield from world.wait(numbers.randrange(1, 150))
        elif what == 1:
            motions = self.watch.motions
            end = machine_state.board.now + 3000 * TICKS_PER_MS
            while self.watch.motions == motions and machine_state.board.now < end:
                yield
            yield from world.wait(numbers.randrange(0, 60))
        else:
            left_ms = self.left_ms()
            yield from world.wait(min(max(left_ms - numbers.randrange(-20, 180), 1), 3000))

    def left_ms(self):
        """Until the motion under way ends, as things stand."""
        engine = controller().board.engine
        if not engine.moving:
            return 1
        return (engine.rates.duration_ticks - engine.clock.ticks()) // TICKS_PER_MS

    def something(self):
        """What a user does while it runs."""
        world, numbers = self.world, self.numbers
        what = ("speed", "speed", "pause", "pause", "status", "counter", "host")[numbers.randrange(0, 7)]
        if what == "speed":
            yield from world.answer("speed", (self.rate(),))
        elif what == "pause":
            kind, _, _ = yield from world.answer("speed", (0,))
            if kind == "ok":
                yield from world.wait(numbers.randrange(0, 250))
                if numbers.randrange(0, 4):
                    yield from world.answer("speed", (RESUME if numbers.randrange(0, 3) else self.rate(),))
                else:
                    what = "left paused"
        elif what == "host":
            world.type(b"\xa5\x11\x02"[: numbers.randrange(0, 4)])  # it died within a frame
            yield from world.wait(numbers.randrange(0, 600))
            self.session += 1
            yield from world.hello(self.session)
        else:
            yield from world.answer(what, (0,) if what == "counter" else ())
        self.count(what)

    def stop(self):
        """End it; name of the fault that this is."""
        world = self.world
        what = ("stop", "stop", "freeze", "estop", "lost")[self.numbers.randrange(0, 5)]
        self.count(what)
        if what in ("stop", "freeze"):
            yield from world.answer("stop", (int(what == "freeze"),))  # refused if it has just ended
            return ""
        if what == "estop":
            set_level(ESTOP, PRESSED)
            yield from world.wait(5)
            set_level(ESTOP, 1 - PRESSED)
            return "estop"
        machine_state.board.lost_ticks = LOST_MS * TICKS_PER_MS
        yield from world.wait(LOST_MS + 20)  # its first answers come before it has looked at the queues
        if (yield from world.status())["fault"]:
            return "underrun"
        yield from world.answer("stop", (0,))
        return ""

    def check(self, fault):
        """It has ended: so say the board and the pins, and nothing moves any more."""
        world, watch = self.world, self.watch
        end = yield from self.ending()
        status = yield from world.status()
        assert status["fault"] == fault, (status, fault)
        self.count(end)
        if watch.motions:
            watch.end(end == "finished")
        assert end in ("finished", "fault" if fault else "stopped"), (end, status)
        if status["known"] == KNOWN:
            assert status["steps"] == watch.position, (end, status, watch.position)
        else:
            self.count("unknown")
        yield from world.wait(100)
        assert not any([pin.runs for pin in watch.pins]), "it moves"
        if fault:
            yield from world.ask("clear")
        self.legs += watch.motions


def story(world):
    """See above."""
    found.append((yield from Soak(world).run()))


say = print  # the board has its own meanwhile
say("seed", SEED)
found = []
whole_board.run(story, FLASH, PROGRAM)
((legs, seconds, seen),) = found
say("motions", legs, "in", seconds, "s:", ", ".join(["%s %d" % one for one in seen]))
