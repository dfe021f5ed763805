"""Limits of the tool's speed and acceleration along a path: for the optimisation of a time axis, and proven bounds."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.progress import alive
from armtempo.planning.fixed_path import Along
from armtempo.planning.line.deviation import halved
from armtempo.planning.tool import Tool
from armtempo.splines import bspline

_DIRECTIONS = 8
"""Number of directions in the plane of motion in which the acceleration is limited; between two of them it
may be 2 % larger, so the limit is reduced."""
_SHARP = 2e-3
"""Relative sharpness of a bound."""
_MOST_PIECES = 100_000


@dataclass(frozen=True, eq=False)
class ToolLimits:
    """Limits on each segment of a path, (S,); infinite without a limit."""

    speed_mm_s: Array
    acceleration_mm_s2: Array

    @property
    def any(self) -> bool:
        """Whether there is a limit."""
        return bool(np.any(np.isfinite(self.speed_mm_s)) or np.any(np.isfinite(self.acceleration_mm_s2)))

    def refined(self, parts: int) -> ToolLimits:
        """The limits with each segment cut into ``parts``."""
        return ToolLimits(np.repeat(self.speed_mm_s, parts), np.repeat(self.acceleration_mm_s2, parts))


def along(pieces_deg: Array, tool: Tool, limits: ToolLimits) -> Along:
    """The tool's path on each segment, for the time axis; ``pieces_deg``: power coefficients (S, 6, J).

    Polynomials are interpolated at six places of a segment: accurate enough for the search; the result is
    proven by ``excess``.
    """
    degree = pieces_deg.shape[1] - 1
    u = 0.5 - 0.5 * np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    powers = u[:, None] ** np.arange(degree + 1)
    angles = np.einsum("up,spj->suj", powers, pieces_deg)
    rates = np.einsum("up,spj->suj", powers[:, :-1], bspline.derivative(pieces_deg))
    state = tool.at(angles.reshape(-1, angles.shape[2]))
    moved = np.einsum("nij,nj->ni", state.slope_mm_deg, rates.reshape(-1, angles.shape[2]))
    moved = moved.reshape(*angles.shape[:2], 3)
    fitted = np.linalg.pinv(powers)
    positions = np.einsum("pu,sui->spi", fitted, state.position_mm.reshape(moved.shape))
    speed = np.einsum("pu,su->sp", np.linalg.pinv(powers[:, :-1]), np.linalg.norm(moved, axis=2))
    way = np.concatenate([np.zeros((len(speed), 1)), speed / np.arange(1, degree + 1)], axis=1)
    scale = np.cos(np.pi / (2 * _DIRECTIONS))
    watched = [way / limits.speed_mm_s[:, None]]
    for direction in _plane_directions(positions):
        part = np.einsum("spi,si->sp", positions, direction)
        watched.append(part / (scale * limits.acceleration_mm_s2[:, None]))
    most = np.full((len(watched), 3), np.inf)
    most[0, 0], most[1:, 1] = 1.0, 1.0
    return Along(np.array(watched), most)


def _plane_directions(positions: Array) -> list[Array]:
    """Directions (S, 3) in the plane in which each segment bends; ``positions``: power coefficients (S, 6, 3)."""
    _, _, axes = np.linalg.svd(positions[:, 1:] * np.arange(1, positions.shape[1])[:, None])
    angles = np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS
    return [np.cos(angle) * axes[:, 0] + np.sin(angle) * axes[:, 1] for angle in angles]


def reached(angles_deg: Array, times_s: Array, tool: Tool) -> tuple[float, float]:
    """Bounds of the tool's speed (mm/s) and acceleration (mm/s^2) on pieces.

    ``angles_deg``: Bernstein coefficients (S, 6, J), ``times_s``: (S, 6). With ' = d/du, p the tool's position and
    n = p'' t' - p' t'', speed is |p'| / t' and acceleration |n| / t'^3; n' = p''' t' - p' t'''.
    """
    group = np.zeros(len(angles_deg), dtype=np.intp)
    speed, acceleration = _largest(angles_deg, times_s, tool, group, 1)
    return float(speed[0]), float(acceleration[0])


def excess(angles_deg: Array, times_s: Array, tool: Tool, limits: ToolLimits) -> float:
    """The factor (>= 1) on time with which the tool keeps its limits, proven. Arguments as in ``reached``."""
    kinds, group = np.unique(
        np.stack([limits.speed_mm_s, limits.acceleration_mm_s2], axis=1), axis=0, return_inverse=True
    )
    speed, acceleration = _largest(angles_deg, times_s, tool, group.reshape(-1), len(kinds))
    return float(np.max([1.0, *(speed / kinds[:, 0]), *np.sqrt(acceleration / kinds[:, 1])]))


def _largest(
    angles_deg: Array, times_s: Array, tool: Tool, group: np.ndarray, groups: int
) -> tuple[Array, Array]:
    """Bounds of speed and acceleration over the pieces of each group, (groups,): branch and bound by halves."""
    best, width = np.zeros((groups, 2)), 1.0
    pieces = _Pieces(_derived(angles_deg), _derived(times_s[:, :, None]))
    while True:
        alive()
        most, here = _bounds(pieces, width, tool)
        np.maximum.at(best, group, here)
        open_ = np.any(most > best[group] * (1.0 + _SHARP) + 1e-9, axis=1)
        if not open_.any() or 2 * np.count_nonzero(open_) > _MOST_PIECES:
            best = best * (1.0 + _SHARP) + 1e-9
            np.maximum.at(best, group, most)
            return best[:, 0], best[:, 1]
        pieces, group = pieces.halved(open_), np.repeat(group[open_], 2)
        width *= 0.5


class _Pieces(NamedTuple):
    """Bernstein coefficients of angles and time with their first three derivatives, each (N, .., J) or (N, .., 1).

    All are by the u of the whole segment, and halved each on its own: as differences of the coefficients of shorter
    and shorter pieces, derivatives would be lost in rounding.
    """

    angles: list[Array]
    times: list[Array]

    def halved(self, which: NDArray[np.bool_]) -> _Pieces:
        """Both halves of some pieces."""
        return _Pieces(*([halved(each[which]) for each in kind] for kind in self))


def _derived(pieces: Array) -> list[Array]:
    """Bernstein pieces (N, k + 1, J) and their first three derivatives."""
    found = [pieces]
    for _ in range(3):
        found.append((found[-1].shape[1] - 1) * np.diff(found[-1], axis=1))
    return found


def _bounds(pieces: _Pieces, width: float, tool: Tool) -> tuple[Array, Array]:
    """Bounds of speed and acceleration over pieces of a ``width``, and their values in the middle: each (N, 2)."""
    first, second = tool.moved(*map(_middle, pieces.angles[:3]))
    t1, t2 = map(_middle, pieces.times[1:3])
    bend = second * t1 - first * t2
    d1, d2, d3 = (np.radians(np.abs(each @ tool.turns.T).max(axis=1)) for each in pieces.angles[1:])
    outer = np.minimum(tool.reach_mm[:, None], tool.reach_mm[None, :])
    pairs = np.einsum("nk,kj,nj->n", d1, outer, d1)
    jump = d2 @ tool.reach_mm + pairs
    third = d3 @ tool.reach_mm + 3.0 * np.einsum("nk,kj,nj->n", d2, outer, d1) + d1.sum(axis=1) * pairs
    least, largest = pieces.times[1].min(axis=(1, 2)), pieces.times[1].max(axis=(1, 2))
    jerk = np.abs(pieces.times[3]).max(axis=(1, 2))
    here = np.linalg.norm(first, axis=1)
    fastest = here + 0.5 * width * jump
    most_bend = np.linalg.norm(bend, axis=1) + 0.5 * width * (third * largest + fastest * jerk)
    t1 = t1[:, 0]
    return (
        np.stack([fastest / least, most_bend / least**3], axis=1),
        np.stack([here / t1, np.linalg.norm(bend, axis=1) / t1**3], axis=1),
    )


def _middle(pieces: Array) -> Array:
    """Value at the middle of Bernstein pieces (N, k + 1, J): (N, J)."""
    degree = pieces.shape[1] - 1
    binomials = np.array([comb(degree, number) for number in range(degree + 1)]) / 2.0**degree
    return np.asarray(np.einsum("b,nbj->nj", binomials, pieces))
