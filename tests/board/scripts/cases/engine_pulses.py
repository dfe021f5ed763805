"""Pulses on the pins are those computed, to the tick; braked at any moment, all joints rest at one point."""

# all cases: slow on CPython

import random
from array import array

import cases
from armtempo_board.buffers import COMMANDED, PATH_HIGH, PATH_LOW, TICKS_HIGH, TICKS_LOW
from armtempo_shared.motion import no_ramps
from brake_motion import BRAKE_TICKS, RAMP_BITS, RAMPS, path, record
from engine_rig import FEWER, TICK_HZ, Motion, Rig, Steps, arm  # simulated hardware; before what needs any

# isort: split
from armtempo_board.motion import readings

# Cases of braking come first: they have the real evaluator, and the others' rigs put theirs in its place for good,
# which the emulator would not forget from case to case.

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
    begin(rig, no_ramps())
    rig.run_to(TICK_HZ // 2)
    rig.engine.brake()
    assert not rig.engine.moving
    assert rig.engine.fault == 0
    assert rig.commanded() == [motor.position for motor in rig.arm.motors]


def check(rig, motion, first=(0,)):
    total = [steps.total() for steps in motion.joints]
    assert rig.engine.fault == 0, (rig.engine.fault, rig.engine.fault_joint)
    assert not rig.engine.moving
    for pulses in rig.pulses:
        pulses.check_end()
        assert pulses.all_came(), pulses.rises
    assert rig.commanded() == total == rig.stepped(), (rig.commanded(), total)


def check_samples(rig, motion):
    count = -(-motion.duration // (TICK_HZ // 10)) + 1
    assert len(rig.samples) == count, (len(rig.samples), count)
    for number, sample in enumerate(rig.samples):
        planned = min(number * (TICK_HZ // 10), motion.duration)
        late = (sample[0] & 0xFFFFFFFF) + (sample[1] << 32) - planned
        assert 0 <= late < 84 * 10, (number, late)
        for joint, steps in enumerate(motion.joints):
            position = 0
            place = [0, 0]
            while steps.at(place) and steps.at(place)[0] <= planned + late:
                position += steps.at(place)[1]
                steps.advance(place)
            assert sample[COMMANDED + joint] == position, (number, joint, sample, position)


def case_a_sample_has_times_beyond_32_bits():
    """From 51.1 s on."""
    sample = array("i", [0] * COMMANDED)
    for ticks in (5, (1 << 31) + 5, (3 << 32) + 5, (3 << 32) + (1 << 31) + 5):
        readings._put_ticks(sample, ticks)
        for low, high in ((TICKS_LOW, TICKS_HIGH), (PATH_LOW, PATH_HIGH)):
            assert (sample[low] & 0xFFFFFFFF) + (sample[high] << 32) == ticks, ticks


def case_three_joints():  # not emulated
    """Fast, turning, slow; twice, from where the first time ended."""
    motion = Motion(
        TICK_HZ + 12345,
        Steps((1000, 400, 3000, 1)),
        Steps((500, 5000, 200, 1), (1060000, 5000, 150, -1), (1830000, 5000, 9, 1)),
        Steps((700, 20_000_000, 4, -1)),
    )
    rig = Rig(arm(3))
    rig.run(motion)
    check(rig, motion)
    check_samples(rig, motion)
    rig.run(motion)
    assert rig.commanded() == [2 * steps.total() for steps in motion.joints]


def case_highest_rate():  # not emulated
    """Three joints at a third of a million steps a second each, on both timers."""
    rig = Rig([dict(joint, channel=channel) for joint, channel in zip(arm(3), (0, 3, 5))], pulse_ticks=100)
    motion = Motion(TICK_HZ // 100, *[Steps((1000 + 7 * n, 252, 3000, 1 - 2 * (n & 1))) for n in range(3)])
    rig.run(motion)
    check(rig, motion)


def case_six_joints():  # not emulated
    """All channels at once."""
    motion = Motion(
        TICK_HZ // 10,
        *[Steps((900 + n, 3000 + 17 * n, 500, 1), (4_000_000, 2000 + n, 700, -1)) for n in range(6)],
    )
    rig = Rig(arm(6))
    rig.run(motion)
    check(rig, motion)
    check_samples(rig, motion)


def case_long_rest():  # not emulated
    """Joints idle for longer than half the counter, for longer than all of it, and to the very end."""
    second = TICK_HZ
    motion = Motion(
        130 * second,
        Steps((100, 5000, 10, 1), (30 * second, 5000, 3, 1), (125 * second, 40_000, 5, -1)),
        Steps((60 * second, 3000, 20, -1), (60 * second + 100_000, 3000, 20, 1)),
        Steps((50, 20_000, 2, 1)),
        Steps(),
    )
    rig = Rig(arm(4), turn_us=20000)
    rig.run(motion)
    check(rig, motion)
    assert len(rig.samples) == 1301


def case_across_the_wrap():
    """Steps at a good rate while the counter comes round, again and again."""
    wrap = 1 << 32
    motion = Motion(
        3 * wrap + TICK_HZ,
        Steps(*[(n * wrap - 2_000_000, 4000, 1000, 1) for n in (1, 2, 3)]),
        Steps((wrap - 1, 10_000, 30, 1), (2 * wrap, 10_000, 30, -1), (3 * wrap - 30_000 * 7, 30_000, 15, 1)),
    )
    rig = Rig(arm(2), turn_us=20000)
    rig.run(motion)
    check(rig, motion)


def case_many_turns():  # not emulated
    """To and fro, every other time with the shortest gap, more turns waiting than the queue holds."""
    gap = 2 * 8400 + 2 * 420 + 168
    blocks = []
    time = 1000
    for n in range(120):
        count = 1 + n % 3
        blocks.append((time, 400, count, 1 - 2 * (n & 1)))
        time += 400 * (count - 1) + (200_000 if n & 1 else gap)
    motion = Motion(time + 1000, Steps(*blocks), Steps(*[(t + 77, g, c, -d) for t, g, c, d in blocks]))
    rig = Rig(arm(2))
    rig.run(motion)
    check(rig, motion)
    assert rig.pulses[0].shortest_hold < 12000, rig.pulses[0].shortest_hold


def case_steps_to_the_end():
    """The last edges are at the motion's end; a motion of a single step; a motion of none."""
    for motion in (
        Motion(100_000, Steps((100_000 - 168 - 5000, 1000, 6, 1))),
        Motion(40_000, Steps((39_000, 1, 1, -1))),
        Motion(5_000, Steps()),
    ):
        rig = Rig(arm(1))
        rig.run(motion)
        check(rig, motion)
        check_samples(rig, motion)


def case_loaded_in_vain():  # not emulated
    """A motion that was loaded and never started leaves nothing behind."""
    rig = Rig(arm(2))
    rig.engine.load(Motion(100_000, Steps((5000, 400, 20, -1)), Steps((900, 300, 50, 1))))
    motion = Motion(8_000_000, Steps((7_000_000, 400, 20, 1)), Steps())
    rig.run(motion)
    check(rig, motion)


cases.run(globals())
