"""The kinematics of an arm in degrees and millimetres: the public functions of this package."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armtempo.basics.arguments import checked
from armtempo.basics.arrays import Array
from armtempo.basics.errors import InputError
from armtempo.kinematics.chain import spread_deg
from armtempo.kinematics.choice import Candidate, Choice, choose_of_rows
from armtempo.kinematics.constraint import Constraint
from armtempo.kinematics.descent import most_swing
from armtempo.kinematics.forward import forward as forward_rad
from armtempo.kinematics.geometry import Geometry
from armtempo.kinematics.inverse import inverse as inverse_rad
from armtempo.kinematics.numerical import NumericalSolution, descents
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.shape import refusals
from armtempo.kinematics.solutions import OK
from armtempo.kinematics.solver import PoseSolver
from armtempo.model.arm import Arm
from armtempo.model.pose import checked_all, checked_rows
from armtempo.model.tool_pose import TOLERANCE_DEG, TOLERANCE_MM, WHOLE, Pose

_MARGIN_DEG, _MARGIN_TOLERANCES = 5.0, 50.0
"""Largest excess over a range, degrees and in tolerances, for which a posture in range is searched."""
_SWINGS = 3.0
"""A joint out of range by more than this times its first-order change within the tolerance is rejected."""
_UNUSABLE_RAD = 1e6
"""Larger than the distance of any usable posture."""
_COST = 2.0
"""Cost (as in ``descent``) of a posture at the limit of both tolerances."""
_MOST = 8
"""Number of branches of a closed form, and of solutions of a pose in ``ManySolutions``."""
_kept: tuple[Arm, PoseSolver] | None = None


class Solution:
    """Joint angles for a pose of the tool."""

    __slots__ = ("_found",)

    def __init__(self, found: Candidate | NumericalSolution) -> None:
        self._found = found

    def __repr__(self) -> str:
        where = f"angles_deg={self.angles_deg.round(4).tolist()}, branch={self.branch!r}"
        return f"Solution({where}, rejections={self.rejections!r}, distance_deg={self.distance_deg:.4g})"

    @property
    def usable(self) -> bool:
        """Whether the arm can take these angles."""
        return self._found.usable

    @property
    def angles_deg(self) -> Array:
        """(joints,): of all joints of the arm; NaN if the pose is out of reach of this branch."""
        return np.degrees(self._found.angles_rad)

    @property
    def branch(self) -> str:
        """The branch of the arm; "" for a numerical solution."""
        return str(self._found.branch) if isinstance(self._found, Candidate) else ""

    @property
    def rejections(self) -> tuple[str, ...]:
        """The reasons for rejection: out of reach, out of a joint's range; empty if usable."""
        return tuple(reason.text for reason in self._found.rejections)

    @property
    def distance_deg(self) -> float:
        """Euclidean distance in joint space from the posture to stay near to, degrees."""
        return math.degrees(self._found.distance_rad)

    @property
    def miss_mm(self) -> float:
        """Distance of the tool from the pose, mm, within its tolerance; 0 with the closed form."""
        return 0.0 if isinstance(self._found, Candidate) else self._found.miss.position_mm

    @property
    def miss_deg(self) -> float:
        """Rotation of the tool from the constrained orientation, degrees, within its tolerance."""
        return 0.0 if isinstance(self._found, Candidate) else self._found.miss.rotation_deg


@checked
def forward(arm: Arm | Path | str, angles_deg: ArrayLike) -> Array:
    """The tool's pose, Eq. (1): (..., 4, 4), lengths in mm, in the frame of the base.

    ``arm``: an arm, its file, or the name of a shipped arm. ``angles_deg``: of all joints, (..., joints), or
    of the driven ones, (..., J), with the others at their home angles. Raises InputError for another number
    of angles.
    """
    arm = Arm.shape(arm)
    return forward_rad(Geometry.of(arm), np.radians(spread_deg(arm, angles_deg)))


