"""A day of a board: what each kind of use erases of its flash; moves erase nothing.

Arguments: see ``whole_board.places``, and the divisor of the moves; next to the flash, in ``day``, are the records that
a host would send. A move that erases nothing is the same for each of a thousand, so tests make fewer; what is stored
is stored as often as in the whole day.
"""

# all cases: not emulated, not on CPython, slow

import sys

import cases
import machine_state
import whole_board
from armtempo_shared import messages, wire
from armtempo_shared.messages import MAX_COMMAND, START_HOMING

FLASHES, PROGRAM, HOME = whole_board.places()
FEWER = int(sys.argv[4])
FLASH = FLASHES + "/finish"
JOGS, GOTOS, RUNS, HOMINGS = 1000 // FEWER, 200 // FEWER, 100 // FEWER, 10
REPETITIONS, UPLOADS, ARMS = 10, 20, 5
MOST = 200  # erasures of a sector
# What is stored erases, by sector: the first upload is of a new file, the others and the arms take the place of another
OF_UPLOADS = {"1": 2 * UPLOADS - 1, "2": 4 * UPLOADS - 1, "3": 12}
OF_ARMS = {"1": 2 * ARMS, "2": 4 * ARMS, "3": 5}


def record(name):
    """A record that the host prepared."""
    return whole_board.read("%s/day/%s" % (FLASHES, name))


def erasures():
    """Of each sector so far."""
    return dict(machine_state.flash.erasures)


def once(world, data, flags=0):
    """Run a record from the board's memory to its end."""
    for at in range(0, len(data), MAX_COMMAND - 4):
        yield from world.ask("put_once", (at, len(data)), data[at : at + MAX_COMMAND - 4])
    yield from start(world, messages.ONCE_NAME, data, flags)


def start(world, name, data, flags=0):
    world.events.clear()
    yield from world.ask("start", (flags, wire.record_crc(data)), name)
    yield from world.until(lambda: "sample" in [event[0] for event in world.events])
    yield from world.until(lambda: world.events[-1][0] != "sample", 30_000)
    assert world.events[-1][0] == "done", world.events[-1]
    yield from world.ask("samples", (1 << 30, 0))


def upload(world, name, data):
    yield from world.ask("put_begin", (len(data), wire.record_crc(data)), name)
    for at in range(0, len(data), MAX_COMMAND - 4):
        yield from world.ask("put_data", (at,), data[at : at + MAX_COMMAND - 4])
    yield from world.ask("put_commit", (wire.record_crc(data),))


def day(world):
    yield from world.hello()
    yield from world.home(HOME)
    there, back, far, near = record("there"), record("back"), record("far"), record("near")
    feed, feeds, way = record("feed"), (record("feed"), record("food")), record("way")
    erased = Erased()
    for number in range(JOGS):
        yield from once(world, back if number & 1 else there)
    assert erased.since("jogs", JOGS) == {}
    for number in range(GOTOS):
        yield from once(world, near if number & 1 else far)
    assert erased.since("gotos", GOTOS) == {}
    for number in range(HOMINGS):
        yield from once(world, back if number & 1 else there, START_HOMING)
    assert erased.since("homings", HOMINGS) == {}
    for number in range(UPLOADS):
        yield from upload(world, "feed", feeds[number & 1 ^ 1])
    assert erased.since("uploads", UPLOADS) == OF_UPLOADS
    for _ in range(RUNS):
        for repetition in range(REPETITIONS):
            if repetition:
                yield from once(world, way)
            yield from start(world, "feed", feed)
        yield from once(world, way)
    assert erased.since("runs of %d repetitions" % REPETITIONS, RUNS) == {}
    for number in range(ARMS):
        yield from upload(world, "/arm", record("arm%d" % (number & 1)))
    assert erased.since("arms", ARMS) == OF_ARMS
    assert max(erasures().values()) < MOST


class Erased:
    """Erasures of each sector since the last look."""

    def __init__(self):
        self._before = erasures()

    def since(self, what, count):
        """Say and return them."""
        now = erasures()
        found = {sector: now[sector] - self._before.get(sector, 0) for sector in now}
        self._before = now
        found = {sector: count for sector, count in found.items() if count}
        whole_board.say(count, what, found)
        return found


def case_no_sector_wears_out_in_a_day():
    whole_board.run(day, FLASH, PROGRAM)


cases.run(globals())
