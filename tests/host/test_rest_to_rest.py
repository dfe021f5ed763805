"""Moves that the board makes itself: their ends, their limits, their times, and what braking on them takes."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from armtempo.encoding import encode
from armtempo.model.arm import Arm
from armtempo.planning import brake_time, point_to_point
from armtempo.splines import extremes
from armtempo.splines.trajectory import Trajectory
from armtempo_shared import limits, motion, rest_to_rest
from armtempo_shared.engine_memory import ONCE_BYTES
from armtempo_shared.motion import EVEN_RAMP, RAMP_LENGTH, RAMP_SHAPE_BIT
from armtempo_shared.rest_to_rest import Move, TooLongError

from tests.host.test_floors import changed_excess, every_start

ARMS = [Arm.paper(), Arm.load("ar4")]


def record(arm: Arm, start: list[int], target: list[int], percent: int = 100) -> bytes:
    move = Move(start, target, encode.move_limits(arm), limits.MAX_STEP_RATE_SUM, percent)
    data = b"".join(move.pieces(7))
    assert len(data) == move.size <= ONCE_BYTES
    assert motion.Motion(data).arm_crc == 7
    return data


def steps(arm: Arm, angles_deg: list[float]) -> list[int]:
    return [round(angle * joint.steps_per_deg) for angle, joint in zip(angles_deg, arm.driven, strict=True)]


def random_ends(rng: random.Random, arm: Arm) -> tuple[list[int], list[int]]:
    """Two postures, near each other or far; often some joints do not move."""
    share = 10 ** rng.uniform(-3, 0)
    start = [rng.uniform(*joint.range_deg) for joint in arm.driven]
    target = [
        here if rng.random() < 0.2 else here + share * (rng.uniform(*joint.range_deg) - here)
        for here, joint in zip(start, arm.driven, strict=True)
    ]
    return steps(arm, start), steps(arm, target)


def brakes_of(data: bytes, found: Trajectory, starts_s: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Length in seconds and shape of the ramps to rest, and of others, from these times."""
    stored = motion.Motion(data)
    unit_s = (1 << stored.ramp_bits) / limits.TICK_HZ
    duration = math.ceil(found.duration_s * limits.TICK_HZ / 1024)
    rows = []
    for to_rest in (True, False):
        entries = np.array(
            [
                stored.ramp(int(start * limits.TICK_HZ / 1024), duration, to_rest)
                for start in starts_s.tolist()
            ]
        )
        rows.append((unit_s * (entries & RAMP_LENGTH), entries >> RAMP_SHAPE_BIT))
    return rows


@pytest.mark.seeds(3)
def test_random_moves_keep_their_limits_and_end_where_they_should(seed: int) -> None:
    print("seed", seed)
    rng = random.Random(seed)
    for _ in range(12):
        arm = rng.choice(ARMS)
        start, target = random_ends(rng, arm)
        data = record(arm, start, target)
        found = encode.decoded(data, arm.transmission, "move")
        for joint, spline, most, begin, end in zip(
            arm.driven, found.joints, extremes.of_joints(found.joints), start, target, strict=True
        ):
            assert np.all(most.values <= 1.0001 * np.array(joint.limits.values) + 1e-6)
            ends = np.array([spline(0.0), spline(found.duration_s)]) * joint.steps_per_deg
            assert ends == pytest.approx([begin, end], abs=1e-4)
            low, high = sorted((begin, end))
            way = spline(np.linspace(0, found.duration_s, 200)) * joint.steps_per_deg
            assert low - 1e-4 <= way.min() <= way.max() <= high + 1e-4


@pytest.mark.seeds(2)
def test_braking_and_changes_of_speed_keep_what_they_may(seed: int) -> None:
    print("seed", seed)
    rng = random.Random(seed)
    for _ in range(3):
        arm = rng.choice(ARMS)
        data = record(arm, *random_ends(rng, arm))
        found = encode.decoded(data, arm.transmission, "move")
        starts = every_start(found, 31)
        allowed = [joint.limits for joint in arm.driven]
        to_rest, others = brakes_of(data, found, starts)
        for rate, (lengths, shapes) in (((1.0, 0.0), to_rest), ((0.5, 0.0), to_rest), ((0.0, 1.0), others)):
            kinds = shapes if rate[1] == 0.0 else np.full(len(starts), EVEN_RAMP)
            worst = changed_excess(found, allowed, starts, lengths, rate, kinds)
            assert worst[:, 0].max() <= 1 + 1e-3
            assert worst[:, 1].max() <= brake_time.EXCESS * 1.03, rate


@pytest.mark.parametrize("share", [0.003, 0.03, 0.3, 0.9])
def test_they_take_little_more_time_than_the_hosts_moves(share: float) -> None:
    """Those fit their law to each move; these are one of five shapes."""
    for arm in ARMS:
        start = [low + 0.05 * (high - low) for low, high in (joint.range_deg for joint in arm.driven)]
        end = [low + (0.05 + share) * (high - low) for low, high in (joint.range_deg for joint in arm.driven)]
        data = record(arm, steps(arm, start), steps(arm, end))
        taken_s = encode.decoded(data, arm.transmission, "move").duration_s
        hosts_s = point_to_point.straight("m", start, end, arm).duration_s
        print(f"{arm.name}, {share:g} of the ranges: {taken_s:.3f} s, the host's {hosts_s:.3f} s")
        assert taken_s <= 1.25 * hosts_s


def test_slower_moves_take_longer_and_one_that_stays_takes_the_least_time() -> None:
    arm = ARMS[0]
    start, target = steps(arm, [0.0, -60.0, 40.0]), steps(arm, [30.0, -50.0, 60.0])
    whole, slow = (motion.Motion(record(arm, start, target, percent)) for percent in (100, 25))
    times = [sum(each.points(each.time_offset(0) + 8 * each.segments, 5)) for each in (whole, slow)]
    assert times[1] == pytest.approx(4 * times[0], rel=1e-6)
    still = Move(start, start, encode.move_limits(arm), limits.MAX_STEP_RATE_SUM)
    assert still.duration_ticks == rest_to_rest.SHORTEST_TICKS


def test_the_largest_record_fits_into_the_boards_memory() -> None:
    points = max(rest_to_rest._points(shape) for shape in rest_to_rest.SHAPES)
    degree = rest_to_rest.DEGREE
    assert motion.size(degree, limits.MAX_JOINTS, True, points - degree, 1) <= ONCE_BYTES


def test_a_move_that_takes_minutes_is_refused() -> None:
    with pytest.raises(TooLongError):
        Move([0], [1 << 20], [[100, 1, 1]], 1000)
