"""From one posture to the nearest one that meets a target: damped least squares (Levenberg and Marquardt), in floats.

For single poses: a step of six joints takes about 40 us, with numpy 300 us.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics.constraint import Constraint, Turned, Vector, cross, dot
from armtempo.kinematics.forward import Frame, frames
from armtempo.kinematics.geometry import Geometry
from armtempo.model.joint_unit import SLIDE_MM

STEPS = 80
"""Largest number of steps from one start, including rejected ones."""

STILL_RAD = 1e-11
"""A step this small ends the descent: the next one, quadratically smaller, would be rounding."""

ENOUGH = 1e-20
"""Cost that ends the descent: errors of 1e-10 of the tolerances."""

FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-4, 1e-10, 1e8
"""Damping in units of the largest second derivative: initial, least, and largest."""

LONGEST_STEP_RAD = 1.0
"""Largest step; beyond it the linear model is not valid."""

Matrix = list[list[float]]
Bounds = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class PoseProblem:
    """An arm, its moving joints, and the target."""

    geometry: Geometry
    constraint: Constraint
    moving: tuple[int, ...]
    """Indices of the joints that move."""
    bounds: Bounds | None = None
    """Least and greatest angle of each of ``moving``, in rad; None: any angle."""

    @cached_property
    def weights(self) -> tuple[float, float]:
        """Weights of the squared errors of position and orientation."""
        by_length, by_turn = self.constraint.weights(self.geometry.reach or 1.0)
        return by_length * by_length, by_turn * by_turn


class Posture(NamedTuple):
    """Angles, the frames of the arm, and the cost."""

    angles_rad: list[float]
    """(joints,)"""
    frames: list[Frame[float]]
    turned: Turned
    cost: float
    """Sum of the squared errors of position and orientation, each in units of its tolerance."""


def descend(problem: PoseProblem, start_rad: Sequence[float]) -> Posture:
    """Descend from ``start_rad``, (joints,), to a local minimum of the cost."""
    at = _posture(problem, _clipped(problem, list(start_rad)))
    damping = FIRST_DAMPING
    system = _system(problem, at)
    for _ in range(STEPS):
        if at.cost < ENOUGH:
            break
        step = _solve(*system, damping)
        trial = _posture(problem, _moved(problem, at.angles_rad, step)) if step else at
        if trial.cost < at.cost:
            at, damping = trial, max(damping * 0.1, LEAST_DAMPING)
            system = _system(problem, at)
        elif damping >= MOST_DAMPING:
            break
        else:
            damping *= 10.0
        if step and max(map(abs, step)) < STILL_RAD:
            break
    return at


def most_swing(problem: PoseProblem, angles_rad: Sequence[float], cost: float) -> Array:
    """Largest change of each turning joint within ``cost``, to first order, at a posture that meets a whole pose.

    (6,), in rad; inf at a singular posture.
    """
    by_length, by_turn = problem.weights
    axes, levers = _columns(problem, frames(problem.geometry, angles_rad))
    core = problem.geometry.core
    slopes = np.concatenate([levers[core], axes[core]], axis=1)
    slopes[:, :3] *= math.sqrt(by_length)
    slopes[:, 3:] *= math.sqrt(2.0 * by_turn)
    try:
        return np.asarray(np.sqrt(cost * np.square(np.linalg.inv(slopes)).sum(axis=0)))
    except np.linalg.LinAlgError:
        return np.full(6, np.inf)


def _columns(problem: PoseProblem, found: list[Frame[float]]) -> tuple[list[Vector], list[Vector]]:
    """Turn of the tool and velocity of its point per rad/s of each moving joint; a sliding one does not turn it."""
    tool, linked = found[-1].origin, problem.geometry.linked
    axes = [found[joint].z for joint in problem.moving]
    levers = [_swept(found[joint], tool) for joint in problem.moving]
    for i, joint in enumerate(problem.moving if linked else ()):
        if joint + 1 in linked:  # the next row turns back by the same angle
            behind = found[joint + 1]
            axes[i] = _from(behind.z, axes[i])
            levers[i] = _from(_swept(behind, tool), levers[i])
    for row, _ in problem.geometry.slides:
        if row in problem.moving:
            i = problem.moving.index(row)
            x, y, z = found[row].z
            axes[i], levers[i] = (0.0, 0.0, 0.0), (SLIDE_MM * x, SLIDE_MM * y, SLIDE_MM * z)
    return axes, levers


def _posture(problem: PoseProblem, angles: list[float]) -> Posture:
    found = frames(problem.geometry, angles)
    tool = found[-1]
    turned = problem.constraint.turned(tool)
    by_length, by_turn = problem.weights
    off = _from(problem.constraint.position, tool.origin)
    cost = by_length * dot(off, off) + by_turn * turned.square
    return Posture(angles, found, turned, cost)


def _system(problem: PoseProblem, at: Posture) -> tuple[Matrix, list[float]]:
    """Half of the cost's second derivatives (by Gauss and Newton) and of its gradient, for the moving joints."""
    by_length, by_turn = problem.weights
    off = _from(problem.constraint.position, at.frames[-1].origin)
    _, torque, both, each, along = at.turned
    axes, levers = _columns(problem, at.frames)
    parts = [dot(axis, along) for axis in axes] if each else [0.0] * len(axes)
    gradient = [
        by_length * dot(lever, off) - by_turn * dot(axis, torque)
        for lever, axis in zip(levers, axes, strict=True)
    ]
    both, each = by_turn * both, by_turn * each
    matrix = [
        [
            by_length * dot(lever, levers[j]) + both * dot(axis, axes[j]) + each * part * parts[j]
            for j in range(i + 1)
        ]
        for i, (lever, axis, part) in enumerate(zip(levers, axes, parts, strict=True))
    ]
    if problem.bounds:
        _hold(problem, at.angles_rad, matrix, gradient)
    return matrix, gradient


