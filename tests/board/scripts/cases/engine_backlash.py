"""Joints with backlash: after each reversal the motor crosses the play, and the joint follows the plan.

The joint is what a motor with play moves; the pins are read as its driver reads them. What is expected are the steps of
the same motion without backlash.
"""

# all cases: not on CPython

import gc
import math
import random

import cases
from armtempo_shared import armrecord, codes
from armtempo_shared.messages import RESUME
from brake_motion import record
from engine_rig import TICK_HZ, Rig, arm
from firmware import external_interrupts

# isort: split
from armtempo_board.motion.next_motion import NextMotion

SEED = 20264
gc.threshold(1 << 20)  # else the steps that are kept lie everywhere in the heap, and no long list has a place
ACCELERATION = 2000.0
"""Of the steps that cross the play, steps/s**2."""
PLAY = (30, 181, 0)
MARGIN_TICKS = TICK_HZ // 20
"""A crossing begins with the reversal, or 25 ms after the program sees it."""


def row(steps, on_motor=0, acceleration=ACCELERATION):
    pace = round(TICK_HZ * (2 / acceleration) ** 0.5 / 64)
    return {"steps": steps, "on_motor": on_motor, "spare": 0, "pace": pace}


def crossing_ticks(steps):
    """How long it takes to cross the play."""
    return 2 * TICK_HZ * (steps / ACCELERATION) ** 0.5


class Driver:
    """A driver with its motor, and the joint that it moves with play; keeps the rising edges."""

    def __init__(self, rig, joint, play):
        self._rig = rig
        self._inverted = joint["dir_inverted"]
        self._step = rig.board.pins.line(rig.pins.STEP[joint["channel"]][0])
        self._dir = rig.board.pins.line(rig.pins.DIR[joint["channel"]])
        self._step.sinks.append(self)
        self._dir.sinks.append(self)
        self.play = play
        self.steps = []
        self.motor = self.declared = 0
        self.joint = None  # not known before the first step
        self._rise = self._fall = self._turn = -(1 << 60)

    def edges(self, line, before, count, times, origin):
        """STEP or DIR toggled."""
        head = self._rig.head
        for time in times:
            now = origin + time
            if line is self._dir:
                assert not self._step.level, "DIR turned within a pulse"
                assert now - self._fall >= head["dir_hold_ticks"] or not self._rig.engine.moving
                self._turn = now
            elif before:
                assert now - self._rise == head["pulse_ticks"], now - self._rise
                self._fall = now
            else:
                self._rise = now
                assert now - self._fall >= head["low_ticks"], now - self._fall
                assert now - self._turn >= head["dir_setup_ticks"], now - self._turn
                self._take((self._dir.level ^ self._inverted) * 2 - 1, now - self._rig.zero())
            before ^= 1

    def _take(self, direction, ticks):
        if self.joint is None:
            self.joint = self._start = self.play if direction < 0 else 0
        self.steps.append((ticks, direction))
        self.motor += direction
        self.joint = min(max(self.joint, self.motor), self.motor + self.play)

    def base(self):
        """The motor's position less the joint's, if the motor pushes up."""
        return 0 if self.joint is None else self._start

    def ahead(self):
        """The same for the side on which the motor is, after the last step."""
        return self.base() - (self.play if self.joint is not None and self.steps[-1][1] < 0 else 0)

    def moved(self):
        """How far the joint has moved."""
        return 0 if self.joint is None else self.joint - self._start


def joints(**values):
    rows = arm(3)
    for joint in rows:
        joint["following_counts"] = 0
        joint["max_rate"] = 60000
        joint.update(values)
    return rows


def some_motion(start=(0, 0, 0), end=None, size=None, segments=14):
    """Three joints that turn again and again, at rest at both ends."""
    times = [0.0]
    for _ in range(segments + 4):
        times.append(times[-1] + random.randrange(120, 300) / 1000)
    times = [time - times[2] for time in times]
    times[1], times[0] = -times[3], -times[4]
    angles = []
    for joint, place in enumerate(start):
        far = size or 10 ** (random.randrange(20, 36) / 10)
        inner = [place + (random.random() - 0.5) * far for _ in range(segments - 5)]
        last = end[joint] if end else place + (random.random() - 0.5) * far
        angles.append([place] * 5 + inner + [last] * 5)
    return record(control_points=angles, time_points=times)


