"""The board's own check of a motion: it passes what is fit to run, up to its limits, and nothing else."""

from __future__ import annotations

import importlib
import itertools
import math
import random
import struct
from array import array
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from armtempo_shared import codes, limits, motion
from armtempo_shared.limits import TICK_HZ

from tests import inprocess, interpreters
from tests.board import motions, oracle

PROBES = Path(__file__).parent / "scripts" / "probes"
SCRIPT = PROBES / "judge.py"
FAR = 10_000_000
Verdict = tuple[int, int, int] | None


def judge(
    interpreter: str, folder: Path, *records: bytes, low: int = -FAR, high: int = FAR, rate: int = 336_330
) -> list[Verdict]:
    paths = [folder / f"{number}.atm" for number in range(len(records))]
    for path, record in zip(paths, records, strict=True):
        path.write_bytes(record)
    words = [str(word) for word in (low, high, rate, oracle.GAP_TICKS, *paths)]
    return [eval(line) for line in interpreters.run(interpreter, SCRIPT, *words).splitlines()]


def straight(times_s: list[float], angles: list[float]) -> bytes:
    """A cubic from control points."""
    return motion.pack(
        3,
        [[round(angle * 2**limits.STEP_FRACTION_BITS) for angle in angles]],
        [[round(time * limits.TICK_HZ * 2**limits.TICK_FRACTION_BITS) for time in times_s]],
        1,
        motion.no_ramps(),
        0,
    )


def test_range(interpreter: str, tmp_path: Path) -> None:
    record = motions.feeding()  # joint 1 goes from 0 to 6400, joint 2 lower than its via points
    assert judge(interpreter, tmp_path, record) == [None]
    assert judge(interpreter, tmp_path, record, high=6400) == [None]
    assert judge(interpreter, tmp_path, record, high=6399) == [(codes.OUT_OF_RANGE, 0, 6400)]
    lowest = -9808  # a little beyond the via point at -9777.8
    code, joint, position = judge(interpreter, tmp_path, record, low=lowest + 40)[0] or (0, 0, 0)
    assert (code, joint) == (codes.OUT_OF_RANGE, 1)
    assert lowest - 5 < position < lowest + 40


def extremes(record: bytes, joint: int) -> tuple[float, float]:
    """Lowest and highest position of a joint, in steps."""
    places = np.linspace(0.0, 1.0, 4001)
    found = [
        piece.first_steps + np.polynomial.polynomial.polyval(places, piece.angle)
        for piece in oracle.pieces(motion.Motion(record), joint)
    ]
    return float(np.min(found)), float(np.max(found))


@pytest.mark.parametrize(
    ("sign", "bend"),
    [(-1, (10.0, 10.0, -40.0, 90.0, 70.0, 10.0)), (1, (10.0, 15.0, -60.0, 95.0, 80.0, 10.0))],
)
def test_range_where_the_extremes_lie_between_the_knots(
    interpreter: str, sign: int, bend: tuple[float, ...], tmp_path: Path
) -> None:
    """One step beyond each extreme is enough, one within it is too little."""
    record = straight([-0.1, 0.0, 0.1, 0.2, 0.3, 0.4], [sign * 37.0 * angle for angle in bend])
    lowest, highest = extremes(record, 0)
    ends = [position for at in (0.0, 1.0) for position in ends_of_pieces(record, at)]
    assert lowest < min(ends) - 3, "no extreme between the knots"
    assert highest > max(ends) + 3, "no extreme between the knots"
    low, high = int(np.floor(lowest)) - 1, int(np.ceil(highest)) + 1
    assert judge(interpreter, tmp_path, record, low=low, high=high) == [None]
    for bounds, extreme in (({"low": low + 3}, lowest), ({"high": high - 3}, highest)):
        verdict = judge(interpreter, tmp_path, record, **bounds)[0]
        assert verdict is not None, bounds
        assert verdict[:2] == (codes.OUT_OF_RANGE, 0)
        assert abs(verdict[2] - extreme) <= 2


