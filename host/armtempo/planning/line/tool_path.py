"""The path of the tool between two rests: straight lines, arcs, and cut corners.

``distance``: arc length in mm; in degrees if the tool only turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import PlanError

_STILL_MM, _STILL_DEG = 1e-6, 1e-6
"""Shorter distances and smaller turns count as 0."""
_NO_SINE = 1e-12
_HALF_TURN_DEG = 179.9
"""The direction of a larger turn is not defined."""
_FLAT = 1e-9
_ROUNDED_MM = 1e-3
"""Digits to which positions are typed."""
_SAMPLES = 33
_CORNER_BEND = 15.0 / 16.0
"""Largest f'' of ``_corner``."""


@dataclass(frozen=True, eq=False)
class ToolPiece:
    """A straight line, or an arc, with the tool turning evenly about one axis of the base."""

    start: Array
    """Pose at its start, (4, 4)."""
    length: float
    """mm; degrees for a rotation without translation."""
    direction: Array
    """Direction at the start, (3,); 0 for a rotation without translation."""
    inward: Array
    """To the centre of the arc times its curvature, (3,) in 1/mm; 0 for a line."""
    turn: Array
    """Rotation vector per mm, (3,) in rad."""

    def moved(self, distance: Array) -> Array:
        """Position relative to the start at distances (N,): (N, 3)."""
        bend = float(np.linalg.norm(self.inward))
        if bend == 0.0:
            return distance[:, None] * self.direction
        along, across = np.sin(bend * distance) / bend, (1.0 - np.cos(bend * distance)) / bend
        return np.asarray(along[:, None] * self.direction + across[:, None] * self.inward / bend)

    def turned(self, distance: Array) -> Array:
        """Rotation from the start's orientation: (N, 3, 3)."""
        return rotations(distance[:, None] * self.turn)


@dataclass(frozen=True)
class Bounds:
    """Largest derivatives by the distance: of position and orientation, first and second (mm, rad)."""

    slope: float
    bend: float
    turn: float
    turn_bend: float


@dataclass(frozen=True, eq=False)
class ToolPath:
    """Consecutive pieces; ``cuts``: the distance before and after each corner over which it is cut, mm."""

    pieces: tuple[ToolPiece, ...]
    cuts: tuple[float, ...] = ()

    @property
    def starts(self) -> Array:
        """Way at the start of each piece, and at the end of the last: (n + 1,)."""
        return np.concatenate([[0.0], np.cumsum([piece.length for piece in self.pieces])])

    @property
    def length(self) -> float:
        """All of it."""
        return float(self.starts[-1])

    def poses(self, distance: Array) -> tuple[Array, Array]:
        """Positions (N, 3) and rotations (N, 3, 3) at distances (N,); beyond the ends the path continues."""
        starts = self.starts
        number = np.clip(np.searchsorted(starts, distance, side="right") - 1, 0, len(self.pieces) - 1)
        positions, rotated = np.empty((len(distance), 3)), np.empty((len(distance), 3, 3))
        for index, piece in enumerate(self.pieces):
            own = number == index
            local = distance[own] - starts[index]
            positions[own] = piece.start[:3, 3] + piece.moved(local)
            rotated[own] = piece.turned(local) @ piece.start[:3, :3]
        for index, cut in enumerate(self.cuts):
            place = starts[index + 1]
            near = np.abs(distance - place) < cut
            if cut > 0.0 and near.any():
                positions[near], rotated[near] = self._cut(index, (distance[near] - place) / cut, cut)
        return positions, rotated

    def _cut(self, index: int, part: Array, cut: float) -> tuple[Array, Array]:
        """Poses in a cut corner, ``part`` from -1 to 1: a blend of both pieces."""
        before, after = self.pieces[index], self.pieces[index + 1]
        left, right = cut * _corner(-part), cut * _corner(part)
        end = np.array([before.length])
        moved = before.moved(before.length - left) - before.moved(end) + after.moved(right)
        back = before.turned(before.length - left) @ np.swapaxes(before.turned(end), 1, 2)
        return after.start[:3, 3] + moved, after.turned(right) @ back @ after.start[:3, :3]

    @property
    def bounds(self) -> Bounds:
        """Bounds over the whole path."""
        bends = [float(np.linalg.norm(piece.inward)) for piece in self.pieces]
        turns = [float(np.linalg.norm(piece.turn)) for piece in self.pieces]
        corner = max((2.0 * _CORNER_BEND / cut for cut in self.cuts if cut > 0.0), default=0.0)
        bend, turn = max(bends) + corner, max(turns)
        # in a corner the distances of both pieces sum to at most one, each with its own turn
        slope = max(float(np.linalg.norm(piece.direction)) for piece in self.pieces)
        return Bounds(slope, bend, turn, turn * corner + turn * turn)


