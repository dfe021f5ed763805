"""Changes of speed, pauses and stops at random moments of random motions, on simulated hardware.

Every step of the path comes once and in order, at the time that the law of the changes gives it; samples say the
motion's own time. What is expected are the steps of the same motion without a change. A number as an argument is how
many motions are tried.
"""

# all cases: slow on CPython

import random
import struct
import sys

import cases
from armtempo_board.errors import Refused
from armtempo_board.hardware import isr
from armtempo_shared import codes
from armtempo_shared.limits import LONGEST_RUN_TICKS
from armtempo_shared.messages import NO_JOINT, RESUME
from armtempo_shared.motion import EVEN_RAMP, RAMP_SHAPES, no_ramps
from brake_motion import BRAKE_TICKS, RAMP_BITS, RAMPS, ramp_way, record
from engine_rig import FEWER, TICK_HZ, Rig, arm

SEED = 20263
CHANGES = 6
BRAKE = -1  # instead of a rate
LONGEST_STOP_TICKS = 2 * (BRAKE_TICKS + TICK_HZ // 19)
"""A change that has just been asked for begins 50 ms later, and the stop 50 ms after its end."""
TURN_MS = 3  # of the loop, here
MOTIONS = int(([word for word in sys.argv[1:] if word.isdigit()] or [4 // FEWER])[0])


class Recorder:
    """Keeps the rising edges of a joint: time since the motion's time 0, direction."""

    def __init__(self, rig, joint):
        self._rig = rig
        self._inverted = joint["dir_inverted"]
        self._step = rig.board.pins.line(rig.pins.STEP[joint["channel"]][0])
        self._dir = rig.board.pins.line(rig.pins.DIR[joint["channel"]])
        self._step.sinks.append(self)
        self.steps = []

    def edges(self, line, before, count, times, origin):
        """STEP toggled."""
        for time in times:
            if not before:
                direction = (self._dir.level ^ self._inverted) * 2 - 1
                self.steps.append((origin + time - self._rig.zero(), direction))
            before ^= 1


def joints():
    rows = arm(3)
    for row in rows:
        row["following_counts"] = 0
    return rows


def some_ramps():
    """Lengths up to BRAKE_TICKS that are all different, and shapes."""
    ramps = [
        [random.randrange(300, longest) + 2048 * random.randrange(len(RAMP_SHAPES)) for longest in lengths]
        for lengths in RAMPS[:2]
    ]
    return ramps[0], ramps[1], RAMP_BITS, random.choice([0, 0, 2, 3, 5])


def place_of(parts, edge_bits, share):
    """Where a share of the motion's duration lies among the entries."""
    if not edge_bits:
        return parts * share
    side, edge = parts * 4 // 9, 0.5**edge_bits
    if share > 0.5:
        return parts - place_of(parts, edge_bits, 1.0 - share)
    if share < edge:
        return side * share / edge
    return side + (parts - 2 * side) * (share - edge) / (1.0 - 2 * edge)


def by_table(motion, to_rest, duration, at):
    """How long a change takes that begins at a time of the motion, in ticks, and the shape just before and after it."""
    ramps = struct.unpack_from("<64H" if to_rest else "<32H", motion.data, 16 if to_rest else 144)
    place = place_of(len(ramps) - 1, motion.data[6] >> 1, min(at / duration, 1.0))
    first = min(int(place), len(ramps) - 2)
    length, after = [ramp % 2048 for ramp in ramps[first : first + 2]]
    shapes = [ramps[max(int(place - 0.02), 0)] // 2048, ramps[first] // 2048]
    return (length + (after - length) * (place - first)) * 2**RAMP_BITS, shapes


def some_motion():
    """Three random joints, at rest at both ends."""
    segments = random.randrange(4, 9)
    times = [0.0]
    for _ in range(segments + 4):
        times.append(times[-1] + random.randrange(60, 200) / 1000)
    times = [time - 2 * times[1] for time in times]
    times = [(time - times[2]) for time in times]
    angles = []
    for _ in range(3):
        size = 10 ** (random.randrange(5, 33) / 10)
        inner = [(random.random() - 0.5) * size for _ in range(segments - 5)] if segments > 5 else []
        last = (random.random() - 0.5) * size
        angles.append([0.0] * 5 + inner + [last] * (segments - len(inner)))
    return record(some_ramps(), angles, times)


def begin(motion, rate=1000):
    """A rig that has started a motion, and recorders of its joints."""
    rig = Rig(joints(), planned=False)
    rig.trusting()
    recorders = [Recorder(rig, joint) for joint in rig.joints]
    rig.laws = [(0, 0, 0, rate, rate, EVEN_RAMP)]
    rig.engine.load(motion, rate)
    ramp = rig.engine.rates.override.ramp

    def watched(from_ticks, to):
        override = rig.engine.rates.override
        before = override.rate
        start = from_ticks + (override.steady_ticks() - from_ticks) % 1000
        passed = motion_ticks(rig.laws, start)
        end = override.ramp_end_ticks(from_ticks, to)
        ramp(from_ticks, to)
        assert override.steady_ticks() == end
        length, shapes = by_table(motion, to == 0, override._duration_ticks, passed)
        near = 2**RAMP_BITS * (1 + 725 * 28 * 32 * 5 * 1024 / override._duration_ticks)  # 5 times 1024 ticks
        assert -near < end - start - length <= 64000 + near, (start, end, length)
        shape = motion.ramp(int(passed) >> 10, (override._duration_ticks >> 10) + 1, to == 0) >> 11
        assert shape in shapes, (shape, shapes)
        rig.laws.append((start, passed, end - start, before, to, shape))

    rig.engine.rates.override.ramp = watched
    rig.engine.start()
    return rig, recorders


def motion_ticks(laws, ticks):
    """The motion's own time at a real time: the law in words of paper."""
    start, passed, length, before, after, shape = [law for law in laws if law[0] <= max(ticks, 0)][-1]
    late = max(ticks - start - length, 0)
    x = (ticks - late - start) / length if length else 0.0
    least, change = min(before, after), abs(after - before)
    way = ramp_way(shape, x) if after > before else ramp_way(shape, 1.0) - ramp_way(shape, 1.0 - x)
    return passed + (length * (least * x + change * way) + late * after) / 1000


def check_steps(rig, recorders, expected):
    """Each step once, in order, when the law has it."""
    near = 4 + 12 * BRAKE_TICKS / 2**30
    for recorder, plain in zip(recorders, expected):
        last = 0
        for number, ((ticks, direction), (exact, towards)) in enumerate(zip(recorder.steps, plain)):
            off = motion_ticks(rig.laws, ticks) - exact
            assert direction == towards, (number, ticks)
            assert abs(off) < near + (exact - last) / 1024, (number, ticks, exact, off, rig.laws)
            last = exact
    return [len(recorder.steps) for recorder in recorders]


def check_samples(rig):
    """Both times of each sample belong together, and there is one every 0.1 s."""
    for number, sample in enumerate(rig.samples):
        ticks = (sample[0] & 0xFFFFFFFF) + (sample[1] << 32)
        path = (sample[2] & 0xFFFFFFFF) + (sample[3] << 32)
        assert abs(path - motion_ticks(rig.laws, ticks)) < 4, (number, ticks, path, rig.laws)
        if number < len(rig.samples) - 1:
            assert 0 <= ticks - number * TICK_HZ // 10 < 2000, (number, ticks)


def change(rig):
    """Another rate, a pause or the end of one, and some time with it."""
    engine = rig.engine
    slow = engine.rates.wanted < 200
    rate = (
        random.choice((1000, RESUME, random.randrange(300, 1000)))
        if slow
        else random.choice((0, 10, random.randrange(10, 1000), random.randrange(10, 1000)))
    )
    engine.change_rate(rate)
    rig.run_to(rig.board.now - rig.zero() + random.randrange(TICK_HZ // 3))


def case_whole_path():  # slow
    """Whatever the speed, the whole path is stepped."""
    random.seed(SEED)
    for number in range(MOTIONS):
        motion = some_motion()
        plain, recorders = begin(motion)
        plain.run_to(4 * TICK_HZ)
        end = plain.engine.rates.duration_ticks
        expected = [recorder.steps for recorder in recorders]
        rate = random.choice((1000, 1000, 500, random.randrange(200, 1000)))
        rig, recorders = begin(motion, rate)
        rig.run_to(random.randrange(-TICK_HZ // 50, end))
        for _ in range(CHANGES):
            if rig.engine.moving:
                change(rig)
        if rig.engine.moving:
            rig.engine.change_rate(1000)
        rig.run_to(rig.board.now - rig.zero() + 5 * TICK_HZ)
        assert not rig.engine.moving and rig.engine.fault == 0, (number, rig.engine.fault)
        rig.turn()
        counts = check_steps(rig, recorders, expected)
        assert counts == [len(steps) for steps in expected], (number, counts, rig.laws)
        assert rig.commanded() == plain.commanded() == [motor.position for motor in rig.arm.motors]
        check_samples(rig)
        assert (rig.samples[-1][2] & 0xFFFFFFFF) >= end, number


def case_standing_joints():
    """In a joint that stands no step is looked for, and it is as after the walk through its motion."""
    random.seed(SEED + 2)
    times = [(number - 2) / 10 for number in range(14)]
    for rate in (1000, 400):
        places = some_place()
        angles = [[place] * 14 for place in places]
        angles[1][5:] = [places[1] + 40.0 + number for number in range(4)] + [places[1] + 50.0] * 5
        motion = record(some_ramps(), angles, times)
        rig = Rig(joints(), planned=False)
        rig.trusting()
        stands = [int(place + 1000.5) - 1000 for place in places]
        rig.engine.home(7, stands)
        looked = [0, 0, 0]
        for number, drive in enumerate(rig.engine.drives):
            count_searches(drive.generator, looked, number)
        rig.engine.load(motion, rate)
        assert looked[0] == looked[2] == 0 < looked[1], looked
        found = [rig.engine.drives[number].generator.end_steps(False) for number in (0, 2)]
        rig.engine.start()
        rig.run_to(4 * TICK_HZ)
        assert not rig.engine.moving and rig.engine.fault == 0, rig.engine.fault
        assert found == rig.commanded()[::2] == stands[::2], (found, stands)
        for number in (0, 2):
            generator = rig.engine.drives[number].generator
            generator.load(motion, number, stands[number], 168, 1000)
            assert looked[number] and generator.ended and not generator.waits()
            assert generator.end_steps(False) == stands[number]


def count_searches(generator, looked, number):
    """Count in ``looked`` how often steps are looked for."""
    search = generator.subintervals.search

    def counted(steps):
        looked[number] += 1
        return search(steps)

    generator.subintervals.search = counted


def some_leg(rig, start, end):
    """A motion of three joints from the steps ``start`` to ``end``, where they rest, but with acceleration."""
    times = [random.randrange(20, 80) / 1000 for _ in range(14)]
    times = [(number - 2) * times[0] for number in range(4)] + [
        2 * times[0] + sum(times[:n]) for n in range(10)
    ]
    angles = []
    for places in zip(start, end):
        size = 10 ** (random.randrange(5, 30) / 10)
        ends = [(place, (random.random() - 0.5) * size) for place in places]
        first, last = [[place + by * speed for by in (1, 0, -1 / 33, 0, 1)] for place, speed in ends]
        angles.append(first + [random.random() * size for _ in range(4)] + last)
    motion = record(some_ramps(), angles, times)
    try:
        rig.engine.check_splines(motion)
    except Refused:  # too abrupt
        return some_leg(rig, start, end)
    return motion


def some_place():
    """Three joints, often close to the middle between two steps: the first steps of a motion then come together."""
    return [random.randrange(-200, 200) + random.choice((-0.45, 0.1, 0.45)) for _ in range(3)]


def case_prepared():  # not emulated, slow
    """Motions prepared while others move, at every speed: on the pins each ends where its record does."""
    random.seed(SEED + 1)
    rig = Rig(joints(), planned=False)
    from armtempo_board.motion.next_motion import NextMotion  # once the rig has its board

    rig.trusting()
    engine = rig.engine
    coming = NextMotion(engine)
    places = [[0, 0, 0], some_place()]
    ready, rate, coming_leg = None, 1000, some_leg(rig, *places)
    for number in range(10 * MOTIONS):
        leg = coming_leg
        places = [places[1], some_place()]
        coming_leg = some_leg(rig, *places)
        engine.load(leg, rate, ready)
        engine.start()
        rig.run_to(random.randrange(-TICK_HZ // 50, TICK_HZ // 2))
        rate, ready = random.choice((1000, 900, 700, 400)), coming
        stands = [round(steps) for steps in places[0]]
        for _ in coming.pieces(rate, lambda leg=coming_leg: leg, lambda _, joint, at=stands: at[joint]):
            rig.turn()
        if engine.moving and random.randrange(2):
            change(rig)
        if engine.moving:
            engine.change_rate(1000)
        rig.run_to(rig.board.now - rig.zero() + 5 * TICK_HZ)
        assert engine.fault == 0, (number, engine.fault)
        moved = [motor.position for motor in rig.arm.motors]
        assert rig.commanded() == moved == stands, (number, rig.commanded(), moved, stands)


def case_step_at_the_start():
    """A joint that begins just beyond the middle between two steps: a step comes at once, whatever follows it."""
    for segments in (1, 2, 4, 8)[: 6 // FEWER]:
        for start, way in ((0.505, 0.0), (0.505, 5.0), (0.505, -3.0), (-0.505, 1.2)):
            points = [start] * 5 + [start + way * (part + 1) / segments for part in range(segments)]
            at_rest = [0.0] * len(points)
            times = [(number - 2) / 20 for number in range(len(points))]
            motion = record(some_ramps(), [points, at_rest, at_rest], times)
            found = []
            for rate in (1000, 700):
                rig, recorders = begin(motion, rate)
                rig.run_to(TICK_HZ)
                assert not rig.engine.moving and rig.engine.fault == 0, (segments, start, way, rate)
                found.append([direction for _, direction in recorders[0].steps])
            assert found[0] == found[1] and found[0][0] == (1 if start > 0 else -1), (
                segments,
                start,
                way,
                found,
            )


def case_stops():  # not emulated
    """A stop, whatever the speed is and is becoming, ends on the path."""
    random.seed(SEED)
    for number in range(max(MOTIONS // 2, 1)):
        motion = some_motion()
        plain, recorders = begin(motion)
        plain.run_to(4 * TICK_HZ)
        expected = [recorder.steps for recorder in recorders]
        rig, recorders = begin(motion, random.choice((1000, 300)))
        rig.run_to(random.randrange(plain.engine.rates.duration_ticks // 2))
        for _ in range(random.randrange(3)):
            if rig.engine.moving:
                change(rig)
        announced_ms = rig.engine.rest_ms() if rig.engine.moving else 0
        rig.engine.brake()
        asked = rig.board.now - rig.zero()
        stood = not rig.engine.moving  # in a pause
        rig.run_to(asked + 5 * TICK_HZ)
        assert not rig.engine.moving and rig.engine.fault == 0, number
        end = asked if stood else rig.engine.rates.duration_ticks
        assert end - asked < LONGEST_STOP_TICKS, (number, end - asked)
        late_ms = (end - asked) * 1000 / TICK_HZ - announced_ms
        assert late_ms <= TURN_MS, (number, late_ms, rig.laws)
        rig.turn()
        counts = check_steps(rig, recorders, expected)
        rest = motion_ticks(rig.laws, end)
        for count, steps in zip(counts, expected):
            due = len([None for ticks, _ in steps if ticks < rest])
            assert abs(count - due) <= 1, (number, count, due)
        assert rig.commanded() == [motor.position for motor in rig.arm.motors]
        check_samples(rig)


def case_wrong_steps():  # not emulated, slow
    """A step that is not in the record is found out however the motion ends, and makes its joint unknown."""
    for rates in ((500, BRAKE), (), (700,), (0, RESUME), (BRAKE,), (0, BRAKE))[: 6 // FEWER]:
        for wrong in (0, 1):
            rig, _ = begin(record())
            rig.run_to(TICK_HZ // 4)
            rig.engine.drives[1]._base += wrong
            for rate in rates:
                rig.engine.brake() if rate == BRAKE else rig.engine.change_rate(rate)
                rig.run_to(rig.board.now - rig.zero() + TICK_HZ // 2)
            rig.run_to(5 * TICK_HZ)
            assert not rig.engine.moving
            found = rig.engine.fault, rig.engine.fault_joint, rig.engine.known
            assert found == ((codes.WRONG_STEPS, 1, 5) if wrong else (0, NO_JOINT, 7)), (rates, wrong, found)
            assert rig.engine.clear() and rig.engine.fault == 0


def case_rings_are_fed():  # not emulated
    """A joint gets another law while its ring is filled: a short ring does not last as long as that takes."""
    rig, _ = begin(record())
    rig.run_to(TICK_HZ // 2)
    before, meanwhile = [], []
    for joint in rig.engine.drives:
        before.append(joint.ring.state[isr.FED])
        joint.generator.finish = lambda last, joint=joint: meanwhile.append(joint.ring.state[isr.FED])
    rig.engine.change_rate(500)
    assert meanwhile == before and 1 in before, (before, meanwhile)


def case_long_pause():  # not emulated
    """A pause longer than the counter's round, then on; and one that is too long ends the run."""
    motion = record()
    plain, recorders = begin(motion)
    plain.run_to(4 * TICK_HZ)
    expected = [recorder.steps for recorder in recorders]
    end = plain.commanded()
    rig, recorders = begin(motion)
    rig.turn_ticks = TICK_HZ // 1000
    rig.run_to(plain.engine.rates.duration_ticks // 2)
    rig.engine.change_rate(0)
    rig.run_to(TICK_HZ)
    rig.turn_ticks = TICK_HZ // 20
    rig.run_to(60 * TICK_HZ)
    assert rig.engine.moving
    standing = rig.commanded()
    rig.turn_ticks = TICK_HZ // 1000
    rig.engine.change_rate(RESUME)
    rig.run_to(65 * TICK_HZ)
    assert not rig.engine.moving
    assert rig.commanded() == end != standing
    assert check_steps(rig, recorders, expected) == [len(steps) for steps in expected]


def case_refused():  # not emulated
    """What cannot change its speed says so, and continues."""
    rig, _ = begin(record(no_ramps()))
    for rate in (0, 500, RESUME):
        assert refusal(rig, rate) == codes.FIXED_SPEED
    rig.run_to(3 * TICK_HZ)
    assert refusal(rig, 500) == codes.NOT_MOVING
    motion = record()
    rig = Rig(joints(), planned=False)
    rig.trusting()
    rig.engine.load(motion)
    rig.engine.start()
    rig.run_to(TICK_HZ // 2)
    rig.engine.rates.override._duration_ticks = LONGEST_RUN_TICKS // 50
    assert refusal(rig, 10) == codes.TOO_LONG
    rig.engine.brake()
    assert refusal(rig, 500) == codes.BUSY


def refusal(rig, rate):
    try:
        rig.engine.change_rate(rate)
    except Refused as refused:
        return refused.code
    return None


cases.run(globals())
