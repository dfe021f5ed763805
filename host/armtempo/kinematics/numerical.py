"""The numerical inverse, for any arm and any target: all postures that a seeded search finds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from armtempo.basics.arrays import Array
from armtempo.kinematics.constraint import Constraint, Miss
from armtempo.kinematics.descent import PoseProblem, Posture, descend
from armtempo.kinematics.forward import forward
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.rejection import Rejection, out_of_range, table
from armtempo.model.arm import Arm
from armtempo.model.joint_unit import DEG, MM
from armtempo.model.pose import to_rpy_deg
from armtempo.model.tool_pose import Pose

LEAST_STARTS, MOST_STARTS = 40, 240
STARTS_PER_SOLUTION = 12
"""The search ends after this many starts for each found solution, plus one."""

SAME_RAD = 1e-4
"""Tolerance for equal postures, up to whole turns."""

BOUNDED_STARTS = 12
"""Starts within the ranges for the posture nearest to an unreachable target."""

_NEARLY = 10.0
"""A miss of fewer tolerances than this can be allowed; a larger one is a pose out of reach."""

MOST_SOLUTIONS = 16
"""Largest number of isolated postures of six revolute joints for a complete pose; more means redundancy."""


@dataclass(frozen=True)
class MovingArm:
    """An arm with some moving joints, for the numerical solver."""

    geometry: Geometry
    """In mm."""
    ranges: Ranges
    moving: tuple[int, ...]
    """Indices of the moving joints; the others keep their start angles."""

    @classmethod
    def of(cls, arm: Arm) -> MovingArm:
        """An arm whose driven joints move."""
        return cls(Geometry.of(arm), Ranges.of(arm), arm.driven_indices)

    @cached_property
    def with_all(self) -> MovingArm:
        """The same arm with every joint moving."""
        return replace(self, moving=tuple(range(self.geometry.joints)))

    @cached_property
    def bounds(self) -> tuple[tuple[float, float], ...]:
        """Ranges of the moving joints."""
        return tuple(self.ranges.ends[joint] for joint in self.moving)

    def problem(self, constraint: Constraint, within: bool) -> PoseProblem:
        """The problem of a constraint, ``within`` the ranges or with unbounded angles."""
        return PoseProblem(self.geometry, constraint, self.moving, self.bounds if within else None)

    def placed(self, angles_rad: Sequence[float], previous_rad: Sequence[float]) -> list[float]:
        """The angles with whole turns added to those of the moving joints, as by ``Ranges.placed``."""
        placed = self.ranges.placed(angles_rad, previous_rad)
        return [placed[i] if i in self.moving else angle for i, angle in enumerate(angles_rad)]

    def underdetermined(self, target: Pose) -> bool:
        """Whether more joints move than the target has constraints."""
        return len(self.moving) > target.constraints


@dataclass(frozen=True, eq=False)
class NumericalSolution:
    """A posture found by the search."""

    angles_rad: list[float]
    """(joints,): whole turns added to lie in the ranges, nearest to the previous posture."""
    miss: Miss
    rejections: tuple[Rejection, ...]
    """The reasons for rejection: joints out of range; empty if it is usable."""
    distance_rad: float
    """Root of the sum of squares of the joints' ways from the previous posture."""

    @property
    def usable(self) -> bool:
        """Whether the arm can take these angles."""
        return not self.rejections


@dataclass(frozen=True)
class NumericalSolutions:
    """The result of the search for one target."""

    arm: MovingArm
    target: Pose
    solutions: tuple[NumericalSolution, ...]
    """Postures within the tolerances; usable ones first, nearest first."""
    nearest: NumericalSolution
    """The chosen posture; if none is usable, the posture within the ranges nearest to the target."""
    starts: int
    """Number of starts."""

    @property
    def chosen(self) -> NumericalSolution | None:
        """The usable solution nearest to the previous posture."""
        usable = self.solutions and not self.solutions[0].rejections
        return self.solutions[0] if usable else None

    @property
    def leaves_free(self) -> bool:
        """Whether there is a continuum of postures."""
        return self.arm.underdetermined(self.target) or len(self.solutions) >= MOST_SOLUTIONS

    @property
    def reason(self) -> str:
        """Why no posture is usable, and what to do; "" if one is."""
        if self.chosen:
            return ""
        return why_not(self) + (table(each.rejections for each in self.solutions) if self.solutions else "")


