"""Lower bounds of the motion time of every time law along a path, to compare a plan with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armtempo.model.arm import Limits
from armtempo.planning import rest_to_rest, topp
from armtempo.splines import bspline
from armtempo.splines.bspline import Array

_WIGGLE = 1e-9
"""Turns smaller than this fraction of the joint's travel are rounding errors."""


def floor(angle_points_deg: Array, degree: int, limits: Sequence[Limits]) -> tuple[float, str]:
    """The highest known lower bound for joints moving together, in seconds, and its name.

    ``angle_points_deg``: (n + degree, J). ``"rests"``: from turn to turn of one joint under its three limits;
    ``"path"``: along the common path under speed and acceleration limits.
    """
    joints = range(len(limits))
    found = [
        (rest_to_rest.floor_s(turns(angle_points_deg[:, j], degree), limits[j], at_rest=degree == 5), "rests")
        for j in joints
    ]
    if len(limits) > 1:
        values = np.array([limit.values for limit in limits])
        found.append((topp.floor_s(angle_points_deg, degree, values[:, 0], values[:, 1]), "path"))
    return max(found)


def turns(angle_points_deg: Array, degree: int) -> Array:
    """Start, turning points and end of one joint's path, in order; ``angle_points_deg``: (n + degree,)."""
    pieces = bspline.polynomials(angle_points_deg, degree)
    angles = np.concatenate([_stationary(piece) for piece in pieces] + [[pieces[-1].sum()]])
    wiggle = _WIGGLE * float(np.ptp(angles))
    kept = [float(angles[0])]
    for angle in angles[1:]:
        if abs(angle - kept[-1]) <= wiggle:
            continue
        if len(kept) > 1 and (angle - kept[-1]) * (kept[-1] - kept[-2]) > 0:
            kept[-1] = float(angle)
        else:
            kept.append(float(angle))
    return np.array(kept)


def _stationary(piece: Array) -> Array:
    """Angles at the start of a segment and where its slope is zero, in order of u."""
    slope = (piece[1:] * np.arange(1, len(piece)))[::-1]
    roots = np.roots(slope) if np.any(slope) else np.empty(0)
    u = np.sort(roots.real[(np.abs(roots.imag) < 1e-7) & (roots.real > 0) & (roots.real < 1)])
    return np.polyval(piece[::-1], np.concatenate([[0.0], u]))
