"""The formulas of the closed form, Eqs. (2) to (11), each once: for floats (``FLOATS``) and for arrays (``ARRAYS``).

Every element is a float, or an array of any shape. Cosines and sines are computed algebraically, and each
joint angle by one arctan2, so floats and arrays give the same angles except for the last digits of arctan2.
Special cases (borders, singular poses) are handled by the callers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Generic, NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics.geometry import T
from armtempo.kinematics.shape import Shape


def _wrapped(angles: Array) -> Array:
    wrapped: Array = angles - math.tau * np.rint(angles * (1.0 / math.tau))
    return wrapped


class Functions(NamedTuple, Generic[T]):
    """Functions with different names for floats and arrays."""

    sqrt: Callable[[T], T]
    arctan2: Callable[[T, T], T]
    wrapped: Callable[[T], T]
    """Maps angles into [-pi, pi]."""


FLOATS: Functions[float] = Functions(math.sqrt, math.atan2, lambda angle: math.remainder(angle, math.tau))
ARRAYS: Functions[Array] = Functions(np.sqrt, np.arctan2, _wrapped)

Pair = tuple[T, T]


def wrist_centre(shape: Shape, n: T, o: T, a: T, position: T) -> T:
    """Eq. (2) for one component of the axes n, o, a and of the position of Eq. (1)."""
    return position - shape.flange[0] * n - shape.flange[1] * o - shape.flange[2] * a


def before_flange(shape: Shape, o: T, a: T) -> Pair[T]:
    """One component of the axes o and a before the twist of row 6."""
    cos, sin = shape.flange_twist
    return cos * o - sin * a, cos * a + sin * o


def square_of_forward(shape: Shape, planar: T) -> T:
    """Square of the wrist centre's distance forwards of axis 1, in the arm's plane; below 0 inside the offset."""
    offset = abs(shape.offset)
    return (planar - offset) * (planar + offset)


def on_axis(shape: Shape, planar: T) -> Any:
    """Whether a wrist centre is on axis 1, or on the border of the cylinder that a shoulder offset leaves free."""
    gap = planar - abs(shape.offset)
    return (gap >= -shape.near) & (gap <= (shape.blur if shape.offset else shape.near))


def on_outer_border(shape: Shape, r: T) -> Any:
    """Whether the elbow is stretched, by the r of Eq. (7)."""
    gap = r - shape.farthest
    return (gap >= -shape.blur) & (gap <= shape.near)


def on_inner_border(shape: Shape, r: T) -> Any:
    """Whether the elbow is folded."""
    gap = r - shape.nearest
    return (gap >= -shape.near) & (gap <= shape.blur)


def base_turn(shape: Shape, x: T, y: T, forward: T) -> Pair[T]:
    """Eq. (5), widened by the shoulder offset: cosine and sine of theta1, from a wrist centre off axis 1.

    ``forward`` is negative for an arm that reaches over its shoulder to the rear.
    """
    sideways = -shape.sign1 * shape.offset
    scale = 1.0 / (x * x + y * y)
    return scale * (x * forward + y * sideways), scale * (y * forward - x * sideways)


def to_shoulder(shape: Shape, forward: T, z: T) -> Pair[T]:
    """The wrist centre seen from the shoulder, in the arm's plane: outwards, and up (if sign1 is positive)."""
    return forward - shape.shoulder, shape.sign1 * (z - shape.height)


def triangle(functions: Functions[T], shape: Shape, r: T) -> Pair[T]:
    """Eq. (7): angle by which the elbow is bent, and the product that all sines of the triangle share.

    The half-angle form keeps the full accuracy if the elbow is stretched or folded, where the arc cosines
    of the paper lose half the digits.
    """
    opened = functions.sqrt((shape.farthest - r) * (shape.farthest + r))
    folded = functions.sqrt((r - shape.nearest) * (r + shape.nearest))
    return 2.0 * functions.arctan2(opened, folded), opened * folded


def upper_arm(functions: Functions[T], shape: Shape, out: T, up: T, square: T, sine: T) -> T:
    """Eq. (6): theta2, with the sine of ``triangle`` signed as the elbow is; ``square``: of r, above 0."""
    cosine = shape.turn2_sign * (square + shape.excess)
    sine = shape.turn2_sign * sine
    # adding 0 turns -0 into 0, so that elbow up and down get the same half turn
    return functions.arctan2(up * cosine - out * sine + 0.0, out * cosine + up * sine)


def forearm(shape: Shape, out: T, up: T, square: T, sine: T) -> Pair[T]:
    """Cosine, and sine times sign1, of theta2 + sign2 * theta3, the direction of x3 in the arm's plane.

    Arguments as of ``upper_arm``.
    """
    cosine = square - shape.excess
    scale = 0.5 / (shape.fore * square)
    along, across = scale * (out * cosine - up * sine), scale * (up * cosine + out * sine)
    cos, sin = shape.fore_turn
    return cos * along - sin * across, shape.sign1 * (sin * along + cos * across)


def bent(shape: Shape, elbow: T) -> T:
    """sign2 * theta3, not wrapped, for the signed angle of ``triangle``."""
    return elbow - shape.bend


def in_arm_plane(cos: T, sin: T, x: T, y: T) -> Pair[T]:
    """Components of one of the tool's axes along the arm's plane and across it, from theta1's cosine and sine."""
    return cos * x + sin * y, cos * y - sin * x


def along_x3(cos: T, sin: T, along: T, height: T) -> T:
    """Its component along the axis x3 of the forearm's frame; ``cos`` and ``sin`` as of ``forearm``."""
    return cos * along + sin * height


def along_y3(shape: Shape, across: T) -> T:
    """Its component along y3."""
    return -shape.hand * across


def along_z3(shape: Shape, cos: T, sin: T, along: T, height: T) -> T:
    """Its component along z3."""
    return shape.hand * (sin * along - cos * height)


def theta4(functions: Functions[T], shape: Shape, a_x: T, a_y: T) -> T:
    """Eq. (9) with its quadrant, for theta5 >= 0."""
    return functions.arctan2(shape.sign5 * a_y, shape.sign5 * a_x)


def theta5(functions: Functions[T], shape: Shape, sin5: T, a_z: T) -> T:
    """Eq. (10) with its quadrant, from the sine, not below 0, and the approach axis along z3."""
    return functions.arctan2(sin5, -shape.sign4 * shape.sign5 * a_z)


def theta6(functions: Functions[T], shape: Shape, a: Pair[T], n: Pair[T], o: Pair[T]) -> T:
    """Eq. (11) with its quadrant, from the components along x3 and y3; of a only the direction counts."""
    return functions.arctan2(
        shape.sign4 * (a[1] * n[0] - a[0] * n[1]), shape.sign4 * (a[1] * o[0] - a[0] * o[1])
    )
