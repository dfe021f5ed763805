"""The motion time as a smooth program of control points: objective, inequalities, equalities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.optimise.interior_point import Kkt, Linearised
from armtempo.optimise.kkt import BandedKkt, Equalities
from armtempo.optimise.reduced_kkt import ReducedKkt
from armtempo.planning.linear_rows import LinearRows
from armtempo.planning.variables import Index, MotionVariables, time_basis


class LinearisedBlock(Protocol):
    """Derivatives of some of the inequalities; see ``optimise.interior_point.Linearised``."""

    def forward(self, step: Array) -> Array: ...

    def backward(self, weights: Array) -> Array: ...

    def hessian(self, weights: Array, multipliers: Array, exact: bool) -> Array: ...


class Block(Protocol):
    """Some of the inequalities; ``rows`` and ``columns`` are the positions of their entries in the matrix."""

    rows: Index
    columns: Index
    count: int
    linear: bool
    """Whether all of them are linear."""

    def values(self, x: Array) -> Array: ...

    def linearise(self, x: Array) -> LinearisedBlock: ...


class MotionProgram:
    """Objective: motion time per segment plus weighted squared steps between neighbouring time differences.

    Different control points of angle and time can give the same motion; the ``smoothing`` weight of each
    step, (S + k - 2,), selects one. ``blocks``: the inequalities, in addition to time differences above
    ``least``. ``kkt``: of another program whose blocks and equalities have their entries at the same positions.
    """

    def __init__(
        self,
        variables: MotionVariables,
        blocks: Sequence[Block],
        equalities: Equalities,
        smoothing: Array | None = None,
        least: float = 0.0,
        kkt: Kkt | None = None,
    ) -> None:
        self.variables, self.equalities = variables, equalities
        index = variables.difference_index
        above = np.full(len(index), least)
        positive = LinearRows(
            variables.size, index[:, None], np.ones((len(index), 1)), above, np.full(len(index), np.inf)
        )
        self.blocks: list[Block] = [*blocks, positive]
        self._smoothing = np.zeros(len(index) - 1) if smoothing is None else smoothing
        self._time = np.zeros(variables.size)
        self._time[index] = time_weights(variables) / variables.segments
        self.kkt = self._kkt() if kkt is None else kkt

    def _kkt(self) -> Kkt:
        """Newton's equations. Without second derivatives, which only fixed paths use, the Hessian is definite."""
        index = self.variables.difference_index
        left, right = index[:-1], index[1:]
        rows = [left, right, left, right, *(block.rows for block in self.blocks)]
        columns = [left, right, right, left, *(block.columns for block in self.blocks)]
        solver = ReducedKkt if self.variables.joints else BandedKkt
        return solver(self.variables.places, np.concatenate(rows), np.concatenate(columns), self.equalities)

    @property
    def linear(self) -> NDArray[np.bool_]:
        """Whether each inequality is linear."""
        return np.concatenate([np.full(block.count, block.linear) for block in self.blocks])

    def duration(self, x: Array) -> float:
        """Motion time per segment, in the program's unit."""
        return float(self._time @ x)

    def objective(self, x: Array) -> float:
        """See ``optimise.interior_point.Program``."""
        steps = np.diff(self.variables.time_differences(x))
        return self.duration(x) + float(self._smoothing @ steps**2)

    def inequalities(self, x: Array) -> Array:
        return np.concatenate([block.values(x) for block in self.blocks])

    def linearise(self, x: Array) -> Linearised:
        return _Linearised(self, x)


class _Linearised:
    def __init__(self, program: MotionProgram, x: Array) -> None:
        self._smoothing = program._smoothing
        self._blocks = [block.linearise(x) for block in program.blocks]
        self._splits = np.cumsum([block.count for block in program.blocks])[:-1]
        steps = 2.0 * self._smoothing * np.diff(program.variables.time_differences(x))
        self.gradient = program._time.copy()
        index = program.variables.difference_index
        self.gradient[index[1:]] += steps
        self.gradient[index[:-1]] -= steps

    def forward(self, step: Array) -> Array:
        return np.concatenate([block.forward(step) for block in self._blocks])

    def backward(self, weights: Array) -> Array:
        parts = np.split(weights, self._splits)
        return np.asarray(sum(block.backward(part) for block, part in zip(self._blocks, parts, strict=True)))

    def hessian(self, weights: Array, multipliers: Array, exact: bool) -> Array:
        smooth = 2.0 * self._smoothing
        entries = [smooth, smooth, -smooth, -smooth]
        parts, others = np.split(weights, self._splits), np.split(multipliers, self._splits)
        for block, part, other in zip(self._blocks, parts, others, strict=True):
            entries.append(block.hessian(part, other, exact))
        return np.concatenate(entries)


def mean_slopes(degree: int) -> Array:
    """Weights of a segment's k differences in the time that it takes: (k,)."""
    nodes, weights = np.polynomial.legendre.leggauss(degree)
    return np.asarray((weights / 2) @ time_basis(degree, (nodes + 1) / 2)[:, 0])


def time_weights(variables: MotionVariables) -> Array:
    """Weights of the differences in the motion time: (S + k - 1,)."""
    return np.convolve(np.ones(variables.segments), mean_slopes(variables.degree))