def _corner(part: Array) -> Array:
    """0 below -1, its argument above 1, in between the second derivative is 15/16 (1 - x^2)^2: a C3 function."""
    x = np.clip(part, -1.0, 1.0)
    inner = (5.0 + 16.0 * x + 15.0 * x**2 - 5.0 * x**4 + x**6) / 32.0
    return np.asarray(np.where(part > 1.0, part, inner))


def line(start: Array, end: Array, turn: Array, where: str) -> ToolPiece:
    """The straight line between two poses (4, 4), with the rotation vector ``turn``, (3,) in rad."""
    distance = end[:3, 3] - start[:3, 3]
    length = float(np.linalg.norm(distance))
    if length > _STILL_MM:
        return ToolPiece(start, length, distance / length, np.zeros(3), turn / length)
    turned_deg = float(np.degrees(np.linalg.norm(turn)))
    if turned_deg <= _STILL_DEG:
        raise PlanError(
            f"{where}: the tool is at this point already", "leave line out, or move one of the via points"
        )
    return ToolPiece(start, turned_deg, np.zeros(3), np.zeros(3), turn / turned_deg)


def arc(
    start: Array, through: Sequence[float], end: Array, turn: Array, where: str, tolerance_mm: float
) -> ToolPiece:
    """The arc from a pose (4, 4) through a point to another one.

    Raises PlanError unless the three points define it within ``tolerance_mm``.
    """
    middle, last = np.array(through) - start[:3, 3], end[:3, 3] - start[:3, 3]
    circle = _circle(middle, last)
    known = circle is not None and _unsure_mm(circle, middle, last) <= tolerance_mm
    if circle is None or not known:
        raise PlanError(
            f"{where}: the start, arc_through_mm and the end do not define an arc within {tolerance_mm:g} mm: on one "
            "line, or two of them nearly the same",
            "move arc_through_mm to the middle of the arc; for a full circle give circle_through_mm, two points",
        )
    length = circle.radius * circle.angle_to(last)
    return ToolPiece(start, length, circle.direction, circle.centre / circle.radius**2, turn / length)


def full_circle(
    start: Array, through: Sequence[Sequence[float]], end: Array, turn: Array, where: str, tolerance_mm: float
) -> ToolPiece:
    """The circle from a pose (4, 4) through two points, in this order, back to where it began; errors as ``arc``."""
    away_mm = float(np.linalg.norm(end[:3, 3] - start[:3, 3]))
    if away_mm > tolerance_mm:
        raise PlanError(
            f"{where}: a full circle ends where it began, but the via points are {away_mm:.4g} mm apart",
            "give both the same position; for a part of a circle give arc_through_mm, one point",
        )
    first, second = (np.array(point) - start[:3, 3] for point in through)
    circle = _circle(first, second)
    if circle is None or _unsure_mm(circle, first, second, True) > tolerance_mm:
        raise PlanError(
            f"{where}: the start and circle_through_mm do not define a circle within {tolerance_mm:g} mm: on one line, "
            "or two of them nearly the same",
            "give two points a third of the circle apart",
        )
    length = 2.0 * np.pi * circle.radius
    return ToolPiece(start, length, circle.direction, circle.centre / circle.radius**2, turn / length)


class _Circle(NamedTuple):
    """A circle through the origin."""

    centre: Array
    direction: Array
    """At the origin."""

    @property
    def radius(self) -> float:
        return float(np.linalg.norm(self.centre))

    def angle_to(self, point: Array) -> float:
        """From the origin along the circle, [0, 2 pi)."""
        to = point - self.centre
        return float(np.arctan2(to @ self.direction, to @ (-self.centre / self.radius))) % (2.0 * np.pi)

    def points(self, angle: float) -> Array:
        """Points up to an angle, evenly: (_SAMPLES, 3)."""
        steps = np.linspace(0.0, angle, _SAMPLES)[:, None]
        return self.centre * (1.0 - np.cos(steps)) + self.direction * (self.radius * np.sin(steps))


