"""The tool as a function of the moving joints, with the others fixed: poses, derivatives, and reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics import chain
from armtempo.kinematics.constraint import Constraint, Miss
from armtempo.kinematics.forward import Frame, array_frames
from armtempo.kinematics.geometry import Geometry
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import SLIDE_MM
from armtempo.model.tool_pose import Pose


@dataclass(frozen=True, eq=False)
class ToolState:
    """Poses of the tool at P postures, and derivatives by J joints."""

    position_mm: Array
    """(P, 3)."""
    rotation: Array
    """(P, 3, 3), its axes in columns."""
    slope_mm_deg: Array
    """Derivative of the position by each joint, mm/deg: (P, 3, J)."""
    axes_deg: Array
    """Axis of each joint times the radians of a degree: (P, 3, J); 0 of a sliding one."""


class Tool:
    """The tool for angles of the joints ``moving``, with the other driven joints at ``posture_deg`` (driven joints,).

    A joint turns its row of the Denavit-Hartenberg table, and, before a parallel linkage, also the next.
    """

    def __init__(self, arm: Arm, moving: list[int], posture_deg: Array) -> None:
        self._arm, self._moving, self._posture_deg = arm, moving, posture_deg
        self._geometry = Geometry.of(arm)
        identity = np.eye(len(arm.joints))[:, [arm.driven_indices[joint] for joint in moving]]
        turned = np.array(self._geometry.turns(list(identity)))
        self._rows = np.flatnonzero(np.any(turned != 0.0, axis=1))
        self._slides = {row for row, _ in self._geometry.slides}
        self.turns = turned[self._rows]
        """Turn of each moving row per turn of each joint: (R, J)."""

    def at(self, angles_deg: Array) -> ToolState:
        """The state for angles (P, J) of the moving joints."""
        chained = self._frames(angles_deg)
        position, rotation = _pose(chained[-1])
        axes, slopes = self._by_row(chained, position)
        by_joint = "rpi,rj->pij"
        return ToolState(
            position,
            rotation,
            np.einsum(by_joint, slopes, self.turns),
            np.einsum(by_joint, axes, self.turns),
        )

    def poses(self, angles_deg: Array) -> tuple[Array, Array]:
        """Position, (P, 3), and axes in columns, (P, 3, 3), alone, for angles (P, J)."""
        return _pose(self._frames(angles_deg)[-1])

    def _by_row(self, chained: list[Frame[Array]], position: Array) -> tuple[Array, Array]:
        """Axis of each moving row, per degree, and the derivative of the tool's position by it: each (R, P, 3)."""
        axes, slopes = [], []
        for row in self._rows:
            axis = np.radians(1.0) * np.stack(chained[row].z, axis=-1)
            if row in self._slides:
                axes.append(np.zeros_like(axis))
                slopes.append(SLIDE_MM * axis)
                continue
            axes.append(axis)
            slopes.append(_cross(axis, position - np.stack(chained[row].origin, axis=-1)))
        return np.array(axes), np.array(slopes)

    def moved(self, angles_deg: Array, rate: Array, bend: Array) -> tuple[Array, Array]:
        """First and second derivatives of the position, each (P, 3), for angles (P, J) with derivatives
        ``rate``, ``bend``.

        A turning row also turns the axes of the rows after it, a sliding one does not.
        """
        chained = self._frames(angles_deg)
        axes, slopes = self._by_row(chained, np.stack(chained[-1].origin, axis=-1))
        rates, bends = (each @ self.turns.T for each in (rate, bend))
        first, second = np.zeros(axes.shape[1:]), np.zeros(axes.shape[1:])
        carried = np.zeros(axes.shape[1:])
        for number, (axis, slope) in enumerate(zip(axes, slopes, strict=True)):
            own = rates[:, number, None]
            first += own * slope
            second += bends[:, number, None] * slope + own * _cross(2.0 * carried + own * axis, slope)
            carried += own * axis
        return first, second

    def positions_mm(self, angles_deg: Array) -> Array:
        """Positions only, (P, 3), for angles (P, J)."""
        return np.stack(self._frames(angles_deg)[-1].origin, axis=-1)

    def _frames(self, angles_deg: Array) -> list[Frame[Array]]:
        driven = np.tile(self._posture_deg, (len(angles_deg), 1))
        driven[:, self._moving] = angles_deg
        return array_frames(self._geometry, np.radians(chain.all_angles_deg(self._arm, driven)))

    def miss(self, angles_deg: Array, target: Pose) -> Miss:
        """The tool's distance from a pose, for angles (J,)."""
        state = self.at(angles_deg[None])
        x, y, z = state.rotation[0].T.tolist()
        return Constraint.of(target).miss(Frame(x, y, z, state.position_mm[0].tolist()))

    @property
    def reach_mm(self) -> Array:
        """Largest distance of the tool from the axis of each moving row: (R,).

        Bound of the column of the Jacobian of each row, per radian. A turn of one changes the column of another by the
        reach of the outer of the two at most; to hold for an outer row that slides, whose column is SLIDE_MM long, that
        of the rows inside of it is no smaller.
        """
        lengths = np.abs(self._geometry.a) + np.array(self._geometry.lengths)
        reach = np.cumsum(lengths[::-1])[::-1] + self._geometry.tool_length
        for row in self._slides:
            reach[row] = SLIDE_MM
            reach[:row] = np.maximum(reach[:row], SLIDE_MM)
        return np.asarray(reach[self._rows])


def _pose(frame: Frame[Array]) -> tuple[Array, Array]:
    """Position, (P, 3), and axes in columns, (P, 3, 3)."""
    *axes, position = (np.stack(part, axis=-1) for part in frame)
    return position, np.stack(axes, axis=-1)


def _cross(first: Array, second: Array) -> Array:
    """Cross products of (P, 3) and (P, 3), in a third of the time that numpy's takes for a few."""
    x, y, z = first.T
    u, v, w = second.T
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
