"""Bounds on the angles of a free path that hold everywhere: on the Bernstein coefficients of every segment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.linear_rows import LinearRows
from armtempo.planning.variables import Index, MotionVariables
from armtempo.splines import bernstein, bspline


def coefficients(degree: int) -> Array:
    """Bernstein coefficients of a segment by its control points: (degree + 1, degree + 1)."""
    power = bspline.basis(degree)
    return np.asarray(bernstein.unscale(bernstein.from_power(power.T)).T)


def of_path(angle_points: Array, degree: int) -> Array:
    """Bernstein coefficients (S, degree + 1, J) of control points (S + degree, J)."""
    windows = np.lib.stride_tricks.sliding_window_view(angle_points, degree + 1, axis=0)
    return np.asarray(np.einsum("bc,sjc->sbj", coefficients(degree), windows))


@dataclass(frozen=True, eq=False)
class Forms:
    """Bernstein coefficients as weighted sums of variables, with their bounds; see ``LinearRows``."""

    columns: Index
    weights: Array
    low: Array
    high: Array

    def rows(self, variables: MotionVariables) -> LinearRows:
        """The inequalities."""
        return LinearRows(variables.size, self.columns, self.weights, self.low, self.high)


def forms(variables: MotionVariables, low: Array, high: Array) -> Forms:
    """All Bernstein coefficients, between ``low`` and ``high``, each (S, k + 1, J).

    A coefficient that two segments share is there twice; that of the second counts.
    """
    count = variables.degree + 1
    segment = np.arange(variables.segments)
    columns, weights, lows, highs = [], [], [], []
    for joint in range(variables.joints):
        control = variables.angle_index(joint)[segment[:, None] + np.arange(count)]
        for number, row in enumerate(coefficients(variables.degree)):
            own = slice(None) if number < count - 1 else slice(-1, None)
            columns.append(control[own])
            weights.append(np.broadcast_to(row, control[own].shape))
            lows.append(low[own, number, joint])
            highs.append(high[own, number, joint])
    return Forms(*(np.concatenate(parts) for parts in (columns, weights, lows, highs)))
