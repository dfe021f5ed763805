"""A day of a board: what each kind of use erases of its flash; moves erase nothing.

Arguments: see ``whole_board.places``, and the divisor of the moves; next to the flash, in ``day``, are the records that
a host would send. A move that erases nothing is the same for each of a thousand, so tests make fewer.
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
    before = erasures()
    for number in range(JOGS):
        yield from once(world, back if number & 1 else there)
    for number in range(GOTOS):
        yield from once(world, near if number & 1 else far)
    for number in range(HOMINGS):
        yield from once(world, back if number & 1 else there, START_HOMING)
    assert erasures() == before, (before, erasures())
    for number in range(UPLOADS):
        yield from upload(world, "feed", feeds[number & 1 ^ 1])
    kept = erasures()
    whole_board.say("uploads", {sector: kept[sector] - before.get(sector, 0) for sector in kept})
    for _ in range(RUNS):
        for repetition in range(REPETITIONS):
            if repetition:
                yield from once(world, way)
            yield from start(world, "feed", feed)
        yield from once(world, way)
    assert erasures() == kept, (kept, erasures())
    for number in range(ARMS):
        yield from upload(world, "/arm", record("arm%d" % (number & 1)))
    found = erasures()
    whole_board.say("all", found)
    assert max(found.values()) < MOST, found
    assert min([found.get(sector, 0) - before.get(sector, 0) for sector in "12"]) > UPLOADS


def case_no_sector_wears_out_in_a_day():
    whole_board.run(day, FLASH, PROGRAM)


cases.run(globals())
