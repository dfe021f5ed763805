"""The tool of an arm whose moving joints turn while the others stand still: poses, slopes, and how far they reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.arrays import Array
from armtempo.kinematics import chain
from armtempo.kinematics.forward import frames
from armtempo.kinematics.geometry import Geometry
from armtempo.model.arm import Arm


@dataclass(frozen=True, eq=False)
class ToolState:
    """Where the tool is at P postures, and how it moves as each of J joints turns."""

    position_mm: Array
    """(P, 3)."""
    rotation: Array
    """(P, 3, 3), its axes in columns."""
    slope_mm_deg: Array
    """Change of the position for a degree of each joint: (P, 3, J)."""
    axes_deg: Array
    """Axis of each joint times the radians of a degree: (P, 3, J)."""


class Tool:
    """The tool for angles of some driven joints, ``moving``, with all others of ``posture_deg`` (driven joints,)."""

    def __init__(self, arm: Arm, moving: list[int], posture_deg: Array) -> None:
        self._arm, self._moving, self._posture_deg = arm, moving, posture_deg
        self._geometry = Geometry.of(arm)
        driven = [number for number, joint in enumerate(arm.joints) if joint.motor is not None]
        self._joints = [driven[joint] for joint in moving]

    def at(self, angles_deg: Array) -> ToolState:
        """For angles (P, J) of the moving joints."""
        driven = np.tile(self._posture_deg, (len(angles_deg), 1))
        driven[:, self._moving] = angles_deg
        chained = list(frames(self._geometry, np.radians(chain.all_angles_deg(self._arm, driven))))
        last = chained[-1]
        slopes, axes = [], []
        for joint in self._joints:
            axis = np.radians(1.0) * chained[joint].z
            slopes.append(np.cross(axis, last.origin - chained[joint].origin, axis=0))
            axes.append(axis)
        return ToolState(
            last.origin.T,
            np.moveaxis(np.stack([last.x, last.y, last.z]), (0, 1, 2), (2, 1, 0)),
            np.moveaxis(np.array(slopes), (0, 1, 2), (2, 1, 0)),
            np.moveaxis(np.array(axes), (0, 1, 2), (2, 1, 0)),
        )

    @property
    def reach_mm(self) -> Array:
        """No posture takes the tool farther from a moving joint's axis: (J,)."""
        lengths = np.abs(self._geometry.a) + np.abs(self._geometry.d)
        return np.asarray(np.cumsum(lengths[::-1])[::-1][self._joints])
