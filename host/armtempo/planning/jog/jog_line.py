"""The postures along a straight line of the tool, or a rotation about an axis, each near the one before.

The line ends where a joint reaches the end of its range, where the tool cannot follow, or near a singular
posture, where small motions of the tool need large motions of the joints. The arm never changes its branch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.kinematics.chain import all_angles_deg
from armtempo.kinematics.forward import forward
from armtempo.kinematics.solver import PoseSolver
from armtempo.model.arm import Arm
from armtempo.model.frame import TOOL
from armtempo.model.joint_unit import SLIDE_MM
from armtempo.model.parts import DrivenJoint
from armtempo.model.tool_pose import APPROACH, BASE, PITCH, ROLL, WHOLE, YAW, Pose
from armtempo.planning.free.angle_bounds import of_path
from armtempo.planning.line.deviation import LineDeviation, SplinePieces, proven
from armtempo.planning.line.tool_path import ToolPath, ToolPiece, rotations
from armtempo.planning.move_law import DEGREE
from armtempo.planning.tool import Tool

TOLERANCE_MM, TOLERANCE_DEG = 0.02, 0.02
"""Tolerances of a posture on the line."""
STRAY_MM, STRAY_DEG = 0.2, 1.0
"""Largest deviation of the tool from its line."""
STEPS_OF_REACH, STEP_DEG = 250, 1.0
"""Steps along the line: the arm's reach divided by this, or this many degrees."""
MOST_GAIN = 5.0
"""A posture is singular if a joint moves by more radians per radian of the tool, or per arm's reach of the tool."""
MARGIN_STEPS = 2.0
"""Motor steps kept as a margin to the end of a joint's range."""
_TRIED = (WHOLE, (APPROACH,), (PITCH,), (YAW,), (ROLL,), ())
_PARALLEL = 0.99
_HALVINGS = 8
_AT_ONCE = 32
"""Postures that are found together: more take longer where the line ends soon, fewer where it is long."""
_LEFT = 1e-9
"""Part of the length at its end that is not followed: rounding."""
_STEPS_TO_JUDGE = 3
_SMALL_RAD = 1e-5
_SINGULAR = 1e-3
"""Singular values of the Jacobian below this, relative to the largest, are 0."""
_MISSED = 0.01
"""Part of a motion along the axis that the joints may leave out."""


def direction_of(arm: Arm, axis: str, tool: Array) -> Array:
    """The direction of an axis in the base, (3,), with the tool at a pose (4, 4).

    ``axis``: "x", "y" or "z" of the base; "tool-x", … of the tool; "NAME-x", … of a frame of the arm. Raises InputError
    if there is no such axis.
    """
    frame, _, letter = axis.rpartition("-")
    if len(letter) != 1 or letter not in "xyz" or axis.startswith("-"):
        raise InputError(f"there is no axis {axis!r}", f"give x, y or z, tool-x, … or {_of_frames(arm)}")
    pose = tool if frame == TOOL else arm.frame(frame or BASE)
    return np.asarray(pose[:3, "xyz".index(letter)])


def axis_of(frame: str, letter: str) -> str:
    """The name of an axis as ``direction_of`` takes it: of the base, TOOL, or a frame of the arm."""
    return letter if frame == BASE else f"{frame}-{letter}"


def _of_frames(arm: Arm) -> str:
    return f"{arm.frames[0].name if arm.frames else 'NAME'}-x, … of a frame of the arm file"


