"""The steps of a motion record, computed independently of the board: fractions for the polynomials, float64
roots on each segment (angles from its own start, so that 1e-9 steps and 1e-5 ticks are met)."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import comb

import numpy as np
from armtempo_shared import limits
from armtempo_shared.basis import BASIS, FACTORIAL
from armtempo_shared.motion import Motion
from numpy.typing import NDArray

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