def search(arm: MovingArm, target: Pose, previous_rad: Sequence[float], seed: int = 0) -> NumericalSolutions:
    """Search the postures that meet ``target``, from ``previous_rad``, (joints,), and from random postures.

    The same ``seed`` gives the same answer. For a redundant arm it returns the one posture of the descent
    from ``previous_rad``, or the first one found.
    """
    previous = [float(angle) for angle in previous_rad]
    problem = arm.problem(Constraint.of(target), arm.underdetermined(target))
    found: list[NumericalSolution] = []
    starts = 0
    for start in _starts(arm, previous, seed):
        solution = _solution(arm, problem, descend(problem, start), previous)
        starts += 1
        if problem.constraint.reached(solution.miss) and not _known(arm, solution, found):
            found.append(solution)
        if _enough(arm, target, found, starts):
            break
    ordered = sorted(found, key=lambda solution: (bool(solution.rejections), solution.distance_rad))
    nearest = (
        ordered[0] if ordered and not ordered[0].rejections else _least_miss(arm, target, previous, seed)
    )
    if problem.constraint.reached(nearest.miss) and nearest not in ordered:
        ordered.insert(0, nearest)
    return NumericalSolutions(arm, target, tuple(ordered[:MOST_SOLUTIONS]), nearest, starts)


def descents(
    arm: MovingArm, target: Pose, previous_rad: Sequence[float], starts_rad: Sequence[Sequence[float]]
) -> list[NumericalSolution]:
    """The results of descents from the starts that meet ``target`` within the ranges."""
    problem, previous = arm.problem(Constraint.of(target), within=True), list(previous_rad)
    found: list[NumericalSolution] = []
    for start in starts_rad:
        solution = _solution(arm, problem, descend(problem, start), previous)
        if problem.constraint.reached(solution.miss) and not _known(arm, solution, found):
            found.append(solution)
    return found


def _starts(arm: MovingArm, previous: list[float], seed: int) -> Iterator[list[float]]:
    """The previous posture, then random ones: within the ranges, or within a turn if one is wider and not sliding."""
    yield previous
    rng = np.random.default_rng(seed)
    ends = [
        (low, high if joint in arm.ranges.slides else min(high, low + math.tau))
        for joint, (low, high) in zip(arm.moving, arm.bounds, strict=True)
    ]
    for _ in range(MOST_STARTS - 1):
        start = previous.copy()
        for joint, (low, high) in zip(arm.moving, ends, strict=True):
            start[joint] = rng.uniform(low, high)
        yield start


def _enough(arm: MovingArm, target: Pose, found: list[NumericalSolution], starts: int) -> bool:
    if arm.underdetermined(target) and found:
        return True
    return starts >= max(LEAST_STARTS, STARTS_PER_SOLUTION * (len(found) + 1)) or len(found) > MOST_SOLUTIONS


def _solution(
    arm: MovingArm, problem: PoseProblem, posture: Posture, previous: list[float]
) -> NumericalSolution:
    angles = arm.placed(posture.angles_rad, previous)
    rejections = tuple(
        each for each in out_of_range(arm.ranges, angles) if (each.joint or 0) - 1 in arm.moving
    )
    miss = problem.constraint.miss(posture.frames[-1])
    return NumericalSolution(angles, miss, rejections, math.dist(angles, previous))


