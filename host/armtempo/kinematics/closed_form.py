"""The closed form of section 2.1 for many poses: Eqs. (3) to (7) for joints 1 to 3, (8) to (11) for joints 4 to 6.

Unlike the paper, which divides by sin(theta4) or sin(theta5), joints 4 to 6 are the arctan2 of sine and cosine from
Eq. (8), so the quadrant is defined and there is no division by a value near zero.

``single`` does the same for one pose, with the same formulas: a pose alone takes ten times as long with arrays, and
many take over ten times as long one by one with floats (host/docs/measurements.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armtempo.basics.arrays import Array
from armtempo.kinematics import formulas
from armtempo.kinematics.formulas import ARRAYS
from armtempo.kinematics.shape import STRAIGHT_WRIST, Shape

Mask = NDArray[np.bool_]


class Radii(NamedTuple):
    """Distances that decide about reach; those within the tolerance of a border are set onto it."""

    forward: Array
    """(N,): of the wrist centre from the base axis, measured in the arm's plane; NaN inside the offset."""
    shoulder: Array
    """(2, N): of the wrist centre from the shoulder axis, front and rear; the r of Eq. (7)."""
    axis: Mask
    """(N,): forward is 0: on axis 1, or on the border of the cylinder that a shoulder offset leaves free."""


def radii(shape: Shape, x: Array, y: Array, z: Array) -> Radii:
    """Measure wrist centres given as three arrays of shape (N,)."""
    planar = np.sqrt(x * x + y * y)
    axis = formulas.on_axis(shape, planar)
    with np.errstate(invalid="ignore"):
        forward = np.sqrt(formulas.square_of_forward(shape, planar))
    forward[axis] = 0.0
    out, up = formulas.to_shoulder(shape, np.stack((forward, -forward)), z)
    shoulder = np.sqrt(out * out + up * up)
    np.copyto(shoulder, shape.farthest, where=formulas.on_outer_border(shape, shoulder))
    np.copyto(shoulder, shape.nearest, where=formulas.on_inner_border(shape, shoulder))
    return Radii(forward, shoulder, axis)


@dataclass(frozen=True)
class Regions:
    """Regions of Fig. 3 for N wrist centres."""

    names: tuple[str, ...]
    """"I" none and too near, "II" front and rear, "III" one of them, "IV" none; "II-III" on a border."""
    postures: NDArray[np.int64]
    """(N,): how many postures of joints 1 to 3 there are, 0 to 4. On axis 1 itself: per angle of joint 1 and
    the one opposite to it."""
    axis: Mask
    """(N,): on axis 1, if joint 1 may take any angle."""


def classify(shape: Shape, wrist: ArrayLike) -> Regions:
    """Name the region and count the arm postures of wrist centres, shape (N, 3)."""
    points = np.atleast_2d(np.asarray(wrist, dtype=np.float64))
    measured = radii(shape, *points.T)
    # -2 too near, -1 on the inner border, 0 inside, 1 on the outer border, 2 too far.
    state = np.sign(measured.shoulder - shape.farthest) + np.sign(measured.shoulder - shape.nearest)
    state = np.where(np.isnan(state), -2, state).astype(np.int64)
    postures = (2 - np.abs(state)).clip(0)
    if shape.offset:
        postures[1, measured.axis] = 0
    names = tuple(_name(int(front), int(rear)) for front, rear in state.T)
    return Regions(names, postures.sum(axis=0), measured.axis & (shape.offset == 0.0))


def _name(front: int, rear: int) -> str:
    return "-".join(sorted({_region(front, rear, 1), _region(front, rear, 0)}))


def _region(front: int, rear: int, border_is_inside: int) -> str:
    inside = sum(abs(state) <= border_is_inside for state in (front, rear))
    if inside:
        return "III" if inside == 1 else "II"
    return "IV" if front > 0 and rear > 0 else "I"


class ArmPart(NamedTuple):
    """Joints 1 to 3 as Denavit-Hartenberg angles, theta3 not wrapped; NaN if out of reach.

    Axes of the arrays: base (front, rear), elbow (up, down), pose.
    """

    theta1: Array
    """(2, N)"""
    theta2: Array
    """(2, 2, N)"""
    theta3: Array
    """(2, 2, N)"""
    turn1: tuple[Array, Array]
    """Cosine and sine of theta1, (2, N) each."""
    fore: tuple[Array, Array]
    """As ``formulas.forearm``, (2, 2, N) each."""
    radii: Radii