def ends_of_pieces(record: bytes, at: float) -> list[float]:
    """Positions of joint 1 at the beginnings (0) or ends (1) of all time segments."""
    return [
        float(piece.first_steps + np.polynomial.polynomial.polyval(at, piece.angle))
        for piece in oracle.pieces(motion.Motion(record), 0)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("place", "step"), [(12.0, 12), (12.49, 12), (12.5, 13), (-12.5, -12), (-12.51, -13)]
)
def test_a_joint_that_stands_is_judged_by_its_place(
    interpreter: str, place: float, step: int, tmp_path: Path
) -> None:
    """As the ends of one that moves."""
    times = [-0.1, 0.0, 0.1, 0.2, 0.3, 0.4]
    stands, moves = straight(times, [place] * 6), straight(times, [place] * 5 + [place + 3.0])
    for record in (stands, moves):
        found = judge(interpreter, tmp_path, record, low=step, high=FAR)
        assert found == [None]
        assert judge(interpreter, tmp_path, record, low=step + 1) == [(codes.OUT_OF_RANGE, 0, step)]
        assert judge(interpreter, tmp_path, record, high=step - 1) == [(codes.OUT_OF_RANGE, 0, step)]
    back = straight([-0.1, 0.0, 0.1, 0.1, 0.3, 0.4], [place] * 6)
    assert judge(interpreter, tmp_path, back)[0] == (codes.TIME_ORDER, 0, 3)


def test_joints_that_stand_cost_no_subintervals() -> None:
    """A jog of one of six joints is checked as quickly as if the arm had one."""
    way = [round(angle * 2**limits.STEP_FRACTION_BITS) for angle in (0.0, 0.0, 0.0, 30.0, 40.0, 40.0)]
    times = [round(0.1 * at * TICK_HZ * 2**limits.TICK_FRACTION_BITS) for at in range(-1, 5)]
    record = motion.pack(3, [[0] * 6, way, *[[5] * 6] * 4], [times], 1, motion.no_ramps(), 0)
    loaded = []
    with inprocess.board_modules():
        check = importlib.import_module("armtempo_board.motion.motion_check").check
        control_points = importlib.import_module("armtempo_board.stepgen.control_points")
        interval = SimpleNamespace(
            load=lambda data, joint: loaded.append(joint),
            measure=lambda: 0,
            close=lambda: None,
            points=control_points.ControlPoints(memoryview(array("i", [0] * control_points.WINDOW_WORDS))),
        )
        row = {"min_steps": -FAR, "max_steps": FAR, "max_rate": 1000}
        check(motion.Motion(record), [row] * 6, 1000, interval)
    assert loaded == [1]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["feeding", "cubic", "refined"])
def test_rate(interpreter: str, name: str, tmp_path: Path) -> None:
    record = motions.feeding(degree=3 if name == "cubic" else 5, refine=8 if name == "refined" else 1)
    peak = oracle.peak_rate(record)
    assert judge(interpreter, tmp_path, record, rate=int(peak * 1.0005) + 1) == [None]
    verdict = judge(interpreter, tmp_path, record, rate=int(peak * 0.9995))[0]
    assert verdict is not None
    assert verdict[0] == codes.TOO_FAST
    assert 0.999 * peak <= verdict[2] <= 1.01 * peak


