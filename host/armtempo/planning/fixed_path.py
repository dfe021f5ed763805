"""The optimal time axis of a fixed path, with a given number of segments per path segment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.model.parts import Limits
from armtempo.optimise import interior_point
from armtempo.optimise.interior_point import Schedule
from armtempo.optimise.kkt import Equalities
from armtempo.planning import collocation
from armtempo.planning.collocation import Curve, Points
from armtempo.planning.motion_program import MotionProgram, time_weights
from armtempo.planning.path_rows import PathRows, Rows
from armtempo.planning.variables import MotionVariables, time_basis, time_points
from armtempo.splines import bspline, time_axis

_ROUNDS = 12
"""Largest number of solves, each with the peaks of the previous solution as new points."""
_PARTS, _LEAST_PARTS, _POINTS = 64, 4, 2000
"""Points per path segment, divided among its time segments; least points per time segment; largest total."""
_PEAK_THRESHOLD = 0.95
"""Peaks of at least this fraction of a limit become points."""
_PEAK_GRID_FACTOR = 4
"""Factor by which the grid for the search of peaks is finer."""
_AWAY = 1.003
"""Factor on time before each solve, for a start within the limits."""
_COARSE = Schedule(first_barrier=1e-2, last_barrier=1e-5)
_AGAIN = 3e-4
"""Initial barrier parameter of all solves after the first."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """A time axis within all limits, and a bound of the local optimum."""

    differences_s: Array
    """Differences of the time control points, (m + degree - 1,)."""
    total_s: float
    bound_s: float
    """Lower bound of the local optimum with the same variables; 0 if not known."""


@dataclass(frozen=True, eq=False)
class Along:
    """Further quantities with limits along a path: the way of the tool, or components of it.

    ``pieces``: power coefficients on each segment of the time axis, (V, m, degree + 1), only used for
    derivatives; ``limits``: of the first three time derivatives, (V, 3).
    """

    pieces: Array
    limits: Array


class FixedPath:
    """A path with limits, whose time axis has ``refine`` segments per path segment.

    ``angle_points_deg``: (n + degree, J); ``limits``: one per joint. With ``mirrored`` ends the axis is given
    by intervals (``time_axis.step_map``), else all differences of its control points are free. ``along``:
    further quantities with limits.
    """

    def __init__(
        self, angle_points_deg: Array, degree: int, limits: Sequence[Limits], refine: int = 1,
        mirrored: bool = False, along: Along | None = None,
    ) -> None:  # fmt: skip
        pieces = bspline.subdivide(bspline.polynomials(angle_points_deg, degree), refine)
        self.degree, self.refine = degree, refine
        self.variables = MotionVariables(len(pieces), degree, 0)
        self.angle = np.ascontiguousarray(np.moveaxis(pieces, 2, 0))
        self.limits = np.array([limit.values for limit in limits])
        if along is not None:
            self.angle = np.concatenate([self.angle, along.pieces])
            self.limits = np.concatenate([self.limits, along.limits])
        self._weights = time_weights(self.variables)
        self._equalities = _mirror(self.variables) if mirrored else Equalities.none()

    def curve(self, differences_s: Array) -> Curve:
        """The motion on this time axis."""
        times = bspline.polynomials(time_points(differences_s, self.degree), self.degree)
        return Curve(self.angle, times, self.limits)

    def of_intervals(self, intervals_s: Array) -> Array:
        """Differences (n + degree - 1,) of the mirrored axis with these intervals (n,)."""
        return np.asarray(intervals_s[time_axis.mirrored(len(intervals_s), (self.degree - 1) // 2)])

    def intervals(self, differences_s: Array) -> Array:
        """Intervals (n,) of a mirrored axis."""
        edge = (self.degree - 1) // 2
        return differences_s[edge : len(differences_s) - edge]

    def duration_s(self, differences_s: Array) -> float:
        """Its motion time."""
        return float(self._weights @ differences_s)

    def scaled(self, differences_s: Array) -> Array:
        """The axis scaled so that the motion just keeps every limit, proven."""
        return np.asarray(differences_s * self.curve(differences_s).scale())

    def optimum(self, differences_s: Array, gap: float) -> Optimum:
        """The local optimum from a start (m + degree - 1,), which is scaled first; never slower than that.

        Ends within a relative ``gap`` of the bound, or if further rounds do not help.
        """
        best = self.scaled(differences_s)
        parts = max(_LEAST_PARTS, min(_PARTS // self.refine, _POINTS // self.variables.segments))
        points = collocation.grid(self.variables.segments, parts, ends=self.degree == 3)
        settings, bound, here = _COARSE, 0.0, best
        seen: list[Array] = []
        for _ in range(_ROUNDS):
            if not np.all(np.isfinite(here) & (here > 0.0)):
                break
            seen.append(here)
            here, bound = self._solve(seen, points, settings)
            curve = self.curve(here)
            scale = curve.scale()
            if self.duration_s(here) * scale < self.duration_s(best):
                best = here * scale
            if bound and self.duration_s(best) <= bound * (1.0 + gap):
                break
            points += collocation.peaks(curve, _PEAK_GRID_FACTOR * parts, _PEAK_THRESHOLD).points
            here = here * scale
            settings = Schedule(_AGAIN, min(_AGAIN, 0.3 * gap))
        return Optimum(best, self.duration_s(best), min(bound, self.duration_s(best)))

    def _solve(self, seen: list[Array], points: Points, settings: Schedule) -> tuple[Array, float]:
        """The optimal axis within the limits at these points, and a lower bound of its motion time.

        Starts from the last axis in ``seen``; constraints are those that could be reached near any of them.
        """
        differences_s = seen[-1]
        unit_s = self.duration_s(differences_s) / self.variables.segments
        limits = self.limits * unit_s ** np.arange(1, 4)
        angle = np.stack([_at(self.angle, points, order) for order in (1, 2, 3)])
        basis, window = time_basis(self.degree, points.u), points.segment[:, None] + np.arange(self.degree)
        times = [(basis @ (one / unit_s)[window][:, :, None])[..., 0].T for one in seen]
        rows = PathRows(self.variables, points, Rows.reachable(angle, times, limits))
        program = MotionProgram(self.variables, [rows], self._equalities)
        found = interior_point.minimise(program, differences_s / unit_s * _AWAY, settings)
        here = found.x * unit_s
        bound = self.duration_s(here) * (1.0 - 2.0 * settings.last_barrier) if found.converged else 0.0
        return here, bound


def _at(angle: Array, points: Points, order: int) -> Array:
    """Derivatives of angles (J, S, k + 1) at points (P,): (P, J)."""
    derived = bspline.derivative(np.moveaxis(angle, 0, 2), order)
    powers = points.u[:, None] ** np.arange(derived.shape[1])
    return np.asarray(np.einsum("pc,pcj->pj", powers, derived[points.segment]))


def _mirror(variables: MotionVariables) -> Equalities:
    """Equalities of a mirrored axis: differences at both ends are equal in pairs."""
    edge = (variables.degree - 1) // 2
    mirrored = time_axis.mirrored(variables.segments, edge) + edge
    own = np.flatnonzero(mirrored != np.arange(len(mirrored)))
    row = np.arange(len(own))
    places = variables.places
    return Equalities(
        np.concatenate([row, row]),
        np.concatenate([own, mirrored[own]]),
        np.repeat([1.0, -1.0], len(own)),
        np.zeros(len(own)),
        0.5 * (places[own] + places[mirrored[own]]),
    )