@dataclass(frozen=True, eq=False)
class ToolLine:
    """A line of the tool from a posture of the arm."""

    arm: Arm
    start_deg: Array
    """The driven joints, (J,)."""
    axis: str
    """As ``direction_of`` takes it."""
    about: bool
    """Turn about the axis instead of moving along it."""
    sign: int

    @cached_property
    def _solver(self) -> PoseSolver:
        return PoseSolver(self.arm)

    @cached_property
    def _start(self) -> Array:
        """Angles of all joints, rad."""
        return np.radians(all_angles_deg(self.arm, self.start_deg))

    @cached_property
    def _pose(self) -> Array:
        return forward(self._solver.geometry, self._start)

    @cached_property
    def reach_mm(self) -> float:
        """Sum of the lengths of all links."""
        return float(self._solver.geometry.reach) or 1.0

    @cached_property
    def step(self) -> float:
        """Step along the line, mm or deg."""
        return STEP_DEG if self.about else self.reach_mm / STEPS_OF_REACH

    @cached_property
    def direction(self) -> Array:
        """Direction of the axis in the frame of the base, (3,)."""
        return self.sign * direction_of(self.arm, self.axis, self._pose)

    def pose(self, distance: float) -> Array:
        """The tool's pose after a distance in mm or deg, (4, 4)."""
        pose = self._pose.copy()
        if self.about:
            pose[:3, :3] = rotations(math.radians(distance) * self.direction[None])[0] @ pose[:3, :3]
        else:
            pose[:3, 3] += distance * self.direction
        return pose

    @cached_property
    def fixed(self) -> tuple[str, ...]:
        """The part of the orientation that the arm can keep on this line; raises InputError if it cannot begin."""
        for fixed in _TRIED[:2] if self.about else _TRIED:
            if self._turns(fixed) and self._begins(fixed):
                return fixed
        what = f"turn the tool about {self.axis}" if self.about else f"move the tool along {self.axis}"
        if self._is_singular:
            raise InputError(
                f"the arm cannot {what} from here: the posture is singular, stretched or folded",
                "bend it first: jog a single joint a few degrees",
            )
        raise InputError(
            f"the arm cannot {what} from here",
            "a joint is at the end of its range, or the arm has too few joints: jog single joints",
        )

    @cached_property
    def _is_singular(self) -> bool:
        """Whether the joints move the tool along the axis from postures nearby, but not from here."""
        moving = list(self.arm.driven_indices)

        def leads(angles: Array) -> bool:
            pose = forward(self._solver.geometry, angles)
            columns = []
            for joint in moving:
                turned = angles.copy()
                turned[joint] += _SMALL_RAD
                change = (forward(self._solver.geometry, turned) - pose) / _SMALL_RAD
                columns.append(np.append(change[:3, 3] / self.reach_mm, change[:3, :3] if self.about else ()))
            turn = np.cross(self.direction, pose[:3, :3], axisb=0, axisc=0)
            wanted = np.append(np.zeros(3), turn) if self.about else self.direction
            matrix = np.array(columns).T
            speeds = np.linalg.lstsq(matrix, wanted, rcond=_SINGULAR)[0]
            return bool(np.linalg.norm(matrix @ speeds - wanted) < _MISSED)

        nearby = self._start.copy()
        nearby[moving] += np.radians(5.0) * np.arange(1, len(moving) + 1)
        return leads(nearby) and not leads(self._start)

    def _turns(self, fixed: tuple[str, ...]) -> bool:
        """Whether a rotation about the axis changes the kept part of the orientation."""
        spins = abs(self.direction @ self._pose[:3, 2]) > _PARALLEL
        return not (self.about and fixed == (APPROACH,) and spins)

    def _begins(self, fixed: tuple[str, ...]) -> bool:
        angles = self._start
        for number in range(1, _STEPS_TO_JUDGE + 1):
            found = self._near(
                number * self.step / _STEPS_TO_JUDGE, angles, fixed, self.step / _STEPS_TO_JUDGE
            )
            if isinstance(found, str):
                return False
            angles = found
        return True

    def _near(self, distance: float, before: Array, fixed: tuple[str, ...], step: float) -> Array | str:
        """All joint angles on the line after ``distance``, rad (joints,), near the posture before; or the reason
        why not."""
        target = Pose(
            tuple(map(tuple, self.pose(distance).tolist())),
            fixed=fixed,
            tolerance_mm=TOLERANCE_MM,
            tolerance_deg=TOLERANCE_DEG,
        )
        found = self._solver.nearest(target, before.tolist())
        if not found.success:
            return _short(found.reason)
        angles = np.array(found.angles_rad)
        if outside := self._outside(angles):
            return outside
        most = MOST_GAIN * (math.radians(step) if self.about else step / self.reach_mm)
        moved = np.abs(angles - before) * self._parts_of_reach
        worst = int(np.argmax(moved))
        if moved[worst] > most + 1e-9:
            joint = self.arm.joints[worst]
            goes = "slide" if joint.slides else "turn"
            return f"the posture is nearly singular: {joint.name} would {goes} too far"
        return angles

    def _near_all(
        self, distances: Sequence[float], start: Array, fixed: tuple[str, ...], step: Array
    ) -> Array:
        """As ``_near`` for many distances, as far as it can be found for all at once: (n, joints).

        ``start``: near each, (K, joints), or near the first, (joints,), each other near the one before. ``step``: (K,).
        """
        if fixed != WHOLE:
            return np.empty((0, start.shape[-1]))
        poses = np.stack([self.pose(distance) for distance in distances])
        found = self._solver.nearest_of_many(poses, start, (TOLERANCE_MM, TOLERANCE_DEG))
        before = np.vstack([start, found])[: len(found)] if start.ndim == 1 else start[: len(found)]
        most = MOST_GAIN * (np.radians(step) if self.about else step / self.reach_mm)
        wrong = np.any(
            np.abs(found - before) * self._parts_of_reach > most[: len(found), None] + 1e-9, axis=1
        )
        for index, _, low, high in self._bounds_deg:
            angles = np.degrees(found[:, index])
            wrong |= (angles < low) | (angles > high)
        return found[: np.argmax([*wrong, True])]

    @cached_property
    def _parts_of_reach(self) -> Array:
        """Of each joint: how far it moves the tool for a radian of the kinematics, at most, by the reach: (joints,)."""
        return np.array([SLIDE_MM / self.reach_mm if joint.slides else 1.0 for joint in self.arm.joints])

    @cached_property
    def _bounds_deg(self) -> list[tuple[int, DrivenJoint, float, float]]:
        """Of each driven joint: its index among all, and how far it may go, which is as far as it is at least."""
        found = []
        for index, joint in zip(self.arm.driven_indices, self.arm.driven, strict=True):
            margin = MARGIN_STEPS / joint.steps_per_deg
            start, (least, most) = math.degrees(self._start[index]), joint.travel_deg
            low, high = min(least + margin, start), max(most - margin, start)
            found.append((index, joint, low - 1e-9, high + 1e-9))
        return found

    def _outside(self, angles: Array) -> str:
        """Say which joint is within the margin of its travel's end, and nearer than at the start; "" if none is."""
        for index, joint, low, high in self._bounds_deg:
            angle = math.degrees(angles[index])
            if not low <= angle <= high:
                return f"{joint.name} is at {joint.end_of_travel('low' if angle < low else 'high')}"
        return ""

    def followed(self, length: float) -> FollowedLine:
        """The part of the line that the arm can follow, at most ``length``."""
        fixed = self.fixed
        distances, postures = [0.0], [self._start]
        ends = ""
        step = min(self.step, length / _STEPS_TO_JUDGE)
        while not ends and length - distances[-1] >= _LEFT * length:
            ahead = [distances[-1]]
            while len(ahead) <= _AT_ONCE and length - ahead[-1] >= _LEFT * length:
                ahead.append(ahead[-1] + min(step, length - ahead[-1]))
            together = self._near_all(ahead[1:], postures[-1], fixed, np.diff(ahead))
            distances += ahead[1 : len(together) + 1]
            postures += [*together]
            if len(together) == len(ahead) - 1:
                continue
            here = min(step, length - distances[-1])
            found = self._near(distances[-1] + here, postures[-1], fixed, here)
            for _ in range(_HALVINGS):
                if not isinstance(found, str):
                    break
                ends, here = found, here / 2.0
                found = self._near(distances[-1] + here, postures[-1], fixed, here)
            if isinstance(found, str):
                break
            distances.append(distances[-1] + here)
            postures.append(found)
        return FollowedLine(self, np.array(distances), np.array(postures), ends)