def _known(arm: MovingArm, one: NumericalSolution, found: list[NumericalSolution]) -> bool:
    return any(_same(arm, one, other) for other in found)


def _same(arm: MovingArm, one: NumericalSolution, other: NumericalSolution) -> bool:
    return all(
        abs(a - b if joint in arm.ranges.slides else math.remainder(a - b, math.tau)) < SAME_RAD
        for joint, (a, b) in enumerate(zip(one.angles_rad, other.angles_rad, strict=True))
    )


def _least_miss(arm: MovingArm, target: Pose, previous: list[float], seed: int) -> NumericalSolution:
    """The posture within the ranges nearest to the target, from a few starts."""
    problem = arm.problem(Constraint.of(target), within=True)
    best = descend(problem, previous)
    for _, start in zip(range(BOUNDED_STARTS), _starts(arm, previous, seed), strict=False):
        if problem.constraint.reached(problem.constraint.miss(best.frames[-1])):
            break
        best = min(best, descend(problem, start), key=lambda posture: posture.cost)
    return _solution(arm, problem, best, previous)


def why_not(answer: NumericalSolutions) -> str:
    """Why no posture is usable, how near the arm comes, and what to do."""
    target, miss = answer.target, answer.nearest.miss
    where = " within the joint ranges" if answer.solutions else ""
    return (
        f"no posture{where} reaches this pose within {target.tolerance_mm:g} mm and {target.tolerance_deg:g} deg: the "
        f"nearest one that was found misses it by {miss}{_ends(answer)}; {_next_step(answer)}"
    )


def _ends(answer: NumericalSolutions) -> str:
    """The joints of the nearest posture that are at an end of their ranges."""
    found = []
    for joint, (low, high) in zip(answer.arm.moving, answer.arm.bounds, strict=True):
        angle = answer.nearest.angles_rad[joint]
        for end in {low, high} if low < high else ():
            if abs(angle - end) < SAME_RAD:
                unit = MM if joint in answer.arm.ranges.slides else DEG
                found.append(f"joint {joint + 1} at the end of its range, {math.degrees(end):g} {unit.name}")
    return f", with {' and '.join(found)}" if found else ""


def _next_step(answer: NumericalSolutions) -> str:
    target, joints, miss = answer.target, len(answer.arm.moving), answer.nearest.miss
    if target.fixed and (turned := _turned(answer)) is not None:
        roll, pitch, yaw = (round(value, 1) + 0.0 for value in to_rpy_deg(turned))
        step = f"its position is reached with roll {roll:g}, pitch {pitch:g}, yaw {yaw:g} deg"
    else:
        x, y, z = np.round(_tool(answer.arm, answer.nearest)[:3, 3], 1) + 0.0
        step = f"bring the pose nearer to the arm, which comes to x {x:g}, y {y:g}, z {z:g} mm in the base"
    if max(miss.position_mm / target.tolerance_mm, miss.rotation_deg / target.tolerance_deg) < _NEARLY:
        step += ", or allow more by tolerance_mm and tolerance_deg"
    if target.constraints <= joints or not target.fixed:
        return step
    moving = f"{joints} joints move" if joints > 1 else "1 joint moves"
    return (
        f"{step}; as it asks for {target.constraints} numbers and {moving}, ask for less: "
        f"{FITTING.get(joints, 'the position only')}"
    )


def _turned(answer: NumericalSolutions) -> Array | None:
    """The tool, (4, 4), at the position of the target in another orientation; None if none was found."""
    arm, nearest = answer.arm, answer.nearest.angles_rad
    found = descents(arm, replace(answer.target, fixed=()), nearest, [nearest])
    return _tool(arm, found[0]) if found else None


def _tool(arm: MovingArm, solution: NumericalSolution) -> Array:
    return forward(arm.geometry, solution.angles_rad)


FITTING = {4: "position and pitch", 5: "position and approach, or position, roll and pitch"}
"""Suitable constraints by number of moving joints."""
