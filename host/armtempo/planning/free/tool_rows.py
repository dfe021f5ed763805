"""Inequalities of a motion program that keep the tool near given poses at points of the motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.planning.collocation import Points
from armtempo.planning.tool import Tool, ToolState
from armtempo.planning.variables import MotionVariables, angle_basis


@dataclass(frozen=True, eq=False)
class ToolTargets:
    """Target poses of the tool at P points, with tolerances."""

    points: Points
    position_mm: Array
    """(P, 3)."""
    rotation: Array
    """(P, 3, 3)."""
    tolerance_mm: Array
    tolerance_deg: Array
    """Largest rotation from the target: (P,); infinite if it is free."""

    def narrowed(self, part: float) -> ToolTargets:
        """With this part of the tolerances."""
        return replace(self, tolerance_mm=part * self.tolerance_mm, tolerance_deg=part * self.tolerance_deg)

    def __add__(self, other: ToolTargets) -> ToolTargets:
        """Both."""
        points = Points(
            np.concatenate([self.points.segment, other.points.segment]),
            np.concatenate([self.points.u, other.points.u]),
        )
        fields = ("position_mm", "rotation", "tolerance_mm", "tolerance_deg")
        joined = (np.concatenate([getattr(self, name), getattr(other, name)]) for name in fields)
        return ToolTargets(points, *joined)


class ToolRows:
    """1 - (distance / tolerance)^2 > 0 for the position, and the like for the cosine of the angle, at each point.

    ``unit_deg``: (J,), degrees per unit of each joint's variables.
    """

    linear = False

    def __init__(self, variables: MotionVariables, tool: Tool, targets: ToolTargets, unit_deg: Array) -> None:
        self._size, self._tool, self._targets, self._unit = variables.size, tool, targets, unit_deg
        count = variables.degree + 1
        window = targets.points.segment[:, None] + np.arange(count)
        self._columns = np.stack(
            [variables.angle_index(joint)[window] for joint in range(variables.joints)], axis=1
        )
        self._basis = angle_basis(variables.degree, targets.points.u, (0,))[:, 0]
        flat = self._columns.reshape(len(window), -1)
        self.rows = np.repeat(flat, flat.shape[1], axis=1).ravel()
        self.columns = np.tile(flat, (1, flat.shape[1])).ravel()
        self._near = np.flatnonzero(np.isfinite(targets.tolerance_mm))
        self._turned = np.flatnonzero(np.isfinite(targets.tolerance_deg))
        self.count = len(self._near) + len(self._turned)
        self._span = 1.0 - np.cos(np.radians(targets.tolerance_deg[self._turned]))

    def values(self, x: Array) -> Array:
        """First those of the position, then those of the orientation."""
        state, targets = self._state(x), self._targets
        away = (state.position_mm - targets.position_mm)[self._near] / targets.tolerance_mm[self._near, None]
        cosine = 0.5 * (np.einsum("pij,pij->p", state.rotation, targets.rotation) - 1.0)
        return np.concatenate(
            [1.0 - np.sum(away**2, axis=1), 1.0 - (1.0 - cosine[self._turned]) / self._span]
        )

    def linearise(self, x: Array) -> LinearisedTool:
        """Their derivatives at x."""
        state, targets = self._state(x), self._targets
        near, turned = self._near, self._turned
        tolerance = targets.tolerance_mm[near, None]
        away = (state.position_mm - targets.position_mm)[near] / tolerance
        slope = state.slope_mm_deg[near] * self._unit / tolerance[:, None]
        both = np.einsum("pij,pkj->pik", state.rotation, targets.rotation)[turned]
        twist = np.stack(
            [both[:, 1, 2] - both[:, 2, 1], both[:, 2, 0] - both[:, 0, 2], both[:, 0, 1] - both[:, 1, 0]]
        )
        axes = state.axes_deg[turned] * self._unit
        by_turn = 0.5 * np.einsum("ip,pij->pj", twist, axes) / self._span[:, None]
        gradient = np.concatenate([-2.0 * np.einsum("pi,pij->pj", away, slope), by_turn])
        curvature = np.concatenate(
            [
                2.0 * np.einsum("pij,pik->pjk", slope, slope),
                np.einsum("pij,pik->pjk", axes, axes) / self._span[:, None, None],
            ]
        )
        return LinearisedTool(self, gradient, curvature)

    def _state(self, x: Array) -> ToolState:
        return self._tool.at(np.einsum("pc,pjc->pj", self._basis, x[self._columns]) * self._unit)

    def spread(self, by_angle: Array) -> Array:
        """Gradient (n,) of the sum over the rows with these derivatives by the angles there, (R, J)."""
        own = np.concatenate([self._near, self._turned])
        values = by_angle[:, :, None] * self._basis[own, None]
        return np.asarray(
            np.bincount(self._columns[own].ravel(), values.ravel(), minlength=self._size), dtype=float
        )

    def change(self, step: Array, gradient: Array) -> Array:
        """Change of each row by a step (n,)."""
        own = np.concatenate([self._near, self._turned])
        angles = np.einsum("pc,pjc->pj", self._basis, step[self._columns])
        return np.asarray(np.sum(gradient * angles[own], axis=1))

    def assemble(self, by_angles: Array) -> Array:
        """Entries at ``rows`` and ``columns`` from matrices by the angles of each row, (R, J, J)."""
        own = np.concatenate([self._near, self._turned])
        sums = np.zeros((len(self._basis), *by_angles.shape[1:]))
        np.add.at(sums, own, by_angles)
        return np.asarray(np.einsum("pjk,pc,pd->pjckd", sums, self._basis, self._basis).ravel())


class LinearisedTool:
    """Derivatives of the rows at one point; see ``optimise.interior_point.Linearised``."""

    def __init__(self, rows: ToolRows, gradient: Array, curvature: Array) -> None:
        self._rows, self._gradient, self._curvature = rows, gradient, curvature

    def forward(self, step: Array) -> Array:
        return self._rows.change(step, self._gradient)

    def backward(self, weights: Array) -> Array:
        return self._rows.spread(weights[:, None] * self._gradient)

    def hessian(self, weights: Array, multipliers: Array, _: bool) -> Array:
        """See there; the distance's own curvature is never negative and always counted."""
        outer = self._gradient[:, :, None] * self._gradient[:, None, :] * weights[:, None, None]
        return self._rows.assemble(outer + multipliers[:, None, None] * self._curvature)
