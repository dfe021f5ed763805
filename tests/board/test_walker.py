"""The evaluator against an independent computation of the same spline; a subinterval's steps, solved."""

from __future__ import annotations

import ast
import importlib
import random
from array import array
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from armtempo_shared.motion import Motion
from numpy.polynomial import Polynomial

from tests import inprocess, interpreters, ramps
from tests.board import motions, oracle

BOARD = interpreters.ROOT / "board" / "armtempo_board"
MOTION_PATH = [
    *sorted((BOARD / "stepgen").glob("*.py")),
    *sorted((BOARD / "motion").glob("*.py")),
    *sorted((BOARD / "hardware").glob("*.py")),
]
QUICK = next(name for name in ("micropython", "cpython") if name in interpreters.AVAILABLE)
"""The interpreter for the long cases; that all give the same is shown on shorter ones."""
CRUISE_S = 2.0
BRAKES = [(2.0, 0.6), (3.1, 0.1), (0.2, 0.5), (1.0, 2.5), (5.5, 0.4)]
SEED = 20261123
CASES = 60
BITS = 25
"""Of the differences: their sum stays below 2**28."""
TIME_UNITS = 4.0
SLOPE_PART = 2.0**-22


@pytest.mark.long
@pytest.mark.parametrize("name", motions.NAMED)
def test_steps_are_where_the_spline_says(name: str, tmp_path: Path) -> None:
    record = motions.NAMED[name]()
    verdicts, steps = oracle.walk(QUICK, tmp_path, [record])
    assert verdicts == ["None"]
    assert oracle.verify(record, steps[0]) <= 0.77  # half a tick is the rounding


@pytest.mark.parametrize("sign", [-1, 1])
def test_a_turn_that_just_reaches_a_half_step(sign: int, tmp_path: Path) -> None:
    """The two steps of a turn that comes too little beyond it are left out; here it lies between two segments."""
    beyond = (-1e-4, -1e-6, 1e-6, 3e-5, 1e-4, 2e-4, 1e-3, 0.1)
    vias = [sign * np.array([0.0, 20.5 + much, 0.0]) for much in beyond]
    records = [motions.record([via], [np.full(2, 0.1)], 5) for via in vias]
    verdicts, steps = oracle.walk(QUICK, tmp_path, records)
    assert verdicts == ["None"] * len(records)
    for record, found in zip(records, steps, strict=True):
        oracle.verify(record, found)


def chance_records(count: int) -> list[bytes]:
    rng = np.random.default_rng(20_240_607)
    return [motions.chance(rng) for _ in range(count)]


@pytest.mark.long
@pytest.mark.slow
def test_random_motions(tmp_path: Path) -> None:
    records = [record for record in chance_records(30) if oracle.peak_rate(record) < 330_000]
    verdicts, steps = oracle.walk(QUICK, tmp_path, records)
    accepted = [number for number, verdict in enumerate(verdicts) if verdict == "None"]
    assert len(accepted) >= 20
    for number in accepted:
        try:
            oracle.verify(records[number], steps[number])
        except AssertionError as error:
            raise AssertionError(f"motion {number} of seed 20240607") from error


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[bytes], list[bytes]]:
    """Some records and their steps on one interpreter."""
    records = [
        motions.NAMED["feeding"](),
        motions.NAMED["cubic refined"](),
        motions.NAMED["20 ms"](),
        *chance_records(8),
    ]
    return records, oracle.walk(QUICK, tmp_path_factory.mktemp("shared"), records, space=2)[1]


@pytest.mark.long
@pytest.mark.slow
def test_all_interpreters_give_the_same_edges(
    interpreter: str, shared: tuple[list[bytes], list[bytes]], tmp_path: Path
) -> None:
    records, expected = shared
    assert oracle.walk(interpreter, tmp_path, records, space=2)[1] == expected


@pytest.mark.slow
def test_edges_do_not_depend_on_how_the_ring_is_filled(
    shared: tuple[list[bytes], list[bytes]], tmp_path: Path
) -> None:
    records, expected = shared
    for space in (14, 512, 1016):
        steps = oracle.walk(QUICK, tmp_path, records, space=space)[1]
        for mine, other in zip(steps, expected, strict=True):
            edges, others = (np.frombuffer(data, dtype="<i4").reshape(-1, 5) for data in (mine, other))
            np.testing.assert_array_equal(edges[:, [0, 1, 3, 4]], others[:, [0, 1, 3, 4]])