@checked
def inverse(
    arm: Arm | Path | str, pose: Pose | ArrayLike, near_deg: ArrayLike | None = None
) -> tuple[Solution, ...]:
    """All solutions for a pose of the tool: usable ones first, the nearest to ``near_deg`` first.

    ``pose``: (4, 4) or (3, 4), lengths in mm, or a Pose, possibly with a partial orientation. ``near_deg``,
    (joints,) or (J,): the posture to stay near to; None: home. A complete pose of an arm with a closed form
    has eight solutions, of which some may be rejected; slides under it stay where they are. For any other arm or
    pose, the result is that of a numerical search with the driven joints, possibly empty: one solution if the arm is
    redundant for the pose, else all, but at most 16 of a continuum, as at a singular pose. Raises InputError for a
    matrix that is not a pose.
    """
    solver = _solver(arm)
    near = solver.home_rad if near_deg is None else tuple(_posture(solver.arm, near_deg).tolist())
    given, rows = (pose.exact(), []) if isinstance(pose, Pose) else (None, checked_rows(pose))
    if given:
        rows = [number for row in given.matrix for number in row]
    if solver.refusals or (given and given.fixed != WHOLE):
        answer = solver.solve(given or _whole(rows), near)
        return _listed(answer.search.solutions if answer.search else ())
    choice = choose_of_rows(solver.geometry.holding(near), rows, solver.ranges, near)
    found = _listed(choice.candidates)
    return found if found[0].usable else _listed(_within_tolerance(solver, choice, given, near)) or found


def _listed(found: Sequence[Candidate | NumericalSolution]) -> tuple[Solution, ...]:
    return tuple(map(Solution, sorted(found, key=_order)))


def _order(one: Candidate | NumericalSolution) -> float:
    """Sort key: usable solutions first, nearest first; unreachable ones last."""
    distance = one.distance_rad
    if one.usable:
        return distance
    return math.inf if math.isnan(distance) else _UNUSABLE_RAD + distance


def _solver(arm: Arm | Path | str) -> PoseSolver:
    """The solver of an arm, cached for its next pose."""
    global _kept
    if _kept and _kept[0] is arm:
        return _kept[1]
    shape = Arm.shape(arm)
    solver = PoseSolver(shape)
    _kept = (arm if isinstance(arm, Arm) else shape), solver
    return solver


def _within_tolerance(
    solver: PoseSolver, choice: Choice, given: Pose | None, near: Sequence[float]
) -> list[NumericalSolution]:
    """Postures in range within the pose's tolerance, if the exact ones are only slightly out of range or reach."""
    tolerance_mm, tolerance_deg = (
        (given.tolerance_mm, given.tolerance_deg) if given else (TOLERANCE_MM, TOLERANCE_DEG)
    )
    slack = math.radians(max(_MARGIN_DEG, _MARGIN_TOLERANCES * tolerance_deg))
    close = [each for each in choice.candidates if each.outside_rad <= slack]
    beyond = choice.beyond
    if not close and beyond == math.inf:
        return []
    turned = math.radians(tolerance_deg)
    reach = tolerance_mm + 2.0 * math.sin(0.5 * turned) * math.hypot(*choice.shape.flange)
    most = _SWINGS * math.sqrt(_COST)
    beside = [each.placed_rad for each in close if choice.may_fit(each, most * reach, most * turned)]
    starts = choice.of_nearer_poses(near, reach, slack) if beyond < reach else []
    if not beside and not starts:
        return []
    target, core = given or _whole(choice.pose), choice.geometry.core
    problem = replace(solver.moving.with_all, geometry=choice.geometry).problem(
        Constraint.of(target), within=False
    )
    for angles in beside:
        swing = _SWINGS * most_swing(problem, angles, _COST)
        if np.all(np.abs(solver.ranges.excess(angles)[core]) <= swing):
            starts.append(angles)
    return descents(solver.moving.with_all, target, near, starts) if starts else []


