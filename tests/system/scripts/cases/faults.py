"""Whatever goes wrong, at whatever moment of a motion: the defined state, its own code, no wrong position.

Every case provokes one kind of fault at many moments; its name is printed with how its motions ended.
Positions are compared with the pulses that were counted on the pins. Arguments: see ``whole_board.arguments``.
"""

# all cases: not emulated, not on CPython

import struct
from binascii import crc32

import cases
import machine_state
import traps
import whole_board
from armtempo_shared import wire
from chip.flash import real_open
from chip.processor import TICKS_PER_MS

FLASHES, PROGRAM, HOME, DURATION, FEWER = whole_board.arguments()
SEED = 20265
KNOWN = 7
LEAD_TICKS = 168_000  # of a start with the drivers on
GO = whole_board.read(FLASHES + "/finish/armtempo/go.atm")


class Trial:
    """One motion after the other from home, each with something that happens to it."""

    def __init__(self, world, seed=SEED, record=GO):
        self.world = world
        self.numbers = whole_board.Numbers(seed)
        self.crc = wire.record_crc(record)
        self.seen = {}
        self.what = ""  # goes wrong, for messages

    def begin(self, ticks=None, action=None):
        """Start; ``action()`` comes when the motion's time is ``ticks``."""
        world = self.world
        world.what = str(self.what)
        yield from world.home(HOME)
        self.before = world.steps()
        if action:
            world.plan(ticks, action)
        yield from world.ask("start", (0, self.crc), "go")

    def moment(self, end=DURATION):
        """Some time from the start of the counters on."""
        return self.numbers.randrange(-LEAD_TICKS // 2, end)

    def end(self, *faults, home=True, alive=False):
        """It has come to rest with one of these faults ("": none, and at home); gives the status.

        ``alive``: the host is there meanwhile.
        """
        world = self.world
        while alive and machine_state.board.timers[2].running:
            yield from world.status()
            yield from world.wait(100)
        yield from world.still()
        yield from world.answer("status")  # which may be what goes wrong
        yield from world.wait(20)
        status = yield from world.status()
        assert status["fault"] in faults, (self.what, status, faults)
        assert status["state"] == ("fault" if status["fault"] else "idle"), status
        assert world.led() == status["state"], (self.what, world.led(), status["state"])
        self.seen[status["fault"]] = self.seen.get(status["fault"], 0) + 1
        made = [now - before for now, before in zip(world.steps(), self.before)]
        if status["known"] == KNOWN:
            assert status["steps"] == [home + steps for home, steps in zip(HOME, made)], (
                self.what,
                status,
                made,
            )
        else:
            assert status["known"] == 0 and status["fault"]
        if home and not status["fault"]:
            assert made == [0, 0, 0], (self.what, made)
        stood = world.steps()
        yield from world.wait(100)
        assert world.steps() == stood
        return status

    def clear(self):
        """Nothing starts before the fault is cleared, and everything after."""
        world = self.world
        refused = yield from world.refused("start", (0, self.crc), "go")
        assert refused == "fault_pending", refused
        yield from world.ask("clear")
        if self.numbers.randrange(0, 8) == 0:
            yield from self.begin()
            yield from self.end("", alive=True)


def case_underrun(world):
    """The main loop is away for some time; for too long or not, and not only for a moment too long."""
    trial = Trial(world)
    yield from world.hello()
    for number in range(40 // FEWER):
        ms = trial.numbers.randrange(3, 60) if number % 4 else trial.numbers.randrange(100, 3000)
        yield from trial.begin(trial.moment(), lambda ms=ms: lose(ms))
        status = yield from trial.end("underrun", "")
        assert status["known"] == KNOWN
        if status["fault"]:
            yield from trial.clear()
    return trial.seen


def lose(ms):
    machine_state.board.lost_ticks = int(ms * TICKS_PER_MS)


def case_host_disappears_and_the_motion_goes_on(world):
    """Also within a frame; another host comes, perhaps before the end, and gets what it asks for."""
    trial = Trial(world)
    yield from world.hello()
    for number in range(12 // FEWER):
        yield from trial.begin()
        half = wire.frame(200, wire.COMMAND["status"][1], b"")
        world.type(half[: trial.numbers.randrange(0, len(half))])
        yield from world.wait(trial.numbers.randrange(0, 3000))
        (_, _, _, state, *_), _ = yield from world.hello(1000 + number)
        assert wire.STATES[state] == ("moving" if machine_state.board.timers[2].running else "idle")
        status = yield from trial.end("")
        world.events.clear()
        yield from world.ask("samples", (0, status["samples_kept"]))
        yield from world.until(lambda status=status: len(world.events) >= status["samples_kept"])
        assert [fields[1] for _, fields, _ in world.events] == list(range(status["samples_kept"]))
    return trial.seen


def case_host_disappears_and_the_arm_stops(world):  # on CPython
    """As this arm's record says: it brakes along the path; not before, and not while the host asks."""
    trial = Trial(world, record=whole_board.read(FLASHES + "/stop/armtempo/go.atm"))
    timeout = world.arm[0]["link_timeout_ms"] * TICKS_PER_MS
    yield from world.hello()
    for _ in range(12 // FEWER):
        yield from trial.begin()
        gone = trial.moment()
        while machine_state.board.now < world.zero + gone and machine_state.board.timers[2].running:
            yield from world.status()
            yield from world.wait(trial.numbers.randrange(10, 500))
        gone = machine_state.board.now
        status = yield from trial.end("link_lost", "")
        assert status["known"] == KNOWN
        if status["fault"]:
            assert timeout < world.zero + status["ticks"] - gone + 500 * TICKS_PER_MS < 3 * timeout
            yield from trial.clear()
    return trial.seen


def case_stop(world):  # on CPython
    """The host's stop before time 0, anywhere, again while it brakes, and at the very end."""
    trial = Trial(world)
    yield from world.hello()
    for number in range(40 // FEWER):
        at = trial.moment(DURATION + 4_000_000) if number % 4 else trial.moment(0)
        yield from trial.begin()
        yield from world.until(lambda at=at: machine_state.board.now >= world.zero + at)
        for now in (number & 1, number >> 1 & 1):
            kind, fields, _ = yield from world.answer("stop", (now,))
            assert kind == "ok" or wire.ERRORS[fields[1]][0] == "not_moving"
            yield from world.wait(trial.numbers.randrange(0, 400))
        yield from trial.end("", home=False)
    return trial.seen


REFUSALS = (
    "bad_record", "arm_mismatch", "wrong_joints", "time_order", "out_of_range", "too_fast", "wrong_start",
    "too_long", "too_abrupt",
)  # fmt: skip


def case_broken_trajectory(world):  # on CPython
    """Bytes of the file in the flash changed, cut off, added; or changed with a checksum that fits."""
    trial = Trial(world)
    yield from world.hello()
    for number in range(90 // FEWER):
        data = damaged(trial.numbers, number % 3)
        with real_open(FLASHES + "/finish/armtempo/go.atm", "wb") as file:
            file.write(data)
        yield from world.home(HOME)
        trial.before = world.steps()
        kind, fields, _ = yield from world.answer("start", (0, wire.record_crc(data)), "go")
        name = "runs" if kind == "ok" else wire.ERRORS[fields[1]][0]
        trial.seen[name] = trial.seen.get(name, 0) + 1
        if kind == "ok":
            assert number % 3 == 2, number
            yield from world.wait(trial.numbers.randrange(0, 2000))
            yield from world.answer("stop", (1,))
        else:
            assert name in REFUSALS, (number, name)
            assert name == "bad_record" or number % 3 == 2, (number, name)
        yield from trial.end("", home=False)
        assert kind == "ok" or world.steps() == trial.before
    with real_open(FLASHES + "/finish/armtempo/go.atm", "wb") as file:
        file.write(GO)
    yield from trial.begin()
    yield from trial.end("")
    return trial.seen


def damaged(numbers, kind):
    """A damaged record: 0 changed, 1 of another length, 2 changed and checksummed again."""
    data = bytearray(GO)
    if kind == 1:
        size = numbers.randrange(0, len(data) + 20)
        data = (data + bytes(20))[: size if size != len(GO) else 0]
        return bytes(data) + bytes(max(0, 4 - len(data)))
    for _ in range(numbers.randrange(1, 3)):
        data[numbers.randrange(0, len(data) - 4)] ^= 1 << numbers.randrange(0, 8)
    return bytes(data) if kind == 0 else bytes(data[:-4]) + struct.pack("<I", crc32(data[:-4]))


def case_watchdog(world):
    """The program hangs: the outputs run dry, the chip starts anew and knows no position."""
    trial = Trial(world)
    yield from world.hello()
    for _ in range(6 // FEWER or 1):
        yield from trial.begin(trial.moment(), hang)
        board, counters, zero = machine_state.board, world.counters, world.zero
        yield from world.until(lambda board=board: machine_state.board is not board, 20_000)
        last = max([counter.last for counter in counters])
        assert last < max(board.hung + 60 * TICKS_PER_MS, zero), (last, board.hung, zero)
        assert board.now - board.hung <= 8100 * TICKS_PER_MS
        trial.before = world.steps()
        yield from world.hello()
        status = yield from trial.end("watchdog")
        assert status["known"] == 0
        assert world.steps() == [0, 0, 0]
        for reason in ("fault_pending", "unhomed"):
            refused = yield from world.refused("start", (0, trial.crc), "go")
            assert refused == reason
            yield from world.ask("clear")
    return trial.seen


def hang():
    machine_state.board.hung = machine_state.board.now
    machine_state.board.lost_ticks = 1 << 50


def case_interrupt_delayed(world):
    """The interrupt that turns DIR comes late: the turn is still right, or the motion ends as not known."""
    trial = Trial(world)
    yield from world.hello()
    turns = Turns()
    yield from trial.begin(-LEAD_TICKS // 2, turns.listen)
    zero = world.zero
    yield from trial.end("")
    assert len(turns.ticks) >= 5
    for turn in turns.ticks[::FEWER]:
        for late_us in (40, 90, 130, 400, 3000):
            trial.what = "turn at %d, %d us late" % (turn, late_us)
            at = turn - zero - 84 * 5
            yield from trial.begin(at, lambda late_us=late_us: machine_state.board.stall(84 * late_us))
            status = yield from trial.end("internal", "")
            assert late_us >= 90 or not status["fault"], trial.what
            assert late_us <= 110 or (status["fault"] and status["known"] == 0), trial.what
            if status["fault"]:
                yield from trial.clear()
    return trial.seen


class Turns:
    """Listens to the DIR pins."""

    def listen(self):
        """From now on."""
        self.ticks = []
        for _, pin in whole_board.STEP_AND_DIR:
            machine_state.board.pins.line(pin).sinks.append(self)

    def edges(self, line, before, count, times, origin):
        """A DIR pin turned."""
        self.ticks.extend([origin + time for time in times])


def case_interrupt_dies(world):  # emulated
    """An exception in the compare interrupt: MicroPython never calls it again."""
    trial = Trial(world)
    yield from world.hello()
    interrupt = machine_state.board.callbacks[(2, 4)]
    for _ in range(16 // FEWER):
        yield from trial.begin(trial.moment(), lambda: machine_state.board.callbacks.pop((2, 4)))
        status = yield from trial.end("internal")
        assert status["known"] == 0
        machine_state.board.callbacks[(2, 4)] = interrupt
        yield from trial.clear()
    return trial.seen


COUNTING = ("JointDrive._count_from", "Ring.stop", "JointDrive.position")
"""Functions between whose calls a joint's count is not what it should be."""


def case_exception_anywhere(world):  # not compiled
    """Each function that the loop calls while it moves raises once, before or after its work."""
    yield from world.hello()
    trial = Trial(world)
    found = traps.everywhere()
    yield from trial.begin(0, lambda: [trap.set() for trap in found])
    yield from trial.end("")
    for trap in found:
        trap.remove()
    called = [trap for trap in found if trap.calls]
    assert len(called) > 100, len(called)
    unknown = 0
    counting = [trap for trap in called if ".".join(trap.path.split(".")[-2:]) in COUNTING]
    assert len(counting) == len(COUNTING)
    chosen = called[SEED % FEWER :: 2 * FEWER] + counting
    for number, trap in enumerate(chosen):
        trap.behind = number & 1
        trap.set()
        trial.what = trap.path
        yield from trial.begin(trial.moment(DURATION // 4), trap.arm)
        status = yield from trial.end("internal", "")
        assert bool(status["fault"]) != trap.armed, trap.path
        trap.remove()
        if status["fault"]:
            unknown += status["known"] == 0
            yield from trial.clear()
    assert trial.seen["internal"] - unknown > 20 // FEWER, unknown
    return trial.seen


def told(case, found):
    """The case as a story; what it gives goes into ``found``."""

    def story(world):
        result = yield from case(world)
        found.update(result)

    return story


for name in cases.wanted(globals()):
    found = {}
    flash = FLASHES + ("/stop" if "stops" in name else "/finish")
    whole_board.run(told(globals()[name], found), flash, PROGRAM)
    print(name, *["%s %d" % (key or "none", found[key]) for key in sorted(found)])
