"""Motions that are run once: a record in memory, and the way back along a stored motion; no file is written."""

# all cases: slow on CPython

import random
import struct
from array import array

import cases
import micropython
import stand_in
from app_rig import ROOT, connected, ends_of, flash, start, state
from armtempo_board.stepgen.control_points import WINDOW_WORDS, ControlPoints
from armtempo_board.storage import store
from armtempo_board.storage.backwards import Backwards
from armtempo_board.storage.motion_file import MotionFile
from armtempo_shared import (
    armrecord,
    backwards,
    codes,
    engine_memory,
    limits,
    messages,
    motion,
    way_back,
    wire,
)

SEED = 20261127
RAMPS = ((5,) * motion.REST_ENTRIES, (7,) * motion.OTHER_ENTRIES, 15, 0)
lock = getattr(micropython, "heap_lock", int)  # CPython locks nothing
unlock = getattr(micropython, "heap_unlock", int)


def put(host, record, piece=900):
    """The answers to all pieces."""
    return [
        host.ask("put_once", (at, len(record)), record[at : at + piece])
        for at in range(0, len(record), piece)
    ]


def start_once(host, record, flags=0):
    return host.ask("start", (flags, wire.record_crc(record)), messages.ONCE_NAME)


def case_a_record_in_memory_is_run_and_no_file_is_written():
    app, host = connected()
    store.open = refused
    for piece in (900, 100):
        assert put(host, host.record, piece)[-1] == ("ok", (len(host.record),), b"")
        assert start_once(host, host.record)[0] == "ok"
        assert state(host) == "moving"
        assert put(host, host.record)[-1] == ("error", "busy", 255, 0)
        app.controller.board.engine.finish()
        host.turn()
        assert ends_of(host)[-1][0] == "done"
        assert start_once(host, host.record)[0] == "ok"  # it is there until another one comes
        app.controller.board.engine.finish()
    del store.open
    assert host.ask("list", (0,))[2] == "feed"
    assert host.ask("list", (1,))[1] == "not_found"


def refused(path, mode="r"):
    raise AssertionError("%s is opened (%s)" % (path, mode))


def by_both(session, flags=0):
    """What ``session`` yields of a board that runs a stored motion, and of one that runs it from memory: the same."""
    found = []
    for once in (False, True):
        app, host = connected(flags)
        put(host, host.record)
        crc = wire.record_crc(host.record)

        def begin(start_flags=0, host=host, crc=crc, name=messages.ONCE_NAME if once else "feed"):
            return host.ask("start", (start_flags, crc), name)

        said = list(session(app, host, begin))
        found.append((said, app.controller.board.engine.calls, ends_of(host)))
    assert found[0] == found[1], found
    return found[0]


def case_stop_pause_and_speed_are_those_of_a_stored_motion():
    def session(app, host, begin):
        yield host.ask("speed", (600,))  # of the next start
        yield begin()
        for rate in (250, 0, messages.RESUME, 1000):
            yield host.ask("speed", (rate,))
            yield app.controller.board.engine.rates.wanted
        yield host.ask("stop", (0,))
        yield state(host)
        yield host.ask("speed", (500,))
        app.controller.board.engine.finish()
        yield state(host)
        yield begin()
        yield host.ask("stop", (1,))
        yield state(host)
        yield host.ask("stop", (0,))
        yield host.ask("status")

    said, calls, _ = by_both(session)
    assert calls.count("rate") == 5
    assert said[3:11:2] == [250, 0, messages.RESUME, 1000]
    assert calls.count("brake") == 1
    assert calls.count("freeze") >= 1
    assert said[-2][:2] == ("error", "not_moving")


def case_it_is_held_and_brakes_in_silence_as_a_stored_motion():
    def session(app, host, begin):
        yield begin(messages.START_HELD)
        for _ in range(5):
            host.turn(limits.HOLD_TIMEOUT_MS - 5)
            yield host.ask("hold")
        host.turn(limits.HOLD_TIMEOUT_MS + 5)
        yield state(host)
        app.controller.board.engine.finish()
        yield state(host)
        yield host.ask("hold")

    said, calls, ends = by_both(session)
    assert calls.count("brake") == 1
    assert said[-3:-1] == ["braking", "idle"]
    assert ends[-1][0] == "done"


def case_a_lost_host_stops_it_as_a_stored_motion():
    """The arm file says so; where the arm is stays known."""

    def session(app, host, begin):
        yield begin()
        host.turn(5000)
        yield app.controller.board.fault()
        app.controller.board.engine.finish()
        yield app.controller.board.known()

    said, calls, _ = by_both(session, armrecord.FLAG_STOP_ON_LINK_LOSS)
    assert said[1] == codes.LINK_LOST
    assert calls.count("brake") == 1
    assert said[-1] == 3


def case_what_is_not_whole_or_not_meant_is_refused():
    app, host = connected()
    record = host.record
    crc = wire.record_crc(record)
    assert host.ask("start", (0, crc), messages.ONCE_NAME) == ("error", "not_found", 255, 0)
    assert host.ask("put_once", (10, 100), b"x") == ("error", "bad_offset", 255, 0)
    assert host.ask("put_once", (0, 9), b"longer than it") == ("error", "bad_offset", 255, 0)
    most = engine_memory.ONCE_BYTES
    assert host.hello()[1][-1] == most
    assert host.ask("put_once", (0, most + 1), b"x") == ("error", "too_long", 255, most)
    assert host.ask("put_once", (0, len(record)), record[:100]) == ("ok", (100,), b"")
    assert start_once(host, record) == ("error", "not_found", 255, 0)
    assert host.ask("put_once", (100, len(record) + 1), record[100:]) == ("error", "bad_offset", 255, 100)
    assert host.ask("put_once", (101, len(record)), record[101:]) == ("error", "bad_offset", 255, 100)
    assert host.ask("put_once", (50, len(record)), record[50:])[0] == "ok"
    assert host.ask("start", (0, crc ^ 1), messages.ONCE_NAME) == ("error", "bad_checksum", 255, 0)
    wrong = bytearray(record)
    wrong[70] ^= 1
    put(host, bytes(wrong))
    assert start_once(host, wrong) == ("error", "bad_record", 255, 0)
    other = stand_in.record(stand_in.arm(low=5))
    put(host, other)
    assert start_once(host, other) == ("error", "arm_mismatch", 255, 0)
    three = stand_in.record(stand_in.arm(), joints=3)
    put(host, three)
    assert start_once(host, three) == ("error", "wrong_joints", 255, 3)
    assert app.controller.board.engine.calls.count("start") == 0
    assert start(host)[0] == "ok"


