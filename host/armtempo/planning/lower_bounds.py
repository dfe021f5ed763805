"""Lower bounds of the motion time of every time law along a path, to compare a plan with."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise

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
        (
            rest_to_rest.floor_s(turns(angle_points_deg[:, j], degree), limits[j], from_rest=degree == 5),
            "rests",
        )
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


def free_floor_s(
    via_deg: Array, limits: Sequence[Limits], stops: Mapping[int, float], loose: Collection[int] = ()
) -> float:
    """No motion through via angles (n + 1, J) takes less, whatever its path.

    From stop to stop (dwells in seconds by via point) the largest over joints of the least time through its turning
    via angles under its three limits: where a joint's via angles turn it stands still there or beyond. ``loose`` via
    points, which may be passed at other angles, do not count.
    """
    last = len(via_deg) - 1
    ends = [0, *sorted(set(stops) - set(loose)), last]
    total = sum(stops.values())
    for first, end in pairwise(ends):
        exact = [via for via in range(first, end + 1) if via not in loose]
        rests = end not in loose
        times = [
            rest_to_rest.floor_s(_turning(via_deg[exact, joint], rests), limit, to_rest=rests)
            for joint, limit in enumerate(limits)
        ]
        total += max(times)
    return total


def _turning(angles: Array, rests: bool) -> Array:
    """First and last of the angles and those between where their direction changes.

    Where the joint does not rest at the last, that is left out.
    """
    kept = [float(angles[0])]
    for angle in angles[1:]:
        if angle == kept[-1]:
            continue
        if len(kept) > 1 and (angle - kept[-1]) * (kept[-1] - kept[-2]) > 0:
            kept[-1] = float(angle)
        else:
            kept.append(float(angle))
    return np.array(kept if rests or len(kept) == 1 else kept[:-1])