def _circle(middle: Array, last: Array) -> _Circle | None:
    """The circle through the origin, ``middle`` and ``last``, in this order; None for points on one line."""
    normal = np.cross(middle, last)
    size = float(np.linalg.norm(normal))
    if size <= _FLAT * float(np.linalg.norm(middle) * np.linalg.norm(last)) or size == 0.0:
        return None
    centre = np.cross(normal, middle) * (last @ last) + np.cross(last, normal) * (middle @ middle)
    centre /= 2.0 * size**2
    return _Circle(centre, np.cross(normal, -centre) / (size * np.linalg.norm(centre)))


def _unsure_mm(circle: _Circle, middle: Array, last: Array, whole: bool = False) -> float:
    """How far the arc, or the ``whole`` circle, moves, to first order, if each of its points is off by _ROUNDED_MM."""
    own = circle.points(2.0 * np.pi if whole else circle.angle_to(last))
    total = 0.0
    for offset in _ROUNDED_MM * np.eye(3):
        for other in (_circle(middle + offset, last), _circle(middle, last + offset)):
            if other is None:
                return np.inf
            end = last if other.angle_to(last) else last + offset
            angle = 2.0 * np.pi if whole else other.angle_to(end)
            total += float(np.abs(other.points(angle) - own).max())
    return total


def turn_between(start: Array, end: Array, where: str) -> Array:
    """Rotation vector of the base that turns one orientation (3, 3) into another, (3,) in rad."""
    vector = np.asarray(rotation_vectors((end @ start.T)[None])[0])
    _check_turn(vector, where)
    return vector


def turn_of_axis(start: Array, end: Array, where: str) -> Array:
    """The smallest rotation vector that turns one direction (3,) into another."""
    normal = np.cross(start, end)
    size = float(np.linalg.norm(normal))
    angle = float(np.arctan2(size, start @ end))
    vector = normal * (angle / size) if size > 0.0 else np.array([angle, 0.0, 0.0])
    _check_turn(vector, where)
    return np.asarray(vector)


def _check_turn(vector: Array, where: str) -> None:
    if np.degrees(np.linalg.norm(vector)) > _HALF_TURN_DEG:
        raise PlanError(
            f"{where}: the tool turns by 180 degrees, so its direction is undefined",
            "add a via point with an orientation between the two",
        )


def rotations(vectors: Array) -> Array:
    """Rotations by rotation vectors (N, 3), Rodrigues: (N, 3, 3)."""
    angle = np.linalg.norm(vectors, axis=1)
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    first = np.sinc(angle / np.pi)[:, None, None]
    second = 0.5 * (np.sinc(angle / (2.0 * np.pi)) ** 2)[:, None, None]
    return np.asarray(np.eye(3) + first * cross + second * (cross @ cross))


def rotation_vectors(matrices: Array) -> Array:
    """Rotation vectors of (N, 3, 3): (N, 3); of the two of a half turn, the one with its largest element positive."""
    twist = 0.5 * np.stack(
        [
            matrices[:, 2, 1] - matrices[:, 1, 2],
            matrices[:, 0, 2] - matrices[:, 2, 0],
            matrices[:, 1, 0] - matrices[:, 0, 1],
        ],
        axis=1,
    )
    sine = np.linalg.norm(twist, axis=1)
    cosine = 0.5 * (np.trace(matrices, axis1=1, axis2=2) - 1.0)
    angle = np.arctan2(sine, cosine)
    scale = np.divide(angle, sine, out=np.ones_like(sine), where=sine > _NO_SINE)
    vectors = twist * scale[:, None]
    for index in np.flatnonzero((sine <= _NO_SINE) & (cosine < 0.0)):
        # of a half turn R = 2 a a^T - 1: the columns of R + 1 are along the axis
        columns = matrices[index] + np.eye(3)
        axis = columns[:, int(np.argmax(np.diag(columns)))]
        vectors[index] = np.pi * axis / np.linalg.norm(axis)
    return np.asarray(vectors)
