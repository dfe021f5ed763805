"""A user's program for the board: its record, with the arm's names in the board's numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from armtempo_shared import program
from armtempo_shared.limits import FULL_OUTPUT, MAX_MOTION_BYTES
from armtempo_shared.wire import record_crc

from armtempo.basics.errors import ArmtempoError, InputError, PlanError
from armtempo.encoding import encode, encoded_motion, planned_for
from armtempo.encoding.encoded_motion import EncodedMotion, MotionKey
from armtempo.model.arm import Arm
from armtempo.model.outputs import SWITCH, Output
from armtempo.model.plan import Plan
from armtempo.model.posture import HOME
from armtempo.model.user_program import UserProgram
from armtempo.planning import point_to_point, via_points, workspace_check


@dataclass(frozen=True, eq=False)
class EncodedProgram:
    """A program that the board stores and runs."""

    program: UserProgram
    arm: Arm
    motions: tuple[EncodedMotion, ...]
    """Those that are uploaded with it."""
    data: bytes
    """The program record (layout: ``armtempo_shared.program``)."""

    @property
    def key(self) -> MotionKey:
        """Its identification on the board."""
        return MotionKey(self.program.name, record_crc(self.data))

    @property
    def records(self) -> tuple[tuple[str, bytes], ...]:
        """What the board stores, the motions first: names and records."""
        return (*((motion.name, motion.data) for motion in self.motions), (self.program.name, self.data))

    @property
    def heap_bytes(self) -> int:
        """Heap that it needs on the board."""
        return program.needed_bytes(len(self.program.marked.encode()))


def motions_beside(found: UserProgram, arm: Arm) -> tuple[EncodedMotion, ...]:
    """The motions that a program names and whose plans are beside it; InputError for one that does not fit the arm."""
    files = {name: found.motion_file(name) for name in found.motions}
    plans = {name: Plan.load(file) for name, file in files.items() if file.is_file()}
    for name, plan in plans.items():
        planned_for.check(files[name], plan.arm, plan.job.frames, arm)
    return tuple(encoded_motion.of_plan(plan, name) for name, plan in plans.items())


def of_program(
    found: UserProgram, arm: Arm, motions: tuple[EncodedMotion, ...] = (), stored: tuple[MotionKey, ...] = ()
) -> EncodedProgram:
    """Encode a program for ``arm``; ``stored``: motions that it runs and the board has.

    Raises InputError if it is too large for the board.
    """
    keys = [*(motion.key for motion in motions), *stored]
    crcs = {key.name: key.crc for key in keys}
    contents = {"file": found.file, "motions": crcs, "counters": [*found.counters], **table(arm)}
    try:
        data = program.pack(record_crc(encode.arm_record(arm)), contents, found.marked)
    except program.ProgramError:
        raise InputError(
            f"{found.path}: the program and the arm's names take more than the {MAX_MOTION_BYTES} bytes of the board",
            "make it shorter",
        ) from None
    return EncodedProgram(found, arm, motions, data)


def table(arm: Arm) -> dict[str, Any]:
    """What ``cell`` must know of an arm, see ``armtempo_shared.program``; postures that it cannot take are left out.

    Raises InputError for an arm with coupled joints: the board knows its motors, but no limits of its joints.
    """
    if arm.coupling:
        raise InputError(
            f"arm {arm.name!r} has coupled joints: the board cannot make moves for it",
            "let the host move it (board.goto, armtempo run), or plan a sequence",
        )
    return {
        "limits": encode.move_limits(arm),
        "per_deg": [joint.steps_per_deg for joint in arm.driven],
        "postures": _postures(arm),
        "outputs": {
            output.name: [number, *output.range, _states(output)] for number, output in enumerate(arm.outputs)
        },
        "inputs": {entry.name: number for number, entry in enumerate(arm.inputs)},
    }


def _postures(arm: Arm) -> dict[str, list[int]]:
    found = {}
    for name in (HOME, *(posture.name for posture in arm.postures)):
        try:
            found[name] = arm.transmission.whole_steps(via_points.posture_deg(arm, arm.posture(name)))
        except ArmtempoError:
            continue
    return found


def _states(output: Output) -> dict[str, int]:
    states = {name: output.raw(name) for name, _ in output.states}
    return {"off": 0, "on": FULL_OUTPUT, **states} if output.kind == SWITCH else states


def moves_that_touch(found: EncodedProgram) -> list[str]:
    """What is wrong with straight moves between the postures that the program names and the ends of its motions.

    The board knows nothing of the workspace; which of these moves the program makes is not known either.
    """
    arm = found.arm
    if not workspace_check.can_touch(arm):
        return []
    places = {
        f"posture {name!r}": via_points.posture_deg(arm, arm.posture(name)) for name in found.program.postures
    }
    for motion in found.motions:
        places[f"the start of {motion.name!r}"] = motion.start_deg
        places[f"the end of {motion.name!r}"] = motion.trajectory(motion.trajectory.duration_s)
    problems = []
    names = [*places]
    for number, here in enumerate(names):
        for there in names[number + 1 :]:
            try:
                workspace_check.check(arm, point_to_point.straight("goto", places[here], places[there], arm))
            except PlanError as error:
                problems.append(f"between {here} and {there}: {error.problem}")
    return problems