def straight(way):
    """From 0, without a turn."""
    return record(
        control_points=[[0] * 5 + [way] * 5] * 3, time_points=[number / 5 for number in range(-2, 8)]
    )


def some_place():
    return [random.randrange(-300, 300) for _ in range(3)]


def check_fast(rig):
    """Whether it ran; no steps came in a burst, even then."""
    for driver in rig.drivers:
        ticks = [time for time, _ in driver.steps]
        for n in range(len(ticks) - 20):
            assert ticks[n + 20] - ticks[n] > TICK_HZ // 1000, (n, ticks[n], rig.engine.fault)
    return rig.engine.fault == 0


def made(plays=PLAY, on_motor=0, rows=None, acceleration=ACCELERATION, **options):
    """A rig whose joints have backlash; none: plays None."""
    backlash = [row(play, on_motor, acceleration) for play in plays] if plays else ()
    rig = Rig(rows or joints(), planned=False, backlash=backlash, **options)
    rig.trusting()
    rig.drivers = [Driver(rig, joint, play) for joint, play in zip(rig.joints, plays or (0, 0, 0))]
    return rig


def run(rig, motion):
    rig.engine.load(motion)
    rig.engine.start()
    rig.run_to(100 * TICK_HZ)
    check_end(rig)


def beside(motion):
    """A rig without backlash and one with it that have made the motion."""
    plain = made(None)
    run(plain, motion)
    rig = made()
    run(rig, motion)
    return plain, rig


def home(rig, steps):
    """Declare where the joints are."""
    for driver, before, after in zip(rig.drivers, rig.commanded(), steps):
        driver.declared += before - after
    rig.engine.home(7, steps)


def check_end(rig):
    """A motion has ended, and each motor is where its position and the side of the play say."""
    assert not rig.engine.moving
    assert rig.engine.fault == 0, (rig.engine.fault, rig.engine.fault_joint)
    assert rig.engine.known == 7
    for number, (driver, position) in enumerate(zip(rig.drivers, rig.commanded())):
        assert driver.motor == position + driver.declared + driver.ahead(), (number, driver.motor, position)


def check_frozen(rig, fault=0):
    """The steps that the pins have made are those of the position and of what the motor has crossed."""
    assert rig.engine.fault == fault and rig.engine.known == 7
    for driver, drive, position in zip(rig.drivers[:2], rig.engine.drives, rig.commanded()):
        ahead = driver.motor - position - driver.base()
        assert ahead == drive._motor_ahead and 0 <= -ahead <= driver.play, (position, ahead)


def case_the_joint_follows():  # on CPython
    """At the end of a motion each joint stands where it does without backlash; one that has none has the same edges."""
    random.seed(SEED)
    plain, rig = beside(some_motion())
    assert rig.commanded() == plain.commanded(), (rig.commanded(), plain.commanded())
    assert rig.drivers[2].steps == plain.drivers[2].steps
    for driver, expected in zip(rig.drivers, plain.commanded()):
        assert driver.moved() == expected, (driver.moved(), expected)


def case_reversals_within_a_crossing():  # not emulated
    """However often a joint reverses before its play is crossed, it ends where it does without backlash."""
    random.seed(SEED + 6)
    seen = 0
    for number in range(2):
        plain, rig = beside(some_motion(size=120))
        assert [driver.moved() for driver in rig.drivers] == plain.commanded(), number
        turned = [plain.drivers[1].steps[begin][0] for begin, _ in legs(plain.drivers[1].steps)]
        for n in range(len(turned) - 2):
            seen += turned[n + 2] - turned[n] < crossing_ticks(PLAY[1])
    assert seen, seen


def case_a_crossing_keeps_its_limits():  # not emulated
    """After a reversal the motor is never farther ahead than its acceleration allows, and has crossed the play in the
    time that it takes."""
    random.seed(SEED + 1)
    seen = 0
    plain, rig = beside(some_motion(size=3000))
    for joint in (0, 1):
        merged, steps = rig.drivers[joint].steps, plain.drivers[joint].steps
        ticks = [time for time, _ in merged]
        least = min([ticks[n + 1] - ticks[n] for n in range(len(ticks) - 1)])
        assert least >= TICK_HZ // 60000, (joint, least)
        for begin, end in legs(steps):
            seen += check_crossing(merged, steps, begin, end, PLAY[joint])
    assert seen > 2, seen


