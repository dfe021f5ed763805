"""A numerical inverse for arms outside the closed form's class: one solution, searched from a posture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from armtempo.kinematics.forward import frames
from armtempo.kinematics.geometry import Array, Geometry
from armtempo.kinematics.ranges import Ranges

ACCURACY = 1e-9
"""Error of a solution that counts as found: position relative to the reach, and orientation in rad."""

STARTS = 20
"""Postures to start from, the previous one first, before the search gives up."""

EVALUATIONS = 60
"""Steps from one start."""


@dataclass(frozen=True)
class NumericalSolution:
    """The best posture found."""

    angles_rad: Array
    """(joints,): within the ranges."""
    found: bool
    position_error: float
    """Distance from the pose, in the geometry's unit."""
    rotation_error_rad: float
    starts: int
    """Postures started from."""

    @property
    def reason(self) -> str:
        """Why there is no solution; empty if there is one."""
        if self.found:
            return ""
        return (
            f"no posture found from {self.starts} starts; the nearest one misses the pose by "
            f"{self.position_error:.4g} in position and by {np.degrees(self.rotation_error_rad):.4g} deg"
        )


def solve(
    geometry: Geometry, pose: ArrayLike, ranges: Ranges, previous_rad: ArrayLike, seed: int = 0
) -> NumericalSolution:
    """Search joint angles that reach ``pose``, shape (4, 4), within ``ranges``, starting at ``previous_rad``.

    Any number of revolute joints. Bounded least squares (scipy's trust region method) with the exact
    Jacobian; if the previous posture leads nowhere, random ones drawn from ``seed`` follow.
    """
    target = np.asarray(pose, dtype=np.float64)
    rng = np.random.default_rng(seed)
    start = np.clip(np.asarray(previous_rad, dtype=np.float64), ranges.low, ranges.high)
    best: NumericalSolution | None = None
    for attempt in range(1, STARTS + 1):
        fit = least_squares(
            lambda q: _miss(geometry, target, q),
            start,
            jac=lambda q: _jacobian(geometry, q),
            bounds=(ranges.low, ranges.high),
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=EVALUATIONS,
        )
        result = _judged(geometry, target, fit.x, attempt)
        if result.found:
            return result
        if best is None or _error(geometry, result) < _error(geometry, best):
            best = result
        start = rng.uniform(ranges.low, ranges.high)
    assert best is not None
    return NumericalSolution(best.angles_rad, False, best.position_error, best.rotation_error_rad, STARTS)


def _unit(geometry: Geometry) -> float:
    """Length that errors of position are measured by: the reach, or 1 for an arm that has none."""
    return geometry.reach or 1.0


def _miss(geometry: Geometry, target: Array, angles: Array) -> Array:
    """Differences of the axes n, o, a and of the position in units of the reach: (12,)."""
    *_, tool = frames(geometry, angles)
    position = (tool.origin - target[:3, 3]) / _unit(geometry)
    return np.concatenate((tool.x - target[:3, 0], tool.y - target[:3, 1], tool.z - target[:3, 2], position))


def _jacobian(geometry: Geometry, angles: Array) -> Array:
    """Derivative of ``_miss`` by the angles, (12, joints): a joint turns all that follows about its axis."""
    *before, tool = frames(geometry, angles)
    columns = [
        np.concatenate(
            (
                np.cross(frame.z, tool.x),
                np.cross(frame.z, tool.y),
                np.cross(frame.z, tool.z),
                np.cross(frame.z, tool.origin - frame.origin) / _unit(geometry),
            )
        )
        for frame in before
    ]
    # With parallel linkages the rows turn by differences of the angles, which come in linearly.
    return np.column_stack(columns) @ geometry.turns(np.eye(geometry.joints)).T


def _judged(geometry: Geometry, target: Array, angles: Array, starts: int) -> NumericalSolution:
    miss = _miss(geometry, target, angles)
    position = float(np.linalg.norm(miss[9:])) * _unit(geometry)
    # The chord of all three axes: 2 sqrt(2) sin(angle / 2).
    chord = float(np.linalg.norm(miss[:9]))
    rotation = 2.0 * float(np.arcsin(min(chord / np.sqrt(8.0), 1.0)))
    found = position <= ACCURACY * _unit(geometry) and rotation <= ACCURACY
    return NumericalSolution(angles, found, position, rotation, starts)


def _error(geometry: Geometry, solution: NumericalSolution) -> float:
    return solution.position_error / _unit(geometry) + solution.rotation_error_rad