def solve_arm(shape: Shape, wrist: Array, previous: Array) -> ArmPart:
    """Find joints 1 to 3 for wrist centres, shape (3, N).

    ``previous``, (N, 6) or (6,), holds the Denavit-Hartenberg angles that decide if the pose leaves
    joint 1 (wrist centre on axis 1) or joint 2 (wrist centre on the shoulder axis) free.
    """
    x, y, z = wrist
    measured = radii(shape, x, y, z)
    forward = np.stack((measured.forward, -measured.forward))
    turn1 = _base(shape, x, y, forward, measured.axis, previous[..., 0])
    out, up = formulas.to_shoulder(shape, forward[:, None], z)
    r, sign = measured.shoulder, elbow_signs(shape)
    with np.errstate(invalid="ignore", divide="ignore"):
        elbow, sine = (sign * part[:, None] for part in formulas.triangle(ARRAYS, shape, r))
        square = np.square(r)[:, None]
        theta2 = formulas.upper_arm(ARRAYS, shape, out, up, square, sine)
        fore = formulas.forearm(shape, out, up, square, sine)
    bent = formulas.bent(shape, elbow)
    folded = r <= shape.near
    if folded.any():
        where = np.broadcast_to(folded[:, None], bent.shape)
        np.copyto(theta2, previous[..., 1], where=where)
        np.copyto(fore[0], np.cos(theta2 + bent), where=where)
        np.copyto(fore[1], shape.sign1 * np.sin(theta2 + bent), where=where)
    theta1 = np.arctan2(turn1[1], turn1[0])
    return ArmPart(theta1, theta2, shape.sign2 * bent, turn1, fore, measured)


def _base(
    shape: Shape, x: Array, y: Array, forward: Array, axis: Mask, previous: Array
) -> tuple[Array, Array]:
    """Cosine and sine of theta1: front and rear, (2, N) each."""
    with np.errstate(invalid="ignore", divide="ignore"):
        cos, sin = formulas.base_turn(shape, x, y, forward)
    if not shape.offset and axis.any():
        kept = np.broadcast_to(previous, x.shape)[axis]
        cos[:, axis] = np.array([[1.0], [-1.0]]) * np.cos(kept)
        sin[:, axis] = np.array([[1.0], [-1.0]]) * np.sin(kept)
    return cos, sin


def elbow_signs(shape: Shape) -> NDArray[np.float64]:
    """Sign of theta3 + bend for base (front, rear) and elbow (up, down): shape (2, 2, 1)."""
    up = -shape.sign1
    return np.array([[[up], [-up]], [[-up], [up]]])


def duplicates(shape: Shape, measured: Radii) -> Mask:
    """Postures that equal an earlier one, on a border: (2, 2, N).

    Elbow up and down are one if the elbow is stretched or folded; front and rear are one on the border
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


class WristPart(NamedTuple):
    """Joints 4 to 6 as Denavit-Hartenberg angles in (-pi, pi], for the solution with theta5 >= 0.

    Shape of each: (2, 2, N), axes as in ArmPart. The flipped solution is theta4 + pi, -theta5, theta6 + pi.
    """

    theta4: Array
    theta5: Array
    theta6: Array
    singular: Mask


def solve_wrist(shape: Shape, arm: ArmPart, axes: Array, previous4: Array) -> WristPart:
    """Find joints 4 to 6 for orientations ``axes``: (3, 3, N), [axis n, o, a of Eq. (1), component].

    ``previous4``, (N,) or (), is the Denavit-Hartenberg angle theta4 to keep if theta5 = 0.
    """
    fore = arm.fore
    in_plane = [formulas.in_arm_plane(*arm.turn1, x, y) for x, y, _ in axes]
    along, heights = [part[:, None] for part, _ in in_plane], axes[:, 2]
    n_x, o_x, a_x = (formulas.along_x3(*fore, part, z) for part, z in zip(along, heights, strict=True))
    n_y, o_y, a_y = (formulas.along_y3(shape, across)[:, None] for _, across in in_plane)
    a_z = formulas.along_z3(shape, *fore, along[2], heights[2])

    sin5 = np.sqrt(a_x * a_x + a_y * a_y)
    singular = sin5 <= STRAIGHT_WRIST
    if singular.any():
        a_y = np.broadcast_to(a_y, a_x.shape).copy()
        np.copyto(a_x, shape.sign5 * np.cos(previous4), where=singular)
        np.copyto(a_y, shape.sign5 * np.sin(previous4), where=singular)
    return WristPart(
        formulas.theta4(ARRAYS, shape, a_x, a_y),
        formulas.theta5(ARRAYS, shape, sin5, a_z),
        formulas.theta6(ARRAYS, shape, (a_x, a_y), (n_x, n_y), (o_x, o_y)),
        singular,
    )
