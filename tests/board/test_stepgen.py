"""The arithmetic of the step generators under CPython: lengths and kinds of cubics, Bezier points, the law of time."""

from __future__ import annotations

import importlib
import random
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import floor, frexp
from pathlib import Path
from types import ModuleType
from unittest.mock import patch

import pytest
from armtempo_shared.limits import TICK_HZ
from armtempo_shared.motion import EVEN_RAMP, RAMP_SHAPES, Motion

from tests import inprocess, interpreters, ramps, scripted
from tests.board import motions

SEED = 20261124
CASES = 300
TIME_SCALE = 8
EVEN_TICKS = 3 / 32
SQUARE_TICKS = 1 / 16
SHORTEST_SQUARE = 8
LONGEST = 16
MANTISSA_BITS = 29
ITEM_WORDS = 12
BASE_KITICKS = 10
NEVER_KITICKS = 1 << 28
LEAST_STEPS = {8_000: 30, 40_000: 120, 240_000: 500}
"""By steps/s: of two cubics, on the mean of the whole way."""


@dataclass(frozen=True)
class Modules:
    """What is tested, and the names of the words that it works on."""

    cubics: ModuleType
    newton: ModuleType
    queue: ModuleType


@pytest.fixture(scope="module")
def records() -> dict[int, bytes]:
    """Motions up to some rates and down again; made before the board's modules take the place of others."""
    return {rate: motions.cruise(rate, total_s=1.2) for rate in LEAST_STEPS}


@pytest.fixture(scope="module")
def board(records: dict[int, bytes]) -> Iterator[Modules]:
    with inprocess.board_modules():
        yield Modules(
            *(
                importlib.import_module(f"armtempo_board.stepgen.{name}")
                for name in ("cubics", "newton", "step_queue")
            )
        )


def put_node(board: Modules, solver: array[int], node: int, ticks: float, slope: float) -> None:
    """A node at a time, with that many ticks per step."""
    fraction, power = frexp(slope)
    solver[node + board.newton.NODE_TIME] = round(ticks * (1 << TIME_SCALE))
    solver[node + board.newton.NODE_MANTISSA] = round(fraction * (1 << MANTISSA_BITS))
    solver[node + board.newton.NODE_EXPONENT] = MANTISSA_BITS - power


def group_of(board: Modules, steps: int, slopes: tuple[float, float], ticks: float) -> tuple[int, bool]:
    """Steps in a group of the cubic that takes that many ticks, from one slope to the other; whether these change."""
    solver = array("i", bytes(4 * board.newton.SOLVER_SIZE))
    queue = array("i", bytes(4 * board.queue.QUEUE_SIZE))
    queue[board.queue.TIME_SCALE] = TIME_SCALE
    put_node(board, solver, board.newton.FIRST_NODE, 0.0, slopes[0])
    put_node(board, solver, board.newton.MIDDLE_NODE, ticks, slopes[1])
    put_node(board, solver, board.newton.END_NODE, ticks + steps * slopes[1], slopes[1])
    board.cubics.put_cubics(steps, solver, queue, 0)
    assert queue[board.queue.IN] == 2
    first_item = board.queue.QUEUE_SIZE - ITEM_WORDS * board.queue.CAPACITY
    kind = queue[first_item + board.queue.GROUP] - 1
    return 1 << kind % board.queue.SQUARE, kind >= board.queue.SQUARE


def derivatives(steps: int, slopes: tuple[float, float], ticks: float) -> tuple[float, float]:
    """Of time over steps: the second at the end where it is greatest, and the third."""
    bend = (slopes[1] - slopes[0]) * steps
    missing = ticks - slopes[0] * steps
    square, cubic = 3 * missing - bend, bend - 2 * missing
    return max(abs(2 * square), abs(2 * square + 6 * cubic)) / steps**2, abs(6 * cubic) / steps**3


