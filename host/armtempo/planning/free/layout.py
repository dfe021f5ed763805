"""The positions of the via points among the segments of a free path, and their equalities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import factorial

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.optimise.kkt import Equalities
from armtempo.planning.motion_program import mean_slopes
from armtempo.planning.variables import Index, MotionVariables
from armtempo.splines import bspline

DEGREE = 5
DWELL_SEGMENTS = DEGREE
"""Segments of a dwell: one difference of time control points acts only on these, and has its time."""
LEAST_PIECES = 3
"""Least number of segments between two via points; fewer leave no freedom."""


@dataclass(frozen=True, eq=False)
class Vias:
    """Conditions at the via points."""

    angles: Array
    """(n + 1, J), in the program's unit."""
    turning: NDArray[np.bool_]
    """Whether a joint stands still there: (n + 1, J)."""
    loose: frozenset[int] = frozenset()
    """Via points that have a tolerance instead of their angles."""

    def joint(self, number: int) -> Vias:
        """The conditions of one joint."""
        one = slice(number, number + 1)
        return Vias(self.angles[:, one], self.turning[:, one], self.loose)


@dataclass(frozen=True, eq=False)
class Layout:
    """Numbers of segments between the via points, (n,), and the rests.

    ``stops``: dwell in seconds by via point, 0 for a rest without a dwell.
    """

    pieces: Index
    stops: Mapping[int, float]

    @property
    def arrivals(self) -> Index:
        """Segments before each via point: (n + 1,)."""
        dwells = [DWELL_SEGMENTS if self.stops.get(via, 0.0) > 0.0 else 0 for via in range(len(self.pieces))]
        return np.concatenate([[0], np.cumsum(self.pieces + np.array(dwells, dtype=np.intp))])

    @property
    def segments(self) -> int:
        """Total number of segments."""
        return int(self.arrivals[-1])

    @property
    def dwells(self) -> dict[int, float]:
        """First segment of each dwell, and its time in seconds."""
        arrivals = self.arrivals
        return {int(arrivals[via]): dwell for via, dwell in self.stops.items() if dwell > 0.0}

    def departures(self) -> Index:
        """Segments before the motion leaves each via point: (n + 1,)."""
        later = np.array([self.stops.get(via, 0.0) > 0.0 for via in range(len(self.pieces) + 1)])
        return np.asarray(self.arrivals + DWELL_SEGMENTS * later)

    def equalities(self, variables: MotionVariables, vias: Vias, unit_s: float) -> Equalities:
        """Via points, rests, and dwells; ``unit_s``: the program's unit of time."""
        rows = _Rows()
        self._add_angles(rows, variables, vias)
        for knot, dwell in self.dwells.items():
            index = variables.difference_index[knot : knot + DWELL_SEGMENTS + DEGREE - 1]
            weights = np.convolve(np.ones(DWELL_SEGMENTS), mean_slopes(DEGREE))
            rows.add(index, weights, dwell / unit_s, float(variables.places[index].mean()))
        return rows.equalities()

    def angle_equalities(self, variables: MotionVariables, vias: Vias) -> Equalities:
        """The equalities of the angles."""
        rows = _Rows()
        self._add_angles(rows, variables, vias)
        return rows.equalities()

    def _add_angles(self, rows: _Rows, variables: MotionVariables, vias: Vias) -> None:
        last, dwells = len(self.pieces), self.dwells
        value, *rest = (_derivative(order) for order in range(3))
        controls = [variables.angle_index(joint) for joint in range(variables.joints)]
        for via, knot in enumerate(self.arrivals.tolist()):
            place = float(knot) + 0.5 * (DEGREE - 1)
            rests = via in (0, last) or via in self.stops
            for joint, control in enumerate(controls):
                angle = float(vias.angles[via, joint])
                if knot in dwells:
                    for point in range(knot, knot + DWELL_SEGMENTS + DEGREE):
                        rows.add(control[point : point + 1], np.ones(1), angle, float(point))
                    continue
                own = control[knot : knot + DEGREE]
                if via not in vias.loose:
                    rows.add(own, value, angle, place)
                for weights in rest if rests else rest[:1] if vias.turning[via, joint] else []:
                    rows.add(own, weights, 0.0, place)


def uniform(vias: int, pieces: int, stops: Mapping[int, float]) -> Layout:
    """``pieces`` segments between any two of ``vias`` via points, but at least DEGREE between two dwells."""
    least = least_pieces(vias, stops)
    return Layout(np.where(least == DEGREE, np.maximum(pieces, DEGREE), pieces), stops)


def shared_out(shares: Array, segments: int, stops: Mapping[int, float]) -> Layout:
    """About ``segments`` in total, in proportion to ``shares`` (n,), and at least ``least_pieces``."""
    dwells = DWELL_SEGMENTS * sum(dwell > 0.0 for dwell in stops.values())
    least = least_pieces(len(shares) + 1, stops)
    free = max(segments - dwells - int(least.sum()), 0)
    exact = np.concatenate([[0.0], np.cumsum(shares / shares.sum())]) * free
    knots = np.floor(exact + 0.5).astype(np.intp)
    return Layout(least + knots[1:] - knots[:-1], stops)


def least_pieces(vias: int, stops: Mapping[int, float]) -> Index:
    """Least numbers of segments between ``vias`` via points: (n,).

    A dwell fixes the control points of its first segment and of the segment after it. DEGREE segments between
    two dwells keep these separate.
    """
    dwells = np.array([stops.get(via, 0.0) > 0.0 for via in range(vias)])
    return np.where(dwells[:-1] & dwells[1:], DEGREE, LEAST_PIECES).astype(np.intp)


def _derivative(order: int) -> Array:
    """Weights of the control points in a derivative at the start of a segment: (DEGREE,)."""
    return np.asarray(bspline.basis(DEGREE)[order, :DEGREE] * factorial(order))


class _Rows:
    """Collects rows of equalities."""

    def __init__(self) -> None:
        self._columns: list[Index] = []
        self._values: list[Array] = []
        self._right: list[float] = []
        self._places: list[float] = []

    def add(self, columns: Index, values: Array, right: float, place: float) -> None:
        self._columns.append(columns)
        self._values.append(values)
        self._right.append(right)
        self._places.append(place)

    def equalities(self) -> Equalities:
        lengths = [len(columns) for columns in self._columns]
        return Equalities(
            np.repeat(np.arange(len(lengths)), lengths),
            np.concatenate(self._columns),
            np.concatenate(self._values),
            np.array(self._right),
            np.array(self._places),
        )