def legs(steps):
    """The first step after each reversal, and the first after the next: pairs of indices."""
    turns = [n for n in range(1, len(steps)) if steps[n][1] != steps[n - 1][1]] + [len(steps)]
    return [(turns[n], turns[n + 1]) for n in range(len(turns) - 1)]


def check_crossing(merged, steps, begin, end, play):
    """Check what came after a reversal; returns 1 if the crossing had the time to end.

    ``begin``, ``end``: of the plain ``steps`` of that direction.
    """
    turned, direction = steps[begin - 1][0], steps[begin][1]
    crossed = turned + crossing_ticks(play) + MARGIN_TICKS
    if [time for time, way in steps[:begin] if time > 2 * turned - crossed and way == direction]:
        return 0  # the crossing before may not have ended
    until = steps[end][0] if end < len(steps) else 1 << 60
    found = [time for time, way in merged if turned < time < until and way == direction]
    own = [time for time, _ in steps[begin:end]]
    came = 0
    for n, time in enumerate(found):
        while came < len(own) and own[came] <= time + 1:
            came += 1
        extra = n + 1 - came
        most = ACCELERATION / 2 * ((time - turned) / TICK_HZ) ** 2 + 1.5
        assert -2 < extra <= min(most, play + 1), (n, time - turned, extra, most)
    if until < crossed:
        return 0
    done = len([None for time in found if time <= crossed])
    due = len([None for time in own if time <= crossed])
    assert done >= play + due - 1, (done, play, due)
    return 1


def case_a_long_crossing_at_the_highest_rate():  # not emulated
    """Joint and play together at up to 10000 steps/s, so that the queue is full again and again."""
    play, rate = 1000, 5000.0
    swing = rate * 1.5 / (2 * math.pi)
    angles = [0] * 4 + [swing * (1 - math.cos(math.pi * k / 4)) for k in range(17)] + [0] * 4
    times = [0.1875 * number for number in range(-2, len(angles) - 2)]
    rig = made([play] * 3, acceleration=rate**2 / play, rows=joints(max_rate=10100), turn_us=8000)
    run(rig, record(control_points=[angles] * 3, time_points=times))
    steps = rig.drivers[0].steps
    assert len(legs(steps)) == 3
    fastest = min([steps[n + 50][0] - steps[n][0] for n in range(len(steps) - 50)])
    assert 50 * TICK_HZ / 10000 <= fastest < 50 * TICK_HZ / 8000, fastest


def case_a_slow_loop_ends_in_a_fault():  # not emulated
    """At 10000 steps/s the loop may take 8 ms; if it is too slow, the motion is frozen before steps come in a burst."""
    ran = []
    for turn_ms in (8, 30):
        random.seed(SEED + 5)
        rig = made([200] * 3, acceleration=2e4, rows=joints(max_rate=200000), turn_us=1000 * turn_ms)
        rig.engine.load(some_motion(size=3000))
        rig.engine.start()
        rig.run_to(100 * TICK_HZ)
        ran.append((turn_ms, check_fast(rig)))
        assert rig.engine.fault in (0, codes.UNDERRUN) and rig.engine.known == 7
    assert ran == [(8, True), (30, False)], ran


