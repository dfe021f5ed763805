"""The law of a jog of a joint: within ranges and limits, nearly the fastest, quick to brake."""

from __future__ import annotations

import math
import platform
import random
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, PlanError
from armtempo.encoding import encode
from armtempo.model import shipped
from armtempo.model.arm import Arm
from armtempo.model.parts import LimitSwitches
from armtempo.planning import brake_time, move_law, point_to_point
from armtempo.planning.jog import jog_motion
from armtempo.planning.jog.jog_motion import JogMove
from armtempo.planning.move_law import MoveLimits
from armtempo.robot import goto
from armtempo.splines import extremes
from armtempo.splines.trajectory import JointSpline, Trajectory
from armtempo_shared.engine_memory import ONCE_BYTES
from armtempo_shared.limits import TICK_HZ
from armtempo_shared.motion import Motion

from tests.host.jogs import AR4, ELBOW_DEG, PAPER, check_limits, on_steps

INF = math.inf


@pytest.mark.slow
def test_the_law_keeps_its_limits_and_is_nearly_the_fastest() -> None:
    seed = 7
    print("seed", seed)
    rng = random.Random(seed)
    for _ in range(100):
        limits = MoveLimits(*(10 ** rng.uniform(-1, 3) for _ in range(3)))
        length = 10 ** rng.uniform(-3, 3)
        law = move_law.law(length, limits, rng.choice([INF, length / 10]))
        spline = JointSpline(move_law.DEGREE, 1, law.distance, law.time_s)
        assert np.all(np.diff(law.time_s) > 0)
        assert spline(0.0) == pytest.approx(0.0, abs=1e-9 * length)
        assert spline(spline.duration_s) == pytest.approx(length)
        reached = extremes.of_joint(spline)
        for value, most in zip(reached.values, (limits.speed, limits.acceleration, limits.jerk), strict=True):
            assert value <= most * (1 + 1e-6)
        for order in (1, 2):
            assert spline(0.0, order) == pytest.approx(0.0, abs=1e-6 * reached.values[order - 1])
        peak = min(limits.peak(length), limits.speed)
        optimum_s = 2.0 * limits.ramp_s(peak) + max(0.0, length - peak * limits.ramp_s(peak)) / peak
        assert spline.duration_s <= max(move_law.SHORTEST_S * (1 + 1e-9), 1.15 * optimum_s)


def test_time_goes_on_where_little_is_left_between_the_ramps() -> None:
    """About as long as two ramps, as jogs of the tool are: a law with constant speed or without, within the limits."""
    print("seed", seed := 11)
    rng = random.Random(seed)
    for _ in range(12):
        joint = rng.choice(AR4.driven)
        limits = move_law.of_joints([joint.limits], [1.0], rng.choice([0.05, 0.25, 1.0]))
        parts = rng.choice([0, 8, 16, 32])
        for length in limits.speed * limits.step_s(limits.speed, INF) * np.linspace(5.0, 40.0, 36):
            law = move_law.law(length, limits, length / parts if parts else INF)
            assert np.all(np.diff(law.time_s) > 0), (length, limits, parts)
        reached = extremes.of_joint(JointSpline(move_law.DEGREE, 1, law.distance, law.time_s))
        for value, most in zip(reached.values, (limits.speed, limits.acceleration, limits.jerk), strict=True):
            assert value <= most * (1 + 1e-6)


