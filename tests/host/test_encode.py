"""Encoding for the board: degrees to steps, seconds to ticks, what does not fit, and the memory for an arm."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import combinations_with_replacement

import numpy as np
import pytest
from armtempo.basics.errors import InputError, PlanError
from armtempo.encoding import encode, engine_heap
from armtempo.encoding.engine_heap import CORE, IN_FIRMWARE, EngineHeap
from armtempo.model.arm import Arm
from armtempo.model.parts import Limits
from armtempo.planning import board_limits, move_law, point_to_point
from armtempo.planning.brake_time import BrakeTimes
from armtempo.splines.trajectory import JointSpline, Trajectory
from armtempo_shared import armrecord, engine_memory, limits, motion
from armtempo_shared.engine_memory import SHORT_MS, memory_words

ARM = Arm.paper()
BRAKES = BrakeTimes(1.0, np.arange(5.0, 69.0), np.arange(100.0, 420.0, 10.0), np.arange(63) % 32, 14)
START, END = np.array([0.0, -60.0, 40.0]), np.array([180.0, -38.0, -52.0])
PAPER = Arm.paper()


def trajectory(shared: bool) -> Trajectory:
    """Three joints, two segments, refined twice; control points that are easy to recognise."""
    splines = tuple(
        JointSpline(5, 2, np.arange(7.0) + 10 * joint, np.arange(9.0) + (0 if shared else joint))
        for joint in range(3)
    )
    return Trajectory("t", splines, shared)


@pytest.mark.parametrize("shared", [False, True])
def test_control_points_arrive_as_steps_and_ticks(shared: bool) -> None:
    record = motion.Motion(encode.motion_record(trajectory(shared), ARM, BRAKES))
    assert (record.degree, record.joints, record.segments, record.refine) == (5, 3, 2, 2)
    assert record.shared == shared
    assert record.ramp_bits == 14
    end = 63 * 100
    expected = [6 + place + 2048 * (place % 32) for place in range(63)]
    assert [record.ramp(100 * place, end, True) for place in range(63)] == expected
    assert record.ramp(end, end, True) == 68 + 2048 * (62 % 32)
    assert [record.ramp(at, end, False) for at in (-5, 0, end, end + 1)] == [101, 101, 410, 410]
    for joint, per_deg in enumerate((6400 / 180, 32000 / 360, 6400 / 180)):
        angles = np.frombuffer(record.data, "<i8", 7, record.angle_offset(joint)) / 2.0**28
        np.testing.assert_allclose(angles, (np.arange(7) + 10 * joint) * per_deg, atol=2.0**-28)
        times = np.frombuffer(record.data, "<i8", 9, record.time_offset(joint)) / 2.0**16
        np.testing.assert_array_equal(times / limits.TICK_HZ, np.arange(9) + (0 if shared else joint))


def test_the_record_names_the_arm_it_was_made_for() -> None:
    crc = armrecord.unpack(encode.arm_record(ARM))[2]
    assert motion.Motion(encode.motion_record(trajectory(False), ARM)).arm_crc == crc


def test_the_record_of_an_arm_is_made_once_and_another_one_for_another_arm() -> None:
    first = encode.arm_record(ARM)
    assert encode.arm_record(ARM) is first
    joint = ARM.joints[0]
    assert joint.motor is not None
    other = replace(
        ARM,
        joints=(
            replace(joint, motor=replace(joint.motor, microsteps=2 * joint.motor.microsteps)),
            *ARM.joints[1:],
        ),
    )
    assert encode.arm_record(other) != first
    assert encode.arm_record(ARM) == first


def test_the_arm_record_speaks_steps_and_counts() -> None:
    head, joints, _ = armrecord.unpack(encode.arm_record(ARM))
    assert head["dir_setup_ticks"] == 5 * 84
    assert head["pulse_ticks"] == 2 * 84
    ratios = [Fraction(joint["counts_num"], joint["counts_den"]) for joint in joints]
    assert ratios == [Fraction(4000, 12800), Fraction(4000, 32000), Fraction(4000, 12800)]
    assert joints[1]["min_steps"] == round(-170 * 32000 / 360)
    assert joints[1]["max_rate"] > 40 * 32000 / 360


def test_an_encoder_on_the_motor_counts_faster() -> None:
    joint = ARM.driven[0]
    assert joint.encoder
    geared = replace(joint, encoder=replace(joint.encoder, on="motor"))
    assert geared.counts_per_step == 2 * joint.counts_per_step


def test_a_ratio_that_a_word_cannot_hold_is_refused() -> None:
    joint = ARM.joints[0]
    assert joint.motor
    for gear, fits in ((5.01, True), (5.000000001, False)):
        fine = replace(joint, motor=replace(joint.motor, gear_ratio=gear))
        arm = replace(ARM, joints=(fine, *ARM.joints[1:]))
        if fits:
            encode.arm_record(arm)
        else:
            with pytest.raises(
                InputError, match="joint 1: the board cannot represent the ratio of encoder counts"
            ):
                encode.arm_record(arm)


def test_a_speed_in_the_wrong_unit_is_refused_with_the_step_rate() -> None:
    joint = replace(ARM.joints[1], limits=Limits(40_000.0, 30.0, 120.0))
    arm = replace(ARM, joints=(ARM.joints[0], joint, *ARM.joints[2:]))
    with pytest.raises(InputError, match=r"joint 2 at its speed limit of 40000 deg/s needs 3555556 steps/s"):
        encode.arm_record(arm)


def test_a_trajectory_for_another_arm_is_refused() -> None:
    two = replace(trajectory(False), joints=trajectory(False).joints[:2])
    with pytest.raises(InputError, match="has 2 joints, arm 'paper-1to5' drives 3"):
        encode.motion_record(two, ARM)


def test_numbers_the_record_cannot_hold_are_refused() -> None:
    first, *others = trajectory(False).joints
    huge = replace(first, angle_points_deg=first.angle_points_deg * 1e12)
    with pytest.raises(InputError, match="too large"):
        encode.motion_record(replace(trajectory(False), joints=(huge, *others)), ARM)


def spread(seconds: float, deg: float = 10.0, segments: int = 4) -> Trajectory:
    """Straight lines to ``deg`` in ``seconds``."""
    joints = tuple(
        JointSpline(5, 1, np.linspace(0.0, deg, segments + 5), np.linspace(0.0, seconds, segments + 5))
        for _ in ARM.driven
    )
    return Trajectory("t", joints, shared=False)


def test_numbers_that_the_board_cannot_hold_are_refused_as_it_does() -> None:
    span_s, most_s = limits.LONGEST_SPAN_TICKS / limits.TICK_HZ, limits.LONGEST_TICKS / limits.TICK_HZ
    for made, words in (
        (spread(span_s * 8 / 5), "raise refine or add via points"),
        (spread(most_s, segments=100), "stop = true and plan with --split"),
        (spread(1.0, 1e6), "more steps than the board can count"),
    ):
        with pytest.raises(PlanError, match=words):
            encode.motion_record(made, ARM)
    for made in (spread(span_s * 8 / 5 - 1), spread(most_s - 1, segments=100)):
        encode.motion_record(made, ARM)


def test_an_angle_of_more_steps_than_the_board_counts_is_refused() -> None:
    """It counts below 2**27, here in small segments."""
    most_deg = 2**27 / max(joint.steps_per_deg for joint in ARM.driven)
    board_limits.check_held(spread(1.0, most_deg * 0.999, segments=100), ARM)
    with pytest.raises(PlanError, match="more steps than the board can count"):
        board_limits.check_held(spread(1.0, most_deg * 1.001, segments=100), ARM)


# moves without a search, and motion records read back


@pytest.mark.parametrize("seed", range(20))
def test_straight_keeps_the_limits_and_uses_one_of_them(seed: int) -> None:
    numbers = np.random.default_rng(seed)
    low, high = np.array([joint.range_deg for joint in ARM.driven]).T
    start, end = numbers.uniform(low, high, (2, 3))
    if seed % 2:
        end = start + 0.01 * (end - start)
    motion = point_to_point.straight("x", start, end, ARM)
    np.testing.assert_allclose([motion(0.0), motion(motion.duration_s)], [start, end], atol=1e-9)
    times = np.linspace(0.0, motion.duration_s, 4001)
    limits = np.array([joint.limits.values for joint in ARM.driven if joint.limits]).T
    shares = [np.abs(motion(times, order)).max(axis=0) / limits[order - 1] for order in (1, 2, 3)]
    most = np.array([[1.0], [move_law.ACCELERATION], [move_law.JERK]])
    assert 0.98 < np.max(shares / most) <= 1.0 + 1e-9
    for order in (1, 2):
        np.testing.assert_allclose(motion(np.array([0.0, motion.duration_s]), order), 0.0, atol=1e-7)


@pytest.mark.parametrize("speed", [0.25, 0.01])
def test_a_straight_move_may_take_minutes(speed: float) -> None:
    """Of one segment, the board takes 163 s."""
    motion = point_to_point.straight("x", [0.0, -60.0, 40.0], [180.0, -60.0, 40.0], ARM, speed)
    encode.motion_record(motion, ARM)
    assert motion.duration_s == pytest.approx(180.0 / (speed * ARM.driven[0].limits.speed_deg_s), rel=0.2)


def test_straight_refuses_what_is_out_of_range() -> None:
    with pytest.raises(InputError, match="joint 1: 200 degrees is outside"):
        point_to_point.straight("x", START, [200.0, -60.0, 0.0], ARM)
    with pytest.raises(InputError, match="3 angles, not 2"):
        point_to_point.straight("x", START, [0.0, 0.0], ARM)


def test_backwards_mirrors_time() -> None:
    motion = point_to_point.straight("x", START, END, ARM)
    back = point_to_point.backwards(motion, "y")
    times = np.linspace(0.0, motion.duration_s, 101)
    np.testing.assert_allclose(back(times), motion(motion.duration_s - times), atol=1e-9)


def test_records_read_back() -> None:
    motion = point_to_point.straight("x", START, END, ARM)
    data = encode.motion_record(motion, ARM)
    found = encode.decoded(data, ARM.transmission, "x")
    times = np.linspace(0.0, motion.duration_s, 101)
    np.testing.assert_allclose(found(times), motion(times), atol=1e-7)
    with pytest.raises(InputError, match="not a motion record"):
        encode.decoded(data[:-1], ARM.transmission, "x")


def six_joints() -> Arm:
    return Arm.load("ar4")


def test_an_arm_that_fits_is_told_with_its_bytes() -> None:
    line = engine_heap.of_arm(PAPER, CORE)
    needed = engine_memory.needed_bytes(encode.step_rates(PAPER))
    assert line == f"memory on the board: {needed} bytes for 3 joints of {CORE.size}"
    assert "fits with stock MicroPython or with the program in it" in engine_heap.of_arm(PAPER)


@pytest.mark.parametrize("size", range(8_000, 24_000, 500))
def test_what_is_said_to_fit_fits_with_the_margin_of_the_record(size: int) -> None:
    for joints in range(1, limits.MAX_JOINTS + 1):
        if rate := EngineHeap(size)._highest_rate(joints):
            assert EngineHeap(size).holds([encode.with_margin(rate)] * joints), (joints, rate)


def test_an_arm_with_more_joints_is_sent_to_the_firmware() -> None:
    arm = six_joints()
    with pytest.raises(InputError) as refused:
        engine_heap.check(arm, CORE)
    assert f"the board has {CORE.size}" in refused.value.problem
    assert "armtempo flash" in refused.value.hint
    assert "too much, or put the program into the board's firmware" in engine_heap.of_arm(arm, CORE)
    assert "fits only with the program in the firmware" in engine_heap.of_arm(arm)
    engine_heap.check(arm, IN_FIRMWARE)


def test_memory_that_is_too_small_is_told_in_bytes() -> None:
    small = EngineHeap(6_000)
    with pytest.raises(InputError) as refused:
        engine_heap.check(PAPER, small)
    assert "the board has 6000" in refused.value.problem
    assert "lower its top speeds" in refused.value.hint


def test_no_way_out_is_promised_that_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_heap, "IN_FIRMWARE", CORE)
    with pytest.raises(InputError) as refused:
        engine_heap.check(six_joints(), CORE)
    assert "armtempo flash" not in refused.value.hint


def test_a_board_tells_what_the_firmware_would_give() -> None:
    lines = engine_heap.of_board(CORE)
    assert len(lines) == 2
    assert "1 x 240000 steps/s, 2 x 120000 steps/s, 3 x 61000 steps/s" in lines[0]
    assert "6 x 40000 steps/s" in lines[1]
    assert "sequences" in lines[1]
    assert len(engine_heap.of_board(IN_FIRMWARE)) == 1


def test_the_words_name_the_highest_rate_that_fits() -> None:
    heap = EngineHeap(8_500)
    (rate,) = [
        int(part.split()[2]) for part in heap.describe().split(": ")[1].split(", ") if part.startswith("3 x")
    ]
    assert heap.holds([rate] * 3)
    assert not heap.holds([rate + 1000] * 3)


def test_rings_last_as_long_as_there_is_memory_for() -> None:
    for rates, in_firmware, core in (
        ([5_000] * 3, 12, 12),
        ([20_000] * 3, 12, 6),
        ([30_000] * 3, 12, 3),
        ([60_000] * 3, 12, 2),
        ([80_000] * 3, 12, 0),
        ([20_000] * 6, 6, 0),
        ([40_000] * 6, 3, 0),
    ):
        assert engine_memory.lasting_ms(rates, memory_words(len(rates), IN_FIRMWARE.size)) == in_firmware
        assert engine_memory.lasting_ms(rates, memory_words(len(rates), CORE.size)) == core
    for lasts_ms in engine_memory.LASTING_MS:
        for rate in (5_000, 60_000, 240_000):
            entries = engine_memory.ring_words(rate, lasts_ms) - 1
            assert entries == 1024 or entries / (2 * rate) >= lasts_ms / 1000


def test_the_largest_rings_find_their_places_first() -> None:
    """Else the small joint's would be in the only block that has space for the large one's."""
    assert engine_memory.lasting_ms([5_000, 240_000], 1960) == 12


def test_a_block_holds_a_ring_of_1024_entries_or_two_of_512() -> None:
    assert engine_memory.blocks(3000) == [1026, 1026, 948]
    assert engine_memory.ring_words(240_000, 3) == 1024 + 1
    assert 2 * engine_memory.ring_words(48_000, 3) == 1026


@pytest.mark.slow
def test_every_arm_fits_the_largest_memory() -> None:
    """Of the joints that a ring is as large for, the slowest each."""
    slowest = [1] + [
        rate
        for rate in range(2, limits.MAX_STEP_RATE + 1)
        if engine_memory.ring_words(rate, SHORT_MS) > engine_memory.ring_words(rate - 1, SHORT_MS)
    ]
    arms = [
        list(rates)
        for joints in range(1, limits.MAX_JOINTS + 1)
        for rates in combinations_with_replacement(slowest, joints)
        if sum(rates) <= limits.MAX_STEP_RATE_SUM
    ]
    assert len(arms) > 200
    most = max(map(engine_memory.words, arms))
    assert most == engine_memory.words([1, 1, *slowest[1:]])
    assert all(engine_memory.lasting_ms(rates, engine_memory.LARGEST_WORDS) for rates in arms)
    assert not all(engine_memory.lasting_ms(rates, engine_memory.LARGEST_WORDS - 1) for rates in arms)
