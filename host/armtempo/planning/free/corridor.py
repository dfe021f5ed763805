"""Proven bounds of the distance between a free path and the spline through the via points.

Both are splines over the same u, so their difference is a spline too, and its Bernstein coefficients bound it.
"""

from __future__ import annotations

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.progress import alive
from armtempo.planning.tool import Tool
from armtempo.splines import bernstein

SHARP = 1e-3
"""Relative sharpness of the bound of the tool's deviation."""
_ROUNDING_MM = 1e-9
_MOST_PIECES = 50_000
"""Largest number of pieces at a time: about 100 MB, and a second."""


def joint_deviation_deg(path: Array, through: Array) -> float:
    """Largest deviation of any joint, from the Bernstein coefficients (S, 6, J) of path and spline."""
    return float(np.max(np.abs(path - through)))


def tool_deviation_mm(path: Array, through: Array, tool: Tool) -> float:
    """Upper bound of the distance between the tools at the same u, sharp to SHARP unless that needs too many pieces.

    ``path`` and ``through``: Bernstein coefficients (S, 6, J) in degrees. At the ends and in the middle of a
    piece the distance is computed; in between, its growth is bounded by ``_growth``, and its excess over the
    chords by ``_bulge``. Pieces that may have the maximum are halved.
    """
    best = 0.0
    while True:
        alive()
        places = np.stack([path[:, 0], _middle(path), path[:, -1]], axis=1)
        others = np.stack([through[:, 0], _middle(through), through[:, -1]], axis=1)
        shape = len(path), 3, 3
        away = tool.positions_mm(places.reshape(-1, path.shape[2])).reshape(shape)
        away -= tool.positions_mm(others.reshape(-1, path.shape[2])).reshape(shape)
        distance = np.linalg.norm(away, axis=2)
        best = max(best, float(distance.max()))
        turned, beside = path @ tool.turns.T, through @ tool.turns.T
        grown = distance[:, 1] + 0.5 * _growth(turned, beside, tool.reach_mm)
        bulged = distance.max(axis=1) + _bulge(turned, tool.reach_mm) + _bulge(beside, tool.reach_mm)
        most = np.minimum(grown, bulged)
        open_ = most > best * (1.0 + SHARP) + _ROUNDING_MM
        if not open_.any():
            return best * (1.0 + SHARP) + _ROUNDING_MM
        if 2 * np.count_nonzero(open_) > _MOST_PIECES:
            return float(most.max())
        path, through = _halved(path[open_]), _halved(through[open_])


def _middle(pieces: Array) -> Array:
    """Angles in the middle of pieces (N, 6, J): (N, J)."""
    return _halved(pieces)[::2, -1]


def _halved(pieces: Array) -> Array:
    """Both halves of pieces (N, 6, J), alternating: (2 N, 6, J)."""
    halves = bernstein.halves(np.moveaxis(pieces, 1, 2))
    return np.asarray(halves.transpose(0, 2, 3, 1).reshape(-1, *pieces.shape[1:]))


def _growth(path: Array, through: Array, reach_mm: Array) -> Array:
    """Bound of the change of the distance between the tools over a piece, mm: (N,).

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


def _bulge(curve: Array, reach_mm: Array) -> Array:
    """Bound of the tool's distance from the chords between ends and middle of a piece, mm: (N,).

    ``curve``: turns of rows, (N, 6, R) in degrees. Over a chord of length h it is h^2 / 8 times the second derivative.
    """
    degree = curve.shape[1] - 1
    angles = np.radians(curve)
    speed = np.abs(np.diff(angles, axis=1)).max(axis=1) * degree
    bend = np.abs(np.diff(angles, 2, axis=1)).max(axis=1) * degree * (degree - 1)
    outer = np.minimum(reach_mm[:, None], reach_mm[None, :])
    return np.asarray((bend @ reach_mm + np.einsum("nk,kj,nj->n", speed, outer, speed)) / 32.0)
