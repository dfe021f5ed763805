"""Proven bounds of the tool's deviation from its path.

Let e(u) be the difference between the tool for the joints' spline and the path at the same u. Over a piece of
length h, |e| exceeds the chord between its ends by at most h^2 / 8 times the largest second derivative, which
is bounded by Bernstein coefficients. Pieces that may have the maximum are halved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.progress import alive
from armtempo.model.tool_pose import APPROACH, WHOLE
from armtempo.planning.line.tool_path import Bounds, ToolPath
from armtempo.planning.tool import Tool
from armtempo.splines import bernstein

_SHARP = 0.02
"""Relative sharpness of a bound."""
_MOST_PIECES = 20_000


class LineDeviation(NamedTuple):
    """Bounds of the deviation over a path."""

    position_mm: float
    rotation_deg: float


class SplinePieces(NamedTuple):
    """Bernstein coefficients of a spline's pieces."""

    angles_deg: Array
    """(S, 6, J)."""
    distances: Array
    """(S, 6)."""


class _Bends(NamedTuple):
    """Bounds of second derivatives over pieces, each (N,): of the position in mm, of the rotation's matrix."""

    position: Array
    rotation: Array


def proven(
    pieces: SplinePieces,
    tool: Tool,
    path: ToolPath,
    fixed: tuple[str, ...],
    enough: LineDeviation,
    whether: bool = False,
) -> LineDeviation:
    """Bounds on the deviation of a spline from its path.

    Found to 2 %, or to that part of ``enough``; with ``whether`` only until it is known whether that is more than
    ``enough``.
    """
    angles_deg, distances = pieces
    bounds = path.bounds
    floor = np.array([enough.position_mm, _chord(enough.rotation_deg)]) * _SHARP
    counts = np.array([1.0, 1.0 if fixed else 0.0])
    outside = max(0.0, -float(distances.min()), float(distances.max()) - path.length)
    beyond_deg = float(np.degrees(bounds.turn)) * outside
    limit = np.array(
        [enough.position_mm - bounds.slope * outside, _chord(max(0.0, enough.rotation_deg - beyond_deg))]
    )
    best = np.zeros(2)
    while True:
        alive()
        reached = counts * _at_ends(angles_deg, distances, tool, path, fixed)
        bends = _bends(angles_deg, distances, tool, bounds)
        best = np.maximum(best, reached.max(axis=0))
        most = reached + counts * np.stack(bends, axis=1) / 8.0
        found = best * (1.0 + _SHARP) + floor
        open_ = np.any(most > found, axis=1)
        final = np.maximum(best, most.max(axis=0)) * (1.0 + _SHARP) + floor  # what may be found at most
        is_known = whether and (np.all(final <= limit) or np.any(found > limit))
        if is_known or not open_.any() or 2 * np.count_nonzero(open_) > _MOST_PIECES:
            if open_.any():
                found = final if is_known and np.all(final <= limit) else np.maximum(found, most.max(axis=0))
            turned_deg = _degrees(float(found[1])) + beyond_deg
            return LineDeviation(float(found[0]) + bounds.slope * outside, turned_deg if fixed else 0.0)
        angles_deg, distances = halved(angles_deg[open_]), halved(distances[open_, :, None])[:, :, 0]


def _at_ends(
    angles_deg: Array, distances: Array, tool: Tool, path: ToolPath, fixed: tuple[str, ...]
) -> Array:
    """The larger deviation of the two ends of pieces, (N, 2): position in mm, and chord of the rotation."""
    at_mm, axes_there = tool.poses(np.concatenate([angles_deg[:, 0], angles_deg[:, -1]]))
    position, rotation = path.poses(np.concatenate([distances[:, 0], distances[:, -1]]))
    away = np.linalg.norm(at_mm - position, axis=1)
    axes = slice(2, 3) if fixed == (APPROACH,) else slice(0, 3)
    turned = (axes_there - rotation)[:, :, axes]
    found = np.stack([away, _per_axis(fixed) * np.linalg.norm(turned, axis=(1, 2))], axis=1)
    return np.asarray(np.maximum(*np.split(found, 2)))


def _per_axis(fixed: tuple[str, ...]) -> float:
    """Factor from the norm of a difference of rotations to 2 sin(angle / 2), that of an axis perpendicular to
    the rotation."""
    return float(np.sqrt(0.5)) if fixed == WHOLE else 1.0


def _chord(angle_deg: float) -> float:
    return 2.0 * float(np.sin(np.radians(min(angle_deg, 180.0)) / 2.0))


def _degrees(chord: float) -> float:
    return float(np.degrees(2.0 * np.arcsin(min(chord / 2.0, 1.0))))


def _bends(angles_deg: Array, distances: Array, tool: Tool, bounds: Bounds) -> _Bends:
    """Bounds of the second derivatives over each piece, of arm and path together.

    Columns of the Jacobian are at most as long as the reach of their joint; their derivative by another joint
    is at most the reach of the outer of the two. Axes turn at most as fast as all joints together.
    """
    turns = np.radians(angles_deg @ tool.turns.T)
    speed, bend = derivatives(turns, 2)
    reach = tool.reach_mm
    outer = np.minimum(reach[:, None], reach[None, :])
    position = bend @ reach + np.einsum("nk,kj,nj->n", speed, outer, speed)
    turn = speed.sum(axis=1)
    rotation = bend.sum(axis=1) + 2.0 * turn**2
    rate, bend = (each[:, 0] for each in derivatives(distances[:, :, None], 2))
    position = position + bounds.slope * bend + bounds.bend * rate**2
    rotation = rotation + bounds.turn * bend + (bounds.turn_bend + bounds.turn**2) * rate**2
    return _Bends(position, rotation)


def derivatives(pieces: Array, orders: int) -> list[Array]:
    """Largest first and later derivatives over Bernstein pieces (N, 6, J): each (N, J)."""
    found, scale = [], 1.0
    for _ in range(orders):
        scale *= pieces.shape[1] - 1
        pieces = np.diff(pieces, axis=1)
        found.append(scale * np.abs(pieces).max(axis=1))
    return found


def halved(pieces: Array) -> Array:
    """Both halves of pieces (N, 6, J), alternating: (2 N, 6, J)."""
    halves = bernstein.halves(np.moveaxis(pieces, 1, 2))
    return np.asarray(halves.transpose(0, 2, 3, 1).reshape(-1, *pieces.shape[1:]))
