"""The tool of an arm whose moving joints turn while the others stand still: poses, slopes, and how far they reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics import chain
from armtempo.kinematics.constraint import Constraint, Miss
from armtempo.kinematics.forward import Frame, array_frames
from armtempo.kinematics.geometry import Geometry
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import Pose


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
    """The tool for angles of some driven joints, ``moving``, with all others of ``posture_deg`` (driven joints,).

    Joints turn rows of the Denavit-Hartenberg table: each its own, before a parallel linkage also the one after.
    """

    def __init__(self, arm: Arm, moving: list[int], posture_deg: Array) -> None:
        self._arm, self._moving, self._posture_deg = arm, moving, posture_deg
        self._geometry = Geometry.of(arm)
        identity = np.eye(len(arm.joints))[:, [arm.driven_indices[joint] for joint in moving]]
        turned = np.array(self._geometry.turns(list(identity)))
        self._rows = np.flatnonzero(np.any(turned != 0.0, axis=1))
        self.turns = turned[self._rows]
        """Turn of each row that turns for a turn of each joint: (R, J)."""

    def at(self, angles_deg: Array) -> ToolState:
        """For angles (P, J) of the moving joints."""
        chained = self._frames(angles_deg)
        *rotation, position = (np.stack(part, axis=-1) for part in chained[-1])
        axes, slopes = self._by_row(chained, position)
        by_joint = "rpi,rj->pij"
        return ToolState(
            position,
            np.stack(rotation, axis=-1),
            np.einsum(by_joint, slopes, self.turns),
            np.einsum(by_joint, axes, self.turns),
        )

    def _by_row(self, chained: list[Frame[Array]], position: Array) -> tuple[Array, Array]:
        """Axis of each row that turns, for a degree, and how the tool moves with it: each (R, P, 3)."""
        axes, slopes = [], []
        for row in self._rows:
            axis = np.radians(1.0) * np.stack(chained[row].z, axis=-1)
            axes.append(axis)
            slopes.append(np.cross(axis, position - np.stack(chained[row].origin, axis=-1)))
        return np.array(axes), np.array(slopes)

    def moved(self, angles_deg: Array, rate: Array, bend: Array) -> tuple[Array, Array]:
        """First and second derivatives of the position where angles (P, J) have these, each (P, J): each (P, 3).

        As a row turns, it carries the axes of those after it along.
        """
        chained = self._frames(angles_deg)
        axes, slopes = self._by_row(chained, np.stack(chained[-1].origin, axis=-1))
        rates, bends = (each @ self.turns.T for each in (rate, bend))
        first, second = np.zeros(axes.shape[1:]), np.zeros(axes.shape[1:])
        carried = np.zeros(axes.shape[1:])
        for number, (axis, slope) in enumerate(zip(axes, slopes, strict=True)):
            own = rates[:, number, None]
            first += own * slope
            second += bends[:, number, None] * slope + own * np.cross(2.0 * carried + own * axis, slope)
            carried += own * axis
        return first, second

    def positions_mm(self, angles_deg: Array) -> Array:
        """Only where it is, (P, 3), for angles (P, J)."""
        return np.stack(self._frames(angles_deg)[-1].origin, axis=-1)

    def _frames(self, angles_deg: Array) -> list[Frame[Array]]:
        driven = np.tile(self._posture_deg, (len(angles_deg), 1))
        driven[:, self._moving] = angles_deg
        return array_frames(self._geometry, np.radians(chain.all_angles_deg(self._arm, driven)))

    def miss(self, angles_deg: Array, target: Pose) -> Miss:
        """How far the tool is from a pose, for angles (J,)."""
        state = self.at(angles_deg[None])
        x, y, z = state.rotation[0].T.tolist()
        return Constraint.of(target).miss(Frame(x, y, z, state.position_mm[0].tolist()))

    @property
    def reach_mm(self) -> Array:
        """No posture takes the tool farther from the axis of a row that turns: (R,)."""
        lengths = np.abs(self._geometry.a) + np.abs(self._geometry.d)
        return np.asarray(np.cumsum(lengths[::-1])[::-1][self._rows])
