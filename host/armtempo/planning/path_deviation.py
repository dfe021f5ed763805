"""Deviations of a path: of the tool with per-joint timing, and of joints from the angles between via points."""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from armtempo.kinematics import chain
from armtempo.kinematics.forward import forward
from armtempo.kinematics.geometry import Geometry
from armtempo.model.arm import Arm
from armtempo.splines import bspline, extremes
from armtempo.splines.bspline import Array
from armtempo.splines.trajectory import Trajectory

_PARTS = 200
"""Chords per path segment; the path is within 0.1 mm of them for an arm of 1 m that turns 90 degrees."""
_TIMES = 2000


def via_spread_s(trajectory: Trajectory) -> Array:
    """Time between the first and the last moving joint at each via point, seconds: (n + 1,).

    Zero at the first; at the last, the difference of the motion times.
    """
    moving = [joint for joint in trajectory.joints if np.ptp(joint.angle_points_deg) > 0]
    return np.asarray(np.ptp([joint.via_times_s for joint in moving or trajectory.joints], axis=0))


def tool_stray_mm(arm: Arm, trajectory: Trajectory) -> float:
    """Largest distance of the tool from the path that shared timing would follow exactly, in mm.

    Joints without a motor are at home. Computed for 2000 times and 200 chords per segment.
    """
    times = np.linspace(0.0, trajectory.duration_s, _TIMES)
    path = _tool(arm, _path_deg(trajectory))
    return float(_distance(_tool(arm, trajectory(times)), path[:-1], path[1:]).max())


class Swing(NamedTuple):
    """A joint that leaves the angles between two via points."""

    beyond_deg: float
    joint: int
    """Index among the driven joints."""
    via: int
    """Number of the via point before it, from 0."""
    reached_deg: float


def widest_swing(trajectory: Trajectory, skipped: Collection[int] = ()) -> Swing:
    """Where a joint gets farthest beyond the angles of the via points before and after it.

    ``skipped``: numbers of via points before which the path is none of its own choice.
    """
    found = [Swing(0.0, 0, 0, 0.0)]
    for joint, spline in enumerate(trajectory.joints):
        pieces = bspline.polynomials(spline.angle_points_deg, spline.degree)
        knots = spline.via_segments or range(len(pieces) + 1)
        for via, (first, last) in enumerate(pairwise(knots)):
            if via + 1 in skipped:
                continue
            own = pieces[first:last]
            ends = float(own[0, 0]), float(own[-1].sum())
            low, high = (float(each[0]) for each in extremes.range_of(own[None]))
            found.append(Swing(min(ends) - low, joint, via, low))
            found.append(Swing(high - max(ends), joint, via, high))
    return max(found)


def _path_deg(trajectory: Trajectory) -> Array:
    """Angles along the path, all joints at the same u: (n * _PARTS + 1, J)."""
    pieces = np.stack(
        [bspline.polynomials(joint.angle_points_deg, joint.degree) for joint in trajectory.joints], axis=-1
    )
    powers = (np.arange(_PARTS) / _PARTS)[:, None] ** np.arange(pieces.shape[1])
    inner = np.einsum("gp,mpj->mgj", powers, pieces).reshape(-1, pieces.shape[2])
    return np.concatenate([inner, pieces[-1:].sum(axis=1)])


def _tool(arm: Arm, driven_deg: Array) -> Array:
    """Tool positions in mm, (N, 3), for angles (N, J) of the driven joints."""
    return forward(Geometry.of(arm), np.radians(chain.all_angles_deg(arm, driven_deg)))[:, :3, 3]


def _distance(points: Array, starts: Array, ends: Array) -> Array:
    """Distance of each point (N, 3) from the nearest chord (M, 3) to (M, 3): (N,)."""
    chords = ends - starts
    squares = np.maximum(np.sum(chords**2, axis=1), 1e-300)
    nearest = np.empty(len(points))
    for first in range(0, len(points), 100):  # in blocks of 100 x M numbers, to save memory
        some = points[first : first + 100]
        along = some @ chords.T - np.sum(starts * chords, axis=1)
        to_start = np.sum(some**2, axis=1)[:, None] - 2.0 * some @ starts.T + np.sum(starts**2, axis=1)
        part = np.clip(along / squares, 0.0, 1.0)
        away = to_start - part * (2.0 * along - part * squares)  # squared, to within 1e-9 mm² for metres
        nearest[first : first + 100] = np.sqrt(np.maximum(away.min(axis=1), 0.0))
    return nearest
