"""From a job's poses, or a mix of poses and angles, to via angles of the driven joints.

A pose asks for all joints of the arm, but only joints with a motor move; the others stay at ``home_deg``.
So for each pose

1. the ranges of the driven joints alone decide which solutions can be used;
2. if the job gives ``posture_deg``, the solution nearest to it is taken; else one that reaches the pose
   with the undriven joints at home comes first, and among equals the one nearest to the posture before;
3. the driven joints take their angles from it. What the pose would need of the others, and how far the tool
   misses it without, is said in a note.

A pose that asks for less than the whole orientation is solved for the driven joints alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armtempo.basics.arrays import Array
from armtempo.basics.errors import ArmtempoError, InputError, PlanError
from armtempo.kinematics.choice import Choice, choose
from armtempo.kinematics.constraint import Constraint, Miss
from armtempo.kinematics.forward import frames
from armtempo.kinematics.ranges import Ranges
from armtempo.kinematics.rejection import table
from armtempo.kinematics.solutions import Branch, branch_of
from armtempo.kinematics.solver import PoseSolver
from armtempo.model.arm import Arm
from armtempo.model.job import Job
from armtempo.model.pallet import ArmPallet
from armtempo.model.posture import ArmPosture
from armtempo.model.tool_pose import WHOLE, Pose

STAYS_DEG = 0.01
"""A joint without a motor that a pose needs this little away from home need not be named."""

WORTH_SAYING = 0.01
"""A miss of more than this part of the tolerance is said."""


@dataclass(frozen=True)
class Note:
    """Something about the via points that the user must know."""

    kind: str
    """"undriven": the pose needs joints without a motor; "miss": the tool comes near to the pose, within its
    tolerance; "branch": the arm changes its branch before it."""
    via: int
    """Number of the via point, from 0."""
    text: str


@dataclass(frozen=True)
class Resolved:
    """The via points as angles."""

    via_deg: Array
    """(n + 1, J): of the driven joints."""
    notes: tuple[Note, ...]


@dataclass(frozen=True)
class _Setup:
    """What all via points share."""

    arm: Arm
    solver: PoseSolver
    ranges: Ranges
    """Of the driven joints; for the others, which stay, the whole turn about home."""
    home: Array
    """(joints,), rad."""
    driven: NDArray[np.bool_]
    closed_form: bool

    @classmethod
    def of(cls, arm: Arm) -> _Setup:
        ends = [
            joint.range_deg if joint.motor else (joint.home_deg - 180.0, joint.home_deg + 180.0)
            for joint in arm.joints
        ]
        low, high = np.radians(ends).T
        solver = PoseSolver(arm)
        driven = np.array([joint.motor is not None for joint in arm.joints])
        return cls(
            arm,
            solver,
            Ranges(low, high, solver.ranges.slides, solver.ranges.beyond_rad),
            np.array(solver.home_rad),
            driven,
            not solver.refusals,
        )

    def moved(self, angles: Array) -> Array:
        """The posture with the driven joints at ``angles`` and the others at their home angles."""
        return np.where(self.driven, angles, self.home)

    def miss(self, target: Pose, angles: Array) -> Miss:
        """How far the tool stays from its pose if only the driven joints move."""
        tool = frames(self.solver.geometry, self.moved(angles).tolist())[-1]
        return Constraint.of(target).miss(tool)


def resolve(arm: Arm, job: Job) -> Resolved:
    """Turn every pose of ``job`` into angles, in order, each nearest to the one before.

    Raises InputError for a via point that is not a pose or has the wrong number of angles, PlanError with all
    reasons for a pose that no solution reaches.
    """
    setup = _Setup.of(arm)
    postures: list[Array] = []
    notes: list[Note] = []
    posture = setup.home
    branch: Branch | None = None
    led = {segment.via for segment in job.tool_segments if segment.line}
    for number, via in enumerate(job.via):
        where = f"job {job.name!r}, P{number}"
        choice = None
        if number in led and isinstance(via, Pose):
            target = via.exact(where)
            needed = _led(arm, job, number, np.degrees(postures[-1])[setup.driven], setup)
            _check_arrival(setup, target, needed, where)
        elif isinstance(via, Pose):
            target = via.exact(where)
            previous = posture if via.posture_deg is None else _preferred(setup, via.posture_deg, where)
            home_first = via.posture_deg in (None, arm.all_home_deg)
            needed, choice = _solve(setup, target, previous, home_first, where)
            notes += _miss_note(setup, target, needed, number)
        else:
            needed = _spread(setup, via, where)
        posture = setup.moved(needed)
        postures.append(posture)
        if setup.closed_form:
            before, branch = branch, _branch(setup, posture, branch)
            if before and number not in led and Pose in (type(via), type(job.via[number - 1])):
                notes += _branch_note(before, branch, choice, number)
    return Resolved(np.degrees(np.array(postures)[:, setup.driven]), tuple(notes))


def _led(arm: Arm, job: Job, number: int, before_deg: Array, setup: _Setup) -> Array:
    """Where the line to a via point leads to from driven angles (J,): all joints, (joints,) in rad."""
    from armtempo.planning.line import legs  # here, because most jobs have no lines

    found = setup.home.copy()
    found[setup.driven] = np.radians(legs.end_deg(arm, job, number, before_deg))
    return found


def _check_arrival(setup: _Setup, target: Pose, needed: Array, where: str) -> None:
    """Raise PlanError if a line does not end at its pose."""
    miss = setup.miss(target, needed)
    if not Constraint.of(target).reached(miss):
        raise PlanError(
            f"{where}: the line ends {miss} from the pose, as it keeps less of the orientation",
            "ask for the whole orientation, for approach, or for position_mm alone; or leave line out",
        )


def posture_deg(arm: Arm, posture: ArmPosture) -> Array:
    """The driven joints' angles of a named posture, degrees (J,); of the solutions of a pose the one nearest to home.

    They are the ones that ``resolve`` takes. Raises PlanError if the arm cannot take it.
    """
    if not isinstance(posture.where, Pose):
        return np.array(arm.placed(posture.where))
    return _reached(_Setup.of(arm), posture.where, None, f"posture {posture.name!r}")


def nearest(arm: Arm, pose: Pose, here_deg: Sequence[float]) -> Array:
    """The driven joints' angles that bring the tool to a pose, degrees (J,), nearest to ``here_deg`` (J,).

    Raises PlanError if the arm cannot take it.
    """
    setup, where = _Setup.of(arm), "the pose"
    return _reached(setup, pose, _spread(setup, tuple(here_deg), where), where)


def _reached(setup: _Setup, pose: Pose, near: Array | None, where: str) -> Array:
    """The driven joints' angles for a pose, degrees (J,), nearest to ``near``, (joints,) in rad; None: to home."""
    target = pose.exact(where)
    needed, _ = _solve(setup, target, setup.home if near is None else near, True, where)
    if not Constraint.of(target).reached(setup.miss(target, needed)):
        raise PlanError(
            f"{where}: the pose needs joints that have no motor: {_needs(setup, needed)}",
            "ask for less of its orientation, or give angles",
        )
    return np.asarray(np.degrees(setup.moved(needed)[setup.driven]))