def _hold(problem: PoseProblem, angles: list[float], matrix: Matrix, gradient: list[float]) -> None:
    """Remove joints that are pushed against an end of their range from the system (active set)."""
    for i, (joint, (low, high)) in enumerate(zip(problem.moving, problem.bounds or (), strict=True)):
        if (angles[joint] <= low and gradient[i] > 0.0) or (angles[joint] >= high and gradient[i] < 0.0):
            gradient[i] = 0.0
            for j in range(len(gradient)):
                matrix[max(i, j)][min(i, j)] = float(i == j)


def _solve(matrix: Matrix, gradient: list[float], damping: float) -> list[float] | None:
    """The descent step by Cholesky factorisation of the damped lower triangle ``matrix``; None if it is not
    definite."""
    damp = damping * max(row[-1] for row in matrix)
    factors: Matrix = []
    forth: list[float] = []
    for i, row in enumerate(matrix):
        factor: list[float] = []
        for j, above in enumerate(factors):
            rest = row[j]
            for k in range(j):
                rest -= factor[k] * above[k]
            factor.append(rest / above[j])
        pivot = row[i] + damp - sum([value * value for value in factor])
        if not pivot > 0.0:
            return None
        factor.append(math.sqrt(pivot))
        rest = -gradient[i]
        for k in range(i):
            rest -= factor[k] * forth[k]
        forth.append(rest / factor[i])
        factors.append(factor)
    for i in range(len(forth) - 1, -1, -1):
        rest = forth[i]
        for k in range(i + 1, len(forth)):
            rest -= factors[k][i] * forth[k]
        forth[i] = rest / factors[i][i]
    return forth


def _moved(problem: PoseProblem, angles: list[float], step: list[float]) -> list[float]:
    scale = LONGEST_STEP_RAD / max(LONGEST_STEP_RAD, *map(abs, step))
    moved = angles.copy()
    for joint, change in zip(problem.moving, step, strict=True):
        moved[joint] += scale * change
    return _clipped(problem, moved)


def _clipped(problem: PoseProblem, angles: list[float]) -> list[float]:
    for joint, (low, high) in zip(problem.moving, problem.bounds or (), strict=False):
        angles[joint] = min(max(angles[joint], low), high)
    return angles


def _from(start: Vector, end: Vector) -> Vector:
    return end[0] - start[0], end[1] - start[1], end[2] - start[2]


def _swept(frame: Frame[float], point: Vector) -> Vector:
    """Velocity of a point per rad/s about the frame's z axis."""
    return cross(frame.z, _from(frame.origin, point))
