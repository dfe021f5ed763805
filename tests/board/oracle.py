"""The steps of a motion record: computed independently of the board, and those of an interpreter compared with them."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import comb
from pathlib import Path

import numpy as np
from armtempo_shared import limits
from armtempo_shared.basis import BASIS, FACTORIAL
from armtempo_shared.motion import Motion
from numpy.typing import NDArray

from tests import interpreters, ramps

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Piece:
    """One time segment: power coefficients over v in [0, 1] of angle and time, from whole numbers on."""

    first_steps: int
    first_ticks: int
    angle: Array
    time: Array


@dataclass(frozen=True)
class Crossing:
    """Exact steps: times in ticks (from ``Piece.first_ticks`` of 0), directions, speed there in steps/s."""

    ticks: Array
    direction: Array
    speed: Array


def pieces(motion: Motion, joint: int) -> list[Piece]:
    """The joint's time segments as polynomials."""
    degree, refine = motion.degree, motion.refine
    angles = _control(motion, motion.angle_offset(joint), motion.segments, limits.STEP_FRACTION_BITS)
    times = _control(motion, motion.time_offset(joint), motion.segments * refine, limits.TICK_FRACTION_BITS)
    result = []
    for number in range(motion.segments * refine):
        segment, part = divmod(number, refine)
        angle = _shift(_power(angles[segment : segment + degree + 1], degree), part, refine)
        time = _power(times[number : number + degree + 1], degree)
        first_steps, first_ticks = int(angle[0]), int(time[0])
        angle[0] -= first_steps
        time[0] -= first_ticks
        as_float = [np.array([float(value) for value in row]) for row in (angle, time)]
        result.append(Piece(first_steps, first_ticks, *as_float))
    return result


def start_steps(motion: Motion, joint: int) -> int:
    """Where the joint stands before the motion: its first angle, rounded."""
    piece = pieces(motion, joint)[0]
    return piece.first_steps + int(np.floor(piece.angle[0] + 0.5))