def check_postures(arm: Arm) -> None:
    """InputError for a named posture whose tool pose the arm cannot take."""
    for posture in arm.postures:
        try:
            posture_deg(arm, posture)
        except PlanError as error:
            raise InputError(f"{arm.source}: {error.problem}", error.hint) from None


def _spread(setup: _Setup, via: tuple[float, ...], where: str) -> Array:
    """All joints, the driven ones at the angles of a via point."""
    if len(via) != setup.driven.sum():
        raise InputError(
            f"{where}: {len(via)} {setup.arm.texts.position}s, but {setup.driven.sum()} joints have a motor",
            f"give one {setup.arm.texts.position} for each of them",
        )
    posture = setup.home.copy()
    posture[setup.driven] = np.radians(via)
    return posture


def _solve(
    setup: _Setup, target: Pose, previous: Array, home_first: bool, where: str
) -> tuple[Array, Choice | None]:
    """All that the pose asks for, (joints,) in rad; the choice only if it came of the closed form."""
    if not setup.closed_form or target.fixed != WHOLE:
        return _searched(setup, target, previous, where), None
    geometry = setup.solver.geometry.holding(previous.tolist())
    choice = choose(geometry, target.matrix, setup.ranges, previous)
    usable = [candidate for candidate in choice.candidates if candidate.usable]
    if not usable:
        return _searched(setup, target, previous, where, choice), None
    if home_first:
        reached = Constraint.of(target).reached
        usable = [c for c in usable if reached(setup.miss(target, c.angles_rad))] or usable
    return min(usable, key=lambda candidate: candidate.distance_rad).angles_rad, choice