def test_the_boards_own_highest_rate(interpreter: str, tmp_path: Path) -> None:
    most = limits.MAX_STEP_RATE
    fit, fast = motions.cruise(most * 997 // 1000), motions.cruise(most * 1021 // 1000)
    verdicts = judge(interpreter, tmp_path, fit, fast, rate=1_000_000)
    assert verdicts[0] is None
    assert verdicts[1] is not None
    assert verdicts[1][0] == codes.TOO_FAST


def test_sum_of_rates(interpreter: str, tmp_path: Path) -> None:
    each = limits.MAX_STEP_RATE_SUM // 6
    fit, fast = motions.cruise(each * 99 // 100, joints=6), motions.cruise(each * 105 // 100, joints=6)
    verdicts = judge(interpreter, tmp_path, fit, fast)
    assert verdicts[0] is None
    assert verdicts[1] is not None
    assert verdicts[1][:2] == (codes.TOO_FAST, 255)


def test_order_of_times(interpreter: str, tmp_path: Path) -> None:
    angles = [0.0, 0.0, 1.0, 2.0, 2.0]
    fit = straight([-0.1, 0.0, 0.1, 0.2, 0.3], angles)
    same = straight([-0.1, 0.0, 0.1, 0.1, 0.3], angles)
    back = straight([-0.1, 0.0, 0.1, 0.2, 0.15], angles)
    assert judge(interpreter, tmp_path, fit, same, back) == [
        None,
        (codes.TIME_ORDER, 0, 3),
        (codes.TIME_ORDER, 0, 4),
    ]


def test_longer_than_the_board_can_hold(interpreter: str, tmp_path: Path) -> None:
    angles = [0.0, 0.0, 1.0, 2.0, 2.0]
    slow = straight([-300.0, 0.0, 300.0, 600.0, 900.0], angles)
    far = straight([-0.1, 0.0, 0.1, 0.2, 0.3], [0.0, 0.0, 2e7, 4e7, 4e7])
    for verdict in judge(interpreter, tmp_path, slow, far):
        assert verdict is not None
        assert verdict[0] == codes.TOO_LONG


def test_reversal_that_the_driver_cannot_follow(interpreter: str, tmp_path: Path) -> None:
    def there_and_back(seconds: float) -> bytes:
        return motions.record([np.array([0.0, 200.5, 0.0])], [np.full(2, seconds)], 5)

    fit, abrupt = there_and_back(0.045), there_and_back(0.009)
    verdicts = judge(interpreter, tmp_path, fit, abrupt)
    assert verdicts[0] is None
    assert verdicts[1] is not None
    assert verdicts[1][0] == codes.TOO_ABRUPT
    assert verdicts[1][2] > 0.16 * (limits.TICK_HZ / oracle.GAP_TICKS) ** 2


@pytest.mark.slow
def test_numbers_beyond_the_evaluator(interpreter: str, tmp_path: Path) -> None:
    """The bounds are those by which the host refuses a plan."""
    span_s, most_s = (ticks / limits.TICK_HZ for ticks in (limits.LONGEST_SPAN_TICKS, limits.LONGEST_TICKS))
    span_steps, segments = float(limits.MOST_SPAN_STEPS), 100
    spread = [most_s * part / (segments + 2) for part in range(segments + 3)]
    flat = [0.0] * (segments + 3)
    verdicts = judge(
        interpreter,
        tmp_path,
        straight([0.0, span_s / 3, 2 * span_s / 3, span_s], [0.0] * 4),
        straight([0.0, span_s / 3, 2 * span_s / 3, span_s - 1e-3], [0.0] * 4),
        straight(spread, flat),
        straight([*spread[:-1], most_s - 1e-3], flat),
        straight([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 0.0, span_steps]),
        low=-(1 << 26),
        high=1 << 26,
    )
    assert [verdict[0] if verdict else 0 for verdict in verdicts] == [
        codes.TOO_LONG,
        0,
        codes.TOO_LONG,
        0,
        codes.TOO_LONG,
    ]


# step rates of subintervals against a limit: the arithmetic by itself, under CPython


SEED = 20261123
TICKS_SCALE = 12
LEAST_TICKS, MOST_TICKS = 1 << 20, 1 << 28
ROUNDED = 8
"""Steps, of the differences' own unit, that the comparison may be off."""


@pytest.fixture(scope="module")
def rate_check() -> ModuleType:
    with inprocess.board_modules():
        return importlib.import_module("armtempo_board.motion.rate_check")


def compared(rate_check: ModuleType, steps: list[int], ticks: list[int], rate: int) -> int:
    """Differences of five Bezier points each, at the scale at which a tick of time is one of theirs."""
    angle, time = (
        array("I", [scale, *(each + rate_check.DIFFERENCE_BIAS for each in row)])
        for scale, row in ((0, steps), (TICKS_SCALE, ticks))
    )
    return int(rate_check.compare(angle, time, rate_check.limits(0, 0, rate, 1)))


def test_a_rate_just_within_and_just_beyond_the_limit(rate_check: ModuleType) -> None:
    """All differences at the limit, either way; then one beyond it: at an end that is certain, within it is not."""
    random.seed(SEED)
    for _ in range(200):
        rate = random.randrange(TICK_HZ // 1000, TICK_HZ // 4)
        ticks = [random.randrange(LEAST_TICKS, MOST_TICKS) for _ in range(5)]
        steps = [random.choice((-1, 1)) * (each * rate // TICK_HZ) for each in ticks]
        assert compared(rate_check, steps, ticks, rate) == rate_check.SLOWER, (SEED, rate, ticks)
        place = random.randrange(5)
        steps[place] += ROUNDED if steps[place] > 0 else -ROUNDED
        beyond = rate_check.FASTER if place in (0, 4) else rate_check.UNDECIDED
        assert compared(rate_check, steps, ticks, rate) == beyond, (SEED, rate, ticks, place)


@pytest.mark.parametrize(
    ("name", "cases"),
    [
        pytest.param(name, 100, marks=pytest.mark.slow) if name == "micropython-arm" else (name, 1000)
        for name in interpreters.AVAILABLE[1:]
    ],
)
def test_what_is_compiled_finds_what_exact_numbers_find(name: str, cases: int) -> None:
    """Words of 64 bits, and of 32 as on the chip: nothing of random subintervals and points overflows."""
    words = [str(SEED), str(cases)]
    exact, found = (
        interpreters.run(each, PROBES / "compiled_check.py", *words) for each in ("cpython", name)
    )
    assert found == exact, SEED


def interval(rate_check: ModuleType, steps: list[int], ticks: list[int]) -> SimpleNamespace:
    """A subinterval whose differences of angle count 2**-10 steps each, those of time 2**-10 ticks."""
    measured = [
        [scale, *(each + rate_check.DIFFERENCE_BIAS for each in (*row, min(row), max(row)))]
        for scale, row in ((10, steps), (22, ticks))
    ]
    return SimpleNamespace(angle_measures=measured[0], time_measures=measured[1])


def test_the_rate_that_is_told(rate_check: ModuleType) -> None:
    """At its ends the greater of the two; else the largest difference of angle over the smallest of time."""
    ticks = [1 << 20] * 5
    for steps in ([1024, 2048, 5000, 2048, -3072], [3072, 2048, -5000, 2048, 1024]):
        found = interval(rate_check, steps, ticks)
        assert rate_check.at_ends(found) == 3072 * TICK_HZ >> 20
        assert rate_check.highest(found) == 5000 * TICK_HZ >> 20
    ticks[2] = 1 << 19
    assert rate_check.highest(interval(rate_check, steps, ticks)) == 5000 * TICK_HZ >> 19


def test_time_that_does_not_advance_has_no_rate(rate_check: ModuleType) -> None:
    ticks = [LEAST_TICKS, LEAST_TICKS, -1, LEAST_TICKS, LEAST_TICKS]
    assert compared(rate_check, [0] * 5, ticks, TICK_HZ // 4) == rate_check.UNDECIDED


def test_what_is_gentle_for_certain_is_so_exactly(rate_check: ModuleType) -> None:
    """Random steady times, angles and gaps: never taken for gentle if the exact bound says no; 3 % below it always."""
    random.seed(SEED)
    found = []
    with inprocess.board_modules():
        exact = importlib.import_module("armtempo_board.motion.motion_check")
    for _ in range(3000):
        least = 1 << random.randrange(2, 28)
        ticks = [random.randrange(least, 2 * least + 1) for _ in range(5)]
        most = 1 << random.randrange(1, 29)
        steps = [random.randrange(-most, most) for _ in range(5)]
        scales = random.randrange(13, 29), random.randrange(17, 29)
        angle, time = (
            array("I", [scale, *(each + (1 << 29) for each in (*row, min(row), max(row)))])
            for scale, row in zip(scales, (steps, ticks), strict=True)
        )
        numerator, denominator = exact._acceleration(angle, time)
        gap = (
            round(math.sqrt(16 * denominator / (100 * numerator)) * random.uniform(0.9, 1.1))
            if numerator
            else 1000
        )
        gap = min(max(gap, 1), 1 << 20)
        part = numerator * gap**2 * 100 / (denominator * 16)
        gentle = rate_check.is_gentle(angle, time, rate_check.limits(0, 0, 1000, gap))
        assert not gentle or part <= 1.0, (SEED, steps, ticks, gap)
        if least >= 1 << 10 and most >= 1 << 10 and gap >= 100:
            assert gentle or part > 0.97, (SEED, steps, ticks, gap, part)
            found.append(gentle)
    assert 300 < sum(found) < len(found) - 300


def test_what_is_certain_of_control_points_is_so() -> None:
    """Random numbers of 64 bits, close together and far apart: rising, equal, bounded; what is clear is said."""
    random.seed(SEED)
    with inprocess.board_modules():
        control_points = importlib.import_module("armtempo_board.stepgen.control_points")
    seen = set()
    for _ in range(3000):
        bound = 1 << random.choice((26, 27))
        centre = random.choice((-1, 1)) * (1 << random.randrange(20, 62))
        apart = 1 << random.randrange(0, 55)
        numbers = [min(max(centre + random.randrange(-apart, apart), -(2**63)), 2**63 - 1) for _ in range(6)]
        numbers = random.choice((numbers, sorted(numbers), [numbers[0]] * 6))
        words = array("i", struct.pack("<2i6q", 7, 7, *numbers))
        found = control_points.survey(words, 2, 6, bound)
        rising = all(one < other for one, other in itertools.pairwise(numbers))
        most, span = max(map(abs, numbers)), max(numbers) - min(numbers)
        if found & control_points.BOUNDED:
            assert most < bound << 28, (SEED, numbers)
            assert span < limits.MOST_SPAN_STEPS << 28, (SEED, numbers)
        elif most < bound - 2 << 28 and span < limits.MOST_SPAN_STEPS - 3 << 28:
            pytest.fail(f"{SEED}: {numbers} are bounded")
        assert bool(found & control_points.RISING) == rising or most >= 1 << 55
        assert not found & control_points.RISING or rising
        assert not found & control_points.EQUAL or len(set(numbers)) == 1
        assert found & control_points.EQUAL or len(set(numbers)) > 1 or most >= 1 << 55
        seen.add(found)
    assert len(seen) >= 5