TIMES_S = (0.1, 0.2, 0.5, 1.0, 2.0)
OPTIMUM_DEG = {
    "paper": (
        2,
        {
            1: (0.016991, 0.074644, 0.25464, 0.55464, 1.1546),
            5: (0.0175, 0.13896, 0.99291, 2.4929, 5.4929),
            25: (0.0175, 0.14, 2.0567, 9.1987, 24.199),
            100: (0.0175, 0.14, 2.0573, 11.619, 54.709),
        },
    ),
    "ar4": (
        0,
        {
            1: (0.013896, 0.069291, 0.24929, 0.54929, 1.1493),
            5: (0.014, 0.11196, 0.93305, 2.4331, 5.4331),
            25: (0.014, 0.112, 1.6122, 8.1696, 23.17),
            100: (0.014, 0.112, 1.6122, 8.898, 41.469),
        },
    ),
    "community": (
        0,
        {
            1: (0.021711, 0.06671, 0.20171, 0.42671, 0.87671),
            5: (0.028, 0.19048, 0.86461, 1.9896, 4.2396),
            25: (0.028, 0.224, 2.7139, 8.3388, 19.589),
            100: (0.028, 0.224, 3.2245, 17.789, 62.478),
        },
    ),
    "moveo": (
        0,
        {
            1: (0.0081172, 0.028048, 0.088048, 0.18805, 0.38805),
            5: (0.0093333, 0.069209, 0.36637, 0.86637, 1.8664),
            25: (0.0093333, 0.074667, 1.0133, 3.5045, 8.5045),
            100: (0.0093333, 0.074667, 1.0748, 5.932, 24.643),
        },
    ),
    "parol6": (
        0,
        {
            1: (0.10241, 0.23341, 0.62641, 1.2814, 2.5914),
            5: (0.33539, 0.99039, 2.9554, 6.2304, 12.78),
            25: (0.4585, 2.9795, 12.802, 29.177, 61.927),
            100: (0.4585, 3.3793, 30.736, 96.223, 227.22),
        },
    ),
    "scara": (
        0,
        {
            1: (0.020844, 0.10394, 0.37394, 0.82394, 1.7239),
            5: (0.021, 0.16794, 1.3996, 3.6496, 8.1496),
            25: (0.021, 0.168, 2.4184, 12.254, 34.754),
            100: (0.021, 0.168, 2.4184, 13.347, 62.204),
        },
    ),
    "community_rail": (
        0,
        {
            1: (0.062204, 0.1622, 0.4622, 0.9622, 1.9622),
            5: (0.1158, 0.57742, 2.0774, 4.5774, 9.5774),
            25: (0.11667, 0.93302, 7.7754, 20.275, 45.275),
            100: (0.11667, 0.93333, 12.25, 57.321, 157.32),
        },
    ),
    "scara_z": (
        0,
        {
            1: (0.009264, 0.046194, 0.16619, 0.36619, 0.76619),
            5: (0.0093333, 0.074642, 0.62204, 1.622, 3.622),
            25: (0.0093333, 0.074667, 1.0748, 5.4464, 15.446),
            100: (0.0093333, 0.074667, 1.0748, 5.932, 27.646),
        },
    ),
}
OPTIMUM_DEG["thor"] = OPTIMUM_DEG["moveo"]  # the same limits
"""Of the joint with the most of speed * jerk / acceleration² of each arm, or its slide (mm): by percent of its speed,
the way after TIMES_S at the limits of a jog, by ruckig's velocity interface (``python -m tests.benchmark.jogs
--table``)."""


def held(arm: Arm, joint: int, speed: float) -> Array:
    """Way of a held jog after TIMES_S, degrees, far from its end."""
    found = move_law.law(3000.0, move_law.of_joints([arm.driven[joint].limits], [1.0], speed))
    return JointSpline(move_law.DEGREE, 1, found.distance, found.time_s)(np.array(TIMES_S))


@pytest.mark.parametrize("name", OPTIMUM_DEG)
def test_a_held_jog_comes_close_to_the_optimum(name: str) -> None:
    joint, rows = OPTIMUM_DEG[name]
    for percent, optimum in rows.items():
        ratio = held(Arm.load(name), joint, percent / 100) / optimum
        assert ratio.min() >= 0.85, (percent, ratio)
        assert ratio.max() <= 1.001


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name != "paper")) for name in OPTIMUM_DEG]
)
def test_a_held_jog_goes_never_less_far_at_a_higher_speed(name: str) -> None:
    arm = Arm.load(name)
    for joint in range(len(arm.driven)):
        ways = np.array([held(arm, joint, percent / 100) for percent in (*range(1, 100, 4), 100)])
        assert np.diff(ways, axis=0).min() >= -1e-9


