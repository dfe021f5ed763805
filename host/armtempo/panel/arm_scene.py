"""The arm in 3-D: links as capsules, via points, the tool's path, the ghost of where it will go."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np
from nicegui import ui
from scipy.spatial.transform import Rotation

from armtempo.basics.arrays import Array
from armtempo.kinematics.chain import all_angles_deg, outline_mm
from armtempo.model.arm import Arm

COLOUR, GHOST, PATH, RUN, VIA = "#4477aa", "#999999", "#228833", "#ee6677", "#ccbb44"
"""Of Paul Tol's bright scheme, which the colour-blind can tell apart."""
_THICK = 0.03
"""Radius of a link as a share of the arm's reach, for arms whose file gives none."""
_SHORT_MM = 1e-6
_GHOST_OPACITY = 0.25


class ArmShape:
    """Where the parts of an arm are at its joint angles; lengths in shares of the reach."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self.reach_mm = sum(abs(joint.d_mm) + abs(joint.a_mm) for joint in arm.joints) or 1.0

    def outline(self, angles_deg: Array) -> Array:
        """Points of the arm's line, (K, 3), for driven angles (J,)."""
        return outline_mm(self.arm, all_angles_deg(self.arm, np.asarray(angles_deg))) / self.reach_mm

    @cached_property
    def pieces(self) -> list[tuple[int, float]]:
        """The point at which each link begins in the outline, and its length; none of no length."""
        points = self.outline(np.array(self.arm.home_deg))
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        return [
            (index, float(length))
            for index, length in enumerate(lengths)
            if length * self.reach_mm > _SHORT_MM
        ]

    def poses(self, angles_deg: Array) -> list[list[float]]:
        """x, y, z and the quaternion x, y, z, w of each piece's middle: its y axis points along it."""
        points = self.outline(angles_deg)
        found = []
        for index, _ in self.pieces:
            begin, end = points[index], points[index + 1]
            along = (end - begin) / np.linalg.norm(end - begin)
            turn, _ = Rotation.align_vectors([along], [[0.0, 1.0, 0.0]])
            found.append([*((begin + end) / 2).round(5).tolist(), *turn.as_quat().round(5).tolist()])
        return found


class ArmScene:
    """The scene of one page."""

    def __init__(self, shape: ArmShape) -> None:
        self._shape = shape
        with ui.scene(width=800, height=500, grid=(4, 16), background_color="#ffffff").classes(
            "w-full h-full"
        ) as self.scene:
            self._links = self._capsules(COLOUR, 1.0)
            self._ghost = self._capsules(GHOST, _GHOST_OPACITY)
        self._lines: dict[str, list[object]] = {}
        self.look("free")

    def _capsules(self, colour: str, opacity: float) -> list[str]:
        """A capsule for each piece; their numbers in the scene."""
        found = []
        for _, length in self._shape.pieces:
            with self.scene.group() as capsule:
                self.scene.cylinder(_THICK, _THICK, length, 16).material(colour, opacity)
                for end in (-length / 2, length / 2):
                    self.scene.sphere(_THICK, 16, 12).material(colour, opacity).move(0, end, 0)
            found.append(str(capsule.id))
        return found

    @property
    def parts(self) -> str:
        """What the page's script moves: the scene, its links and its ghost, as JSON."""
        return json.dumps({"scene": self.scene.id, "links": self._links, "ghost": self._ghost})

    def look(self, view: str) -> None:
        """Look from the side, from above, or from in front and above."""
        eye = {"side": (0.01, -1.2, 0.2), "top": (0.01, -0.01, 1.4), "free": (0.7, -0.9, 0.6)}[view]
        self.scene.move_camera(*eye, 0, 0, 0.1, duration=0.3)

    def draw(self, name: str, points_mm: Array, colour: str) -> None:
        """A line through points (N, 3), in the place of the one of that name."""
        for old in self._lines.pop(name, []):
            old.delete()  # type: ignore[attr-defined]
        points = (np.asarray(points_mm) / self._shape.reach_mm).tolist()
        with self.scene:
            self._lines[name] = [
                self.scene.line(begin, end).material(colour) for begin, end in pairwise(points)
            ]

    def dots(self, name: str, points_mm: Sequence[Sequence[float]], colour: str) -> None:
        """A ball at each point, in the place of those of that name."""
        for old in self._lines.pop(name, []):
            old.delete()  # type: ignore[attr-defined]
        with self.scene:
            self._lines[name] = [
                self.scene.sphere(1.3 * _THICK, 16, 12)
                .material(colour)
                .move(*(np.asarray(point) / self._shape.reach_mm).tolist())
                .with_name(f"{name} {number}")
                for number, point in enumerate(points_mm)
            ]
