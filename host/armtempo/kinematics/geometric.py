"""Joints 1 to 3 from the wrist centre: the geometric half of section 2.1, Eqs. (3) to (7)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armtempo.kinematics.geometry import Array
from armtempo.kinematics.regions import Mask, Radii, radii
from armtempo.kinematics.shape import Shape


class ArmPart(NamedTuple):
    """Joints 1 to 3 as Denavit-Hartenberg angles, not wrapped; NaN where out of reach.

    Axes of the arrays: base (front, rear), elbow (up, down), pose.
    """

    theta1: Array
    """(2, N)"""
    theta2: Array
    """(2, 2, N)"""
    theta3: Array
    """(2, 2, N)"""
    fore: Array
    """(2, 2, N): theta2 + sign2 * theta3, the direction of x3 in the arm's plane."""
    radii: Radii


def solve_arm(shape: Shape, wrist: Array, previous: Array) -> ArmPart:
    """Find joints 1 to 3 for wrist centres, shape (3, N).

    ``previous``, (N, 6) or (6,), holds the Denavit-Hartenberg angles that decide where the pose leaves
    joint 1 (wrist centre on axis 1) or joint 2 (wrist centre on the shoulder axis) free.
    """
    x, y, z = wrist
    measured = radii(shape, x, y, z)
    theta1 = _base(shape, x, y, measured, previous[..., 0])
    forward = np.stack((measured.forward, -measured.forward))
    theta2, stretch = _triangle(shape, forward - shape.shoulder, shape.sign1 * (z - shape.height), measured)
    folded = measured.shoulder <= shape.near
    if folded.any():
        free = np.broadcast_to(previous[..., 1], folded.shape)
        np.copyto(theta2, free[:, None], where=folded[:, None])
    bent = stretch - shape.bend
    return ArmPart(theta1, theta2, shape.sign2 * bent, theta2 + bent, measured)


def _base(shape: Shape, x: Array, y: Array, measured: Radii, previous: Array) -> Array:
    """Eq. (5), widened by the shoulder offset: front and rear, (2, N)."""
    sideways = -shape.sign1 * shape.offset
    forward = np.stack((measured.forward, -measured.forward))
    theta1: Array = np.arctan2(y, x) - np.arctan2(sideways, forward)
    on_axis = measured.axis & (shape.offset == 0.0)
    if on_axis.any():
        theta1[:, on_axis] = np.broadcast_to(previous, x.shape)[on_axis] + np.array([[0.0], [np.pi]])
    return theta1


def _triangle(shape: Shape, out: Array, up: Array, measured: Radii) -> tuple[Array, Array]:
    """Solve the triangle shoulder, elbow, wrist, Eqs. (6) and (7): theta2 and theta3 + bend, (2, 2, N).

    The half-angle form keeps the full accuracy where the elbow is stretched or folded, where the arc cosines
    of the paper lose half the digits.
    """
    r, upper, fore = measured.shoulder, shape.upper, shape.fore
    with np.errstate(invalid="ignore"):
        opened = np.sqrt((shape.farthest - r) * (shape.farthest + r))
        folded = np.sqrt((r - shape.nearest) * (r + shape.nearest))
    elbow = np.arctan2(opened, folded) * 2.0
    lift = np.arctan2(opened * folded, r * r + (upper - fore) * (upper + fore))
    sign = elbow_signs(shape)
    direction = np.arctan2(up, out) + shape.turn2
    return direction[:, None] - sign * lift[:, None], sign * elbow[:, None]


def elbow_signs(shape: Shape) -> NDArray[np.float64]:
    """Sign of theta3 + bend for base (front, rear) and elbow (up, down): shape (2, 2, 1)."""
    up = -shape.sign1
    return np.array([[[up], [-up]], [[-up], [up]]])


def duplicates(shape: Shape, measured: Radii) -> Mask:
    """Postures that equal an earlier one, on a border: (2, 2, N).

    Elbow up and down are one where the elbow is stretched or folded; front and rear are one on the border
    of the cylinder that a shoulder offset leaves free.
    """
    same = np.zeros((2, 2, measured.forward.size), dtype=bool)
    same[:, 1] = on_border(shape, measured)
    if shape.offset:
        same[1] |= measured.axis
    return same


def on_border(shape: Shape, measured: Radii) -> Mask:
    """Where the elbow is stretched or folded: (2, N)."""
    border: Mask = (measured.shoulder == shape.farthest) | (measured.shoulder == shape.nearest)
    return border
