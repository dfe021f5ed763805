"""How far a free path leaves the spline through the via points, as proven bounds.

Both are splines over the same u, so their difference is one too, and its Bernstein coefficients bound it.
"""

from __future__ import annotations

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.free.tool import Tool
from armtempo.splines import bernstein

SHARP = 1e-3
"""How far, relative, a bound on the tool's deviation may lie above what is reached."""
_DEPTH = 20


def joint_deviation_deg(path: Array, through: Array) -> float:
    """Largest deviation of any joint, from the Bernstein coefficients (S, 6, J) of path and spline."""
    return float(np.max(np.abs(path - through)))


def tool_deviation_mm(path: Array, through: Array, tool: Tool) -> float:
    """Upper bound, sharp to SHARP, of the distance between the tools at the same u.

    ``path`` and ``through``: Bernstein coefficients (S, 6, J) in degrees. In the middle of a piece the distance is
    computed; away from it, it grows no faster than ``_growth`` says. Pieces that may hold the largest are halved.
    """
    best = 0.0
    for _ in range(_DEPTH):
        ends = np.concatenate([path, path[:, ::-1]])[:, 0], np.concatenate([through, through[:, ::-1]])[:, 0]
        middle = _middle(path), _middle(through)
        first, second = (tool.at(angles).position_mm for angles in middle)
        distance = np.linalg.norm(first - second, axis=1)
        outer = np.linalg.norm(tool.at(ends[0]).position_mm - tool.at(ends[1]).position_mm, axis=1)
        best = max(best, float(distance.max()), float(outer.max()))
        most = distance + 0.5 * _growth(path @ tool.turns.T, through @ tool.turns.T, tool.reach_mm)
        open_ = most > best * (1.0 + SHARP) + 1e-9
        if not open_.any():
            return best * (1.0 + SHARP) + 1e-9
        path, through = _halved(path[open_]), _halved(through[open_])
    return float(most.max())


def _middle(pieces: Array) -> Array:
    """Angles in the middle of pieces (N, 6, J): (N, J)."""
    return _halved(pieces)[::2, -1]


def _halved(pieces: Array) -> Array:
    """Both halves of pieces (N, 6, J) by turns: (2 N, 6, J)."""
    halves = bernstein.halves(np.moveaxis(pieces, 1, 2))
    return np.asarray(halves.transpose(0, 2, 3, 1).reshape(-1, *pieces.shape[1:]))


def _growth(path: Array, through: Array, reach_mm: Array) -> Array:
    """Bound on how fast the distance between the tools changes over a piece, mm for the whole of it: (N,).

    ``path`` and ``through`` are turns of rows of the Denavit-Hartenberg table, (N, 6, R) in degrees.
    d/du of p(q) - p(r) is J(q) (q' - r') + (J(q) - J(r)) r'. A column of J is no longer than the reach of its
    joint, and as joint k turns it changes by no more than the reach of the outer one of both.
    """
    degree = path.shape[1] - 1
    difference = np.radians(path - through)
    away = np.abs(difference).max(axis=1)
    drift = np.abs(np.diff(difference, axis=1)).max(axis=1) * degree
    speed = np.abs(np.diff(np.radians(through), axis=1)).max(axis=1) * degree
    outer = np.minimum(reach_mm[:, None], reach_mm[None, :])
    return np.asarray(drift @ reach_mm + np.einsum("nk,kj,nj->n", away, outer, speed))
