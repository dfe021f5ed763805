"""Where the wrist centre lies: the inequalities of Eq. (3) and the regions of Fig. 3.

The arm can turn its shoulder towards the wrist centre (front) or away from it (rear). Either way the wrist
centre is within reach while its distance from the shoulder axis is between |L2 - L34| and L2 + L34: two
arm postures (elbow up and down) inside, one on the border, none outside.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armtempo.basics.arrays import Array
from armtempo.kinematics import formulas
from armtempo.kinematics.shape import Shape

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
