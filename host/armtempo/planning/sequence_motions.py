"""The different motions of a sequence, each planned once for its tool and load."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.basics.progress import Progress
from armtempo.model import frame
from armtempo.model.arm import Arm
from armtempo.model.job import GRADIENT, Job
from armtempo.model.leg import PlanLeg
from armtempo.model.parts import NOTHING
from armtempo.model.plan import Plan
from armtempo.model.posture import ArmPosture
from armtempo.model.steps import SourceMotion
from armtempo.model.tool import ArmTool
from armtempo.model.tool_pose import BASE, Pose
from armtempo.planning import board_limits, checks, planner, via_points, workspace_check
from armtempo.splines.trajectory import Trajectory

Angles = tuple[float, ...]
_REFINE = 16
"""Time segments of a straight motion: within 1 % of its lower bound, and quickly checked by the board."""
_SAME_STEPS = 1 / 128
"""Tolerance for equal angles, steps: the board allows 1/64 step between two motions."""


@dataclass(frozen=True)
class NamedAngles:
    """A posture of the arm, and its name for messages."""

    angles_deg: Angles
    name: str


@dataclass
class SequenceMotions:
    """The motions so far, and the arm with its present tool and load."""

    arm: Arm
    progress: Progress | None
    holds: str = ""
    """The present load."""
    legs: list[PlanLeg] = field(default_factory=list)
    changes_tool: bool = False
    notes: list[str] = field(default_factory=list)
    frames: list[str] = field(default_factory=list)
    """Those in which poses were given."""
    _known: dict[tuple[object, ...], int] = field(default_factory=dict)
    _plans: dict[tuple[int, str, str], Trajectory] = field(default_factory=dict)
    _motions: dict[int, SourceMotion] = field(default_factory=dict)

    @property
    def tool(self) -> str:
        """The name of the present tool."""
        return self.arm.tool.name if self.arm.tool else NOTHING

    def joint_move(self, here: Angles, to: Angles, where: str) -> int:
        """Number of the leg in which all joints move straight from one posture to another."""
        key = (self.tool, self.holds, here, to)
        if key not in self._known:
            self._known[key] = self._add(self._straight(here, to, where), self.holds)
        return self._known[key]

    def line(self, here: Angles, to: Angles | Pose, speed_mm_s: float | None, where: str) -> int:
        """Number of the leg in which the tool moves in a straight line to angles (J,), or to a pose."""
        key = (self.tool, self.holds, "line", here, to, speed_mm_s)
        if key not in self._known:
            try:
                found = planner.straight_line(self.arm, here, to, speed_mm_s, self.progress, self.holds)
            except ArmtempoError as error:
                raise type(error)(f"{where}{error.problem}", error.hint) from error
            self._known[key] = self._add(found, self.holds)
        return self._known[key]

    def run(self, motion: SourceMotion, trajectory: Trajectory) -> int:
        """Number of the leg of a motion that was ``planned``."""
        holds = _job(motion).holds or self.holds
        key = ("run", id(trajectory), self.tool, holds)
        if key not in self._known:
            self._known[key] = self._add(trajectory, holds)
        return self._known[key]

    def motion(self, motion: SourceMotion | Job | Plan) -> SourceMotion:
        """One object for equal motions."""
        if isinstance(motion, SourceMotion):
            return motion
        if id(motion) not in self._motions:
            self._motions[id(motion)] = SourceMotion(motion.name, motion)
        return self._motions[id(motion)]

    def listed(self, angles: Angles) -> str:
        """Angles (J,) as a text."""
        return self.arm.texts.listed(f"{round(angle, 3) + 0.0:g}" for angle in angles)

    def note_frame(self, posture: ArmPosture) -> None:
        """Note the frame in which a posture is given."""
        if isinstance(posture.where, Pose) and posture.where.frame != BASE:
            self.frames.append(posture.where.frame)

    def posture(self, posture: ArmPosture, where: str) -> NamedAngles:
        """The arm at that posture; raises PlanError if it cannot be there."""
        self.note_frame(posture)
        try:
            return NamedAngles(to_angles(via_points.posture_deg(self.arm, posture)), posture.name)
        except ArmtempoError as error:
            raise type(error)(f"{where}{error.problem}", error.hint) from error

    def planned(self, motion: SourceMotion, where: str) -> Trajectory:
        """The trajectory of a motion with the present tool and load."""
        self.frames.extend(_job(motion).frames)
        # A plan with another load is accepted if it keeps to the workspace
        for (known, tool, _), found in self._plans.items():
            if (known, tool) != (id(motion), self.tool):
                continue
            arm = self.arm.holding(_job(motion).holds or self.holds)
            outwards = _job(motion).start_touches
            if workspace_check.touch_of(arm, found, None, outwards) is None:
                return found
        found = self._plans[id(motion), self.tool, self.holds] = self._of(motion.source, where)
        return found

    def _check_arm(self, plan: Plan, where: str) -> None:
        """Raise InputError for a plan for another arm; its postures, and frames that it does not use, may differ."""
        kept = {key: getattr(self.arm, key) for key in ("postures", "frames", "tools", "pallets", "tool")}
        arm = replace(plan.arm, **kept)
        if arm != self.arm:
            raise InputError(
                f"{where}run: it was planned for a different arm than {self.arm.name!r}", "plan it again"
            )
        if change := frame.changed(plan.arm.frames, self.arm.frames, plan.job.frames):
            raise InputError(f"{where}run: it is old: {change}", "plan it again")
        self._check_tool(plan.arm.tool, where)

    def _check_tool(self, tool: ArmTool | None, where: str) -> None:
        """Raise InputError for a motion with another tool than the arm has in this sequence."""
        if tool != self.arm.tool:
            has, wants = (f"tool {each.name!r}" if each else "no tool" for each in (self.arm.tool, tool))
            changed = ", as it was before it changed" if tool and tool not in self.arm.tools else ""
            raise InputError(
                f"{where}run: it is for {wants}{changed}, but the sequence has {has} here",
                'write tool = "NAME" before the first step of the sequence or as a step before it, or plan it again',
            )

    def _of(self, source: Job | Plan, where: str) -> Trajectory:
        if isinstance(source, Plan):
            self._check_arm(source, where)
            arm = self.arm.holding(source.job.holds or self.holds)
            workspace_check.check(arm, source.trajectory, source.job.start_touches)
            return source.trajectory
        self._check_tool(self.arm.with_tool(source.tool).tool, where)
        job = replace(source, holds=source.holds or self.holds)
        planned = planner.plan(self.arm, job, self.progress)
        board_limits.check_held(planned.trajectory, self.arm)
        told = checks.hardware_notes(self.arm)
        self.notes.extend(f"{job.name}: {note}" for note in planned.notes if note not in told)
        return planned.trajectory

    def _straight(self, start: Angles, end: Angles, where: str) -> Trajectory:
        job = Job(
            "goto",
            via_deg=[start, end],
            path="through",
            optimiser=GRADIENT,
            refine=_REFINE,
            holds=self.holds,
        )
        try:
            return planner.plan(self.arm, job, self.progress).trajectory
        except ArmtempoError as error:
            raise type(error)(f"{where}{error.problem}", error.hint) from error

    def _add(self, trajectory: Trajectory, holds: str) -> int:
        self.legs.append(PlanLeg(trajectory, holds, self.tool))
        return len(self.legs) - 1

    def same(self, one: Angles, other: Angles) -> bool:
        """Whether two postures are equal to the board."""
        off_steps = self.arm.transmission.steps(np.array(one) - np.array(other))
        return bool(np.all(np.abs(off_steps) <= _SAME_STEPS))


def _job(motion: SourceMotion) -> Job:
    return motion.source.job if isinstance(motion.source, Plan) else motion.source


def to_angles(values: np.ndarray) -> Angles:
    """Values (J,) as a tuple of floats."""
    return tuple(float(value) for value in values)