def case_its_name_is_no_stored_motions():
    _, host = connected()
    put(host, host.record)
    for name, values in (("remove", ()), ("set_default", ())):
        assert host.ask(name, values, messages.ONCE_NAME) == ("error", "bad_name", 255, 0)
    assert host.ask("put_begin", (10, 0), messages.ONCE_NAME) == ("error", "bad_name", 255, 0)


def case_after_a_reset_it_is_gone():
    app, host = connected()
    put(host, host.record)
    again = type(app)(stand_in.Port(), flash())
    host = stand_in.Host(again, again.link.stream)
    host.hello()
    host.ask("home", (3,), bytes(8))
    record = stand_in.record(stand_in.arm())
    assert start_once(host, record) == ("error", "not_found", 255, 0)


def case_the_way_back_needs_the_motion_that_is_meant():
    app, host = connected()
    back = way_back.pack(host.record, "feed", RAMPS)
    store.open = reading
    put(host, back)
    assert start_once(host, back)[0] == "ok"
    app.controller.board.engine.finish()
    host.turn()
    del store.open
    motion_of = app.controller.load(messages.ONCE_NAME)
    assert (motion_of.crc, motion_of.ramp_bits) == (wire.record_crc(back), 15)
    assert motion_of.ramp(0, 100, True) == 5
    assert motion_of.ramp(0, 100, False) == 7
    other = way_back.pack(host.record, "food", RAMPS)
    put(host, other)
    assert start_once(host, other) == ("error", "not_found", 255, 0)
    host.upload("feed", stand_in.record(stand_in.arm(), segments=9))
    put(host, back)
    assert start_once(host, back) == ("error", "bad_checksum", 255, 0)


def reading(path, mode="r"):
    assert mode == "rb"
    return open(path, mode)


def chance():
    """A random motion record; its numbers mean nothing."""
    degree = random.choice((3, 5))
    joints = random.randint(1, 6)
    axes = random.choice((1, joints))
    segments = random.randint(1, 12)
    refine = random.randint(1, 3)
    angles = [[number() for _ in range(segments + degree)] for _ in range(joints)]
    times = [[number() for _ in range(segments * refine + degree)] for _ in range(axes)]
    return motion.pack(degree, angles, times, refine, RAMPS, 0)


def number():
    value = 0
    for _ in range(random.randint(0, 3)):
        value = value << 20 | random.getrandbits(20)
    return value if random.getrandbits(1) else -value


def splines(one):
    """(offset, control points, number of the time axis or -1) of each spline of a motion."""
    for joint in range(one.joints):
        yield one.angle_offset(joint), one.segments + one.degree, -1
        if not one.shared or joint == one.joints - 1:
            axis = 0 if one.shared else joint
            yield one.time_offset(joint), one.segments * one.refine + one.degree, axis


def windows(one, offset, points):
    """All control points of a spline as the board's walk reads them; nothing may be allocated."""
    reader = ControlPoints(memoryview(WORDS))
    reader.open(one.stream(offset), one.degree)
    found = []
    for segment in range(points - one.degree):
        lock()
        at = reader.seek(segment)
        unlock()
        words = WORDS[at : at + 2 * (one.degree + 1)]
        fresh = struct.unpack("<%dq" % (one.degree + 1), struct.pack("<%di" % len(words), *words))
        found = (found or list(fresh[:-1])) + [fresh[-1]]
    reader.close()
    return found


WORDS = array("i", [0] * WINDOW_WORDS)


def case_points_are_read_alike_from_memory_and_file_and_backwards():
    random.seed(SEED)
    print("seed", SEED)
    path = ROOT + "feed.atm"
    _, host = connected()
    for _ in range(5):
        record = chance()
        if len(record) > engine_memory.ONCE_BYTES:
            continue
        with open(path, "wb") as file:
            file.write(record)
        plain = motion.Motion(record)
        put(host, record)
        once = host.app.controller.board.once.motion(None)
        way = backwards.WayBack(way_back.pack(record, "feed", RAMPS))
        back = Backwards(path, len(record), way)
        for offset, count, axis in splines(plain):
            points = plain.points(offset, count)
            assert once.points(offset, count) == points
            assert windows(once, offset, count) == list(points)
            assert windows(MotionFile(path, len(record)), offset, count) == list(points)
            mirrored = list(reversed(points))
            if axis >= 0:
                origin = int.from_bytes(way.origins[axis], "little")
                mirrored = [wrapped(origin - point) for point in mirrored]
            assert windows(back, offset, count) == mirrored
            for first in range(count - plain.degree + 1):
                found = list(back.points(offset + 8 * first, plain.degree))
                assert found == mirrored[first : first + plain.degree], (offset, first)


def wrapped(value):
    """As 64 bits with a sign."""
    value &= (1 << 64) - 1
    return value - (1 << 64) if value >> 63 else value


cases.run(globals())
