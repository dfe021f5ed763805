"""Inequalities of a motion program that keep speed, acceleration and jerk at points of u within limits."""

from __future__ import annotations

import numpy as np

from armtempo.arrays import Array
from armtempo.planning import limit_ratios
from armtempo.planning.collocation import Points
from armtempo.planning.variables import Index, MotionVariables, angle_basis, time_basis


class LimitRows:
    """1 - ratio > 0 and 1 + ratio > 0 for speed, acceleration and jerk of each joint at each point.

    ``points``: P of them, at least one in every segment; ``limits``: (J, 3); ``angle``: (3, P, J), derivatives of
    the angles at the points where the path is fixed, else None.
    """

    def __init__(
        self, variables: MotionVariables, points: Points, limits: Array, angle: Array | None
    ) -> None:
        segment, u = points.segment, points.u
        self.limits, self._segment, self._angle = limits, segment, angle
        self._starts = np.searchsorted(segment, np.arange(variables.segments))
        self._bases = angle_basis(variables.degree, u)
        self._time_bases = time_basis(variables.degree, u)
        window = np.arange(variables.segments)[:, None]
        self._times = variables.difference_index[window + np.arange(variables.degree)]
        control = window + np.arange(variables.degree + 1)
        none = np.empty((variables.segments, 0, variables.degree + 1), dtype=np.intp)
        joints = [variables.angle_index(joint)[control] for joint in range(variables.joints)]
        self._angles = np.stack(joints, axis=1) if joints else none
        self.rows, self.columns = self._pattern()
        self.size = variables.size

    def _pattern(self) -> tuple[Index, Index]:
        """Positions of the entries of ``_Linearised.hessian``."""
        pairs = [(self._times, self._times)]
        for joint in range(self._angles.shape[1]):
            own = self._angles[:, joint]
            pairs.extend([(own, own), (own, self._times), (self._times, own)])
        rows, columns = [], []
        for left, right in pairs:
            full = (len(left), left.shape[1], right.shape[1])
            rows.append(np.broadcast_to(left[:, :, None], full).ravel())
            columns.append(np.broadcast_to(right[:, None, :], full).ravel())
        return np.concatenate(rows), np.concatenate(columns)

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        """q', q'', q''' (3, P, J) and t', t'', t''' (3, P) at the points."""
        time = np.einsum("pok,pk->op", self._time_bases, x[self._times][self._segment])
        if self._angle is not None:
            return self._angle, time
        return np.einsum("poc,pjc->opj", self._bases, x[self._angles][self._segment]), time

    def values(self, x: Array) -> Array:
        """All 1 - ratio, then all 1 + ratio: (2 * 3 * P * J,)."""
        ratios = limit_ratios.ratios(*self.derivatives(x), self.limits)
        return np.concatenate([(1.0 - ratios).ravel(), (1.0 + ratios).ravel()])

    def assemble(self, local: Array) -> Array:
        """Entries of the matrix from those by the six derivatives at each point, (6, 6, P, J)."""
        bases = self._time_bases
        by_time = np.einsum("pak,abp,pbl->pkl", bases, local[3:, 3:].sum(axis=3), bases, optimize=True)
        entries = [np.add.reduceat(by_time, self._starts).ravel()]
        if self._angle is None:
            half = np.einsum("pac,abpj->jpcb", self._bases, local[:3], optimize=True)
            own = np.add.reduceat(half[..., :3] @ self._bases, self._starts, axis=1)
            mixed = np.add.reduceat(half[..., 3:] @ bases, self._starts, axis=1)
            for joint in range(local.shape[3]):
                entries.extend([own[joint].ravel(), mixed[joint].ravel()])
                entries.append(mixed[joint].swapaxes(1, 2).ravel())
        return np.concatenate(entries)

    def linearise(self, x: Array) -> LinearisedLimits:
        """Their derivatives at x."""
        return LinearisedLimits(self, *self.derivatives(x))


class LinearisedLimits:
    """Derivatives of the rows at one point; see ``optimise.interior_point.Linearised``."""

    def __init__(self, rows: LimitRows, angle: Array, time: Array) -> None:
        self._rows, self._angle, self._time = rows, angle, time
        self._gradient = limit_ratios.gradient(angle, time, rows.limits)

    def forward(self, step: Array) -> Array:
        """See there."""
        rows = self._rows
        time = np.einsum("pok,pk->op", rows._time_bases, step[rows._times][rows._segment])
        change = np.einsum("kopj,op->kpj", self._gradient[:, 3:], time)
        if rows._angle is None:
            angle = np.einsum("poc,pjc->opj", rows._bases, step[rows._angles][rows._segment])
            change += np.einsum("kopj,opj->kpj", self._gradient[:, :3], angle)
        return np.concatenate([-change.ravel(), change.ravel()])

    def backward(self, weights: Array) -> Array:
        """See there."""
        rows = self._rows
        upper, lower = weights.reshape(2, 3, *self._angle.shape[1:])
        local = np.einsum("kopj,kpj->opj", self._gradient, lower - upper)
        by_time = np.einsum("pok,op->pk", rows._time_bases, local[3:].sum(axis=2))
        result = np.bincount(
            rows._times.ravel(), np.add.reduceat(by_time, rows._starts).ravel(), minlength=rows.size
        )
        if rows._angle is None:
            by_angle = np.einsum("poc,opj->pjc", rows._bases, local[:3])
            sums = np.add.reduceat(by_angle, rows._starts)
            result += np.bincount(rows._angles.ravel(), sums.ravel(), minlength=rows.size)
        return np.asarray(result)

    def hessian(self, weights: Array, multipliers: Array, exact: bool) -> Array:
        """See there; the entries stand at ``LimitRows.rows`` and ``columns``."""
        rows = self._rows
        shape = (2, 3, *self._angle.shape[1:])
        both = weights.reshape(shape).sum(axis=0)
        local = np.einsum("kapj,kbpj->abpj", self._gradient * both[:, None], self._gradient, optimize=True)
        if exact:
            upper, lower = multipliers.reshape(shape)
            local += limit_ratios.curvature(self._angle, self._time, rows.limits, upper - lower)
        return rows.assemble(local)
