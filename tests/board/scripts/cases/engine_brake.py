"""Braking a real motion at many moments: every joint comes to rest at the same point of the path."""

# all cases: slow on CPython

import random

import cases
from armtempo_shared import motion
from brake_motion import BRAKE_TICKS, RAMP_BITS, RAMPS, path, record
from engine_rig import FEWER, TICK_HZ, Rig, arm

SEED = 20262
LENGTH_TICKS = -(-(RAMPS[0][0] << RAMP_BITS) // 64000) * 64000
"""Of a ramp, as it is run."""


def joints():
    rows = arm(3)
    rows[2]["following_counts"] = 0
    return rows


def case_whole_motion():  # not emulated
    """Without braking it ends at the last points."""
    rig = Rig(joints(), planned=False)
    begin(rig)
    rig.run_to(3 * TICK_HZ)
    assert rig.engine.fault == 0
    expected = path(10.0)
    assert [abs(a - b) <= 0.5 for a, b in zip(rig.commanded(), expected)] == [True] * 3, expected
    assert rig.commanded() == [rig.arm.motors[n].position for n in range(3)]


def begin(rig, ramps=RAMPS):
    rig.trusting()
    rig.engine.load(record(ramps))
    rig.engine.start()


def case_anywhere():  # slow
    """The stop is on the path, the samples continue to it, and nothing comes after it."""
    random.seed(SEED)
    for number in range(15 // FEWER):
        rig = Rig(joints(), planned=False)
        begin(rig)
        rig.run_to(random.randrange(-TICK_HZ // 50, TICK_HZ))
        asked = rig.board.now - rig.zero()
        rig.engine.brake()
        rig.engine.brake()
        end = rig.engine.rates.duration_ticks
        assert asked + BRAKE_TICKS < end < asked + BRAKE_TICKS + TICK_HZ // 9, (asked, end)
        rig.run_to(3 * TICK_HZ)
        assert rig.engine.fault == 0, rig.engine.fault
        assert rig.engine.known == 7
        rest = (end - LENGTH_TICKS / 2) / TICK_HZ
        for joint, (position, exact) in enumerate(zip(rig.commanded(), path(rest))):
            assert abs(position - exact) < 0.6, (number, joint, position, exact)
        assert rig.commanded() == [motor.position for motor in rig.arm.motors]
        last = (rig.samples[-1][0] & 0xFFFFFFFF) - end
        assert 0 <= last < 1000, last
        assert len(rig.samples) == -(-end // (TICK_HZ // 10)) + 1, len(rig.samples)
        assert rig.samples[-1][4:7] == rig.commanded()


def case_too_late():  # not emulated
    """Asked for when the motion is nearly over, it ends as planned."""
    rig = Rig(joints(), planned=False)
    begin(rig)
    end = rig.engine.rates.duration_ticks
    rig.run_to(end - TICK_HZ // 25)
    rig.engine.brake()
    assert rig.engine.rates.duration_ticks == end
    rig.run_to(3 * TICK_HZ)
    assert [abs(a - b) <= 0.5 for a, b in zip(rig.commanded(), path(10.0))] == [True] * 3


def case_never_longer_than_the_motion():  # not emulated
    """If braking would take longer than the rest of the motion, it ends as planned; earlier, it is braked."""
    for asked in (TICK_HZ // 2, TICK_HZ - TICK_HZ // 5):
        rig = Rig(joints(), planned=False)
        begin(rig)
        end = rig.engine.rates.duration_ticks
        rig.run_to(asked)
        left_ms = rig.engine.rest_ms()
        rig.engine.brake()
        assert abs(rig.engine.rest_ms() - left_ms) <= 1
        assert (rig.engine.rates.duration_ticks == end) == (asked + TICK_HZ // 20 + BRAKE_TICKS > end)
        now = rig.board.now - rig.zero()
        assert abs(rig.engine.rates.duration_ticks - now - 84000 * left_ms) <= 84000, (asked, left_ms)
        rig.run_to(3 * TICK_HZ)
        assert rig.engine.rest_ms() == 1
        assert rig.engine.rates.duration_ticks <= end


def case_not_planned_for():  # not emulated
    """A motion without a braking time is frozen."""
    rig = Rig(joints(), planned=False)
    begin(rig, motion.NO_RAMPS)
    rig.run_to(TICK_HZ // 2)
    rig.engine.brake()
    assert not rig.engine.moving
    assert rig.engine.fault == 0
    assert rig.commanded() == [motor.position for motor in rig.arm.motors]


cases.run(globals())