def even_ticks(second: float, group: int) -> float:
    """The most that steps of one length leave the cubic within a group."""
    return second * group**2 / 8


def square_ticks(third: float, group: int) -> float:
    """As much of steps whose lengths change evenly: x (x - 1/2) (x - 1) / 6 is 0.00802 at most."""
    return third * group**3 * 0.00802


def unit_ticks(steps: int, slopes: tuple[float, float]) -> float:
    """The unit in which the cubic is computed."""
    return 2.0 ** (frexp(max(slopes))[1] + (steps - 1).bit_length() - MANTISSA_BITS)


def test_a_group_is_as_long_as_its_error_bound_allows(board: Modules) -> None:
    """Steps of one length within 3/32 tick, else of lengths that change evenly; twice as long would not do."""
    random.seed(SEED)
    found = set()
    for _ in range(CASES):
        steps = random.randrange(8, 400)
        first = random.uniform(400.0, 4000.0)
        slopes = (first, first + random.choice((-1, 1)) * first * 10 ** random.uniform(-5.0, -0.7))
        even = steps * (slopes[0] + slopes[1]) / 2
        ticks = even + random.uniform(-0.15, 0.15) * steps * (slopes[1] - slopes[0])
        group, is_square = group_of(board, steps, slopes, ticks)
        found.add((group, is_square))
        case = f"seed {SEED}: {steps} steps, slopes {slopes}, {ticks} ticks: {group}, {is_square}"
        second, third = derivatives(steps, slopes, ticks)
        unit = unit_ticks(steps, slopes)
        longer = 2 * max(group, 2)
        if is_square:
            assert group >= SHORTEST_SQUARE, case
            assert even_ticks(second + unit, SHORTEST_SQUARE) > 0.99 * EVEN_TICKS, case
            assert square_ticks(third, group) <= SQUARE_TICKS, case
            assert unit * group**2 / 16 <= SQUARE_TICKS, case
            if longer <= min(LONGEST, steps) and unit * longer**2 / 16 <= SQUARE_TICKS:
                # what is left over of the last group makes it at most twice as long as steps // group says
                assert square_ticks(third, longer) * 8 > SQUARE_TICKS, case
        else:
            assert group == 1 or even_ticks(second, group) <= 1.01 * EVEN_TICKS, case
            if longer <= min(LONGEST, steps):
                assert even_ticks(second + unit, longer) > 0.99 * EVEN_TICKS, case
    assert found >= {(1, False), (8, False), (16, False), (8, True), (16, True)}, found


@dataclass
class Tried:
    """How often cubics were tried, and the steps of those that kept the error bound, on the way through a motion."""

    fitted: int = 0
    rejected: int = 0
    steps: int = 0
    solved: int = 0
    """Calls of ``solve``, for one node or two."""


class Arrays:
    """In the place of ``armtempo_board.memory.Memory``."""

    def take_for_processor(self, words: int) -> array[int]:
        """So many words."""
        return array("i", bytes(4 * words))


def walk(board: Modules, record: bytes, brake: tuple[int, int] = (0, 0)) -> Tried:
    """Through a motion of one joint; ``brake``: where it begins and how long it takes, ticks."""
    generators, intervals = (
        importlib.import_module(f"armtempo_board.stepgen.{name}")
        for name in ("step_generator", "interval_steps")
    )
    tried = Tried()
    fit, put, solve = intervals.cubics_fit, intervals.put_cubics, intervals.solve

    def fitting(steps: int, *others: object) -> int:
        verdict: int = fit(steps, *others)
        tried.rejected += verdict <= 0
        return verdict

    def putting(steps: int, *others: object) -> None:
        tried.fitted += 1
        tried.steps += 2 * steps
        put(steps, *others)

    def solving(*others: object) -> None:
        tried.solved += 1
        solve(*others)

    with patch.multiple(intervals, cubics_fit=fitting, put_cubics=putting, solve=solving):
        generator = generators.StepGenerator(Arrays())
        generator.load(Motion(record), 0, 0, 168, 20_000)
        if brake[1]:
            generator.follow(braked(*brake), True)
        while not generator.ended:
            generator.prepare(NEVER_KITICKS)
            generator.queue[board.queue.STEPS] = 0
            generator.queue[board.queue.OUT] = generator.queue[board.queue.IN]
            assert not generator.at_reversal
    return tried


