"""The pulses of whole replays, read from the pin log, against the splines in the trajectory file; samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.system.conftest import SAME
from tests.system.replays import TICK_HZ, Replay, exact, pulses

JOINTS = range(3)
EDGE_TICKS = 2.0
"""How far an edge may be from the exact crossing if the joint is fast."""
COMPUTED_TICKS = 0.01
"""What the exact crossing itself may be off by: bisection in doubles over up to 2e9 ticks."""
FAST_STEPS_S = 50.0
FROM_SPLINE_STEPS = 0.55
SETUP_TICKS = 5 * TICK_HZ // 1_000_000
DIR_APART_TICKS = 200 * TICK_HZ // 1_000_000
"""DIR is turned by an interrupt, as late as the program's other work makes it: up to 200 us between two
interpreters. STEP edges come from DMA alone and may not differ at all."""
EVERY_S = 0.1
LATE_S = 20e-6
"""How late the interrupt may read the clock (board facts: 2 us to enter; the rest is work under way)."""


@pytest.fixture(params=JOINTS, ids=lambda joint: f"joint{joint + 1}")
def joint(request: pytest.FixtureRequest) -> int:
    """Each driven joint."""
    return int(request.param)


def test_every_step_is_there_none_extra_each_in_its_direction(replay: Replay, joint: int) -> None:
    made, wanted = pulses(replay, joint), exact(replay, joint).crossings()
    assert len(made.rises) == len(made.falls) == len(wanted.ticks)
    np.testing.assert_array_equal(made.directions, wanted.directions)


def test_edges_are_where_the_spline_crosses_half_a_step(replay: Replay, joint: int) -> None:
    made, spline = pulses(replay, joint), exact(replay, joint)
    wanted = spline.crossings().ticks
    rates = spline.rate(wanted)
    off = np.abs(made.rises - wanted)
    assert np.max(off[rates > FAST_STEPS_S]) <= EDGE_TICKS + COMPUTED_TICKS
    # slower ones may be later, but by less than a fiftieth of a step
    assert np.max(off * rates) / TICK_HZ < 0.02


def test_the_commanded_position_keeps_to_the_spline_at_all_times(replay: Replay, joint: int) -> None:
    made, spline = pulses(replay, joint), exact(replay, joint)
    # between two edges the position rests and the spline is monotone but at its turns: these are the extremes
    edges = made.rises.astype(float)
    for ticks in (edges - 1.0, edges, spline.turn_ticks()):
        off = made.position(spline.start, ticks) - spline.angle(ticks)
        assert np.max(np.abs(off)) <= FROM_SPLINE_STEPS


def test_it_ends_within_half_a_step_of_the_last_via_point(replay: Replay, joint: int) -> None:
    made, spline = pulses(replay, joint), exact(replay, joint)
    motor = replay.plan.arm.driven[joint].motor
    assert motor is not None
    end = spline.start + made.directions.sum()
    assert abs(end - replay.plan.via_deg[-1, joint] * motor.steps_per_deg) <= 0.5
    assert replay.repetition["commanded_steps"][joint] == end


def test_dir_changes_well_before_the_next_step_and_after_the_last(replay: Replay, joint: int) -> None:
    made = pulses(replay, joint)
    following = np.searchsorted(made.rises, made.dir_ticks, side="right")
    before = made.dir_ticks[following < len(made.rises)]
    after = made.dir_ticks[following > 0]
    assert np.all(made.rises[following[following < len(made.rises)]] - before >= SETUP_TICKS)
    assert np.all(after - made.falls[following[following > 0] - 1] >= SETUP_TICKS)


def test_pulses_are_as_wide_and_as_far_apart_as_the_arm_file_says(replay: Replay, joint: int) -> None:
    made, driver = pulses(replay, joint), replay.plan.arm.driver
    wide, apart = made.falls - made.rises, made.rises[1:] - made.falls[:-1]
    assert np.all(wide == round(driver.pulse_us * TICK_HZ / 1e6))
    assert np.all(apart >= driver.low_us * TICK_HZ / 1e6)


@pytest.mark.parametrize(("job", "name", "other"), SAME)
def test_all_interpreters_give_the_same_pin_log_and_samples(
    replay_of: Callable[[str, str], Replay], job: str, name: str, other: str
) -> None:
    ours, theirs = replay_of(job, name), replay_of(job, other)
    assert np.max(np.abs(ours.samples.time_s - theirs.samples.time_s)) <= LATE_S
    assert np.max(np.abs(ours.samples.commanded_steps - theirs.samples.commanded_steps)) <= 1
    for joint in JOINTS:
        one, two = pulses(ours, joint), pulses(theirs, joint)
        np.testing.assert_array_equal(one.rises, two.rises)
        np.testing.assert_array_equal(one.falls, two.falls)
        np.testing.assert_array_equal(one.directions, two.directions)
        turned = [made.dir_ticks[made.dir_ticks > made.rises[0]] for made in (one, two)]
        assert len(turned[0]) == len(turned[1])
        assert np.all(np.abs(turned[0] - turned[1]) <= DIR_APART_TICKS)


def end_s(replay: Replay) -> float:
    """The motion time as the splines have it."""
    return max(exact(replay, joint).duration_ticks for joint in JOINTS) / TICK_HZ


def test_a_sample_every_100_ms_and_one_at_the_end_none_missing_or_doubled(replay: Replay) -> None:
    end, times, repetition = end_s(replay), replay.samples.time_s, replay.repetition
    wanted = np.append(np.arange(0.0, end, EVERY_S), end)
    assert len(times) == len(wanted) == repetition["samples"]
    assert np.min(times - wanted) >= -1 / TICK_HZ
    assert np.max(times - wanted) <= LATE_S
    np.testing.assert_array_equal(replay.samples.index, np.arange(len(times)))
    assert replay.samples.commanded_steps[-1].tolist() == repetition["commanded_steps"]
    assert (repetition["lost"], repetition["state"]) == ([], "complete")
    assert abs(repetition["duration_s"] - end) <= LATE_S


def test_commanded_steps_are_those_on_the_pins_at_that_time(replay: Replay) -> None:
    ticks = np.rint(replay.samples.time_s * TICK_HZ)
    for joint in JOINTS:
        made, start = pulses(replay, joint), exact(replay, joint).start
        # the clock is read first, then the counts, within a microsecond or two
        earliest, latest = made.position(start, ticks - 1), made.position(start, ticks + LATE_S * TICK_HZ)
        found = replay.samples.commanded_steps[:, joint]
        assert np.all((found == earliest) | (found == latest))


def test_encoders_follow_the_commanded_angle(replay: Replay) -> None:
    """Ideal motors: what an encoder shows is a count's rounding away from the commanded angle."""
    for joint, driven in enumerate(replay.plan.arm.driven):
        assert driven.encoder is not None
        count_deg = 360.0 / driven.encoder.counts_per_rev
        off = replay.samples.angle_deg[:, joint] - replay.samples.commanded_deg[:, joint]
        # half a count for the start, half a count for the reading
        assert np.max(np.abs(off)) <= count_deg
