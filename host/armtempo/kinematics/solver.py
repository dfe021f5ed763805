"""Inverse kinematics of any arm: by the closed form if it has one, else numerically.

Slides under the six joints of a closed form or behind them stay where they are, unless no solution is usable there.

``PoseSolver.nearest`` is for following a moving target (a jog in tool space): one answer, near the present
posture. ``PoseSolver.solve`` finds all postures, with reasons for rejected ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError, PlanError
from armtempo.kinematics.chain import all_angles_deg
from armtempo.kinematics.choice import Candidate, Choice, choose
from armtempo.kinematics.constraint import Constraint, Miss
from armtempo.kinematics.descent import descend
from armtempo.kinematics.forward import forward, frames
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.inverse import inverse, inverse_of_pose
from armtempo.kinematics.numerical import MovingArm, NumericalSolution, NumericalSolutions, search, why_not
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.rejection import out_of_range, table
from armtempo.kinematics.shape import refusals
from armtempo.kinematics.solutions import OK
from armtempo.model.arm import Arm
from armtempo.model.tool_pose import CONSTRAINTS, WHOLE, Pose

CLOSED_FORM, NUMERICAL = "closed form", "numerical"
_SAME_DEG = 0.01


@dataclass(frozen=True)
class Nearest:
    """The posture that meets a target nearest to the start, or why there is none."""

    success: bool
    angles_rad: tuple[float, ...]
    """(joints,), within the ranges; without success the nearest approach to the target."""
    miss: Miss
    """Distance of the tool from the target, in mm and deg."""
    change_rad: float
    """Largest change of a joint from the start; a large one means a change of branch."""
    reason: str
    """Reason of a failure; "" with success."""
    method: str
    """CLOSED_FORM or NUMERICAL."""

    @property
    def angles_deg(self) -> tuple[float, ...]:
        """(joints,)"""
        return tuple(map(math.degrees, self.angles_rad))


@dataclass(frozen=True, eq=False)
class Answer:
    """The postures of a target."""

    arm: Arm
    target: Pose
    choice: Choice | None
    """The eight solutions of the closed form, if used."""
    search: NumericalSolutions | None
    """The result of the numerical search, if used: without a closed form, or if none of the eight is usable."""
    angles_rad: tuple[float, ...]
    """(joints,): the chosen posture; without success the nearest approach to the target."""
    tool: Array
    """(4, 4): the pose that these angles lead to, lengths in mm."""
    miss: Miss
    """Its distance from the target."""
    miss_driven: Miss
    """Distance of the tool with the undriven joints at home."""
    reason: str
    """Why no posture is usable, and what to do; "" if one is."""

    @property
    def success(self) -> bool:
        """Whether a posture is usable."""
        return not self.reason

    @property
    def usable_deg(self) -> list[tuple[float, ...]]:
        """All usable postures, (joints,) each, the nearest to the previous one first."""
        found: list[Candidate | NumericalSolution] = []
        found += self.choice.candidates if self.choice else ()
        found += self.search.solutions if self.search else ()
        usable = sorted((one for one in found if one.usable), key=lambda one: one.distance_rad)
        return [tuple(map(math.degrees, one.angles_rad)) for one in usable]

    @property
    def angles_deg(self) -> tuple[float, ...]:
        """(joints,)"""
        return tuple(map(math.degrees, self.angles_rad))


@dataclass(frozen=True)
class PoseSolver:
    """The inverse kinematics of one arm."""

    arm: Arm

    @cached_property
    def geometry(self) -> Geometry:
        """In mm."""
        return Geometry.of(self.arm)

    @cached_property
    def ranges(self) -> Ranges:
        """Of all joints."""
        return Ranges.of(self.arm)

    @cached_property
    def moving(self) -> MovingArm:
        """The arm with its driven joints moving."""
        return MovingArm.of(self.arm)

    @cached_property
    def home_rad(self) -> tuple[float, ...]:
        """(joints,)"""
        return tuple(map(math.radians, self.arm.all_home_deg))

    @cached_property
    def refusals(self) -> list[str]:
        """Why the closed form does not serve this arm; empty if it does."""
        return refusals(self.geometry.holding(self.home_rad))

    @cached_property
    def _has_closed_form(self) -> bool:
        """Whether it serves, and a motor turns each of its joints."""
        turning = [joint for joint in self.moving.moving if joint not in self.ranges.slides]
        return not self.refusals and len(turning) == 6

    def nearest(self, target: Pose, start_rad: Sequence[float]) -> Nearest:
        """The posture that meets ``target`` nearest to ``start_rad``, (joints,): well under a millisecond.

        Joints without a motor keep their start angles. An arm with a closed form and six driven joints gets
        the nearest of all solutions; others the result of one descent from the start.
        """
        start = self._checked(start_rad)
        if target.fixed == WHOLE and self._has_closed_form:
            angles = self._nearest_of_eight(target, start)
            if angles is not None:
                return self._answer(target, start, angles, CLOSED_FORM)
        constraint = Constraint.of(target)
        problem = self.moving.problem(constraint, self.moving.underdetermined(target))
        found = self.moving.placed(descend(problem, start).angles_rad, start)
        outside = [
            each.text
            for each in out_of_range(self.ranges, found)
            if (each.joint or 0) - 1 in self.moving.moving
        ]
        if not outside:
            return self._answer(target, start, found, NUMERICAL)
        within = descend(self.moving.problem(constraint, within=True), start).angles_rad
        return self._answer(target, start, within, NUMERICAL, "; ".join(outside))

    def nearest_of_many(self, poses: Array, start_rad: Array, most: tuple[float, float]) -> Array:
        """The postures nearest to a start that meet whole poses, (K, 4, 4), by the closed form: (n, joints), n <= K.

        ``start_rad``: of each pose, (K, joints), or of the first, (joints,); the others then start from the posture
        before. ``most``: tolerances in mm and degrees. The postures end where one is singular, has a free angle, or
        is not found: ``nearest`` tells more of that one.
        """
        joints = len(self.arm.joints)
        if not self._has_closed_form:
            return np.empty((0, joints))
        starts = np.broadcast_to(start_rad, (len(poses), joints)).tolist()
        solutions = inverse(self.geometry.holding(starts[0]), poses, start_rad)
        free = np.any((solutions.outcome == OK) & (solutions.singular != 0), axis=1)
        rows: list[list[float]] = []
        for angles, outcome, start in zip(
            solutions.angles_rad[: np.argmax([*free, True])].tolist(),
            solutions.outcome.tolist(),
            starts,
            strict=False,
        ):
            best = self._nearest_usable(angles, outcome, rows[-1] if rows and start_rad.ndim == 1 else start)
            if best is None:
                break
            rows.append(best)
        found = np.array(rows).reshape(-1, joints)
        off = forward(self.geometry, found)[:, :3] - poses[: len(found), :3]
        chord = np.sqrt(np.square(off[:, :, :3]).sum(axis=(1, 2)))
        missed = np.sqrt(np.square(off[:, :, 3]).sum(axis=1)) > most[0]
        missed |= chord > 2.0 * math.sqrt(2.0) * math.sin(math.radians(most[1]) / 2.0)
        return found[: np.argmax([*missed, True])]

    def solve(self, target: Pose, previous_rad: Sequence[float], numerically: bool = False) -> Answer:
        """All postures that meet ``target``, the one nearest to ``previous_rad``, (joints,), chosen.

        A complete pose is solved by the closed form if the arm has one, unless ``numerically``, with all
        joints moving. Otherwise the driven joints move, and all joints only if a complete pose needs them.
        """
        previous = self._checked(previous_rad)
        choice = None
        if target.fixed == WHOLE and not self.refusals and not numerically:
            choice = choose(self.geometry.holding(previous), target.matrix, self.ranges, previous)
            if choice.chosen:
                return self._solved(target, choice, None, choice.chosen.angles_rad.tolist())
            found = search(self.moving.with_all, target, previous)
            reason = "" if found.chosen else _reason(choice, found)
            return self._solved(target, choice, found, found.nearest.angles_rad, reason)
        found = search(self.moving, target, previous)
        if not found.chosen and target.fixed == WHOLE and found.arm != self.moving.with_all:
            wider = search(self.moving.with_all, target, previous)
            found = wider if wider.chosen else found
        return self._solved(target, None, found, found.nearest.angles_rad, found.reason)

    def _checked(self, angles_rad: Sequence[float]) -> list[float]:
        """The angles of all joints; InputError for another number of them."""
        angles = [float(angle) for angle in angles_rad]
        if len(angles) != len(self.arm.joints):
            raise InputError(
                f"{len(angles)} angles given, the arm has {len(self.arm.joints)} joints",
                "give one angle for each joint, base first",
            )
        return angles

    def _nearest_of_eight(self, target: Pose, start: list[float]) -> list[float] | None:
        """The nearest solution of the closed form within the ranges; None if there is none."""
        rows = [element for row in target.matrix for element in row]
        return self._nearest_usable(*inverse_of_pose(self.geometry.holding(start), rows, start)[:2], start)

    def _nearest_usable(
        self, solutions: Sequence[Sequence[float]], outcomes: Sequence[int], start: list[float]
    ) -> list[float] | None:
        """The nearest of eight solutions within the ranges; None if there is none."""
        best, least = None, math.inf
        for angles, outcome in zip(solutions, outcomes, strict=True):
            if outcome != OK:
                continue
            placed, outside = self.ranges.fitted(angles, start)
            distance = math.dist(placed, start)
            if not outside and distance < least:
                best, least = placed, distance
        return best

    def _answer(
        self, target: Pose, start: list[float], angles: list[float], method: str, outside: str = ""
    ) -> Nearest:
        constraint = Constraint.of(target)
        miss = constraint.miss(frames(self.geometry, angles)[-1])
        reached = constraint.reached(miss)
        reason = ""
        if not reached:
            reason = outside or "the arm does not reach the pose from here"
            reason += f"; the nearest posture that was found misses it by {miss}"
        change = max(abs(angle - before) for angle, before in zip(angles, start, strict=True))
        return Nearest(reached, tuple(angles), miss, change, reason, method)

    def _solved(
        self,
        target: Pose,
        choice: Choice | None,
        found: NumericalSolutions | None,
        angles: Sequence[float],
        reason: str = "",
    ) -> Answer:
        constraint = Constraint.of(target)
        driven = [
            angle if joint.motor else home
            for joint, angle, home in zip(self.arm.joints, angles, self.home_rad, strict=True)
        ]
        miss, miss_driven = (
            constraint.miss(frames(self.geometry, posture)[-1]) for posture in (angles, driven)
        )
        tool = forward(self.geometry, angles)
        return Answer(self.arm, target, choice, found, tuple(angles), tool, miss, miss_driven, reason)


def _reason(choice: Choice, found: NumericalSolutions) -> str:
    """Why none of the eight solutions can be used."""
    return why_not(found) + table(candidate.rejections for candidate in choice.candidates)


def moved_tool_deg(arm: Arm, angles_deg: Array, position_mm: Sequence[float]) -> list[Array]:
    """The postures of the driven joints, (J,) each, with the tool at ``position_mm``, nearest to ``angles_deg`` first.

    With six driven joints the tool's orientation is kept; with fewer only the position is reached. Raises
    PlanError, with the reason, if there is no such posture.
    """
    solver = PoseSolver(arm)
    before = np.radians(all_angles_deg(arm, np.asarray(angles_deg, dtype=float)))
    pose = forward(Geometry.of(arm), before)
    pose[:3, 3] = position_mm
    fixed = WHOLE if len(arm.driven) >= CONSTRAINTS[WHOLE] else ()
    answer = solver.solve(Pose.of_matrix(pose, fixed), before.tolist())
    if not answer.success:
        raise PlanError(answer.reason.splitlines()[0].split("; ")[0], "choose another place")
    found: list[Array] = []
    for posture in answer.usable_deg:
        driven = np.array(posture)[list(arm.driven_indices)]
        if all(np.abs(driven - other).max() > _SAME_DEG for other in found):
            found.append(driven)
    return found
