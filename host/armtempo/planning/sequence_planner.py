"""Planning a sequence: every motion time-optimally, from the end of the one before."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from armtempo_shared import sequence as record

from armtempo.basics.errors import ArmtempoError, InputError
from armtempo.basics.progress import Progress
from armtempo.model import frame
from armtempo.model import steps as kinds
from armtempo.model.arm import Arm
from armtempo.model.job import GRADIENT, Job
from armtempo.model.parts import NOTHING
from armtempo.model.plan import Plan
from armtempo.model.posture import ArmPosture
from armtempo.model.sequence import Sequence
from armtempo.model.sequence_plan import SequencePlan, SequenceRow, check_size
from armtempo.model.steps import SourceMotion, Step
from armtempo.model.tool import ArmTool
from armtempo.model.tool_pose import BASE, Pose
from armtempo.planning import board_limits, checks, pallet_places, planner, via_points, workspace_check
from armtempo.planning.pallet_places import Place
from armtempo.splines.trajectory import Trajectory

Angles = tuple[float, ...]
_REFINE = 16
"""Time segments of a straight motion: within 1 % of its lower bound, and quickly checked by the board."""
_THEN = {kinds.NEXT: record.NEXT_THEN, kinds.FAULT: record.FAULT_THEN}
_SAME_STEPS = 1 / 128
"""Tolerance for equal angles, steps: the board allows 1/64 step between two motions."""


def plan(arm: Arm, sequence: Sequence, progress: Progress | None = None) -> SequencePlan:
    """All different motions of a sequence, and the rows that the board executes.

    Raises InputError, naming file and step, if a motion does not begin at the end of the one before, or the
    sequence has no effect; PlanError if a motion cannot be planned.
    """
    arm = arm.with_tool(sequence.tool)
    compiler = _Compiler(arm, progress)
    source = sequence.source or f"sequence {sequence.name!r}"
    start = compiler.posture(sequence.start, f"{source}: start: ") if sequence.start else _End(None, "")
    rows, _ = compiler.rows(sequence.steps, start.angles_deg, start.name)
    if not rows:
        raise InputError(f"{source}: the sequence has no effect", "add a step that moves, sets or waits")
    check_size(len(rows), len(compiler.legs), len(compiler.counters), source)
    legs = [replace(leg, name=f"{sequence.name}-{number}") for number, leg in enumerate(compiler.legs, 1)]
    return SequencePlan(
        arm,
        sequence.name,
        tuple(legs),
        tuple(rows),
        tuple(compiler.counters),
        planner.versions(),
        tuple(compiler.loads),
        tuple(dict.fromkeys(compiler.notes)),
        tuple(dict.fromkeys(compiler.frames)),
        tuple(compiler.tools) if compiler.changes_tool else (),
        tuple(dict.fromkeys(name for name, _ in compiler.places)),
    )


@dataclass(frozen=True)
class _Place:
    """A posture of the arm, and its name for messages."""

    angles_deg: Angles
    name: str


@dataclass(frozen=True)
class _End:
    """The posture after some rows; None if nothing has moved yet."""

    angles_deg: Angles | None
    name: str


@dataclass
class _Compiler:
    arm: Arm
    progress: Progress | None
    legs: list[Trajectory] = field(default_factory=list)
    counters: list[str] = field(default_factory=list)
    loads: list[str] = field(default_factory=list)
    """The load in each leg."""
    notes: list[str] = field(default_factory=list)
    frames: list[str] = field(default_factory=list)
    """Those in which poses were given."""
    tools: list[str] = field(default_factory=list)
    """The tool in each leg."""
    changes_tool: bool = False
    places: dict[tuple[str, str], list[Place]] = field(default_factory=dict)
    """Of each pallet that is used, and tool."""
    _present: dict[str, int] = field(default_factory=dict)
    """Index of the present place of each pallet that a repeat goes through."""
    _holds: str = ""
    """The present load."""
    _known: dict[tuple[object, ...], int] = field(default_factory=dict)
    _plans: dict[tuple[int, str, str], Trajectory] = field(default_factory=dict)
    _motions: dict[int, SourceMotion] = field(default_factory=dict)
    _depth: int = 0

    def rows(self, steps: tuple[Step, ...], here: Angles | None, name: str) -> tuple[list[SequenceRow], _End]:
        """The rows of some steps from a posture on, and the posture after them."""
        end = _End(here, name)
        found: list[SequenceRow] = []
        for step in steps:
            if isinstance(step, kinds.Repeat):
                rows, end = self._repeat(step, end)
            elif isinstance(step, kinds.EachPlace):
                rows, end = self._each_place(step, end)
            elif isinstance(step, kinds.ToPlace):
                rows, end = self._place(step, end)
            elif isinstance(step, kinds.Goto):
                rows, end = self._goto(step, end)
            elif isinstance(step, kinds.RunMotion):
                rows, end = self._run(step, end)
            elif isinstance(step, kinds.Hold):
                rows = self._hold(step)
            elif isinstance(step, kinds.UseTool):
                rows = self._use_tool(step)
            else:
                rows = [self._still(step)]
            found += rows
        return found, end

    def _hold(self, step: kinds.Hold) -> list[SequenceRow]:
        """The following motions are planned with the load, which is not sent to the board."""
        try:
            self.arm.holding(step.load)
        except InputError as error:
            raise InputError(f"{step.where}{error.problem}", error.hint) from None
        self._holds = step.load
        return []

    @property
    def _tool(self) -> str:
        """The name of the present tool."""
        return self.arm.tool.name if self.arm.tool else NOTHING

    def _use_tool(self, step: kinds.UseTool) -> list[SequenceRow]:
        """The following motions are planned with the tool, of which the board knows nothing."""
        try:
            self.arm = self.arm.with_tool(step.tool)
        except InputError as error:
            raise InputError(f"{step.where}{error.problem}", error.hint) from None
        self.changes_tool = True
        return []

    def _repeat(self, step: kinds.Repeat, before: _End) -> tuple[list[SequenceRow], _End]:
        """The rows of a repeat; its first pass is separate if it starts at another posture."""
        outermost = not self._depth
        self._depth += 1
        first, end = self.rows(step.steps, before.angles_deg, before.name)
        if not first:
            raise InputError(
                f"{step.where}repeat: nothing is repeated", "put steps between repeat and its end"
            )
        apart = before.angles_deg is not None and end.angles_deg != before.angles_deg
        rows, last = self.rows(step.steps, end.angles_deg, end.name) if end.angles_deg else (first, end)
        apart = apart or rows != first
        self._depth -= 1
        times = step.times - apart if step.times else 0
        if apart and step.times == 1:
            return first, end
        words = f"{step.times} times" if step.times else "for ever"
        begin = SequenceRow(record.REPEAT, 0, int(apart and outermost), times, step.step, f"repeat {words}")
        close = SequenceRow(record.END, 0, int(outermost), 0, step.step, "end of repeat")
        return [*(first if apart else ()), begin, *rows, close], last

    def _each_place(self, step: kinds.EachPlace, end: _End) -> tuple[list[SequenceRow], _End]:
        """The rows of each place, one after the other, as each has its own motions."""
        places = self._places(step)
        last = step.last or len(places)
        if not 1 <= step.first <= last <= len(places):
            raise InputError(
                f"{step.where}repeat: places {step.first} to {last} of the {len(places)} of pallet {step.pallet!r}",
                "give a first that is not behind the last",
            )
        if step.pallet in self._present:
            raise InputError(
                f"{step.where}repeat: it is within another repeat for pallet {step.pallet!r}",
                "repeat it once",
            )
        if not step.steps:
            raise InputError(
                f"{step.where}repeat: nothing is repeated", "put steps between repeat and its end"
            )
        outermost = not self._depth
        self._depth += 1
        found: list[SequenceRow] = []
        for index in range(step.first - 1, last)[:: -1 if step.reverse else 1]:
            self._present[step.pallet] = index
            rows, end = self.rows(step.steps, end.angles_deg, end.name)
            found.append(SequenceRow(record.REPEAT, 0, 0, 1, step.step, places[index].name))
            found += rows
            found.append(SequenceRow(record.END, 0, int(outermost), 0, step.step, "end of place"))
        del self._present[step.pallet]
        self._depth -= 1
        return found, end

    def _places(self, step: kinds.EachPlace | kinds.ToPlace) -> list[Place]:
        """The places of a pallet, with the angles above them; PlanError names one that cannot be reached."""
        try:
            pallet = self.arm.pallet(step.pallet)
            if pallet.frame != BASE:
                self.frames.append(pallet.frame)
            key = step.pallet, self._tool
            if key not in self.places:
                self.places[key] = pallet_places.resolve(self.arm, pallet)
        except ArmtempoError as error:
            raise type(error)(f"{step.where}repeat: {error.problem}", error.hint) from error
        return self.places[key]

    def _place(self, step: kinds.ToPlace, here: _End) -> tuple[list[SequenceRow], _End]:
        """To the point above a place and down to it, or up from it."""
        key = "leave" if step.leave else "place"
        index = self._present.get(step.pallet)
        if index is None:
            raise InputError(
                f"{step.where}{key} = {step.pallet!r}: it is not within a repeat for this pallet",
                f'put it between repeat = "{step.pallet}" and its end',
            )
        place = self._places(step)[index]
        above = _End(place.above_deg, f"above {place.name}")
        where = f"{step.where}{key}: "
        if step.leave:
            return self._straight_to(above.name, place.above_deg, here, step, where)
        over = kinds.Goto(ArmPosture(above.name, place.above_deg), where=step.where, step=step.step)
        rows, end = self._goto(over, here)
        down, end = self._straight_to(place.name, place.pose, end, step, f"{where}{place.name}: ")
        return [*rows, *down], end

    def _goto(self, step: kinds.Goto, here: _End) -> tuple[list[SequenceRow], _End]:
        if step.line:
            return self._line(step, here)
        target = self._target(step)
        if here.angles_deg is None or here.angles_deg == target.angles_deg:
            return [], _End(target.angles_deg, target.name)
        key = (self._tool, self._holds, here.angles_deg, target.angles_deg)
        if key not in self._known:
            found = self._straight(step, here.angles_deg, target.angles_deg)
            self._known[key] = self._add(found, self._holds)
        words = f"goto {target.name}"
        return [_move(self._known[key], step.step, words)], _End(target.angles_deg, target.name)

    def _line(self, step: kinds.Goto, here: _End) -> tuple[list[SequenceRow], _End]:
        """A straight line of the tool; to a pose in the present branch of the arm."""
        posture = self.arm.posture(step.target) if isinstance(step.target, str) else step.target
        pose = posture.where if isinstance(posture, ArmPosture) else None
        if isinstance(posture, ArmPosture):
            self._note_frame(posture)
        if isinstance(pose, Pose) and isinstance(posture, ArmPosture):
            return self._straight_to(posture.name, pose, here, step, f"{step.where}goto: ")
        target = self._target(step)
        return self._straight_to(target.name, target.angles_deg, here, step, f"{step.where}goto: ")

    def _straight_to(
        self, name: str, to: Angles | Pose, here: _End, step: kinds.Goto | kinds.ToPlace, where: str
    ) -> tuple[list[SequenceRow], _End]:
        """A straight line of the tool to angles (J,), or to a pose."""
        if here.angles_deg is None:
            raise InputError(
                f"{where}a line needs a known start, and the arm's position is not known here",
                "give the sequence a start, or put a goto without line before it",
            )
        if to == here.angles_deg:
            return [], here
        key = (self._tool, self._holds, "line", here.angles_deg, to, step.speed_mm_s)
        if key not in self._known:
            try:
                found = planner.straight_line(
                    self.arm, here.angles_deg, to, step.speed_mm_s, self.progress, self._holds
                )
            except ArmtempoError as error:
                raise type(error)(f"{where}{error.problem}", error.hint) from error
            self._known[key] = self._add(found, self._holds)
        leg = self.legs[self._known[key]]
        end = _End(_angles(leg(leg.duration_s)) if isinstance(to, Pose) else to, name)
        return [_move(self._known[key], step.step, f"line to {name}")], end

    def _run(self, step: kinds.RunMotion, here: _End) -> tuple[list[SequenceRow], _End]:
        motion = self._motion(step.motion)
        trajectory = self._planned(motion, step.where)
        start, end = _angles(trajectory(0.0)), _angles(trajectory(trajectory.duration_s))
        if here.angles_deg is not None and not self._same(here.angles_deg, start):
            raise InputError(
                f"{step.where}run: {motion.name} begins at {self._listed(start)}, but the arm is at "
                f"{here.name or self._listed(here.angles_deg)} ({self._listed(here.angles_deg)})",
                f"put a step before it that goes there: goto with the same file as run, {motion.name!r}",
            )
        holds = _job(motion).holds or self._holds
        key = ("run", id(trajectory), self._tool, holds)
        if key not in self._known:
            self._known[key] = self._add(trajectory, holds)
        return [_move(self._known[key], step.step, f"run {motion.name}")], _End(
            end, f"the end of {motion.name}"
        )

    def _motion(self, motion: SourceMotion | Job | Plan) -> SourceMotion:
        """One object for equal motions."""
        if isinstance(motion, SourceMotion):
            return motion
        if id(motion) not in self._motions:
            name = motion.name if isinstance(motion, Job) else motion.job.name
            self._motions[id(motion)] = SourceMotion(name, motion)
        return self._motions[id(motion)]

    def _listed(self, angles: Angles) -> str:
        return self.arm.texts.listed(f"{round(angle, 3) + 0.0:g}" for angle in angles)

    def _target(self, step: kinds.Goto) -> _Place:
        target = step.target
        if isinstance(target, str):
            target = self.arm.posture(target)
        elif isinstance(target, list | tuple):
            if problem := self.arm.angles_problem(target):
                raise InputError(f"{step.where}goto: {problem}", "give one for each joint with a motor")
            target = ArmPosture(self._listed(target), tuple(target))
        if isinstance(target, ArmPosture):
            return self.posture(target, f"{step.where}goto: ")
        motion = self._motion(target)
        trajectory = self._planned(motion, "")
        return _Place(_angles(trajectory(0.0)), f"the start of {motion.name}")

    def _note_frame(self, posture: ArmPosture) -> None:
        if isinstance(posture.where, Pose) and posture.where.frame != BASE:
            self.frames.append(posture.where.frame)

    def posture(self, posture: ArmPosture, where: str) -> _Place:
        """The arm at that posture; raises PlanError if it cannot be there."""
        self._note_frame(posture)
        try:
            return _Place(_angles(via_points.posture_deg(self.arm, posture)), posture.name)
        except ArmtempoError as error:
            raise type(error)(f"{where}{error.problem}", error.hint) from error

    def _planned(self, motion: SourceMotion, where: str) -> Trajectory:
        self.frames.extend(_job(motion).frames)
        # A plan with another load is accepted if it keeps to the workspace
        for (known, tool, _), found in self._plans.items():
            if (known, tool) != (id(motion), self._tool):
                continue
            arm = self.arm.holding(_job(motion).holds or self._holds)
            outwards = _job(motion).start_touches
            if workspace_check.touch_of(arm, found, None, outwards) is None:
                return found
        found = self._plans[id(motion), self._tool, self._holds] = self._of(motion.source, where)
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
            arm = self.arm.holding(source.job.holds or self._holds)
            workspace_check.check(arm, source.trajectory, source.job.start_touches)
            return source.trajectory
        self._check_tool(self.arm.with_tool(source.tool).tool, where)
        job = replace(source, holds=source.holds or self._holds)
        planned = planner.plan(self.arm, job, self.progress)
        board_limits.check_held(planned.trajectory, self.arm)
        told = checks.hardware_notes(self.arm)
        self.notes.extend(f"{job.name}: {note}" for note in planned.notes if note not in told)
        return planned.trajectory

    def _straight(self, step: kinds.Goto, start: Angles, end: Angles) -> Trajectory:
        job = Job(
            "goto",
            via_deg=[start, end],
            path="through",
            optimiser=GRADIENT,
            refine=_REFINE,
            holds=self._holds,
        )
        try:
            return planner.plan(self.arm, job, self.progress).trajectory
        except ArmtempoError as error:
            raise type(error)(f"{step.where}goto: {error.problem}", error.hint) from error

    def _still(self, step: kinds.SetOutput | kinds.Wait | kinds.WaitInput | kinds.Count) -> SequenceRow:
        """The row of a step without motion."""
        if isinstance(step, kinds.SetOutput):
            output = self.arm.output(step.output)
            raw = self.arm.outputs[output].raw(step.to)
            return SequenceRow(record.OUTPUT, output, raw, 0, step.step, f"output {step.output} {step.to}")
        if isinstance(step, kinds.Wait):
            return SequenceRow(
                record.WAIT, 0, 0, round(step.wait_s * 1000), step.step, f"wait {step.wait_s:g} s"
            )
        if isinstance(step, kinds.Count):
            if step.counter not in self.counters:
                self.counters.append(step.counter)
            number = self.counters.index(step.counter)
            return SequenceRow(record.COUNT, number, 0, 0, step.step, f"count {step.counter}")
        value = int(step.active) | _THEN.get(step.on_timeout, record.STOP_THEN)
        limit = f", at most {step.timeout_s:g} s, then {step.on_timeout}" if step.timeout_s else ""
        words = f"wait for input {step.input}{'' if step.active else ' not'}{limit}"
        return SequenceRow(
            record.WAIT_INPUT,
            self.arm.input(step.input),
            value,
            round(step.timeout_s * 1000),
            step.step,
            words,
        )

    def _add(self, trajectory: Trajectory, holds: str) -> int:
        self.legs.append(trajectory)
        self.loads.append(holds)
        self.tools.append(self._tool)
        return len(self.legs) - 1

    def _same(self, one: Angles, other: Angles) -> bool:
        off_steps = self.arm.transmission.steps(np.array(one) - np.array(other))
        return bool(np.all(np.abs(off_steps) <= _SAME_STEPS))


def _job(motion: SourceMotion) -> Job:
    return motion.source.job if isinstance(motion.source, Plan) else motion.source


def _move(leg: int, step: int, words: str) -> SequenceRow:
    return SequenceRow(record.MOVE, leg, 0, 0, step, words)


def _angles(values: np.ndarray) -> Angles:
    return tuple(float(value) for value in values)