def rest_s(limits: MoveLimits, speed: float, acceleration: float) -> float:
    """The shortest time to rest from a speed that still rises."""
    most = speed + 0.5 * acceleration**2 / limits.jerk
    return acceleration / limits.jerk + limits.ramp_s(most)


@pytest.mark.parametrize("name", OPTIMUM_DEG)
def test_a_released_jog_is_soon_at_rest(name: str) -> None:
    """From any moment of the ramp, of slow and long jogs too, whose ramps are a small part of them."""
    arm = Arm.load(name)
    driven = arm.driven[OPTIMUM_DEG[name][0]].limits
    for percent in (1, 10, 100):
        limits = move_law.of_joints([driven], [1.0], percent / 100)
        law = move_law.law(400.0, limits)
        spline = JointSpline(move_law.DEGREE, 1, law.distance, law.time_s)
        brakes = brake_time.of_motion(Trajectory(name, (spline,), True), [driven])
        times_s = np.append(limits.ramp_s(limits.speed) * np.linspace(0.1, 0.9, 9), 0.4 * spline.duration_s)
        for time_s in times_s:
            shortest_s = rest_s(limits, float(spline(time_s, 1)), float(spline(time_s, 2)))
            assert brakes.rest_s(time_s) <= 1.15 * shortest_s, (percent, time_s)


@pytest.mark.parametrize("speed", [0.01, 0.05, 0.25])
def test_the_board_reads_what_was_planned(speed: float) -> None:
    """From any moment, both kinds of changes, with entries that are close at the ends."""
    motion = jog_motion.plan("x", AR4, on_steps(AR4, ELBOW_DEG), JogMove(INF, joint=0), speed)
    brakes = motion.brakes
    record = Motion(encode.motion_record(motion.trajectory, AR4, brakes))
    assert record.edge_bits == brakes.edge_bits > 1
    duration_s = motion.trajectory.duration_s
    seed = 5
    print("seed", seed)
    times = np.random.default_rng(seed).uniform(0.0, 1.0, 200)
    times = duration_s * np.concatenate(
        [times, times * 2.0**-brakes.edge_bits, 1.0 - times * 2.0**-brakes.edge_bits]
    )
    unit_s = 2**brakes.unit_bits / TICK_HZ
    for to_rest, lengths in ((True, brakes.rest_s(times)), (False, brakes.change_s(times))):
        for time_s, length_s in zip(times, lengths, strict=True):
            at, end = int(time_s * TICK_HZ) >> 10, int(duration_s * TICK_HZ) >> 10
            found_s = unit_s * (record.ramp(at, end + 1, to_rest) % 2048)
            assert -1e-9 <= found_s - length_s <= 1.01 * unit_s + 0.02 * length_s


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped.files())
def test_the_first_step_comes_within_50_ms(name: str) -> None:
    """As a move begins ahead by nearly half a step, which no motor exceeds: jogs of joints, of the tool, and a goto."""
    arm = Arm.load(name)
    here = np.array(on_steps(arm, ELBOW_DEG if name == "ar4" else list(arm.home_deg)))
    stands = np.rint(arm.transmission.steps(here))
    moves = [JogMove(by, joint=joint) for joint in range(len(arm.driven)) for by in (3.0, -INF)]
    if name == "ar4":
        moves += [JogMove(by, axis=axis) for by in (0.3, -INF) for axis in ("x", "tool-y")]
    found = []
    for move in moves:
        with suppress(InputError):  # at the end of its range
            found.append(jog_motion.plan("x", arm, here.tolist(), move).trajectory)
    low, high = np.array([joint.range_deg for joint in arm.driven]).T
    found.append(goto.motion(arm, here, np.clip(here + 5.0, low, high), goto.MovePace(0.25)))
    assert len(found) > len(arm.driven)
    for trajectory in found:
        begin, soon = arm.transmission.steps(trajectory(np.array([0.0, 0.05]))) - stands
        assert np.abs(begin).max() == pytest.approx(point_to_point.AHEAD_STEPS, abs=0.005)
        assert np.any(np.rint(soon) != 0.0)


