"""Proven lower bounds of the motion time, for comparison with a plan."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.progress import stage
from armtempo.model.parts import Limits
from armtempo.planning import dual_bound, dual_value, rest_to_rest, via_bound
from armtempo.planning.dual_bound import Cells
from armtempo.splines import bspline

_WIGGLE = 1e-9
"""Reversals smaller than this fraction of the joint's way are rounding."""
_ROUNDED = 1.0 - 1e-9
"""Factor on the bounds, for the rounding of angles and sums."""
_MOST_CELLS, _LEAST_CELLS = 16, 4
"""Cells per segment of the path, most and least."""
_WORK = 10_000
"""Bound of segments times the square of the number of joints; above it, fewer cells are used."""


@dataclass(frozen=True)
class LowerBound:
    """A proven lower bound of a motion time under speed, acceleration and jerk limits.

    ``kind``: ``"rests"``: of one joint between its reversals; ``"path"``: along the common path; through the via
    points, for any path, ``"vias"``: of one joint, ``"together"``: of all of them.
    """

    time_s: float
    kind: str


def of_path(angle_points_deg: Array, degree: int, limits: Sequence[Limits], about_s: float) -> LowerBound:
    """The highest lower bound for joints that move together on a path; ``about_s``: approximate motion time.

    ``angle_points_deg``: (n + degree, J). Bounds: each joint between its reversals, where it stands still; for
    several joints, also the dual bound of all time laws along the path.
    """
    found = []
    # Exact for a short way, for which it is the larger bound
    angle_points_deg = angle_points_deg - angle_points_deg[0]
    for joint, limit in enumerate(limits):
        reached = turns(angle_points_deg[:, joint], degree)
        found.append(
            LowerBound(_ROUNDED * rest_to_rest.lower_bound_s(reached, limit, from_rest=degree == 5), "rests")
        )
    if len(limits) > 1:
        found.append(LowerBound(_path_s(angle_points_deg, degree, limits, about_s), "path"))
    return max(found, key=lambda bound: bound.time_s)


def _path_s(angle_points_deg: Array, degree: int, limits: Sequence[Limits], about_s: float) -> float:
    """The dual bound, on more cells if few prove nothing; 0 if that does not help."""
    stage("proving the lower bound")
    segments = len(angle_points_deg) - degree
    parts = min(max(_WORK // (segments * len(limits) ** 2), _LEAST_CELLS), _MOST_CELLS)
    found = _by_cells(angle_points_deg, degree, limits, about_s, parts)
    while found <= 0.0 and parts < _MOST_CELLS:
        parts *= 2
        found = _by_cells(angle_points_deg, degree, limits, about_s, parts)
    return found


def _by_cells(points_deg: Array, degree: int, limits: Sequence[Limits], about_s: float, parts: int) -> float:
    """The dual bound with ``parts`` cells per segment of the path."""
    pieces = bspline.subdivide(bspline.polynomials(points_deg, degree), parts)
    cell_s = about_s / len(pieces)
    values = np.array([limit.values for limit in limits]) * cell_s ** np.arange(1, 4)
    cells = Cells(pieces, values, degree == 5)
    return dual_value.value(cells, dual_bound.best_multipliers(cells)) * cell_s


def turns(angle_points_deg: Array, degree: int) -> Array:
    """Start, turning points and end of one joint's path, in order; ``angle_points_deg``: (n + degree,)."""
    pieces = bspline.polynomials(angle_points_deg, degree)
    angles = np.concatenate([_stationary(piece) for piece in pieces] + [[pieces[-1].sum()]])
    wiggle = _WIGGLE * float(np.ptp(angles))
    return np.array(_turning(angles, wiggle))


def _stationary(piece: Array) -> Array:
    """Angles at the start of a segment and at zeros of its slope, in order of u."""
    slope = (piece[1:] * np.arange(1, len(piece)))[::-1]
    roots = np.roots(slope) if np.any(slope) else np.empty(0)
    u = np.sort(roots.real[(np.abs(roots.imag) < 1e-7) & (roots.real > 0) & (roots.real < 1)])
    return np.polyval(piece[::-1], np.concatenate([[0.0], u]))


def of_vias(
    via_deg: Array,
    limits: Sequence[Limits],
    stops: Mapping[int, float],
    loose: Collection[int] = (),
    times_s: Array | None = None,
) -> LowerBound:
    """A lower bound for all motions through via angles (n + 1, J), on any path.

    The sum over legs between stops (dwells in seconds by via point) of the largest, over joints, of the
    least time through its turning via angles under its three limits: at a turning via angle the joint stands
    still there or beyond. With several joints and ``times_s`` (n + 1,), when a plan arrives at the via points, or
    what ``via_bound`` proves for the joints together, if that is more. ``loose`` via points, which may be passed at
    other angles, are ignored.
    """
    last = len(via_deg) - 1
    ends = [0, *sorted(set(stops) - set(loose)), last]
    total, kind = sum(stops.values()), "vias"
    values = np.array([limit.values for limit in limits])
    for first, end in pairwise(ends):
        exact = [via for via in range(first, end + 1) if via not in loose]
        rests = end not in loose
        alone = max(
            rest_to_rest.lower_bound_s(_stood_at(via_deg[exact, joint], rests), limit, to_rest=rests)
            for joint, limit in enumerate(limits)
        )
        together = 0.0
        if times_s is not None and len(limits) > 1 and len(exact) > 1:
            stage("proving the lower bound")
            lasts_s = np.diff(times_s[exact]) - [
                sum(dwell for via, dwell in stops.items() if here <= via < there)
                for here, there in pairwise(exact)
            ]
            together = via_bound.lower_bound_s(via_deg[exact], values, lasts_s, rests)
        kind = "together" if together > alone else kind
        total += _ROUNDED * max(alone, together)
    return LowerBound(total, kind)


def _turning(angles: Array, wiggle: float = 0.0) -> list[float]:
    """The first and last angle, and those at which the direction changes by more than ``wiggle``."""
    kept = [float(angles[0])]
    for angle in angles[1:]:
        if abs(angle - kept[-1]) <= wiggle:
            continue
        if len(kept) > 1 and (angle - kept[-1]) * (kept[-1] - kept[-2]) > 0:
            kept[-1] = float(angle)
        else:
            kept.append(float(angle))
    return kept


def _stood_at(angles: Array, rests: bool) -> Array:
    """As ``_turning``, without the last if the joint does not rest there."""
    kept = _turning(angles)
    return np.array(kept if rests or len(kept) == 1 else kept[:-1])