def _whole(rows: Sequence[float]) -> Pose:
    return Pose.of_matrix(np.reshape(rows, (4, 4)))


def _posture(arm: Arm, near_deg: ArrayLike) -> Array:
    """All joints, (joints,), in rad."""
    near = np.asarray(near_deg, dtype=float)
    if near.ndim != 1:
        raise InputError("near_deg must be one posture", "give an angle for each joint")
    return np.radians(spread_deg(arm, near, "near_deg: "))


@dataclass(frozen=True, eq=False)
class ManySolutions:
    """Joint angles for each of N tool poses."""

    angles_deg: Array
    """(N, 8, joints): whole turns added to lie in the ranges, nearest to the posture to stay near to; NaN if out of
    reach. Without a closed form those of ``inverse``, at most 8, and then NaN."""
    usable: NDArray[np.bool_]
    """(N, 8): within reach and all ranges, and not equal to an earlier one."""
    nearest_deg: Array
    """(N, joints): the usable solution nearest to that posture; NaN if there is none."""


@checked
def inverse_many(arm: Arm | Path | str, poses: ArrayLike, near_deg: ArrayLike | None = None) -> ManySolutions:
    """The eight solutions of each of many poses, some hundred thousand per second; ``inverse`` gives reasons
    for rejection.

    ``poses``: (N, 4, 4) or (N, 3, 4), lengths in mm; ``near_deg``, (joints,) or (J,): the posture to stay near to;
    None: home. For an arm without a closed form, such as one with a sliding joint, each pose takes the search of
    ``inverse``. Raises InputError for what is not a pose.
    """
    arm = Arm.shape(arm)
    geometry, ranges = Geometry.of(arm), Ranges.of(arm)
    given = checked_all(poses)
    if refusals(geometry):
        return _each(arm, given, near_deg)
    near = np.array(arm.all_home_deg) if near_deg is None else np.asarray(near_deg, dtype=float)
    if near.ndim != 1:
        raise InputError("near_deg must be one posture", "give an angle for each joint")
    near = np.radians(spread_deg(arm, near, "near_deg: "))
    found = inverse_rad(geometry, given, near)
    angles, inside = _placed(ranges, found.angles_rad, near)
    usable = inside & (found.outcome == OK)
    distance = np.where(usable, np.linalg.norm(angles - near, axis=2), np.inf)
    best = angles[np.arange(len(angles)), distance.argmin(axis=1)]
    nearest = np.where(usable.any(axis=1)[:, None], best, np.nan)
    return ManySolutions(np.degrees(angles), usable, np.degrees(nearest))


def _each(arm: Arm, poses: Array, near_deg: ArrayLike | None) -> ManySolutions:
    """The solutions of ``inverse`` for each of the poses (N, 4, 4)."""
    angles = np.full((len(poses), _MOST, len(arm.joints)), np.nan)
    usable = np.zeros(angles.shape[:2], dtype=bool)
    for number, pose in enumerate(poses):
        for place, one in enumerate(inverse(arm, pose, near_deg)[:_MOST]):
            angles[number, place], usable[number, place] = one.angles_deg, one.usable
    return ManySolutions(angles, usable, np.where(usable[:, :1], angles[:, 0], np.nan))


def _placed(ranges: Ranges, angles: Array, near: Array) -> tuple[Array, NDArray[np.bool_]]:
    """``ranges.placed`` for angles (N, 8, joints), and whether all joints lie in their ranges then: (N, 8)."""
    low, high, beyond = ranges.low, ranges.high, ranges.outside_rad
    least = np.ceil((low - beyond - angles) / math.tau)
    most = np.floor((high + beyond - angles) / math.tau)
    turns = np.clip(np.round((near - angles) / math.tau), least, most)
    within = np.clip(angles + math.tau * turns, low, high)
    below, above = angles + math.tau * (least - 1.0), angles + math.tau * least
    nearest = np.where(low - below < above - high, below, above)
    fits = least <= most
    return np.where(fits, within, nearest), np.all(fits, axis=2)