@pytest.mark.slow
@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another allocator")
def test_plans_take_no_new_memory_each_time() -> None:
    """Memory that is given back is zeroed page by page when it is needed again; in a process with a heap of its own."""
    program = """
import math, resource
import numpy as np
from armtempo.model.arm import Arm
from armtempo.planning.jog import jog_motion
faults = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_minflt
arm, move = Arm.load("ar4"), jog_motion.JogMove(math.inf, joint=0)
for times in (3, 10):
    before = faults()
    for _ in range(times):
        jog_motion.plan("jog", arm, arm.home_deg, move)
print((faults() - before) / times)
for times in (1, 5):  # as large as those of a plan
    before = faults()
    for _ in range(times):
        np.ones(20 << 17)
print((faults() - before) / times)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert max(map(float, done.stdout.split())) < 150, done.stdout


def test_a_way_of_a_step_begins_where_the_arm_stands() -> None:
    here = np.array(on_steps(PAPER, [0.0, -60.0, 40.0]))
    for way in (1e-6, 1.0 / PAPER.driven[0].steps_per_deg):
        motion = jog_motion.plan("x", PAPER, here.tolist(), JogMove(way, joint=0))
        np.testing.assert_allclose(motion.trajectory(0.0), here, atol=1e-9)
    off = here + 0.4 / np.array([joint.steps_per_deg for joint in PAPER.driven])
    assert point_to_point.ahead(off, off + 5.0, PAPER) == 0.0


@pytest.mark.slow
def test_a_joint_goes_to_the_end_of_its_range_and_not_beyond_and_stops_soon() -> None:
    """Braking from a constant speed takes what EXCESS of the limits allows, as the rise of a jog uses half of them."""
    for arm, numbers in ((PAPER, (0, 2)), (AR4, (1,))):
        here = on_steps(arm, list(arm.home_deg))
        for number in numbers:
            joint = arm.driven[number]
            for sign in (1, -1):
                motion = jog_motion.plan("x", arm, here, JogMove(sign * INF, joint=number))
                assert "end of its range" in motion.ends
                check_limits(motion, arm, jog_motion.SPEED)
                edge = joint.range_deg[sign > 0]
                assert 0 <= sign * (edge - motion.end_deg[number]) < 1 / joint.steps_per_deg
                others = np.delete(motion.end_deg - here, number)
                np.testing.assert_allclose(others, 0.0, atol=1e-9)
                speed, most = jog_motion.SPEED * joint.limits.speed_deg_s, joint.limits
                from_speed_s = max(
                    1.5 * speed / most.acceleration_deg_s2,
                    (10 / 3**0.5 * speed / 1.25 / most.jerk_deg_s3) ** 0.5,
                )
                assert motion.brakes.longest_rest_s < 2.0 * from_speed_s


def test_at_the_end_of_the_range_only_the_way_back_is_open() -> None:
    here = on_steps(PAPER, [0.0, -60.0, 40.0])
    end = jog_motion.plan("x", PAPER, here, JogMove(INF, joint=1)).end_deg
    with pytest.raises(InputError, match="joint 2 is at the end of its range") as refused:
        jog_motion.plan("x", PAPER, end, JogMove(1.0, joint=1))
    assert jog_motion.problem(PAPER, end.tolist(), JogMove(INF, joint=1)) == str(refused.value)
    assert not jog_motion.problem(PAPER, end.tolist(), JogMove(-INF, joint=1))
    back = jog_motion.plan("x", PAPER, end, JogMove(-1.0, joint=1))
    assert back.end_deg[1] == pytest.approx(end[1] - 1.0)


def test_a_jog_to_the_end_of_the_range_does_not_end_early() -> None:
    """Also to a hundredth of a step beyond it, which is the end."""
    for to_deg, ends in ((190.0, ""), (190.0001, ""), (-10.0001, ""), (190.001, "joint 1 is at the end of")):
        motion = jog_motion.plan("x", PAPER, [0.0, -60.0, 40.0], JogMove(to_deg, joint=0))
        assert motion.ends[:24] == ends


def test_no_move_by_hand_goes_on_to_a_switch_within_the_range() -> None:
    switches = LimitSwitches(low=1, low_deg=-1.0, high="PD0", high_deg=5.0)
    arm = replace(PAPER, joints=(replace(PAPER.joints[0], switches=switches), *PAPER.joints[1:]))
    here = on_steps(arm, [0.0, -60.0, 40.0])
    jog = jog_motion.plan("x", arm, here, JogMove(-30.0, joint=0))
    assert -1.0 <= jog.end_deg[0] < -1.0 + 1.0 / arm.driven[0].steps_per_deg
    assert jog.ends == "joint 1 is at its low switch, -1 degrees"
    with pytest.raises(InputError, match="joint 1 is at its low switch"):
        jog_motion.plan("x", arm, jog.end_deg, JogMove(-1.0, joint=0))
    along = jog_motion.plan("x", arm, here, JogMove(-INF, axis="y"))
    assert along.ends == "joint 1 is at its low switch"
    assert along.end_deg[0] >= -1.0
    for start, end in ((0.0, -8.0), (-2.0, -3.0)):
        with pytest.raises(PlanError, match=f"joint 1 would go to {end:g} degrees, beyond its low switch"):
            goto.motion(arm, np.array([start, -60, 40]), np.array([end, -60, 40]), goto.MovePace())
    for start, end in ((0.0, 30.0), (-3.0, -2.0)):  # the other switch is read while homing only
        goto.motion(arm, np.array([start, -60, 40]), np.array([end, -60, 40]), goto.MovePace())


@pytest.mark.slow
@pytest.mark.parametrize(("by", "speed"), [(0.1, 1.0), (-1.0, 0.25), (10.0, 0.01), (10.0, 1.0)])
def test_a_step_goes_as_far_as_it_says(by: float, speed: float) -> None:
    here = on_steps(AR4, ELBOW_DEG)
    motion = jog_motion.plan("x", AR4, here, JogMove(by, joint=4), speed)
    assert motion.end_deg[4] - here[4] == pytest.approx(by)
    assert not motion.ends
    check_limits(motion, AR4, speed)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.01, 0.25, 1.0])
def test_the_boards_memory_holds_a_held_jog(speed: float) -> None:
    for move in (
        JogMove(INF, joint=0),
        JogMove(-INF, joint=3),
        JogMove(INF, axis="x"),
        JogMove(-INF, axis="y"),
    ):
        motion = jog_motion.plan("x", AR4, on_steps(AR4, ELBOW_DEG), move, speed)
        assert len(encode.motion_record(motion.trajectory, AR4, motion.brakes)) <= ONCE_BYTES


@pytest.mark.parametrize(
    ("move", "speed", "said"),
    [
        (JogMove(0.0, joint=0), 0.25, "by 0 moves nothing"),
        (JogMove(math.nan, joint=0), 0.25, "by 0 moves nothing"),
        (JogMove(1.0), 0.25, "a joint or the tool"),
        (JogMove(1.0, joint=0, axis="x"), 0.25, "a joint or the tool"),
        (JogMove(1.0, axis="w"), 0.25, "no axis 'w'"),
        (JogMove(1.0, joint=0), 0.0, "a speed of 0"),
        (JogMove(1.0, joint=0), 1.5, "a speed of 1.5"),
    ],
)
def test_what_is_no_jog_is_refused(move: JogMove, speed: float, said: str) -> None:
    with pytest.raises(InputError, match=said):
        jog_motion.plan("x", PAPER, [0.0, -60.0, 40.0], move, speed)


def test_joints_have_numbers_and_names() -> None:
    named = replace(PAPER, joints=tuple(replace(j, name=f"j{n}") for n, j in enumerate(PAPER.joints, 1)))
    assert (
        jog_motion.number_of_joint(named, "j2")
        == jog_motion.number_of_joint(named, 2)
        == jog_motion.number_of_joint(named, "2")
        == 1
    )
    for wrong in (0, 4, "j9", "-1", -1):
        with pytest.raises(InputError, match="drives no joint"):
            jog_motion.number_of_joint(named, wrong)