@pytest.mark.parametrize("rate", LEAST_STEPS)
def test_how_long_the_next_cubics_may_be_is_found_without_many_trials(
    board: Modules, records: dict[int, bytes], rate: int
) -> None:
    """Speeding up, where they may become longer, and slowing down, where they have to become shorter."""
    tried = walk(board, records[rate])
    assert 0.95 * rate * 0.7 < tried.steps < rate * 0.7, tried
    assert tried.rejected <= 0.12 * tried.fitted, tried
    assert tried.steps >= LEAST_STEPS[rate] * tried.fitted, tried


def braked(start: int, length: int) -> array[int]:
    """The law of a brake; the length is a multiple of 128 000 ticks."""
    time_law = importlib.import_module("armtempo_board.stepgen.time_law")
    law = array("i", bytes(4 * time_law.LAW_WORDS))
    time_law.set_length(law, length)
    time_law.set_ramp(law, EVEN_RAMP, 1000, 0)
    for place, motion_ticks, ticks in (("START", start, start), ("END", start + length // 2, start + length)):
        time_law.set_times(law, getattr(time_law, f"{place}_HIGH"), motion_ticks)
        time_law.set_times(law, getattr(time_law, f"REAL_{place}_HIGH"), ticks)
    return law


@pytest.mark.parametrize(
    ("rate", "ramp_s", "start_s", "least_steps", "most_solved"),
    [(80_000, 0.5, 0.6, 47_500, 240), (20_000, 0.6, 0.45, 5_000, 160)],
)
def test_a_brake_solves_few_nodes(
    board: Modules, rate: int, ramp_s: float, start_s: float, least_steps: int, most_solved: int
) -> None:
    """Half a second of braking, at full speed and while it speeds up, which solved so many that arms had underruns."""
    start = round(start_s * TICK_HZ / 1000) * 1000
    tried = walk(board, motions.cruise(rate, 1, ramp_s, 1.6), (start, 41_984_000))
    assert tried.steps > least_steps, tried
    assert tried.solved < most_solved, tried
    assert tried.rejected <= 0.12 * tried.fitted, tried


def test_steps_wait_20_ms_ahead_while_it_speeds_up_and_brakes(board: Modules) -> None:
    """At 20 000 steps/s, whose cubics are short: the loop of six joints is away from one for up to 20 ms."""
    generator = importlib.import_module("armtempo_board.stepgen.step_generator").StepGenerator(Arrays())
    generator.load(Motion(motions.cruise(20_000, 1, 0.6, 1.6)), 0, 0, 168, 20_000)
    words = board.queue
    ms = TICK_HZ / 1024 / 1000
    for now in range(0, 800, 2):
        drop_until(generator.queue, words, int(now * ms))
        if now == 450:
            generator.follow(braked(TICK_HZ // 2, 41_984_000), True)
        while generator.prepare(int((now + 50) * ms)):
            pass
        ahead = generator.queue[words.LATEST_KITICKS] / ms - now
        assert ahead > 20 or now < 200, (now, ahead)


def drop_until(queue: array[int], words: ModuleType, kiticks: int) -> None:
    """As if the steps until a time were written."""
    while queue[words.OUT] != queue[words.IN]:
        after = (queue[words.OUT] + 1) & 0xFFFF
        if after == queue[words.IN]:
            break
        item = words.QUEUE_SIZE - ITEM_WORDS * words.CAPACITY + ITEM_WORDS * (after % words.CAPACITY)
        if queue[item + BASE_KITICKS] > kiticks:
            break
        queue[words.OUT] = after


# bezier points of spline segments, to the unit, under CPython


BEZIER_SEED = 20261123
BEZIER_CASES = 40
STEP_BITS = 28


@pytest.fixture(scope="module")
def bezier() -> Iterator[ModuleType]:
    with inprocess.board_modules():
        yield importlib.import_module("armtempo_board.stepgen.bezier")


def bezier_points(control: list[int]) -> list[Fraction]:
    """Of the segment [0, 1] of a B-spline with whole knots: its polar form at (0, ..., 0, 1, ..., 1)."""
    degree = len(control) - 1
    found = []
    for ones in range(degree + 1):
        points = [Fraction(point) for point in control]
        for level, at in enumerate([0] * (degree - ones) + [1] * ones, 1):
            knots = range(level - degree, 1)
            points = [
                left + (right - left) * Fraction(at - knot, degree + 1 - level)
                for knot, (left, right) in zip(knots, pairwise(points), strict=True)
            ]
        found += points
    return found


def test_points_of_quintics_are_rounded_to_the_nearest_unit(bezier: ModuleType) -> None:
    random.seed(BEZIER_SEED)
    for _ in range(BEZIER_CASES):
        start = random.randrange(-(1 << 50), 1 << 50)
        control = [start + random.randrange(-(1 << 48), 1 << 48) for _ in range(6)]
        data = array("i", array("q", [0, *control]).tobytes())
        piece = array("i", bytes(4 * 30))
        bezier.from_control_points(data, 2, bezier.weights(5), piece)
        for number, exact in enumerate(bezier_points(control)):
            high, low = piece[bezier.HIGH + number], piece[bezier.LOW + number]
            found = ((high - bezier.BIAS) << STEP_BITS) + low
            assert found == floor(exact + Fraction(1, 2)), f"seed {BEZIER_SEED}: point {number} of {control}"


# parts of a motion: whichever halves are kept and used again, each is that of the segment


SCRIPT = Path(__file__).parent / "scripts" / "probes" / "halves.py"


@pytest.mark.slow
def test_parts_are_the_segments_halves_whatever_way_leads_to_them(interpreter: str, tmp_path: Path) -> None:
    records = [motions.feeding(degree=3, refine=3)]
    if interpreter != scripted.EMULATED:
        records.append(motions.feeding())
    paths = [tmp_path / f"{number}.atm" for number in range(len(records))]
    for path, record in zip(paths, records, strict=True):
        path.write_bytes(record)
    count, deepest = map(int, interpreters.run(interpreter, SCRIPT, *map(str, paths)).split())
    assert count > 1000
    assert deepest > 8


# the law of real time at a constant rate: times of steps against exact arithmetic, under CPython


TIME_SEED = 20261123
TIMES = 300
BIAS = 1 << 28
HIGH_TICKS = 1 << 12
"""What a high word of time counts."""
FRACTION = Fraction(1, 1 << 10)
"""Ticks of the motion to which the law works."""


@pytest.fixture(scope="module")
def modules() -> Iterator[tuple[ModuleType, ModuleType]]:
    with inprocess.board_modules():
        yield tuple(  # type: ignore[misc]
            importlib.import_module(f"armtempo_board.stepgen.{name}") for name in ("override", "time_law")
        )


def test_times_at_a_constant_rate(modules: tuple[ModuleType, ModuleType]) -> None:
    """Whatever part of a tick the times of a subinterval are told to."""
    overrides, time_law = modules
    random.seed(TIME_SEED)
    for number in range(TIMES):
        rate, scale = random.randrange(10, 1000), random.randrange(1, 22)
        high, time = random.randrange(1 << 20), random.randrange(1 << 28)
        override = overrides.Override()
        override.begin(rate, None, 1 << 38)
        words = array("i", bytes(4 * time_law.LAW_WORDS))
        law = overrides.JointLaw(words)
        real_high = law.take(override.law, BIAS + high) - BIAS
        node = array("i", bytes(32))
        node[time_law._NODE_TIME] = time
        assert time_law.to_real_time(words, node, 0, scale) == 1
        part = Fraction(node[time_law._NODE_TIME], 1 << scale)
        found = real_high * HIGH_TICKS + node[time_law._NODE_DELAY] + part
        exact = (high * HIGH_TICKS + Fraction(time, 1 << scale)) * 1000 / rate
        allowed = FRACTION * 1000 / rate + FRACTION + Fraction(1, 1 << scale)
        case = f"seed {TIME_SEED}, case {number}: rate {rate}, scale {scale}"
        assert abs(found - exact) <= allowed, f"{case}: {float(found - exact)} ticks late"
        assert 0 <= part < 1, case
        assert node[time_law._NODE_RATE] == pytest.approx(rate * 2**30 / 1000, abs=2), case


def test_ramps_of_every_shape(modules: tuple[ModuleType, ModuleType]) -> None:
    """Rate and motion's time at any place of a ramp to 10 / 2**30, and the place again from the motion's time."""
    _, time_law = modules
    random.seed(TIME_SEED)
    law = array("i", bytes(4 * time_law.LAW_WORDS))
    for shape in range(len(RAMP_SHAPES)):
        first, second = RAMP_SHAPES[shape] & 15, RAMP_SHAPES[shape] >> 4
        rise = ramps.rise(shape)
        way = rise.antiderivative()
        assert 1 <= first < second <= 15
        assert min(rise.derivative()([first / 16, second / 16])) >= 0
        for place in (*random.choices(range(1 << 30), k=12), 7, first << 26, second << 26, (1 << 30) - 1):
            before, after = random.choice(
                [(1000, 0), (0, 1000), (random.randrange(1001), random.randrange(1001))]
            )
            time_law.set_ramp(law, shape, before, after)
            least, change = min(before, after) / 1000, abs(after - before) / 1000
            rate = least + change * rise(place / 2**30)
            time_law._evaluate(law, place, -1)
            case = f"seed {TIME_SEED}: shape {first} {second}, {before} to {after}, {place}"
            assert abs(law[time_law._SLOPE] - rate * 2**30) <= 10, case
            assert abs(law[time_law._VALUE] - (least * place + change * way(place / 2**30) * 2**30)) <= 10, (
                case
            )
            if rate > 0.01:
                value = law[time_law._VALUE]
                near = min(max(place + random.randrange(-(1 << 26), 1 << 26), 0), (1 << 30) - 1)
                for begin in ((1 << 30) - 1, 0, near):
                    again = time_law._evaluate(law, begin, value)
                    assert abs(again - place) * rate <= 10, f"{case} from {begin}"


def test_shares_of_a_ramp(modules: tuple[ModuleType, ModuleType]) -> None:
    """Of any length; from 3.2 s on it is counted in more than one tick. There and back again."""
    _, time_law = modules
    random.seed(TIME_SEED)
    for number in range(TIMES):
        grid = time_law.RAMP_GRID_TICKS
        length = grid * random.randrange(1, (time_law.LONGEST_RAMP_TICKS >> random.randrange(10)) // grid)
        ticks, scale = random.randrange(length), random.randrange(22)
        fraction = random.randrange(1 << scale)
        law = array("i", bytes(4 * time_law.LAW_WORDS))
        time_law.set_length(law, length)
        share = time_law._share(law, ticks, fraction, scale)
        case = f"seed {TIME_SEED}, case {number}: {ticks} ticks of {length}"
        assert abs(share - Fraction(ticks * 2**scale + fraction, length * 2**scale) * 2**30) <= 4, case
        rest = time_law._ticks_of(law, share)
        found = law[time_law._VALUE] + Fraction(rest, 1 << 15)
        assert abs(found - Fraction(share * length, 2**30)) <= FRACTION, case