def _brake(start_s: float, length_s: float) -> tuple[int, int]:
    """In ticks; the length whole in a record's unit for it and on the grid of ramps, 64000 ticks: as it is run."""
    whole = 125 << max(14, (int(length_s * oracle.TICK_HZ) // 1900).bit_length())
    return round(start_s * oracle.TICK_HZ), round(length_s * oracle.TICK_HZ / whole) * whole


@pytest.mark.long
@pytest.mark.parametrize(("start_s", "length_s"), BRAKES)
def test_braking_stays_on_the_path(interpreter: str, start_s: float, length_s: float, tmp_path: Path) -> None:
    start, length = _brake(start_s, length_s)
    record = motions.feeding()
    steps = oracle.walk(interpreter, tmp_path, [record], brake=(start, length))[1][0]
    for joint in range(3):
        _verify_braked(Motion(record), joint, oracle.steps_of(steps, joint), start, length)


@pytest.mark.slow
@pytest.mark.parametrize(("start_s", "length_s"), BRAKES)
def test_nothing_is_written_beyond_the_time_at_which_braking_begins(
    start_s: float, length_s: float, tmp_path: Path
) -> None:
    """However much space there is, the edges are those that are written one by one.

    A step in the Ki tick in which braking begins is one of a cubic, or solved by itself: within a cubic's error.
    """
    brake = _brake(start_s, length_s)
    records = [motions.feeding()] + [motions.cruise(90_000)] * (start_s < CRUISE_S)
    one_by_one, *others = (
        oracle.walk(QUICK, tmp_path, records, space=space, brake=brake)[1] for space in (2, 14, 1016)
    )
    for steps in others:
        for mine, other in zip(steps, one_by_one, strict=True):
            edges, wanted = (np.frombuffer(data, dtype="<i4").reshape(-1, 5) for data in (mine, other))
            np.testing.assert_array_equal(edges[:, :2], wanted[:, :2])
            off = np.abs(edges[:, 3:] - wanted[:, 3:])
            begins = wanted[:, 3] >> 10 == brake[0] >> 10
            assert off[begins].max(initial=0) <= 4
            assert not off[~begins].any()


@pytest.mark.long
@pytest.mark.slow
def test_braking_from_full_speed(tmp_path: Path) -> None:
    start, length = _brake(0.9, 0.8)
    record = motions.cruise(333_000)
    steps = oracle.walk(QUICK, tmp_path, [record], brake=(start, length))[1][0]
    _verify_braked(Motion(record), 0, oracle.steps_of(steps, 0), start, length)


def _verify_braked(motion: Motion, joint: int, steps: oracle.Steps, start: int, length: int) -> None:
    exact = oracle.without_grazes(oracle.crossings(motion, joint), oracle.GAP_TICKS)
    count = int(np.sum(exact.ticks < oracle.braked(np.array([start + length]), start, length)))
    assert abs(len(steps.ticks) - count) <= 1
    count = min(count, len(steps.ticks))
    np.testing.assert_array_equal(steps.direction[:count], exact.direction[:count])
    path = oracle.braked(steps.ticks[:count].astype(float), start, length)
    error = np.abs(path - exact.ticks[:count])
    # Nodes: of the length, 13.1 / 2**30 at the worst of eleven lengths from 0.5 to 2.9 s; the 1.5 hold half a tick for
    # an edge between them, which in real time may be 1/1024 of its interval off, half a tick at least, 32 at most
    x = np.clip((steps.ticks[:count] - start) / length, 0.0, 1.0)
    rate = ramps.rate(x, 1.0, 0.0, oracle.BRAKE_SHAPE)
    interval = oracle.TICK_HZ / (exact.speed[:count] * rate)
    between = np.clip(interval / 1024, 0.5, 32.0)
    assert np.all(error <= 1.5 + 14 * length / 2**30 + rate * (between - 0.5))
    assert np.max(error * exact.speed[:count], initial=0.0) / oracle.TICK_HZ <= 0.02


def test_no_float_can_occur() -> None:
    """The chip has single floats only, so the motion path has none: no constant, no true division, no call."""
    for module in MOTION_PATH:
        tree = ast.parse(module.read_text())
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant):
                assert not isinstance(node.value, float | complex), module
            if isinstance(node, ast.BinOp | ast.AugAssign):
                assert not isinstance(node.op, ast.Div), module
            if isinstance(node, ast.Name):
                assert node.id not in ("float", "round", "math", "divmod", "pow"), module


@pytest.fixture(scope="module")
def newton() -> Iterator[ModuleType]:
    with inprocess.board_modules():
        yield importlib.import_module("armtempo_board.stepgen.newton")


def differences() -> list[int]:
    """Of neighbouring Bezier points: within a factor of two of each other."""
    least = random.randrange(1 << BITS - 2, 1 << BITS - 1)
    return [random.randrange(least, 2 * least) for _ in range(5)]


def polynomial(steps: list[int]) -> Polynomial:
    """The quintic over [0, 1] from 0 whose Bezier points differ by these."""
    b = [0, *np.cumsum(steps)]
    powers = [
        b[0],
        5 * (b[1] - b[0]),
        10 * (b[2] - 2 * b[1] + b[0]),
        10 * (b[3] - 3 * b[2] + 3 * b[1] - b[0]),
        5 * (b[4] - 4 * b[3] + 6 * b[2] - 4 * b[1] + b[0]),
        b[5] - 5 * b[4] + 10 * b[3] - 10 * b[2] + 5 * b[1] - b[0],
    ]
    return Polynomial([float(power) for power in powers])


def place_of(angle: Polynomial, target: float) -> float:
    """Where it is reached: the polynomial rises."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if angle(middle) < target else (low, middle)
    return low


def measures(newton: ModuleType, scale: int, steps: list[int], sign: int = 1) -> array[int]:
    return array("i", [scale, *(sign * step + newton._BIAS for step in steps), *[0] * 6])


@pytest.mark.parametrize("sign", [1, -1])
def test_times_and_slopes_are_those_of_the_polynomials(newton: ModuleType, sign: int) -> None:
    """Of rising and falling subintervals: single steps, and two at a time as the queue asks for them."""
    random.seed(SEED)
    for number in range(CASES):
        angle_scale, time_scale = random.randrange(12, 24), random.randrange(12, 24)
        angle_steps, time_steps = differences(), differences()
        angle, time = polynomial(angle_steps), polynomial(time_steps)
        solver = array("i", bytes(4 * newton.SOLVER_SIZE))
        solver[newton.TARGET] = (1 << 28) + sign  # half a step from the first point's whole one, which is
        low = random.randrange(1 << 27)  # so much of a step after it
        solver[newton.TIME_OFFSET] = offset = random.randrange(1 << 20)
        newton.set_interval(
            solver,
            array("i", [*[0] * newton._LOW, low, *[0] * 5]),
            measures(newton, angle_scale, angle_steps, sign),
            measures(newton, time_scale, time_steps),
        )
        assert solver[newton.RANGE] == angle(1.0)
        last = (solver[newton.RANGE] >> angle_scale) - 1
        length = max(last // 8, 1)
        newton.solve(solver, 0, 0)
        newton.solve(solver, 0, length)
        for index, node in (
            (0, newton.FIRST_NODE),
            (length, newton.MIDDLE_NODE),
            (2 * length, newton.END_NODE),
        ):
            case = f"seed {SEED}, case {number}, step {index}"
            w = place_of(angle, (index + 0.5 - sign * low / 2**28) * 2**angle_scale)
            late = solver[node + newton.NODE_TIME] - offset - time(w)
            assert abs(late) <= TIME_UNITS, f"{case}: {late} units late"
            slope = solver[node + newton.NODE_MANTISSA] / 2.0 ** solver[node + newton.NODE_EXPONENT]
            exact = time.deriv()(w) / angle.deriv()(w) * 2.0 ** (12 - time_scale + angle_scale)
            assert abs(slope / exact - 1) <= SLOPE_PART, f"{case}: slope {slope}, not {exact}"