@dataclass(frozen=True, eq=False)
class FollowedLine:
    """The part of a line that the arm can follow."""

    line: ToolLine
    distances: Array
    """(K,), from 0, mm or deg."""
    angles_rad: Array
    """Angles of all joints there, (K, joints)."""
    ends: str
    """Why the line ends early; "" if it does not."""

    @property
    def length(self) -> float:
        """Its length, mm or deg."""
        return float(self.distances[-1])

    def at(self, distances: Array) -> Array:
        """The driven joints at distances along it, degrees (K, J); raises InputError if the tool cannot follow."""
        line, step = self.line, max(self.line.step, 1e-3)
        near = np.stack(
            [np.interp(distances, self.distances, column) for column in self.angles_rad.T], axis=1
        )
        found = [*line._near_all(distances.tolist(), near, line.fixed, np.full(len(distances), step))]
        for distance, start in zip(distances[len(found) :].tolist(), near[len(found) :], strict=True):
            angles = line._near(distance, start, line.fixed, step)
            if isinstance(angles, str):
                raise InputError(f"the tool cannot follow the line: {angles}", "jog single joints")
            found.append(angles)
        return np.asarray(np.degrees(np.array(found)[:, list(line.arm.driven_indices)]))

    def is_kept(self, angle_points_deg: Array, distance_points: Array) -> bool:
        """Whether it is proven that the tool keeps to it, for splines of the driven joints, (S + 5, J), and of the
        distance, (S + 5,)."""
        line = self.line
        fixed = line.fixed if line.fixed in (WHOLE, (APPROACH,)) else ()
        turn = math.radians(1.0) * line.direction if line.about else np.zeros(3)
        direction = np.zeros(3) if line.about else line.direction
        piece = ToolPiece(line._pose, self.length, direction, np.zeros(3), turn)
        tool = Tool(line.arm, list(range(len(line.arm.driven))), line.start_deg)
        distances = of_path(distance_points[:, None], DEGREE)[:, :, 0]
        pieces = SplinePieces(of_path(angle_points_deg, DEGREE), distances)
        most = LineDeviation(STRAY_MM, STRAY_DEG)
        found = proven(pieces, tool, ToolPath((piece,)), fixed, most, whether=True)
        return found.position_mm <= STRAY_MM and found.rotation_deg <= STRAY_DEG


def _short(reason: str) -> str:
    """The reason why a posture was not found, without numbers."""
    first = reason.partition(";")[0]
    return "the arm reaches no further" if first.startswith("the arm does not reach") else first