def _searched(
    setup: _Setup, target: Pose, previous: Array, where: str, choice: Choice | None = None
) -> Array:
    """A posture of the numerical search, (joints,) in rad; PlanError with all reasons if there is none."""
    answer = setup.solver.solve(target, previous.tolist(), numerically=True)
    if answer.success:
        return np.array(answer.angles_rad)
    reasons = table(candidate.rejections for candidate in choice.candidates) if choice else ""
    raise PlanError(
        f"{where}: {answer.reason}{reasons}",
        "move or turn the pose, or ask for less of its orientation",
    )


def _preferred(setup: _Setup, posture_deg: tuple[float, ...], where: str) -> Array:
    if len(posture_deg) != len(setup.home):
        raise InputError(
            f"{where}: {setup.arm.texts.list_key('posture_deg')} has {len(posture_deg)} "
            f"{setup.arm.texts.position}s, not {len(setup.home)}",
            f"give one {setup.arm.texts.position} for each joint of the arm",
        )
    return np.radians(posture_deg)


def _miss_note(setup: _Setup, target: Pose, needed: Array, number: int) -> list[Note]:
    """What to say if the tool does not quite reach the pose."""
    miss = setup.miss(target, needed)
    if not Constraint.of(target).reached(miss):
        text = (
            f"P{number}: the pose needs joints that have no motor: {_needs(setup, needed)}; the tool misses the "
            f"pose by {miss}"
        )
        return [Note("undriven", number, text)]
    if max(miss.position_mm / target.tolerance_mm, miss.rotation_deg / target.tolerance_deg) > WORTH_SAYING:
        allowed = f"{target.tolerance_mm:g} mm and {target.tolerance_deg:g} deg"
        return [Note("miss", number, f"P{number}: the tool misses the pose by {miss} ({allowed} allowed)")]
    return []


def _needs(setup: _Setup, needed: Array) -> str:
    return ", ".join(
        f"{joint.name} at {angle:.4g} {joint.unit.name} (stays at {joint.home_deg:g})"
        for joint, angle in zip(setup.arm.joints, np.degrees(needed), strict=True)
        if joint.motor is None and abs(angle - joint.home_deg) > STAYS_DEG
    )


def _branch(setup: _Setup, posture: Array, before: Branch | None) -> Branch:
    """The branch at a via point; if the arm is between two, it still counts as on the one before."""
    here = branch_of(setup.solver.geometry.holding(posture.tolist()), posture)
    return here.after(before) if before else here


def _branch_note(old: Branch, new: Branch, choice: Choice | None, number: int) -> list[Note]:
    changed = old.differs(new)
    if not changed:
        return []
    text = (
        f"between P{number - 1} and P{number} the arm changes its branch ({', '.join(changed)}): from "
        f"{old} to {new}, so the joints pass through a singular posture on the way"
    )
    for candidate in choice.candidates if choice else ():
        if not old.differs(candidate.branch) and not candidate.usable:
            text += f". Staying in {candidate.branch} is not possible: {candidate.rejections[0].text}"
            break
    return [Note("branch", number, text)]


# places of pallets
@dataclass(frozen=True)
class Place:
    """A place of a pallet."""

    name: str
    """Its row, column, layer and pallet."""
    pose: Pose
    """Of the tool there, in the base."""
    above_deg: tuple[float, ...]
    """The driven joints' angles with the tool above it, degrees (J,)."""


def places(arm: Arm, pallet: ArmPallet) -> list[Place]:
    """All places, in order; the angles above each are the solution nearest to the place before, at first to home.

    Raises PlanError, with row, column and layer, for a place above which the tool cannot be; InputError as
    ``ArmPallet.pose``.
    """
    found: list[Place] = []
    for number in range(1, pallet.places + 1):
        name = pallet.describe(number)
        above = pallet.pose(number, arm.frames, above=True)
        try:
            if found:
                angles = nearest(arm, above, found[-1].above_deg)
            else:
                home = replace(above, posture_deg=arm.all_home_deg)
                angles = posture_deg(arm, ArmPosture(name, home))
        except ArmtempoError as error:
            problem = error.problem.split(": ", 1)[-1]
            raise type(error)(f"{pallet.above_mm:g} mm above {name}: {problem}", error.hint) from error
        found.append(Place(name, pallet.pose(number, arm.frames), tuple(map(float, angles))))
    return found
