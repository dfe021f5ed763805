"""The samples of whole replays: every 100 ms of the motion clock, and what the pins had done by then."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.system import pulses
from tests.system.conftest import SAME
from tests.system.exact import TICK_HZ
from tests.system.replays import Replay

EVERY_S = 0.1
LATE_S = 20e-6
"""How late the interrupt may read the clock (board facts: 2 us to enter; the rest is work under way)."""
JOINTS = range(3)


def end_s(replay: Replay) -> float:
    """The motion time as the splines have it."""
    return max(pulses.exact(replay, joint).duration_ticks for joint in JOINTS) / TICK_HZ


def test_there_is_one_every_100_ms_and_one_at_the_end(replay: Replay) -> None:
    end = end_s(replay)
    wanted = np.append(np.arange(0.0, end, EVERY_S), end)
    assert len(replay.samples.time_s) == len(wanted)
    late = replay.samples.time_s - wanted
    assert np.min(late) >= -1 / TICK_HZ
    assert np.max(late) <= LATE_S


def test_none_is_missing_or_doubled(replay: Replay) -> None:
    np.testing.assert_array_equal(replay.samples.index, np.arange(len(replay.samples.time_s)))
    assert replay.repetition["samples"] == len(replay.samples.time_s)
    assert replay.repetition["lost"] == []


def test_the_end_is_reported_with_the_motion_s_own_time(replay: Replay) -> None:
    assert abs(replay.repetition["duration_s"] - end_s(replay)) <= LATE_S
    assert replay.repetition["state"] == "complete"


def test_commanded_steps_are_those_on_the_pins_at_that_time(replay: Replay) -> None:
    ticks = np.rint(replay.samples.time_s * TICK_HZ)
    for joint in JOINTS:
        made, start = pulses.pulses(replay, joint), pulses.exact(replay, joint).start
        # the clock is read first, then the counts, within a microsecond or two
        earliest, latest = made.position(start, ticks - 1), made.position(start, ticks + LATE_S * TICK_HZ)
        found = replay.samples.commanded_steps[:, joint]
        assert np.all((found == earliest) | (found == latest))


def test_the_last_sample_shows_the_whole_motion(replay: Replay) -> None:
    assert replay.samples.commanded_steps[-1].tolist() == replay.repetition["commanded_steps"]


def test_encoders_follow_the_commanded_angle(replay: Replay) -> None:
    """Ideal motors: what an encoder shows is a count's rounding away from the commanded angle."""
    for joint, driven in enumerate(replay.plan.arm.driven):
        assert driven.encoder is not None
        count_deg = 360.0 / driven.encoder.counts_per_rev
        off = replay.samples.angle_deg[:, joint] - replay.samples.commanded_deg[:, joint]
        # half a count for the start, half a count for the reading
        assert np.max(np.abs(off)) <= count_deg


@pytest.mark.parametrize(("job", "name", "other"), SAME)
def test_interpreters_agree(replay_of: Callable[[str, str], Replay], job: str, name: str, other: str) -> None:
    one, two = replay_of(job, name).samples, replay_of(job, other).samples
    assert np.max(np.abs(one.time_s - two.time_s)) <= LATE_S
    assert np.max(np.abs(one.commanded_steps - two.commanded_steps)) <= 1