def change(rig):
    """Another speed, a pause or the end of one, and some time with it."""
    slow = rig.engine.rates.wanted < 200
    rig.engine.change_rate(random.choice((1000, RESUME)) if slow else random.choice((0, 10, 300, 700, 900)))
    rig.run_to(rig.board.now - rig.zero() + random.randrange(TICK_HZ // 2))


def case_changes_and_stops():  # not emulated
    """Changes of speed, pauses, stops, freezes, a loop of up to 8 ms: the next motion begins where the joints are."""
    random.seed(SEED + 2)
    rig = made()
    run(rig, straight(20))
    place = [20, 20, 20]
    for _ in range(8):
        rig.turn_ticks = 84000 * random.choice((1, 3, 8))
        rig.engine.load(some_motion(place), random.choice((1000, 1000, 600)))
        rig.engine.start()
        rig.run_to(random.randrange(-TICK_HZ // 50, TICK_HZ))
        for _ in range(random.randrange(4)):
            if rig.engine.moving:
                change(rig)
        end = random.choice(("stop", "freeze", "on"))
        if rig.engine.moving and end == "stop":
            rig.engine.brake()
        elif rig.engine.moving and end == "freeze":
            rig.engine.freeze()
        elif rig.engine.moving:
            rig.engine.change_rate(1000)
        if rig.engine.moving:
            rig.run_to(rig.board.now - rig.zero() + 20 * TICK_HZ)
            check_end(rig)
        else:  # frozen, as by a stop in a pause: perhaps within a crossing
            rig.turn()
            check_frozen(rig)
        place = rig.commanded()


def case_an_estop_within_a_crossing():  # not emulated
    """The next motion crosses what is left of the play."""
    random.seed(SEED + 7)
    rig = made(flags=armrecord.FLAG_ESTOP_FITTED)
    run(rig, straight(20))
    left = 0
    for _ in range(4):
        rig.engine.load(some_motion(rig.commanded()))
        rig.engine.start()
        rig.board.at(rig.zero() + random.randrange(TICK_HZ), lambda: external_interrupts.set_level("E15", 0))
        rig.run_to(2 * TICK_HZ)
        check_frozen(rig, codes.ESTOP)
        left += [
            0 < drive._left < driver.play for driver, drive in zip(rig.drivers, rig.engine.drives[:2])
        ].count(True)
        external_interrupts.set_level("E15", 1)
        rig.turn()
        assert rig.engine.clear()
        run(rig, some_motion(rig.commanded()))
    assert left > 1, left


def case_prepared_motions():  # not emulated
    """The next motion is prepared while one runs, as in a sequence."""
    random.seed(SEED + 3)
    rig = made()
    coming = NextMotion(rig.engine)
    places = [[0, 0, 0], some_place()]
    ready, motion = None, some_motion(*places, segments=10)
    for number in range(4):
        following = [places[1], some_place()]
        rig.engine.load(motion, 1000, ready)
        rig.engine.start()
        motion = some_motion(*following, segments=10)
        stands = places[1]
        for _ in coming.pieces(1000, lambda leg=motion: leg, lambda _, joint, at=stands: at[joint]):
            rig.turn()
        ready = coming
        rig.run_to(rig.board.now - rig.zero() + 20 * TICK_HZ)
        check_end(rig)
        assert rig.commanded() == places[1], number
        places = following


def case_an_encoder_on_the_motor():  # not emulated
    """It counts the steps of the crossing; they are taken out of what the board reports and watches."""
    random.seed(SEED + 4)
    rows = joints(encoder=0, following_counts=3)
    for number, joint in enumerate(rows):
        joint.update(encoder=number, channel=number)
    rig = made(on_motor=1, rows=rows)
    place = [0, 0, 0]
    for number in range(2):
        run(rig, some_motion(place))
        place = rig.commanded()
        for sample in rig.samples:
            for joint in range(3):
                off = sample[7 + joint] - sample[4 + joint] * 5 / 16
                assert abs(off) <= 2, (number, joint, sample)
    home(rig, [1000, 2000, 3000])
    run(rig, some_motion([1000, 2000, 3000]))


def case_the_side_is_forgotten():
    """A joint whose position was unknown begins without a crossing, whichever way; not one that is homed again."""
    for forgets, way in ((False, 1), (False, -1), (True, -1)):
        rig = made()
        run(rig, straight(100))
        if forgets:
            rig.engine.drivers(0)
            for driver in rig.drivers:
                driver.declared += driver.ahead() - driver.base() + driver.play
        home(rig, [0, 0, 0])
        count = len(rig.drivers[0].steps)
        run(rig, straight(50 * way))
        extra = len(rig.drivers[0].steps) - count - 50
        assert extra == (0 if forgets or way > 0 else PLAY[0]), (forgets, way, extra)


def case_homing_keeps_the_side():
    """The positions are unknown between its motions, as the controller has it, but the motors' steps are counted."""
    for released in (False, True):
        rig = made()
        for way in (-400, 300, -90):
            rig.engine.drivers(0) if released else None
            for driver in rig.drivers:
                driver.steps = []
            before = [driver.joint for driver in rig.drivers]
            home(rig, [0, 0, 0])
            rig.engine.load(straight(way))
            rig.engine.start()
            rig.run_to(100 * TICK_HZ)
            rig.engine.withdrawn |= rig.engine.known  # as Controller does
            rig.engine.known = 0
            for driver, stood, play in zip(rig.drivers, before, PLAY):
                extra = 0 if released or stood is None else play
                assert len(driver.steps) == abs(way) + extra, (released, way, len(driver.steps))
                assert stood is None or released or driver.joint == stood + way, (way, stood, driver.joint)


cases.run(globals())