def crossings(motion: Motion, joint: int) -> Crossing:
    """Every passage of the angle through a half step, in order."""
    parts = [_piece_crossings(piece) for piece in pieces(motion, joint)]
    return Crossing(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def turns(piece: Piece) -> Array:
    """Both ends of a piece, and where its angle turns."""
    return _breaks(np.polynomial.Polynomial(piece.angle).deriv())


def place_of(piece: Piece, ticks: NDArray[np.int64]) -> Array:
    """v of those of the times that lie within the piece."""
    time = np.polynomial.Polynomial(piece.time)
    wanted = (ticks - piece.first_ticks).astype(float)
    inside = wanted[(wanted >= time(0.0)) & (wanted <= time(1.0))]
    return _invert(time, time.deriv(), inside, 0.0, 1.0)


def without_grazes(exact: Crossing, gap_ticks: float) -> Crossing:
    """The same without pairs of opposite steps closer than ``gap_ticks``."""
    keep: list[int] = []
    for at in range(len(exact.ticks)):
        last = keep[-1] if keep else -1
        close = last >= 0 and exact.ticks[at] - exact.ticks[last] <= gap_ticks
        if close and exact.direction[at] != exact.direction[last]:
            keep.pop()
        else:
            keep.append(at)
    return Crossing(exact.ticks[keep], exact.direction[keep], exact.speed[keep])


def _control(motion: Motion, offset: int, segments: int, bits: int) -> list[Fraction]:
    raw = np.frombuffer(motion.data, dtype="<i8", count=segments + motion.degree, offset=offset)
    return [Fraction(int(value), 1 << bits) for value in raw]


def _power(control: list[Fraction], degree: int) -> list[Fraction]:
    rows = BASIS[degree]
    return [
        sum((weight * point for weight, point in zip(row, control, strict=True)), Fraction(0))
        / FACTORIAL[degree]
        for row in rows
    ]


def _shift(power: list[Fraction], part: int, parts: int) -> list[Fraction]:
    """Coefficients of p((part + v) / parts)."""
    result = []
    for low in range(len(power)):
        terms = [
            comb(high, low) * power[high] * Fraction(part ** (high - low), parts**high)
            for high in range(low, len(power))
        ]
        result.append(sum(terms, Fraction(0)))
    return result


def _piece_crossings(piece: Piece) -> tuple[Array, Array, Array]:
    angle, time = np.polynomial.Polynomial(piece.angle), np.polynomial.Polynomial(piece.time)
    rate = angle.deriv()
    edges = _breaks(rate)
    places, signs = [], []
    for low, high in pairwise(edges):
        thresholds = _between(angle(low), angle(high))
        if len(thresholds):
            places.append(_invert(angle, rate, thresholds, low, high))
            signs.append(np.full(len(thresholds), np.sign(angle(high) - angle(low))))
    if not places:
        return (np.zeros(0),) * 3
    v = np.concatenate(places)
    speed = np.abs(rate(v)) / time.deriv()(v) * limits.TICK_HZ
    return piece.first_ticks + time(v), np.concatenate(signs), speed


def _breaks(rate: np.polynomial.Polynomial) -> Array:
    """0, the zeros of the angle's rate in between, 1."""
    roots = rate.trim(1e-300).roots() if np.any(rate.coef) else np.zeros(0)
    real = np.sort(roots[np.abs(roots.imag) < 1e-7].real)
    return np.concatenate([[0.0], real[(real > 0) & (real < 1)], [1.0]])


def _between(low: float, high: float) -> Array:
    """The half steps passed from ``low`` to ``high``, in order."""
    if high >= low:
        return np.arange(np.floor(low + 0.5), np.floor(high + 0.5)) + 0.5
    return np.arange(np.floor(low + 0.5), np.floor(high + 0.5), -1) - 0.5


def _invert(
    angle: np.polynomial.Polynomial, rate: np.polynomial.Polynomial, wanted: Array, low: float, high: float
) -> Array:
    """Where the angle, monotone from ``low`` to ``high``, takes the wanted values: bisection, then Newton."""
    sign = np.sign(angle(high) - angle(low))
    left, right = np.full(len(wanted), low), np.full(len(wanted), high)
    for _ in range(40):
        middle = 0.5 * (left + right)
        before = sign * (angle(middle) - wanted) < 0
        left, right = np.where(before, middle, left), np.where(before, right, middle)
    v = 0.5 * (left + right)
    for _ in range(3):
        slope = rate(v)
        step = np.divide(angle(v) - wanted, slope, out=np.zeros_like(v), where=slope != 0)
        v = np.where(np.abs(step) < 1e-6, v - step, v)
    return v


# walks motion records on an interpreter and holds the steps against the oracle


SCRIPT = Path(__file__).parent / "scripts" / "probes" / "walk.py"
PULSE_TICKS = 168
GAP_TICKS = 20_000
BRAKE_SHAPE = 31
"""Half of the time until it brakes most."""


@dataclass(frozen=True)
class Steps:
    """What a generator wrote for one joint: rising edges in ticks and directions."""

    ticks: NDArray[np.int64]
    direction: NDArray[np.int64]


def walk(
    interpreter: str, folder: Path, records: list[bytes], space: int = 2, brake: tuple[int, int] = (0, 0)
) -> tuple[list[str], list[bytes]]:
    """What the board's check says of each record (a line each), and the bytes of the steps."""
    paths = [folder / f"{number}.atm" for number in range(len(records))]
    for path, record in zip(paths, records, strict=True):
        path.write_bytes(record)
    words = [str(word) for word in (PULSE_TICKS, GAP_TICKS, space, *brake, BRAKE_SHAPE, *paths)]
    verdicts = interpreters.run(interpreter, SCRIPT, *words).splitlines()
    return verdicts, [Path(f"{path}.steps").read_bytes() for path in paths]


def steps_of(data: bytes, joint: int) -> Steps:
    """One joint's steps from a file written with space 2."""
    rows = np.frombuffer(data, dtype="<i4").reshape(-1, 5)
    rows = rows[rows[:, 0] == joint].astype(np.int64)
    near, rise, fall = rows[:, 2] << 10, rows[:, 3], rows[:, 4]
    assert np.all((fall - rise) & 0xFFFFFFFF == PULSE_TICKS)
    ticks = near + ((rise - near + (1 << 31)) & 0xFFFFFFFF) - (1 << 31)
    assert np.all((ticks - near >= -2048) & (ticks - near < 1 << 24))
    return Steps(ticks, rows[:, 1])


def verify(record: bytes, data: bytes) -> float:
    """Hold every joint's steps against the exact spline; the largest error above 50 steps/s, in ticks."""
    motion = Motion(record)
    return max([_verify_joint(motion, joint, steps_of(data, joint)) for joint in range(motion.joints)])


def _verify_joint(motion: Motion, joint: int, steps: Steps) -> float:
    exact = without_grazes(crossings(motion, joint), GAP_TICKS)
    np.testing.assert_array_equal(steps.direction, exact.direction)
    error = np.abs(steps.ticks - exact.ticks)
    fast = exact.speed > 50
    worst = float(np.max(error[fast], initial=0.0))
    assert worst <= 2.0
    turns = np.diff(steps.direction) != 0
    assert np.all(np.diff(steps.ticks)[turns] >= GAP_TICKS)
    assert np.all(np.diff(steps.ticks)[~turns] > 2 * PULSE_TICKS * 0.7)
    assert position_error(motion, joint, steps) <= 0.52
    return worst


def position_error(motion: Motion, joint: int, steps: Steps) -> float:
    """Largest distance of the commanded position from the spline: at every edge, turn and segment end."""
    start = start_steps(motion, joint)
    commanded = start + np.concatenate([[0], np.cumsum(steps.direction)])
    worst = 0.0
    for piece in pieces(motion, joint):
        place = np.concatenate([turns(piece), place_of(piece, steps.ticks)])
        angle = piece.first_steps + np.polynomial.polynomial.polyval(place, piece.angle)
        ticks = piece.first_ticks + np.polynomial.polynomial.polyval(place, piece.time)
        for side in (-1e-3, 1e-3):  # just before and just after
            at = commanded[np.searchsorted(steps.ticks, np.rint(1000 * ticks) / 1000 + side)]
            worst = max(worst, float(np.max(np.abs(angle - at), initial=0.0)))
    return worst


def peak_rate(record: bytes) -> float:
    """Highest speed at any step, steps/s."""
    motion = Motion(record)
    speeds = [crossings(motion, joint).speed for joint in range(motion.joints)]
    return max(float(np.max(speed, initial=0.0)) for speed in speeds)


def braked(ticks: NDArray[np.float64], start: int, length: int) -> NDArray[np.float64]:
    """Motion time at a real time while braking (the law in ``armtempo_board/stepgen/time_law.py``)."""
    x = np.clip((ticks - start) / length, 0.0, 1.0)
    return np.where(ticks < start, ticks, start + length * ramps.passed(x, 1.0, 0.0, BRAKE_SHAPE))


TICK_HZ = limits.TICK_HZ
